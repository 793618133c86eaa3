//! Sums over ticks, from which the scatter of the field with any hard iron follows, and how well it is
//! known.

use nalgebra::{ComplexField, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::ticks::Tick;
use crate::math::sound::{are_within, is_size};

/// Scatter that no field goes below: of places, not of noise.
const FLOOR: f64 = 0.01;
/// Seconds that count as one independent observation, and how many a span may have.
const ONE: f64 = 10.0;
const MOST: f64 = 4.0;
const LEAST: f64 = 0.5;
/// Deviation of a direction of a hard iron that is known.
pub const KNOWN: f64 = 0.10;
/// No sum is larger.
const LARGEST: f64 = 1e12;

/// Weighted sums of ticks, fields in units of their usual size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sums {
    weight: f64,
    /// Of e, of its squared size, of B, of BᵀB and of Bᵀe.
    turned: Vector3<f64>,
    squared: f64,
    rotation: Matrix3<f64>,
    own: Matrix3<f64>,
    both: Vector3<f64>,
}

impl Default for Sums {
    fn default() -> Self {
        let (zero, none) = (Vector3::zeros(), Matrix3::zeros());
        Self { weight: 0.0, turned: zero, squared: 0.0, rotation: none, own: none, both: zero }
    }
}

impl Sums {
    /// Adds a tick of this weight, after all before it have kept so much of theirs.
    pub fn add(&mut self, tick: &Tick, weight: f64, kept: f64) {
        let Tick { turned, rotation, .. } = tick;
        self.weight = kept * self.weight + weight;
        self.turned = self.turned * kept + turned * weight;
        self.squared = kept * self.squared + weight * turned.norm_squared();
        self.rotation = self.rotation * kept + rotation * weight;
        self.own = self.own * kept + rotation.tr_mul(rotation) * weight;
        self.both = self.both * kept + rotation.tr_mul(turned) * weight;
    }

    pub fn weight(&self) -> f64 {
        self.weight
    }

    fn part(&self) -> f64 {
        1.0 / self.weight.max(1e-9)
    }

    /// Mean of BᵀB without that of the mean of B: what turning says of a hard iron.
    pub fn turning(&self) -> Matrix3<f64> {
        let (part, mean) = (self.part(), self.rotation * self.part());
        let spread = self.own * part - mean.tr_mul(&mean);
        (spread + spread.transpose()) * 0.5
    }

    /// The same of Bᵀe.
    fn seen(&self) -> Vector3<f64> {
        let part = self.part();
        self.both * part - self.rotation.tr_mul(&self.turned) * (part * part)
    }

    /// The mean field without a hard iron.
    pub fn field(&self, iron: &Vector3<f64>) -> Vector3<f64> {
        (self.turned - self.rotation * iron) * self.part()
    }

    /// Variance of an axis of the field about its mean without a hard iron.
    pub fn variance(&self, iron: &Vector3<f64>) -> f64 {
        let part = self.part();
        let raw = self.squared * part - (self.turned * part).norm_squared();
        let less = iron.dot(&self.seen()) * 2.0 - iron.dot(&(self.turning() * iron));
        ((raw - less) / 3.0).max(0.0)
    }

    /// The hard iron of least scatter.
    pub fn iron(&self) -> Option<Vector3<f64>> {
        let turning = self.turning() + Matrix3::from_diagonal_element(1e-9);
        Some(turning.try_inverse()? * self.seen())
    }

    /// Covariance of a hard iron that was seen for so many seconds.
    pub fn covariance(&self, iron: &Vector3<f64>, seconds: f64) -> Matrix3<f64> {
        let limit = self.variance(iron).max(FLOOR * FLOOR);
        let observations = (seconds / ONE).clamp(LEAST, MOST);
        let information = self.turning() * (observations / limit) + Matrix3::identity();
        let found = information.try_inverse().unwrap_or_else(Matrix3::identity);
        (found + found.transpose()) * 0.5
    }

    pub fn is_sound(&self) -> bool {
        is_size(self.weight, LARGEST)
            && is_size(self.squared, LARGEST)
            && are_within(&self.turned, LARGEST)
            && are_within(&self.rotation, LARGEST)
            && are_within(&self.own, LARGEST)
            && are_within(&self.both, LARGEST)
    }
}

/// How many directions of a hard iron of this covariance are known, and what the iron is with nothing
/// along the others.
pub fn known_part(iron: &Vector3<f64>, covariance: &Matrix3<f64>) -> (usize, Vector3<f64>) {
    let Some(found) = covariance.try_symmetric_eigen(1e-12, 100) else {
        return (0, Vector3::zeros());
    };
    let (mut count, mut value) = (0, Vector3::zeros());
    for (size, axis) in found.eigenvalues.iter().zip(found.eigenvectors.column_iter()) {
        if *size < KNOWN * KNOWN {
            count += 1;
            value += axis * axis.dot(iron);
        }
    }
    (count, value)
}

/// Square of how many deviations two hard irons are apart.
pub fn apart(difference: &Vector3<f64>, covariance: &Matrix3<f64>) -> f64 {
    match covariance.try_inverse() {
        Some(inverse) => difference.dot(&(inverse * difference)).max(0.0),
        None => f64::INFINITY,
    }
}

/// RMS that a variance is of.
pub fn root(variance: f64) -> f64 {
    ComplexField::sqrt(variance)
}
