//! Sums over ticks. They give the scatter of the field with any hard iron, and the covariance of
//! the hard iron.

use core::ops::Range;

use nalgebra::{ComplexField, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::ticks::Tick;
use crate::math::validity::{is_size, is_within};

/// Smallest scatter of a field: it comes from places, not from noise.
const MIN_SCATTER: f64 = 0.01;
/// Time of one independent observation, s, and largest number of observations in a span.
const OBSERVATION_S: f64 = 10.0;
const MAX_OBSERVATIONS: f64 = 4.0;
const MIN_OBSERVATIONS: f64 = 0.5;
/// Standard deviation up to which a direction of a hard iron is known.
pub const MAX_KNOWN_SIGMA: f64 = 0.10;
/// Largest sum.
const MAX_SUM: f64 = 1e12;

/// Indices in a row of sums: 1, e, its squared size, B, BᵀB and Bᵀe.
const WEIGHT: usize = 0;
const FIELD: Range<usize> = 1..4;
const FIELD_SQUARED: usize = 4;
const ROTATION: Range<usize> = 5..14;
const GRAM: Range<usize> = 14..23;
const CROSS: Range<usize> = 23..COUNT;
const COUNT: usize = 26;

/// Terms of a tick for the sums; fields are in units of their usual size.
#[derive(Debug, Clone, Copy)]
pub struct Products([f64; COUNT]);

impl Products {
    pub fn of(tick: &Tick) -> Self {
        let Tick { turned, rotation, .. } = tick;
        let mut row = [0.0; COUNT];
        (row[WEIGHT], row[FIELD_SQUARED]) = (1.0, turned.norm_squared());
        row[FIELD].copy_from_slice(turned.as_slice());
        row[ROTATION].copy_from_slice(rotation.as_slice());
        row[GRAM].copy_from_slice(rotation.tr_mul(rotation).as_slice());
        row[CROSS].copy_from_slice(rotation.tr_mul(turned).as_slice());
        Self(row)
    }
}

/// Weighted sums of ticks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Sums([f64; COUNT]);

impl Sums {
    /// Adds a tick with this weight, after the weights of all previous ticks are multiplied by
    /// `kept`.
    pub fn add(&mut self, tick: &Products, weight: f64, kept: f64) {
        for (sum, number) in self.0.iter_mut().zip(&tick.0) {
            *sum = kept * *sum + weight * number;
        }
    }

    pub fn weight(&self) -> f64 {
        self.0[WEIGHT]
    }

    fn turned(&self) -> Vector3<f64> {
        Vector3::from_column_slice(&self.0[FIELD])
    }

    fn rotation(&self) -> Matrix3<f64> {
        Matrix3::from_column_slice(&self.0[ROTATION])
    }

    fn part(&self) -> f64 {
        1.0 / self.weight().max(1e-9)
    }

    /// Mean of BᵀB minus the product of the means of B: information on a hard iron from rotation.
    pub fn turning(&self) -> Matrix3<f64> {
        let (part, mean) = (self.part(), self.rotation() * self.part());
        let own = Matrix3::from_column_slice(&self.0[GRAM]);
        let spread = own * part - mean.tr_mul(&mean);
        (spread + spread.transpose()) * 0.5
    }

    /// Mean of Bᵀe minus the product of the means.
    fn seen(&self) -> Vector3<f64> {
        let part = self.part();
        let both = Vector3::from_column_slice(&self.0[CROSS]);
        both * part - self.rotation().tr_mul(&self.turned()) * (part * part)
    }

    /// Mean field if this hard iron is subtracted.
    pub fn field(&self, iron: &Vector3<f64>) -> Vector3<f64> {
        (self.turned() - self.rotation() * iron) * self.part()
    }

    /// Variance per axis of the field about its mean, if this hard iron is subtracted.
    pub fn variance(&self, iron: &Vector3<f64>) -> f64 {
        let part = self.part();
        let raw = self.0[FIELD_SQUARED] * part - (self.turned() * part).norm_squared();
        let less = iron.dot(&self.seen()) * 2.0 - iron.dot(&(self.turning() * iron));
        ((raw - less) / 3.0).max(0.0)
    }

    /// The hard iron of least scatter.
    pub fn iron(&self) -> Option<Vector3<f64>> {
        let turning = self.turning() + Matrix3::from_diagonal_element(1e-9);
        Some(turning.try_inverse()? * self.seen())
    }

    /// Covariance of a hard iron from an observation of this duration, s.
    pub fn covariance(&self, iron: &Vector3<f64>, seconds: f64) -> Matrix3<f64> {
        let limit = self.variance(iron).max(MIN_SCATTER * MIN_SCATTER);
        let observations = (seconds / OBSERVATION_S).clamp(MIN_OBSERVATIONS, MAX_OBSERVATIONS);
        let information = self.turning() * (observations / limit) + Matrix3::identity();
        let found = information.try_inverse().unwrap_or_else(Matrix3::identity);
        (found + found.transpose()) * 0.5
    }

    pub fn is_valid(&self) -> bool {
        let sizes = is_size(self.weight(), MAX_SUM) && is_size(self.0[FIELD_SQUARED], MAX_SUM);
        sizes && self.0.iter().all(|x| is_within(*x, MAX_SUM))
    }
}

/// Number of known directions of a hard iron with this covariance, and the hard iron with zeros
/// along the other directions.
pub fn known_part(iron: &Vector3<f64>, covariance: &Matrix3<f64>) -> (usize, Vector3<f64>) {
    let Some(found) = covariance.try_symmetric_eigen(1e-12, 100) else {
        return (0, Vector3::zeros());
    };
    let (mut count, mut value) = (0, Vector3::zeros());
    for (size, axis) in found.eigenvalues.iter().zip(found.eigenvectors.column_iter()) {
        if *size < MAX_KNOWN_SIGMA * MAX_KNOWN_SIGMA {
            count += 1;
            value += axis * axis.dot(iron);
        }
    }
    (count, value)
}

/// Squared distance of two hard irons, in standard deviations.
pub fn apart(difference: &Vector3<f64>, covariance: &Matrix3<f64>) -> f64 {
    match covariance.try_inverse() {
        Some(inverse) => difference.dot(&(inverse * difference)).max(0.0),
        None => f64::INFINITY,
    }
}

/// RMS of a variance.
pub fn root(variance: f64) -> f64 {
    ComplexField::sqrt(variance)
}
