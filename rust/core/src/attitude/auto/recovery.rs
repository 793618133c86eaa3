//! A tilt that is wrong: after a knock, lost or clipped samples, or a bias that jumped.
//!
//! Then the force in the frame keeps pointing one way, and corrections of the tilt with it, while the
//! filter takes the velocity that it sees for the body's own and believes its evidence less and less.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::attitude::GRAVITY;
use crate::attitude::sample::FORCE_MAX;
use crate::math::sound::{are_within, is_size};

/// Seconds of the mean force, and those between two recoveries.
const MEAN: f64 = 1.5;
const BETWEEN: f64 = 2.0;
/// Square of the sum of corrections, in times of what is expected, from which on they persist.
const PERSIST: f64 = 2.0;
/// Level part of the mean force, m/s², that a body under way does not keep up.
const LEVEL: f64 = 2.5;
/// Largest deviation of the tilt, rad.
const TILT: f64 = 0.5;
/// Share of the mean force that points up, below which the frame is more than 45 deg off, and the
/// least such force, m/s².
const UPRIGHT: f64 = 0.7;
const LEAST: f64 = 3.0;

/// Less than this, m/s², no force changes by from tick to tick but that of a stuck accelerometer,
/// where the body turns by so much, (rad/s)².
const STUCK: f64 = 1e-9;
const TURNS: f64 = 0.01;

/// What a mean force says of the tilt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wrong {
    /// Variance of the tilt about each level axis, rad².
    Tilted(f64),
    /// More than a filter of small errors can mend.
    Fallen,
}

/// The mean force in the frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Recovery {
    mean: Vector3<f64>,
    /// The last tick's in the axes of the sensor.
    last: Vector3<f64>,
    /// Seconds since the last recovery.
    since: f64,
}

impl Default for Recovery {
    fn default() -> Self {
        Self { mean: Vector3::new(0.0, 0.0, GRAVITY), last: Vector3::zeros(), since: BETWEEN }
    }
}

impl Recovery {
    /// Takes the mean force of a tick after the start, in the frame and in the axes of the sensor, and
    /// the mean square of the rate. One that never changes says nothing of a body that turns.
    pub fn observe(
        &mut self,
        force: &Vector3<f64>,
        felt: &Vector3<f64>,
        speed_squared: f64,
        span: f64,
    ) {
        let before = core::mem::replace(&mut self.last, *felt);
        if (felt - before).norm_squared() <= STUCK * STUCK && speed_squared > TURNS {
            return;
        }
        self.mean += (force - self.mean) * (span / MEAN).min(1.0);
        self.since = (self.since + span).min(BETWEEN);
    }

    /// What is wrong, if corrections persist in these times of what is expected and the tilt has
    /// this variance; in a rest only a fall is seen.
    pub fn judge(&mut self, persistence: Option<f64>, variance: f64) -> Option<Wrong> {
        let length = self.mean.norm();
        if self.mean.z < UPRIGHT * length && length > LEAST {
            *self = Self::default();
            return Some(Wrong::Fallen);
        }
        let level = self.mean.x * self.mean.x + self.mean.y * self.mean.y;
        let angle = level / (GRAVITY * GRAVITY);
        let wrong = persistence.is_some_and(|times| times > PERSIST)
            && level > LEVEL * LEVEL
            && angle > variance
            && self.since >= BETWEEN * (1.0 - 1e-9);
        if !wrong {
            return None;
        }
        self.since = 0.0;
        Some(Wrong::Tilted(angle.min(TILT * TILT)))
    }

    pub fn is_sound(&self) -> bool {
        are_within(&self.mean, 2.0 * FORCE_MAX)
            && are_within(&self.last, 2.0 * FORCE_MAX)
            && is_size(self.since, BETWEEN)
    }
}
