//! A steady turn about the vertical, which neither gyro nor accelerometer tell from rest: the magnetic
//! field turns with it.

use nalgebra::{ComplexField, Vector3};
use serde::{Deserialize, Serialize};

use super::limits::MEAN_S;
use crate::attitude::sample::MAX_FIELD;
use crate::math::rotation::exponential;
use crate::math::validity::{are_within, is_size};
use crate::rest::quiet::{FIRST_DIRECTION_TICKS, LAST_DIRECTION_GAIN};

/// Deviations by which a field that stands still moves at most, squared, and the least of them as a
/// share of its strength.
const MAX_SIGMAS_SQUARED: f64 = 9.0;
const MIN_SIGMA_SHARE: f64 = 0.01;
/// Ticks with a field until a candidate has been observed.
const MIN_TICKS: f64 = 20.0;
/// Level share of the earth's field, seconds by which a mean is behind, and how many times
/// further than the limit a turn would have rotated it.
const LEVEL_SHARE: f64 = 0.4;
const MEAN_DELAY_S: f64 = 0.4;
const MIN_TURN_RATIO: f64 = 3.0;
/// Least sum of squared changes of what is measured, by its own square.
const MIN_CHANGE_RATIO: f64 = 1e-12;
/// Seconds at whose end the first mean is taken in its middle, and the share of how far the field has
/// moved, squared, by which it may miss where the gyro would have turned it.
const FIRST_MEAN_DELAY_S: f64 = 0.25;
const MAX_MISS_RATIO: f64 = 0.25;
/// Seconds in which the noise known doubles.
const NOISE_DOUBLING_S: f64 = 300.0;

/// The field while something may be a rest, in the axes of the sensor.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct FieldObserver {
    ticks: f64,
    /// Its means at the begin and now, and the last tick's.
    first: Vector3<f64>,
    last: Vector3<f64>,
    before: Vector3<f64>,
    /// Sum of squared changes from tick to tick, from the fifth on.
    changes: f64,
    /// Noise of a tick in the calmest rest to date, squared; zero before the first.
    noise: f64,
    /// Mean over half a second, and the same where the far level's anchor lies.
    mean: Vector3<f64>,
    anchor: Vector3<f64>,
    seen: bool,
}

impl FieldObserver {
    /// So many seconds passed.
    pub fn age(&mut self, span: f64) {
        let grown = 1.0 + 2.0 * core::f64::consts::LN_2 / NOISE_DOUBLING_S * span;
        self.noise = (self.noise * grown).min(MAX_FIELD * MAX_FIELD);
    }

    /// A candidate begins.
    pub fn begin(&mut self) {
        (self.ticks, self.changes) = (0.0, 0.0);
    }

    /// Takes the mean field of a tick; returns whether it has moved since the candidate began, and
    /// whether since the far level's anchor.
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

    /// Square of how far the field of a body at rest moves at most.
    fn limit_squared(&self) -> f64 {
        let noise = if self.noise > 0.0 { self.noise } else { self.own() };
        MAX_SIGMAS_SQUARED
            * noise.max(MIN_SIGMA_SHARE * MIN_SIGMA_SHARE * self.before.norm_squared())
    }

    /// True if a turn at this rate, for as long as the candidate lasts, would have moved the field: one
    /// that never changes is none.
    pub fn refutes_turn(&self, rate: f64, seconds: f64) -> bool {
        let rotated = rate * (seconds - 2.0 * MEAN_DELAY_S) * LEVEL_SHARE * self.before.norm();
        let lives = self.changes > MIN_CHANGE_RATIO * self.before.norm_squared();
        self.ticks >= MIN_TICKS
            && lives
            && rotated > MIN_TURN_RATIO * ComplexField::sqrt(self.limit_squared())
    }

    /// True if the field has turned as the gyro says that the body does, in so many seconds: it is
    /// no magnet that has moved it.
    pub fn follows_rotation(&self, rate: &Vector3<f64>, seconds: f64) -> bool {
        let angle = rate * -(seconds - FIRST_MEAN_DELAY_S - MEAN_DELAY_S).max(0.0);
        let expected = exponential(&angle) * self.first;
        let apart = (self.last - expected).norm_squared();
        apart < MAX_MISS_RATIO * (self.last - self.first).norm_squared()
    }

    /// Forgets what a rest that was none has taught.
    pub fn forget(&mut self) {
        self.noise = 0.0;
        self.begin();
    }

    /// Takes a rest.
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
