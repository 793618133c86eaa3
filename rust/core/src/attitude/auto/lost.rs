//! Lost samples: the gyro gives no rate while the body may turn.

use nalgebra::{ComplexField, Vector3};
use serde::{Deserialize, Serialize};

use crate::attitude::sample::{Inertial, MAX_RATE};
use crate::math::validity::is_size;

/// Time constants of the last rate and of the usual rate, s.
const RATE_DECAY_S: f64 = 0.3;
const USUAL_RATE_S: f64 = 5.0;
/// Largest rate of a body that seemed to rest, rad/s.
const MAX_REST_RATE_RAD_S: f64 = 0.01;
/// Variance per second of an angle without any known rate, rad²/s.
const UNKNOWN_RATE_VARIANCE: f64 = 1.0;
/// Angular acceleration, rad/s², with which a resting body may have begun to turn in a gap, and
/// shortest such gap, s. After five seconds its direction is unknown.
const ANGULAR_ACCELERATION_RAD_S2: f64 = 0.25;
const MIN_REST_GAP_S: f64 = 1.0;
/// Largest angle, rad.
const MAX_ANGLE_RAD: f64 = 10.0;

/// Bound of the body's rotation since the last rate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Lost {
    /// The angle, rad, and growth of its square in the tick.
    angle: f64,
    grown: f64,
    /// Time of the tick with a known rate, s.
    covered: f64,
    /// Mean square of the rate over seconds, (rad/s)².
    usual: f64,
}

/// Possible rate of a body that rested this number of seconds ago, rad/s.
fn rate_begun(seconds: f64) -> f64 {
    if seconds > MIN_REST_GAP_S { ANGULAR_ACCELERATION_RAD_S2 * seconds } else { 0.0 }
}

impl Lost {
    /// Notes that a rate is known again.
    #[inline(always)]
    pub fn end(&mut self) {
        self.angle = 0.0;
    }

    /// Share of the last rate that is still assumed some seconds later.
    #[cold]
    #[inline(never)]
    pub fn fade(&mut self, sample: &Inertial, rate: &Vector3<f64>) -> f64 {
        if sample.age < f64::INFINITY {
            self.covered += sample.unknown;
        }
        let kept = ComplexField::exp(-sample.age / RATE_DECAY_S);
        let rate =
            rate.norm_squared().max(self.usual).max(MAX_REST_RATE_RAD_S * MAX_REST_RATE_RAD_S);
        // A present force shows the tilt: only the gyro gives no samples.
        let all = sample.accel.is_none() && sample.age < f64::INFINITY;
        let begun = if all { rate_begun(sample.age) } else { 0.0 };
        let more = sample.dt * ((1.0 - kept) * ComplexField::sqrt(rate)).max(begun);
        let angle = (self.angle + more).min(MAX_ANGLE_RAD);
        self.grown += angle * angle - self.angle * self.angle;
        self.angle = angle;
        kept
    }

    /// Ends a tick with this mean square rate and this time without a rate. Returns the growth of
    /// the orientation's variance, rad².
    pub fn take(&mut self, speed_squared: f64, span: f64, unknown: f64) -> f64 {
        if self.angle == 0.0 {
            self.usual += (span / USUAL_RATE_S).min(1.0) * (speed_squared - self.usual);
        }
        let (grown, covered) =
            (core::mem::take(&mut self.grown), core::mem::take(&mut self.covered));
        grown + UNKNOWN_RATE_VARIANCE * (unknown - covered).max(0.0)
    }

    /// Variance of the angle, rad², by which the body may have turned in this time. It turned with
    /// this mean square rate, in another direction every second, or from rest.
    pub fn turned(&self, speed_squared: f64, seconds: f64) -> f64 {
        let rest = MAX_REST_RATE_RAD_S * MAX_REST_RATE_RAD_S;
        let begun = 0.5 * rate_begun(seconds) * seconds;
        ((speed_squared.max(self.usual) + rest) * seconds).max(begun * begun)
    }

    pub fn is_valid(&self) -> bool {
        is_size(self.angle, MAX_ANGLE_RAD)
            && is_size(self.grown, 2.0 * MAX_ANGLE_RAD * MAX_ANGLE_RAD)
            && is_size(self.covered, 1e3)
            && is_size(self.usual, 2.0 * MAX_RATE * MAX_RATE)
    }
}
