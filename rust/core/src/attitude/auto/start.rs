//! The first second: up is the direction of the mean force in a frame that the gyro holds.
//!
//! A body that moves at the start has accelerations. Their mean is its velocity change divided by
//! time, and decreases with time.

use nalgebra::{ComplexField, Quaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::errors::{Errors, VELOCITY};
use crate::attitude::GRAVITY;

/// Duration of the start, s.
const START_S: f64 = 1.0;
/// Largest velocity change of a body in the start, m/s.
pub const MAX_SPEED_CHANGE_M_S: f64 = 1.0;
/// Standard deviation of an unknown tilt, rad.
pub const TILT_SIGMA_RAD: f64 = 0.5;
/// Smallest mean force of all samples with a direction, m/s².
const MIN_FORCE_M_S2: f64 = 1e-6;
/// Largest sum of the forces, m/s²: samples may have no duration.
const MAX_SUM: f64 = 1e9;

/// Sum of the forces to date.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Size of the sum, which points up.
    sum: f64,
    /// Time since the first force, s.
    elapsed: f64,
    pub over: bool,
    north: North,
}

/// Source of the heading to date.
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
enum North {
    #[default]
    Unknown,
    /// From a first field, which may be a spike.
    Doubted,
    Known,
}

impl Start {
    /// Adds a force in the frame's axes; returns the rotation of the frame that turns the sum
    /// upwards again.
    pub fn add(&mut self, force: &Vector3<f64>) -> Option<Quaternion<f64>> {
        let sum = Vector3::new(force.x, force.y, force.z + self.sum);
        let length = sum.norm();
        if length < MIN_FORCE_M_S2 {
            return None;
        }
        self.sum = length.min(MAX_SUM);
        let half = ComplexField::sqrt(((1.0 + sum.z / length) * 0.5).max(0.0));
        if half < 1e-6 {
            // Upside down: a rotation about any level axis.
            return Some(Quaternion::new(0.0, 1.0, 0.0, 0.0));
        }
        let scale = 0.5 / (half * length);
        Some(Quaternion::new(half, sum.y * scale, -sum.x * scale, 0.0).normalize())
    }

    /// Starts again, with the known heading.
    pub fn again(&mut self) {
        *self = Self { north: self.north, ..Self::default() };
    }

    /// True for the first field, and for the first field that is `known` to be no spike.
    pub fn is_first_field(&mut self, known: bool) -> bool {
        let north = if known { North::Known } else { North::Doubted };
        let first = north > self.north;
        if first {
            self.north = north;
        }
        first
    }

    /// True if a tick belongs to the start; the errors then belong to a mean force over the
    /// time.
    pub fn observe(&mut self, elapsed: f64, errors: &mut Errors) -> bool {
        if self.over || self.sum == 0.0 {
            return !self.over;
        }
        self.elapsed += elapsed;
        if self.elapsed > START_S * (1.0 + 1e-9) && self.elapsed > elapsed {
            self.over = true;
            return false;
        }
        let slope = MAX_SPEED_CHANGE_M_S / (GRAVITY * self.elapsed);
        let tilt = (2.0 * slope * slope).min(TILT_SIGMA_RAD * TILT_SIGMA_RAD);
        errors.restart(&[0, 1], tilt);
        errors.restart(&[VELOCITY, VELOCITY + 1], MAX_SPEED_CHANGE_M_S * MAX_SPEED_CHANGE_M_S);
        if tilt < TILT_SIGMA_RAD * TILT_SIGMA_RAD {
            errors.couple(1, VELOCITY, slope * MAX_SPEED_CHANGE_M_S);
            errors.couple(0, VELOCITY + 1, -slope * MAX_SPEED_CHANGE_M_S);
        }
        true
    }

    pub fn is_valid(&self) -> bool {
        (0.0..=MAX_SUM).contains(&self.sum) && (0.0..=1e3).contains(&self.elapsed)
    }
}

#[cfg(test)]
mod tests {
    use super::{Errors, MAX_SPEED_CHANGE_M_S, Start, VELOCITY};
    use crate::attitude::GRAVITY;
    use crate::attitude::auto::errors::States;
    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;

    fn errors() -> Errors {
        Errors::new(&States::repeat(0.1), 1.0)
    }

    proptest! {
        #[test]
        fn the_sum_of_forces_points_up(
            forces in prop::collection::vec(prop::array::uniform3(-20.0..20.0_f64), 1..20),
        ) {
            // The forces are in a constant frame, seen as `q`.
            let (mut start, mut q, mut sum) = (Start::default(), UnitQuaternion::identity(), Vector3::zeros());
            for force in forces.into_iter().map(Vector3::from) {
                sum += force;
                if let Some(turn) = start.add(&(q * force)) {
                    // Heading is not its own.
                    prop_assert_eq!(turn.k, 0.0);
                    q = UnitQuaternion::new_normalize(turn) * q;
                }
                let seen = q * sum;
                let length = sum.norm();
                prop_assert!((seen - Vector3::z() * length).amax() <= 1e-9 * (1.0 + length));
            }
        }
    }

    #[test]
    fn straight_down_is_half_a_turn() {
        let turn = Start::default().add(&Vector3::new(0.0, 0.0, -9.81)).expect("a direction");
        assert_eq!((turn.w, turn.i, turn.j, turn.k), (0.0, 1.0, 0.0, 0.0));
    }

    #[test]
    fn no_force_is_no_direction() {
        assert_eq!(Start::default().add(&Vector3::zeros()), None);
    }

    #[test]
    fn it_lasts_a_second_and_knows_the_better_the_longer() {
        let (mut start, mut errors) = (Start::default(), errors());
        assert!(start.observe(0.1, &mut errors), "it waits for a force");
        assert!(start.add(&Vector3::new(0.0, 0.0, 9.81)).is_some());
        for tick in 1..=10 {
            assert!(start.observe(0.1, &mut errors));
            let slope = MAX_SPEED_CHANGE_M_S / (GRAVITY * 0.1 * f64::from(tick));
            let tilt = (2.0 * slope * slope).min(0.25);
            assert!((errors.variance(0) / tilt - 1.0).abs() < 1e-12);
            // A tilt is the velocity to date over the time: from north along x, from east along -y.
            let coupled = errors.covariance()[(1, VELOCITY)];
            assert_eq!(coupled, -errors.covariance()[(0, VELOCITY + 1)]);
            assert!(
                (coupled - if tilt < 0.25 { slope * MAX_SPEED_CHANGE_M_S } else { 0.0 }).abs()
                    < 1e-15
            );
            assert!(errors.is_valid());
        }
        assert!(!start.over);
        assert!(!start.observe(0.1, &mut errors));
        assert!(start.over);
    }

    #[test]
    fn a_tick_longer_than_a_second_is_a_start_too() {
        let (mut start, mut errors) = (Start::default(), errors());
        assert!(start.add(&Vector3::new(0.0, 0.0, 9.81)).is_some());
        assert!(start.observe(2.0, &mut errors));
        assert!(!start.observe(2.0, &mut errors));
    }
}
