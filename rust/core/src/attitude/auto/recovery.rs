//! Recovery from a wrong tilt: after a knock, lost or clipped samples, or a jump of the bias.
//!
//! The mean force in the frame then keeps one direction, and corrections of the tilt do, too.
//! Meanwhile the filter attributes the velocity to the body and gives it less and less weight.
//!
//! A body that accelerates for seconds looks similar, except for the size of the force: a wrong
//! tilt only turns gravity, an acceleration adds to it.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::attitude::GRAVITY;
use crate::attitude::sample::MAX_FORCE;
use crate::math::validity::{are_within, is_size};

/// Time of the mean force, and shortest time between two recoveries, s.
const FORCE_MEAN_S: f64 = 1.5;
const MIN_RECOVERY_INTERVAL_S: f64 = 2.0;
/// Ratio of the squared sum of corrections to its expectation above which they persist.
const MIN_CORRECTION_RATIO: f64 = 2.0;
/// Smallest horizontal part of the mean force, m/s², that a moving body does not sustain.
const MIN_LEVEL_FORCE_M_S2: f64 = 2.5;
/// Largest standard deviation of the tilt, rad.
const MAX_TILT_SIGMA_RAD: f64 = 0.5;
/// Share of the mean force that points up below which the frame is wrong by more than 45 deg, and
/// smallest such force, m/s².
const MIN_UP_SHARE: f64 = 0.7;
const MIN_UP_FORCE_M_S2: f64 = 3.0;
/// Share of the squared horizontal force by which the whole squared force exceeds gravity: all of
/// it for an accelerating body, nothing for a wrong tilt. Accelerations are more frequent than
/// knocks. The second value is the smallest acceleration that contradicts a rest, m/s², if gravity
/// is known.
const MIN_PUSH_SHARE: f64 = 0.25;
const MIN_SURE_PUSH_SHARE: f64 = 0.5;
const MIN_PUSH_M_S2: f64 = 1.0;
/// Time of an acceleration after which the velocity is not near zero, s, and factor of its variance
/// then.
const LONG_PUSH_S: f64 = 3.0;
const VELOCITY_VARIANCE_FACTOR: f64 = 10.0;

/// Smallest change of a force between ticks, m/s², below which the accelerometer is stuck if the
/// body turns this fast, (rad/s)².
const MAX_STUCK_CHANGE_M_S2: f64 = 1e-9;
const MIN_TURN_RATE_SQUARED: f64 = 0.01;

/// Verdict of a mean force on the tilt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wrong {
    /// Variance of the tilt about each level axis, rad².
    Tilted(f64),
    /// The error is too large for a filter of small errors.
    Fallen,
}

/// The mean force in the frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Recovery {
    mean: Vector3<f64>,
    /// Mean force of the last tick in the sensor's axes.
    last: Vector3<f64>,
    /// Time since the last recovery, s, and time of a certain acceleration, s.
    since: f64,
    pushed: f64,
}

impl Default for Recovery {
    fn default() -> Self {
        let (mean, last) = (Vector3::new(0.0, 0.0, GRAVITY), Vector3::zeros());
        Self { mean, last, since: MIN_RECOVERY_INTERVAL_S, pushed: 0.0 }
    }
}

impl Recovery {
    /// Processes the mean force of a tick after the start, in the frame and in the sensor's axes;
    /// the mean square of the rate; and gravity, if known. A constant force of a turning body is
    /// not used.
    pub fn observe(
        &mut self,
        force: &Vector3<f64>,
        felt: &Vector3<f64>,
        speed_squared: f64,
        gravity: Option<f64>,
        span: f64,
    ) {
        let before = core::mem::replace(&mut self.last, *felt);
        if (felt - before).norm_squared() <= MAX_STUCK_CHANGE_M_S2 * MAX_STUCK_CHANGE_M_S2
            && speed_squared > MIN_TURN_RATE_SQUARED
        {
            return;
        }
        self.mean += (force - self.mean) * (span / FORCE_MEAN_S).min(1.0);
        self.since = (self.since + span).min(MIN_RECOVERY_INTERVAL_S);
        let surely = gravity.is_some_and(|known| self.is_pushed(known, MIN_SURE_PUSH_SHARE))
            && self.level_squared() > MIN_PUSH_M_S2 * MIN_PUSH_M_S2;
        self.pushed = if surely { self.pushed + span } else { 0.0 };
    }

    /// True if the body certainly accelerates: it does not rest.
    pub fn is_strong(&self) -> bool {
        self.pushed > 0.0
    }

    /// Factor on the variance of "the velocity is zero": during a long acceleration the gyro holds
    /// the tilt.
    pub fn doubt(&self) -> f64 {
        if self.pushed > LONG_PUSH_S * (1.0 + 1e-9) { VELOCITY_VARIANCE_FACTOR } else { 1.0 }
    }

    fn level_squared(&self) -> f64 {
        self.mean.x * self.mean.x + self.mean.y * self.mean.y
    }

    /// True if this share of the horizontal part adds to gravity. If the force points down, the
    /// tilt has fallen.
    fn is_pushed(&self, gravity: f64, share: f64) -> bool {
        let more = self.mean.norm_squared() - gravity * gravity;
        self.mean.z > 0.0 && more > share * self.level_squared()
    }

    /// Error of the tilt, if corrections persist by this ratio, the tilt has this variance and
    /// gravity this size. In a rest only a fall is detected.
    pub fn test(&mut self, persistence: Option<f64>, variance: f64, gravity: f64) -> Option<Wrong> {
        if self.is_pushed(gravity, MIN_PUSH_SHARE) {
            return None;
        }
        let length = self.mean.norm();
        if self.mean.z < MIN_UP_SHARE * length && length > MIN_UP_FORCE_M_S2 {
            *self = Self::default();
            return Some(Wrong::Fallen);
        }
        let level = self.level_squared();
        let angle = level / (GRAVITY * GRAVITY);
        let wrong = persistence.is_some_and(|times| times > MIN_CORRECTION_RATIO)
            && level > MIN_LEVEL_FORCE_M_S2 * MIN_LEVEL_FORCE_M_S2
            && angle > variance
            && self.since >= MIN_RECOVERY_INTERVAL_S * (1.0 - 1e-9);
        if !wrong {
            return None;
        }
        self.since = 0.0;
        Some(Wrong::Tilted(angle.min(MAX_TILT_SIGMA_RAD * MAX_TILT_SIGMA_RAD)))
    }

    pub fn is_valid(&self) -> bool {
        are_within(&self.mean, 2.0 * MAX_FORCE)
            && are_within(&self.last, 2.0 * MAX_FORCE)
            && is_size(self.since, MIN_RECOVERY_INTERVAL_S)
            && is_size(self.pushed, 1e18)
    }
}

#[cfg(test)]
mod tests {
    use super::{GRAVITY, Recovery, Vector3, Wrong};

    /// State after four seconds of this force.
    fn felt(force: Vector3<f64>) -> Recovery {
        let mut recovery = Recovery::default();
        for k in 0..40 {
            let felt = force + Vector3::x() * f64::from(k % 2) * 1e-3;
            recovery.observe(&force, &felt, 0.0, Some(GRAVITY), 0.1);
        }
        recovery
    }

    #[test]
    fn a_wrong_tilt_turns_gravity() {
        let mut knocked = felt(Vector3::new(4.0, 0.0, 8.957));
        assert!(!knocked.is_strong());
        assert!(matches!(knocked.test(Some(3.0), 0.01, GRAVITY), Some(Wrong::Tilted(_))));
        let mut fallen = felt(Vector3::new(0.0, 1.0, -12.0));
        assert_eq!(fallen.test(None, 0.01, GRAVITY), Some(Wrong::Fallen));
    }

    #[test]
    fn what_speeds_up_adds_to_it() {
        let mut pushed = felt(Vector3::new(4.0, 0.0, GRAVITY));
        assert!(pushed.is_strong() && pushed.doubt() > 1.0);
        assert_eq!(pushed.test(Some(3.0), 0.01, GRAVITY), None);
        let mut faster = felt(Vector3::new(12.0, 0.0, GRAVITY));
        assert_eq!(faster.test(Some(3.0), 0.01, GRAVITY), None);
    }
}
