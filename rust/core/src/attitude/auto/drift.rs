//! A heading that drifts from its field: the gyro's bias has jumped along the vertical, where no
//! gravity shows it.
//!
//! A magnetometer corrects the heading alone, so a bias that neither a rest nor a tilt has told stays.
//! Once a field that is trusted keeps the heading on one side for ten seconds, the heading gets a bias
//! of its own, in the axes of the sensor, which nothing else uses.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::errors::Errors;
use super::{DEGREE, square};
use crate::math::sound::{are_within, is_size};

/// Seconds of the mean innovation, and those in which a rest forgets it.
const MEAN: f64 = 10.0;
const RESTED: f64 = 2.0;
/// Deviations, of whatever is largest, from which on a mean is a drift; the least of them, rad.
const SURE: f64 = 1.5;
const LEAST: f64 = 5.0 * DEGREE;
/// Walk of the heading's bias, rad/s/√s.
const WALK: f64 = 0.01 * DEGREE;
/// Seconds of turning at this rate, rad/s, over which the field's own spread is averaged, and the
/// deviation of its direction at the start, rad.
const PLACES: f64 = 60.0;
const TURNING: f64 = 20.0 * DEGREE;
const FIRST: f64 = 3.0 * DEGREE;
/// Largest bias, rad/s, and a variance that none falls below, (rad/s)².
const BIAS_MAX: f64 = 10.0;
const REGULAR: f64 = 1e-20;

/// How much the field differs from place to place: the iron of a room or of the body shows in its
/// level and vertical part before it shows in its direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Places {
    level: f64,
    down: f64,
    /// Square of the angle by which the direction differs, rad².
    spread: f64,
    seen: bool,
}

impl Default for Places {
    fn default() -> Self {
        Self { level: 0.0, down: 0.0, spread: FIRST * FIRST, seen: false }
    }
}

/// The share of a mean over places that a tick at this rate has.
pub fn share_of_places(rate: f64, span: f64) -> f64 {
    (span / PLACES * (rate / TURNING).min(1.0)).min(1.0)
}

impl Places {
    /// Takes the level part and the one down of a field.
    pub fn observe(&mut self, level: f64, down: f64, weight: f64) {
        if !self.seen {
            (self.level, self.down, self.seen) = (level, down, true);
        }
        self.level += weight * (level - self.level);
        self.down += weight * (down - self.down);
        let apart = square(level - self.level) + square(down - self.down);
        let angle = (apart / (2.0 * self.level * self.level).max(f64::MIN_POSITIVE)).min(1.0);
        self.spread += weight * (angle - self.spread);
    }

    pub fn is_sound(&self) -> bool {
        is_size(self.level, 1e10) && self.down.abs() <= 1e10 && is_size(self.spread, 1.0)
    }
}

/// The heading's own bias, rad/s, with its covariance and that with the heading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HeadingDrift {
    bias: Vector3<f64>,
    covariance: Matrix3<f64>,
    with_heading: Vector3<f64>,
    /// Whether there is one.
    active: bool,
    /// Mean innovation, rad, and seconds since a drift began.
    mean: f64,
    since: f64,
    places: Places,
}

impl Default for HeadingDrift {
    fn default() -> Self {
        Self {
            bias: Vector3::zeros(),
            covariance: Matrix3::zeros(),
            with_heading: Vector3::zeros(),
            active: false,
            mean: 0.0,
            since: MEAN,
            places: Places::default(),
        }
    }
}

impl HeadingDrift {
    /// Carries the heading through a tick; returns by what it turns and by what its variance grows.
    pub fn predict(&mut self, up: &Vector3<f64>, span: f64) -> (f64, f64) {
        self.since = (self.since + span).min(MEAN);
        if !self.active {
            return (0.0, 0.0);
        }
        let driven = self.covariance * up;
        let grown = span * (span * up.dot(&driven) - 2.0 * up.dot(&self.with_heading));
        self.with_heading -= driven * span;
        self.covariance += Matrix3::from_diagonal_element(span * WALK * WALK);
        (-span * up.dot(&self.bias), grown)
    }

    /// Takes an innovation, the heading's variance and whether the field can be believed in motion;
    /// returns what the variance grows by if the heading has drifted.
    pub fn judge(
        &mut self,
        innovation: f64,
        heading: f64,
        believed: bool,
        up: &Vector3<f64>,
        span: f64,
    ) -> f64 {
        let seen = if believed { innovation } else { 0.0 };
        self.mean += (span / MEAN).min(1.0) * (seen - self.mean);
        let usual = heading.max(LEAST * LEAST).max(4.0 * self.places.spread);
        let drifts = believed
            && self.since >= MEAN * (1.0 - 1e-9)
            && self.mean * innovation > 0.0
            && self.mean * self.mean > SURE * SURE * usual;
        if !drifts {
            return 0.0;
        }
        let grown = square(self.mean).max(square(innovation));
        // A second of its walk about the other axes keeps it regular.
        let walked = Matrix3::from_diagonal_element(WALK * WALK);
        self.covariance += up * up.transpose() * square(self.mean / MEAN) + walked;
        (self.active, self.mean, self.since) = (true, 0.0, 0.0);
        grown
    }

    /// Learns from a field, whose innovation had this variance and corrected the heading with this
    /// gain.
    pub fn correct(&mut self, innovation: f64, variance: f64, gain: f64) {
        if !self.active {
            return;
        }
        let by = self.with_heading * (1.0 / variance);
        self.bias = (self.bias + by * innovation).map(|x| x.clamp(-BIAS_MAX, BIAS_MAX));
        self.covariance -= by * self.with_heading.transpose();
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
        self.with_heading *= 1.0 - gain;
    }

    /// The deviation of the heading was shrunk by this to its bound.
    pub fn shrink(&mut self, by: f64) {
        if self.active && by < 1.0 {
            self.with_heading *= by;
        }
    }

    /// The bias of the gyro has learned something: if it is this, it is known twice.
    pub fn learned(&mut self, by: &Vector3<f64>) {
        let rest = self.bias - by;
        if self.active && rest.norm_squared() < self.bias.norm_squared() {
            self.bias = rest;
        }
    }

    /// The body rests: what a field says is no drift.
    pub fn rest(&mut self, span: f64) {
        self.mean *= (1.0 - span / RESTED).max(0.0);
    }

    /// The bias of the gyro is known.
    pub fn end(&mut self) {
        let Self { mean, since, places, .. } = *self;
        *self = Self { mean, since, places, ..Self::default() };
    }

    pub fn places(&mut self) -> &mut Places {
        &mut self.places
    }

    /// Whether it can be that of a running filter with these errors.
    pub fn is_sound_with(&self, errors: &Errors) -> bool {
        let none = self.covariance == Matrix3::zeros()
            && self.with_heading == Vector3::zeros()
            && self.bias == Vector3::zeros();
        let regular = self.covariance.diagonal().iter().all(|x| *x >= REGULAR);
        are_within(&self.bias, BIAS_MAX)
            && self.covariance == self.covariance.transpose()
            && if self.active { regular } else { none }
            && errors.is_sound(&self.covariance, &self.with_heading)
            && self.mean.abs() <= 4.0
            && is_size(self.since, MEAN)
            && self.places.is_sound()
    }
}
