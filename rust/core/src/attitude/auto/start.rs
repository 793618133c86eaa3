//! The first second: up is where the mean force of a frame that the gyro holds still points.
//!
//! A body that is moved from the start feels accelerations of its own. Their mean is what its
//! velocity has changed by over the time: it falls the longer one waits.

use nalgebra::{ComplexField, Quaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::errors::{Errors, VELOCITY};
use crate::attitude::GRAVITY;

/// Seconds that it lasts.
const LASTS: f64 = 1.0;
/// Speed that a body may change by in it, m/s.
pub const SPEED: f64 = 1.0;
/// Standard deviation of a tilt that nothing is known of, rad.
pub const TILT: f64 = 0.5;
/// A mean force shorter than this, of all samples together, tells no direction, m/s².
const LEAST: f64 = 1e-6;

/// The sum of the forces so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Its length: it points up.
    sum: f64,
    /// Seconds since the first force.
    elapsed: f64,
    pub over: bool,
}

impl Start {
    /// Adds a force in the axes of the frame; returns the rotation of the frame that makes the sum
    /// point up again.
    pub fn add(&mut self, force: &Vector3<f64>) -> Option<Quaternion<f64>> {
        let sum = Vector3::new(force.x, force.y, force.z + self.sum);
        let length = sum.norm();
        if length < LEAST {
            return None;
        }
        self.sum = length;
        let half = ((1.0 + sum.z / length) * 0.5).max(0.0).sqrt();
        if half < 1e-6 {
            // Upside down: about any level axis.
            return Some(Quaternion::new(0.0, 1.0, 0.0, 0.0));
        }
        let scale = 0.5 / (half * length);
        Some(Quaternion::new(half, sum.y * scale, -sum.x * scale, 0.0).normalize())
    }

    /// Whether a tick belongs to the start; then the errors are those of a mean force over the time.
    pub fn observe(&mut self, elapsed: f64, errors: &mut Errors) -> bool {
        if self.over || self.sum == 0.0 {
            return !self.over;
        }
        self.elapsed += elapsed;
        if self.elapsed > LASTS * (1.0 + 1e-9) && self.elapsed > elapsed {
            self.over = true;
            return false;
        }
        let slope = SPEED / (GRAVITY * self.elapsed);
        let tilt = (2.0 * slope * slope).min(TILT * TILT);
        errors.restart(&[0, 1], tilt);
        errors.restart(&[VELOCITY, VELOCITY + 1], SPEED * SPEED);
        if tilt < TILT * TILT {
            errors.couple(1, VELOCITY, slope * SPEED);
            errors.couple(0, VELOCITY + 1, -slope * SPEED);
        }
        true
    }

    pub fn is_sound(&self) -> bool {
        (0.0..=1e9).contains(&self.sum) && (0.0..=1e3).contains(&self.elapsed)
    }
}
