//! The first rest, if it was none: a table that turns slowly from the first sample on rests to a gyro
//! and an accelerometer, and nobody can tell it from a bias.
//!
//! The filter takes it for one. What that would have turned the heading by is in the heading's deviation
//! until the body moves as no table does.

use serde::{Deserialize, Serialize};

use super::{DEGREE, square};
use crate::math::validity::is_size;

/// Rate about the vertical, rad/s, up to which a first level is a bias: good gyros have no more.
const MAX_BIAS_RAD_S: f64 = 0.8 * DEGREE;
/// Seconds of motion after which the first rest was one.
const MIN_MOTION_S: f64 = 3.0;
/// Deviations that the angle is.
const ANGLE_SIGMAS: f64 = 2.5;
/// No angle is further off, rad.
const MAX_ANGLE_RAD: f64 = 10.0;

/// Heading change by the first level if that was no rest, rad, and seconds of motion.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct FirstRest {
    turned: f64,
    moved: f64,
}

impl FirstRest {
    /// Takes a tick: whether the body is quiet, and the bias about the vertical.
    pub fn observe(&mut self, quiet: bool, bias: f64, span: f64) {
        if self.moved >= MIN_MOTION_S {
            return;
        }
        if bias.abs() > MAX_BIAS_RAD_S {
            self.turned = (self.turned + bias.abs() * span).min(MAX_ANGLE_RAD);
        }
        // Before the first half second of rest nothing is known of either.
        if !quiet && self.turned > 0.0 {
            self.moved += span;
        }
        if self.moved >= MIN_MOTION_S {
            self.turned = 0.0;
        }
    }

    /// The heading is known.
    pub fn align(&mut self) {
        self.turned = 0.0;
    }

    /// Variance of the heading by it, rad².
    pub fn variance(&self) -> f64 {
        square(self.turned / ANGLE_SIGMAS)
    }

    pub fn is_valid(&self) -> bool {
        is_size(self.turned, MAX_ANGLE_RAD) && is_size(self.moved, 1e3)
    }
}
