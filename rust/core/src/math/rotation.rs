//! Rotations in space by rotation vectors: φ rotates by the angle |φ| about φ.
//!
//! J. Solà, J. Deray, D. Atchuthan, *A micro Lie theory for state estimation in robotics*, 2018.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::Limits;

/// Rotation by a rotation vector, accurate for any small vector. Never NaN for a finite vector.
///
/// nalgebra's own function is the identity below 4e-16 rad: sums of such steps would be lost.
#[inline]
pub fn exponential<T: Limits>(phi: &Vector3<T>) -> UnitQuaternion<T> {
    let half = clamp(phi) * of::<T>(0.5);
    let angle = half.norm();
    UnitQuaternion::new_unchecked(Quaternion::from_parts(angle.cos(), half * sinc(angle)))
}

/// Matrix J in Exp(φ + δ) = Exp(φ) Exp(J δ), to first order in δ (Solà et al., eq. 143).
#[inline]
pub fn right_jacobian<T: Limits>(phi: &Vector3<T>) -> Matrix3<T> {
    let phi = clamp(phi);
    let angle = phi.norm();
    let axis = phi / if angle > T::zero() { angle } else { T::one() };
    let half = sinc(angle * of(0.5));
    // (1 - cos x)/x² and 1 - sin(x)/x, written to keep their digits for small angles.
    let across = (axis * axis.transpose() - Matrix3::identity()) * (T::one() - sinc(angle));
    Matrix3::identity() - phi.cross_matrix() * (half * half * of(0.5)) + across
}

/// Rotation vector of a step between two samples of a linearly changing rate: the mean rate, and
/// coning (P. G. Savage, *J. Guidance, Control, and Dynamics* 21(1), 1998).
#[inline(always)]
pub fn step<T: Limits>(before: &Vector3<T>, after: &Vector3<T>, dt: T) -> Vector3<T> {
    let coning = before.cross(after) * (dt * of(1.0 / 12.0));
    ((before + after) * of::<T>(0.5) + coning) * dt
}

/// `rotation`, followed by a rotation vector about the rotated axes. Rounding errors of the norm do
/// not accumulate.
#[inline]
pub fn turned<T: Limits>(rotation: &UnitQuaternion<T>, phi: &Vector3<T>) -> UnitQuaternion<T> {
    let mut turned = rotation * exponential(phi);
    turned.renormalize_fast();
    turned
}

/// sin(x)/x, also correct if a norm has underflowed.
fn sinc<T: Limits>(x: T) -> T {
    if x > T::zero() { x.sin() / x } else { T::one() }
}

/// Limits a vector so that its squares are finite.
fn clamp<T: Limits>(v: &Vector3<T>) -> Vector3<T> {
    v.map(|x| x.clamp(-T::MAX_DIFFERENCE, T::MAX_DIFFERENCE))
}

fn of<T: Limits>(x: f64) -> T {
    nalgebra::convert(x)
}

#[cfg(test)]
mod tests {
    use super::{exponential, right_jacobian, step, turned};
    use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
    use proptest::prelude::*;

    fn direction() -> impl Strategy<Value = Vector3<f64>> {
        let number = || -1.0..1.0_f64;
        let vectors = (number(), number(), number()).prop_map(|(x, y, z)| Vector3::new(x, y, z));
        vectors.prop_filter("a direction", |v| v.norm() > 1e-3).prop_map(|v| v.normalize())
    }

    /// Series of the matrix exponential, by repeated squaring for large angles.
    fn by_series(phi: &Vector3<f64>) -> Matrix3<f64> {
        if phi.norm() > 0.5 {
            let half = by_series(&(phi * 0.5));
            return half * half;
        }
        let (x, mut term, mut sum) = (phi.cross_matrix(), Matrix3::identity(), Matrix3::identity());
        for k in 1..20 {
            term = term * x / f64::from(k);
            sum += term;
        }
        sum
    }

    proptest! {
        #[test]
        fn the_exponential_is_that_of_the_matrix(axis in direction(), decade in -320.0..1.0_f64) {
            let phi = axis * 10.0_f64.powf(decade);
            let found = exponential(&phi);
            // A few roundings a squaring.
            prop_assert!((found.to_rotation_matrix().matrix() - by_series(&phi)).amax() < 2e-14);
            // Small ones to the last digits, where the matrix has lost them.
            let small = phi * (0.5 - phi.norm_squared() / 48.0);
            let digits = (found.imag() - small).amax() <= 1e-15 * small.amax() + 1e-323;
            prop_assert!(decade > -4.0 || digits);
            prop_assert!((found.norm() - 1.0).abs() < 4e-16);
        }

        #[test]
        fn the_jacobian_is_that_of_the_exponential(axis in direction(), decade in -9.0..1.0_f64) {
            let phi = axis * 10.0_f64.powf(decade);
            let h = 1e-6;
            let jacobian = right_jacobian(&phi);
            for i in 0..3 {
                let moved = |h: f64| exponential(&(phi + Vector3::ith(i, h)));
                let difference = moved(-h).rotation_to(&moved(h));
                let derivative = moved(-h).inverse() * difference * moved(-h);
                let column = derivative.scaled_axis() / (2.0 * h);
                // Central differences: h², and a rounding of the angle over h.
                prop_assert!((jacobian.column(i) - column).amax() < 1e-8, "{i}");
            }
        }

        #[test]
        fn no_finite_vector_is_no_rotation(
            phi in prop::array::uniform3(prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL),
        ) {
            let phi = Vector3::from(phi);
            let found = turned(&UnitQuaternion::identity(), &phi);
            prop_assert!((found.norm() - 1.0).abs() < 1e-12);
            prop_assert!(right_jacobian(&phi).iter().all(|x| x.is_finite()));
            let single = phi.map(|x| x.clamp(-3e38, 3e38) as f32);
            prop_assert!((exponential(&single).norm() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn steps_of_a_constant_rate_are_one_turn() {
        let rate = Vector3::new(0.3, -1.1, 0.7);
        let mut rotation = UnitQuaternion::<f64>::identity();
        for _ in 0..100_000 {
            rotation = turned(&rotation, &step(&rate, &rate, 1e-3));
        }
        let expected = Rotation3::new(rate * 100.0);
        // A rounding a step at most, and of the angle.
        assert!((rotation.to_rotation_matrix().matrix() - expected.matrix()).amax() < 1e-11);
        assert!((rotation.norm() - 1.0).abs() < 1e-15);
    }
}
