//! Orientation by integration of the rates.

use nalgebra::{UnitQuaternion, Vector3};

use super::{axes, clamp};
use crate::math::rotation::{step, turned};

/// Number of steps between two checks for a stop.
#[cfg(feature = "std")]
const STEPS_PER_CHECK: usize = 1 << 14;

/// Integration of a step's rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integration {
    /// The rate at the step's end: Kalman's drift collection, 252-254.
    BackwardEuler,
    /// Mean of the rates at the start and end.
    Trapezoid,
    /// Mean of the rates, with the coning of a linearly changing rate.
    Coning,
}

impl Integration {
    /// All variants with their names.
    pub const NAMES: [(Self, &str); 3] = [
        (Self::BackwardEuler, "backward-euler"),
        (Self::Trapezoid, "trapezoid"),
        (Self::Coning, "coning"),
    ];

    /// The variant with this name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(_, known)| *known == name).map(|(method, _)| *method)
    }

    #[inline(always)]
    fn rotation_vector(self, before: &Vector3<f64>, after: &Vector3<f64>, dt: f64) -> Vector3<f64> {
        match self {
            Self::BackwardEuler => after * dt,
            Self::Trapezoid => (before + after) * (0.5 * dt),
            Self::Coning => step(before, after, dt),
        }
    }
}

/// Orientation at each sample of the rates, rad/s, as quaternions with the scalar first. Each
/// rotates vectors from the body's axes at the sample to its axes at the first sample.
///
/// `steps` are the times from each sample to the next, s. Orientations after a missing sample are
/// NaN.
pub fn integrate(
    rates: &[[f64; 3]],
    steps: &[f64],
    method: Integration,
    quaternions: &mut [[f64; 4]],
) {
    let mut rotation = UnitQuaternion::identity();
    let Some(first) = quaternions.first_mut() else { return };
    *first = [1.0, 0.0, 0.0, 0.0];
    for (k, (dt, slot)) in steps.iter().zip(&mut quaternions[1..]).enumerate() {
        #[cfg(feature = "std")]
        if k % STEPS_PER_CHECK == STEPS_PER_CHECK - 1 {
            crate::work::pause();
        }
        let (before, after) = (axes(&rates[k]), axes(&rates[k + 1]));
        let phi = method.rotation_vector(&before, &after, clamp(*dt));
        rotation = turned(&rotation, &phi);
        *slot = [rotation.w, rotation.i, rotation.j, rotation.k];
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::{Integration, integrate};
    use nalgebra::{Quaternion, UnitQuaternion};

    /// A body with its axis on a cone of half-angle β, at W/2π turns per second: rates and
    /// orientation.
    fn coning(beta: f64, w: f64, t: f64) -> ([f64; 3], UnitQuaternion<f64>) {
        let ((sin, cos), half) = ((w * t).sin_cos(), beta / 2.0);
        let rate = [-w * beta.sin() * sin, w * beta.sin() * cos, -2.0 * w * half.sin().powi(2)];
        let q = Quaternion::new(half.cos(), half.sin() * cos, half.sin() * sin, 0.0);
        (rate, UnitQuaternion::new_normalize(q))
    }

    /// Angle from the truth after one second.
    fn error(method: Integration, n: usize) -> f64 {
        let (beta, w) = (0.2, 20.0);
        let dt = 1.0 / n as f64;
        let rates: Vec<_> = (0..=n).map(|k| coning(beta, w, k as f64 * dt).0).collect();
        let mut found = vec![[0.0; 4]; n + 1];
        integrate(&rates, &vec![dt; n], method, &mut found);
        let [s, x, y, z] = found[n];
        let found = UnitQuaternion::new_normalize(Quaternion::new(s, x, y, z));
        let expected = coning(beta, w, 0.0).1.inverse() * coning(beta, w, 1.0).1;
        found.angle_to(&expected)
    }

    #[test]
    fn errors_in_pure_coning_fall_with_the_order_of_the_method() {
        use Integration::{BackwardEuler, Coning, Trapezoid};
        for (method, order) in [(BackwardEuler, 2.0), (Trapezoid, 4.0), (Coning, 4.0)] {
            let (coarse, fine) = (error(method, 1000), error(method, 2000));
            assert!((coarse / fine / order - 1.0).abs() < 0.2, "{method:?}: {coarse} {fine}");
        }
    }
}
