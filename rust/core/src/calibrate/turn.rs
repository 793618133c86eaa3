//! The rotation between two static intervals, and its sensitivities to gyro errors.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{axes, clamp};
use crate::math::rotation::{right_jacobian, step, turned};

/// Number of steps between two checks for a stop.
#[cfg(feature = "std")]
const STEPS_PER_CHECK: usize = 1 << 14;

/// The rotation between two static intervals, and the effect of small errors.
///
/// An error adds a rotation `Exp(ψ)`. A constant vector is `u` in the body's axes before the
/// rotation and `Pᵀ u` after it. The error moves it by `(Pᵀ u) × ψ`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// Matrix P, from the body's axes after the rotation to its axes before it.
    pub rotation: Matrix3<f64>,
    /// Derivatives of ψ: element `(a, b)` of the matrix `c` by element `(b, c)` of the correction.
    pub by_matrix: [Matrix3<f64>; 3],
    /// Derivative of ψ by a constant error of the corrected rate.
    pub by_rate: Matrix3<f64>,
    /// Sum of the angles of all steps, rad.
    pub angle: f64,
}

/// Propagates a rotation through rates, `steps` seconds apart, corrected by `matrix (rate - bias)`;
/// `matrix` is stored as rows.
///
/// The steps are processed from the last to the first. The rotation after a step, which multiplies
/// its errors, is then known at the step, and one pass is enough.
pub fn propagate_turn(
    rates: &[[f64; 3]],
    steps: &[f64],
    bias: &[f64; 3],
    matrix: &[[f64; 3]; 3],
) -> Turn {
    // Inverse of the rotation from here to the end.
    let mut back = UnitQuaternion::identity();
    let mut turn = Turn {
        rotation: Matrix3::identity(),
        by_matrix: [Matrix3::zeros(); 3],
        by_rate: Matrix3::zeros(),
        angle: 0.0,
    };
    let (bias, matrix) = (axes(bias), Matrix3::from_fn(|i, j| clamp(matrix[i][j])));
    for (k, dt) in steps.iter().enumerate().rev() {
        #[cfg(feature = "std")]
        if k % STEPS_PER_CHECK == STEPS_PER_CHECK - 1 {
            crate::work::pause();
        }
        let (raw, dt) = ([k, k + 1].map(|k| axes(&rates[k]) - bias), clamp(*dt));
        let rate = raw.map(|raw| (matrix * raw).map(clamp));
        let phi = step(&rate[0], &rate[1], dt);
        turn.add(&raw, &rate, &phi, &back, dt);
        back = turned(&back, &-phi);
    }
    turn.rotation = back.inverse().to_rotation_matrix().into_inner();
    turn
}

impl Turn {
    /// Adds a step, with the rotation back through all later steps.
    #[inline(always)]
    fn add(
        &mut self,
        raw: &[Vector3<f64>; 2],
        rate: &[Vector3<f64>; 2],
        phi: &Vector3<f64>,
        back: &UnitQuaternion<f64>,
        dt: f64,
    ) {
        let seen = back.to_rotation_matrix().matrix() * right_jacobian(phi);
        // Effect of coning on errors at the two ends.
        let coning = rate.map(|rate| seen * rate.cross_matrix() * (dt * dt / 12.0));
        let mean = (raw[0] + raw[1]) * (0.5 * dt);
        for c in 0..3 {
            self.by_matrix[c] += seen * mean[c] + coning[0] * raw[1][c] - coning[1] * raw[0][c];
        }
        self.by_rate += seen * dt + coning[0] - coning[1];
        self.angle += phi.norm();
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::{Turn, propagate_turn};
    use nalgebra::{Matrix3, Rotation3, Vector3};
    use proptest::prelude::*;

    const STEPS: usize = 150;

    fn numbers<const N: usize>(size: f64) -> impl Strategy<Value = [f64; N]> {
        prop::collection::vec(-size..size, N).prop_map(|x| std::array::from_fn(|i| x[i]))
    }

    /// Smooth rates with uneven steps.
    fn record(waves: &[f64; 6]) -> (Vec<[f64; 3]>, Vec<f64>) {
        let rate = |k: usize| {
            let t = k as f64 / STEPS as f64;
            [0, 1, 2].map(|i| waves[i] + waves[3 + i] * (3.0 * t + i as f64).sin())
        };
        let steps = (0..STEPS).map(|k| 0.01 + 0.004 * (k as f64).sin()).collect();
        ((0..=STEPS).map(rate).collect(), steps)
    }

    fn propagate(
        (rates, steps): &(Vec<[f64; 3]>, Vec<f64>),
        bias: &Vector3<f64>,
        matrix: &Matrix3<f64>,
    ) -> Turn {
        let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|j| matrix[(i, j)]));
        propagate_turn(rates, steps, &(*bias).into(), &rows)
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(32) })]

        #[test]
        fn sensitivities_are_those_of_finite_differences(
            waves in numbers::<6>(2.0),
            bias in numbers::<3>(0.1),
            errors in numbers::<9>(0.05),
        ) {
            let record = record(&waves);
            let bias = Vector3::from(bias);
            let matrix = Matrix3::identity() + Matrix3::from_row_slice(&errors);
            let turn = propagate(&record, &bias, &matrix);
            let rotation = |bias: Vector3<f64>, matrix: Matrix3<f64>| propagate(&record, &bias, &matrix).rotation;
            let h = 1e-5;
            // ψ of the small additional rotation, from differences on two sides.
            let psi = |moved: [Matrix3<f64>; 2]| {
                let further = moved.map(|moved| turn.rotation.transpose() * moved);
                let sine = further.map(|m| (m - m.transpose()) / 2.0);
                let difference = (sine[0] - sine[1]) / (2.0 * h);
                Vector3::new(difference[(2, 1)], difference[(0, 2)], difference[(1, 0)])
            };
            // Central differences: h² times a curvature of some tens, and 1e-14 over h.
            let tolerance = 1e-7;
            for (b, c) in (0..9).map(|i| (i / 3, i % 3)) {
                let mut change = Matrix3::zeros();
                change[(b, c)] = h;
                let found = psi([rotation(bias, matrix + change), rotation(bias, matrix - change)]);
                prop_assert!((turn.by_matrix[c].column(b) - found).amax() < tolerance, "{b}{c}");
            }
            for i in 0..3 {
                // The bias is subtracted before the correction.
                let change = matrix.try_inverse().expect("near the identity") * Vector3::ith(i, h);
                let found = psi([rotation(bias - change, matrix), rotation(bias + change, matrix)]);
                prop_assert!((turn.by_rate.column(i) - found).amax() < tolerance, "{i}");
            }
        }
    }

    #[test]
    fn a_constant_rate_is_one_rotation() {
        let rate = [0.4, -0.9, 1.3];
        let record = (vec![rate; 201], vec![0.01; 200]);
        let turn = propagate(&record, &Vector3::zeros(), &Matrix3::identity());
        let phi = Vector3::from(rate) * 2.0;
        // One rounding error per step.
        assert!((turn.rotation - Rotation3::new(phi).matrix()).amax() < 1e-13);
        assert!((turn.angle - phi.norm()).abs() < 1e-13);
        let jacobian = crate::math::rotation::right_jacobian(&phi) * 2.0;
        assert!((turn.by_rate - jacobian).amax() < 1e-12);
        for c in 0..3 {
            assert!((turn.by_matrix[c] - jacobian * rate[c]).amax() < 1e-12);
        }
    }

    #[test]
    fn no_finite_rates_are_not_a_number() {
        let rates = [[f64::MAX, -f64::MAX, 1.0], [f64::MIN_POSITIVE, 0.0, f64::MAX], [1e200; 3]];
        let steps = [f64::MAX, 1e-300];
        let turn = propagate_turn(&rates, &steps, &[1e60; 3], &[[f64::MAX; 3]; 3]);
        let sensitivities = turn.by_matrix.iter().chain([&turn.by_rate, &turn.rotation]);
        assert!(
            sensitivities.flat_map(|m| m.iter()).all(|x| x.is_finite()) && turn.angle.is_finite()
        );
    }
}
