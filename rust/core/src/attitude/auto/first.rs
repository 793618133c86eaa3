//! The first rest may be false. On a table that turns slowly from the first sample on, gyro and
//! accelerometer look like a biased gyro at rest.
//!
//! The filter accepts it as rest. The possible heading error adds to the heading's standard
//! deviation, until the body moves in a way that no table does.

use serde::{Deserialize, Serialize};

use super::{DEGREE, square};
use crate::math::validity::is_size;

/// Largest rate about the vertical, rad/s, at which a first level is surely a bias: good gyros have
/// no larger bias.
const MAX_BIAS_RAD_S: f64 = 0.8 * DEGREE;
/// Time of motion after which the first rest is confirmed, s.
const MIN_MOTION_S: f64 = 3.0;
/// Ratio of the angle to the standard deviation.
const ANGLE_SIGMAS: f64 = 2.5;
/// Largest angle, rad.
const MAX_ANGLE_RAD: f64 = 10.0;

/// Heading change by the first level if it was no rest, rad, and time of motion, s.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct FirstRest {
    turned: f64,
    moved: f64,
}

impl FirstRest {
    /// Processes a tick: whether the body is quiet, and the bias about the vertical.
    pub fn observe(&mut self, quiet: bool, bias: f64, span: f64) {
        if self.moved >= MIN_MOTION_S {
            return;
        }
        if bias.abs() > MAX_BIAS_RAD_S {
            self.turned = (self.turned + bias.abs() * span).min(MAX_ANGLE_RAD);
        }
        // Before the first half second of rest the two are unknown.
        if !quiet && self.turned > 0.0 {
            self.moved += span;
        }
        if self.moved >= MIN_MOTION_S {
            self.turned = 0.0;
        }
    }

    /// Notes that the heading is known.
    pub fn align(&mut self) {
        self.turned = 0.0;
    }

    /// Variance of the heading from the first rest, rad².
    pub fn variance(&self) -> f64 {
        square(self.turned / ANGLE_SIGMAS)
    }

    pub fn is_valid(&self) -> bool {
        is_size(self.turned, MAX_ANGLE_RAD) && is_size(self.moved, 1e3)
    }
}
