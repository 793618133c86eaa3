//! Lost samples: the gyro is silent while the body may turn.

use nalgebra::{ComplexField, Vector3};
use serde::{Deserialize, Serialize};

use crate::attitude::sample::{Inertial, MAX_RATE};
use crate::math::validity::is_size;

/// Seconds in which the last rate is forgotten, and those of the usual rate.
const RATE_DECAY_S: f64 = 0.3;
const USUAL_RATE_S: f64 = 5.0;
/// Rate of a body that seemed to rest, rad/s.
const MAX_REST_RATE_RAD_S: f64 = 0.01;
/// Variance per second of an angle while no rate is known at all, rad²/s.
const UNKNOWN_RATE_VARIANCE: f64 = 1.0;
/// Angular acceleration, rad/s², with which a body that rested may have begun to turn as a gap began,
/// where that is longer than so many seconds: after five it points anywhere.
const ANGULAR_ACCELERATION_RAD_S2: f64 = 0.25;
const MIN_REST_GAP_S: f64 = 1.0;
/// No angle is further off, rad.
const MAX_ANGLE_RAD: f64 = 10.0;

/// Bound of the body's rotation since the last rate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Lost {
    /// The angle, rad, and what its square has grown by in the tick.
    angle: f64,
    grown: f64,
    /// Seconds of the tick that it is known for.
    covered: f64,
    /// Mean square of the rate over seconds, (rad/s)².
    usual: f64,
}

/// Rate that a body may have, rad/s, that rested so many seconds ago.
fn rate_begun(seconds: f64) -> f64 {
    if seconds > MIN_REST_GAP_S { ANGULAR_ACCELERATION_RAD_S2 * seconds } else { 0.0 }
}

impl Lost {
    /// A rate is known again.
    #[inline(always)]
    pub fn end(&mut self) {
        self.angle = 0.0;
    }

    /// The share of the last rate that is still believed, some seconds after it.
    #[cold]
    #[inline(never)]
    pub fn fade(&mut self, sample: &Inertial, rate: &Vector3<f64>) -> f64 {
        if sample.age < f64::INFINITY {
            self.covered += sample.unknown;
        }
        let kept = ComplexField::exp(-sample.age / RATE_DECAY_S);
        let rate =
            rate.norm_squared().max(self.usual).max(MAX_REST_RATE_RAD_S * MAX_REST_RATE_RAD_S);
        // A force that goes on says how the body leans: it is the gyro alone that is silent.
        let all = sample.accel.is_none() && sample.age < f64::INFINITY;
        let begun = if all { rate_begun(sample.age) } else { 0.0 };
        let more = sample.dt * ((1.0 - kept) * ComplexField::sqrt(rate)).max(begun);
        let angle = (self.angle + more).min(MAX_ANGLE_RAD);
        self.grown += angle * angle - self.angle * self.angle;
        self.angle = angle;
        kept
    }

    /// A tick ends, of this mean square rate and so many seconds without a rate; returns by how much
    /// the variance of the orientation has grown, rad²: where there was no rate before, by any.
    pub fn take(&mut self, speed_squared: f64, span: f64, unknown: f64) -> f64 {
        if self.angle == 0.0 {
            self.usual += (span / USUAL_RATE_S).min(1.0) * (speed_squared - self.usual);
        }
        let (grown, covered) =
            (core::mem::take(&mut self.grown), core::mem::take(&mut self.covered));
        grown + UNKNOWN_RATE_VARIANCE * (unknown - covered).max(0.0)
    }

    /// Variance of the angle, rad², by which the body may have turned in so many seconds: as it did, of
    /// this mean square rate, another way every second, or from rest on.
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
