//! Detection of a steady rotation about the vertical by the magnetic field, which rotates with it.
//! Gyro and accelerometer do not distinguish it from rest.

use nalgebra::{ComplexField, Vector3};
use serde::{Deserialize, Serialize};

use super::limits::MEAN_S;
use crate::attitude::sample::MAX_FIELD;
use crate::math::rotation::exponential;
use crate::math::validity::{are_within, is_size};
use crate::rest::quiet::{FIRST_DIRECTION_TICKS, LAST_DIRECTION_GAIN};

/// Largest squared movement of a constant field, in standard deviations, and smallest standard
/// deviation as a share of its strength.
const MAX_SIGMAS_SQUARED: f64 = 9.0;
const MIN_SIGMA_SHARE: f64 = 0.01;
/// Number of ticks with a field after which a candidate has been observed.
const MIN_TICKS: f64 = 20.0;
/// Horizontal share of the earth's field; delay of a mean, s; and ratio to the limit by which a
/// rotation would have turned the field.
const LEVEL_SHARE: f64 = 0.4;
const MEAN_DELAY_S: f64 = 0.4;
const MIN_TURN_RATIO: f64 = 3.0;
/// Smallest sum of squared changes, relative to the square of the field.
const MIN_CHANGE_RATIO: f64 = 1e-12;
/// Delay of the first mean, in the middle of its time, s; and largest squared difference from the
/// rotation by the gyro, as a share of the field's movement.
const FIRST_MEAN_DELAY_S: f64 = 0.25;
const MAX_MISS_RATIO: f64 = 0.25;
/// Time in which the known noise doubles, s.
const NOISE_DOUBLING_S: f64 = 300.0;

/// The field during a candidate, in the sensor's axes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct FieldObserver {
    ticks: f64,
    /// Its means at the beginning and now, and the last tick's field.
    first: Vector3<f64>,
    last: Vector3<f64>,
    before: Vector3<f64>,
    /// Sum of squared changes between ticks, from the fifth tick on.
    changes: f64,
    /// Noise of a tick in the calmest rest to date, squared; zero before the first.
    noise: f64,
    /// Mean over half a second, and mean at the far level's anchor.
    mean: Vector3<f64>,
    anchor: Vector3<f64>,
    seen: bool,
}

impl FieldObserver {
    /// Lets this time pass, s.
    pub fn age(&mut self, span: f64) {
        let grown = 1.0 + 2.0 * core::f64::consts::LN_2 / NOISE_DOUBLING_S * span;
        self.noise = (self.noise * grown).min(MAX_FIELD * MAX_FIELD);
    }

    /// Begins a candidate.
    pub fn begin(&mut self) {
        (self.ticks, self.changes) = (0.0, 0.0);
    }

    /// Processes the mean field of a tick. Returns whether it has moved since the candidate began,
    /// and whether it has moved since the far level's anchor.
    pub fn observe(&mut self, field: &Vector3<f64>, span: f64) -> [bool; 2] {
        if !self.seen {
            (self.seen, self.mean, self.anchor) = (true, *field, *field);
        }
        self.mean += (field - self.mean) * (span / MEAN_S).min(1.0);
        self.ticks += 1.0;
        if self.ticks >= FIRST_DIRECTION_TICKS {
            self.changes += (field - self.before).norm_squared() * 0.5;
        }
        self.before = *field;
        if self.ticks <= FIRST_DIRECTION_TICKS {
            self.first += (field - self.first) * (1.0 / self.ticks);
            self.last = self.first;
        } else {
            self.last += (field - self.last) * LAST_DIRECTION_GAIN;
        }
        let limit = self.limit_squared();
        let moved = (self.last - self.first).norm_squared() > limit;
        let away = (self.mean - self.anchor).norm_squared() > limit;
        if away {
            self.anchor = self.mean;
        }
        [moved, away]
    }

    fn own(&self) -> f64 {
        self.changes / (self.ticks - 1.0).max(1.0)
    }

    /// Largest squared movement of the field of a body at rest.
    fn limit_squared(&self) -> f64 {
        let noise = if self.noise > 0.0 { self.noise } else { self.own() };
        MAX_SIGMAS_SQUARED
            * noise.max(MIN_SIGMA_SHARE * MIN_SIGMA_SHARE * self.before.norm_squared())
    }

    /// True if a rotation at this rate during the candidate would have moved the field. A field
    /// that never changes is no evidence.
    pub fn refutes_turn(&self, rate: f64, seconds: f64) -> bool {
        let rotated = rate * (seconds - 2.0 * MEAN_DELAY_S) * LEVEL_SHARE * self.before.norm();
        let lives = self.changes > MIN_CHANGE_RATIO * self.before.norm_squared();
        self.ticks >= MIN_TICKS
            && lives
            && rotated > MIN_TURN_RATIO * ComplexField::sqrt(self.limit_squared())
    }

    /// True if the field has rotated with the gyro in this time, s: no magnet has moved it.
    pub fn follows_rotation(&self, rate: &Vector3<f64>, seconds: f64) -> bool {
        let angle = rate * -(seconds - FIRST_MEAN_DELAY_S - MEAN_DELAY_S).max(0.0);
        let expected = exponential(&angle) * self.first;
        let apart = (self.last - expected).norm_squared();
        apart < MAX_MISS_RATIO * (self.last - self.first).norm_squared()
    }

    /// Forgets everything learned from a false rest.
    pub fn forget(&mut self) {
        self.noise = 0.0;
        self.begin();
    }

    /// Learns from a rest.
    pub fn learn(&mut self) {
        if self.ticks >= MIN_TICKS {
            let own = self.own();
            self.noise = if self.noise > 0.0 { self.noise.min(own) } else { own };
        }
    }

    pub fn is_valid(&self) -> bool {
        let most = 4.0 * MAX_FIELD;
        let fields = [self.first, self.last, self.before, self.mean, self.anchor];
        fields.iter().all(|v| are_within(v, most))
            && is_size(self.ticks, 1e15)
            && is_size(self.changes, 1e36)
            && is_size(self.noise, MAX_FIELD * MAX_FIELD)
    }
}
