//! Standard deviation of a heading from a magnetometer. Fields of rooms and iron of the body do not
//! average out like white noise.

use nalgebra::{ComplexField, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::DEGREE;
use super::iron::Iron;
use crate::math::validity::{are_within, is_size};

/// Smallest standard deviation, rad, and initial value.
const MIN_DEVIATION_RAD: f64 = 0.5 * DEGREE;
const INITIAL_DEVIATION_RAD: f64 = 3.0 * DEGREE;
/// Time of the mean innovation whose square gives the error from place to place, s.
const INNOVATION_MEAN_S: f64 = 5.0;
/// Variance of an unknown heading, rad².
const MAX_HEADING_VARIANCE_RAD2: f64 = 10.0;
/// Largest tangent of a dip.
const MAX_DIP_TANGENT: f64 = 10.0;
/// Variance of an unknown tilt, rad²: its error is at most half a turn.
const MAX_TILT_VARIANCE_RAD2: f64 = core::f64::consts::PI * core::f64::consts::PI;

/// Correction of the heading by the field.
#[derive(Debug, Clone, Copy)]
pub struct Correction {
    pub gain: f64,
    pub noise: f64,
    /// Angle from north, rad.
    pub innovation: f64,
    /// Horizontal and vertical part of the field.
    pub level: f64,
    pub down: f64,
    /// Variance of the tilt about one axis, rad².
    pub tilt: f64,
    /// East in the sensor's axes.
    pub east: Vector3<f64>,
    /// Weight of the tick in a mean over places.
    pub field_weight: f64,
    pub span: f64,
}

/// Parts of the heading's variance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Deviation {
    /// Share of the field's white noise in the filter's variance, and the remaining variance that
    /// no field has shown, rad².
    white: f64,
    own: f64,
    /// Variance of the filter when a field was last used, rad².
    known: f64,
    /// Standard deviation of the heading from a tilt that mixes the field's dip into it, rad.
    tilted: f64,
    /// Mean innovation at a place, rad, and its mean square over places.
    mean: f64,
    field_variance: f64,
    /// Derivative of the heading by a field in the sensor's axes, one over the field's unit.
    shares: Vector3<f64>,
}

impl Deviation {
    /// Standard deviation of a heading with this variance.
    pub fn new(heading: f64) -> Self {
        Self {
            white: 0.0,
            own: heading,
            known: heading,
            tilted: 0.0,
            mean: 0.0,
            field_variance: INITIAL_DEVIATION_RAD * INITIAL_DEVIATION_RAD,
            shares: Vector3::zeros(),
        }
    }

    /// Variance that no field has shown, for a heading that has this variance now.
    fn since_field(&self, heading: f64) -> f64 {
        (self.own + heading - self.known).max(0.0)
    }

    /// Processes a correction of the heading: its variance before and after, and the field's size.
    pub fn correct(&mut self, by: &Correction, before: f64, after: f64, strength: f64) {
        let (gain, rest) = (by.gain, 1.0 - by.gain);
        self.white = rest * rest * self.white + gain * gain * by.noise;
        let slope = (by.down.abs() / by.level).min(MAX_DIP_TANGENT);
        self.tilted +=
            gain * (slope * ComplexField::sqrt(by.tilt.min(MAX_TILT_VARIANCE_RAD2)) - self.tilted);
        self.mean += (by.span / INNOVATION_MEAN_S).min(1.0) * (by.innovation - self.mean);
        self.field_variance += by.field_weight * (self.mean * self.mean - self.field_variance);
        self.own = (rest * rest * self.since_field(before))
            .min((after - self.white).max(0.0))
            .min(self.field_variance + MIN_DEVIATION_RAD * MIN_DEVIATION_RAD);
        self.known = after;
        let east = by.east * (1.0 / by.level.max(1e-6 * strength));
        self.shares += (east - self.shares) * gain;
    }

    /// Restarts with this variance of the heading.
    pub fn restart(&mut self, heading: f64) {
        let Self { field_variance, .. } = *self;
        *self = Self { field_variance, ..Self::new(heading) };
    }

    /// Variance of the heading, from the filter's own variance.
    pub fn variance(&self, heading: f64, iron: &Iron) -> f64 {
        let (iron, unsure) = iron.of_heading(&self.shares);
        let seen = MIN_DEVIATION_RAD * MIN_DEVIATION_RAD
            + self.tilted * self.tilted
            + iron * iron
            + unsure;
        (self.since_field(heading).max(self.field_variance) + seen).min(MAX_HEADING_VARIANCE_RAD2)
    }

    /// Variance of the heading from a field error with this covariance in the sensor's axes.
    pub fn by_field(&self, covariance: &Matrix3<f64>) -> f64 {
        (covariance * self.shares).dot(&self.shares).max(0.0)
    }

    pub fn is_valid_with(&self, iron: &Iron) -> bool {
        let sizes = [
            (self.white, 1e3),
            (self.own, 1e3),
            (self.known, 1e3),
            (self.tilted, 1e2),
            (self.field_variance, 16.0),
        ];
        sizes.iter().all(|(x, most)| is_size(*x, *most))
            && self.mean.abs() <= 4.0
            && self.has_valid_shares(iron.strength())
    }

    /// True if the shares are valid; before the first field they are zero.
    fn has_valid_shares(&self, strength: f64) -> bool {
        match strength {
            0.0 => self.shares == Vector3::zeros(),
            strength => are_within(&(self.shares * strength), 1e7),
        }
    }
}
