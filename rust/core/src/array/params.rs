//! Parameters of an array.

use serde::{Deserialize, Serialize};

use crate::drift::{AutoParams, Behaviour};
use crate::error::{Error, check_positive, check_rate};
use crate::memory;
use crate::rest::RestLimits;

/// Largest number of sensors in an array: covariances grow with its square.
const MAX_SENSORS: usize = 256;

/// Largest distance of a rotation from an orthonormal matrix.
const MAX_ORTHONORMALITY_ERROR: f64 = 1e-6;

/// Largest distance of a correction's element from the identity.
const MAX_CORRECTION: f64 = 0.5;

/// Method of fusion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Fusion {
    /// Biases learned at rest, weights, and exclusion by a vote.
    Voted,
    /// Two stages of Kalman filters that model the rate as a random walk (Liu, He & Zhao).
    Centralised,
}

/// Weighting of sensors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Weights {
    /// Weights by noise at rest and by scale errors in motion.
    Auto,
    /// Equal weights.
    Mean,
    /// Weights by white noise only.
    White,
    /// Stated weights, by sensor and axis of the body.
    Given(Vec<f64>),
}

/// Parameters of a [`GyroArray`](super::GyroArray).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ArrayParams {
    /// Samples per second.
    pub rate: f64,
    /// Number of gyros.
    pub sensors: usize,
    /// Names of the sensors.
    pub labels: Vec<String>,
    /// Rotation of each sensor, row by row, from its axes to the body's; None if all are aligned.
    pub rotations: Option<Vec<f64>>,
    /// Correction of each sensor for scale and misalignment, row by row, `rate = correction ·
    /// sample`, applied before the rotation.
    pub corrections: Option<Vec<f64>>,
    /// Saturation level: a sample of this size or more counts as missing.
    pub limit: Option<f64>,
    /// Limits of rest.
    pub limits: RestLimits,
    /// Weighting of the sensors.
    pub weights: Weights,
    /// Standard deviation of the sensors' scale factors.
    pub scale_error: f64,
    /// Method of fusion.
    pub fusion: Fusion,
}

impl ArrayParams {
    /// Parameters of the drift filter of each axis.
    pub(super) fn of_filter(&self) -> AutoParams {
        let behaviour = Behaviour { limit: self.limit, ..Behaviour::default() };
        AutoParams { rate: self.rate, behaviour, limits: self.limits, ..AutoParams::default() }
    }

    /// Matrices from each sensor's samples to the axes of the body, row by row; `None` if the axes
    /// are equal.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory.
    pub(super) fn body_rotations<const A: usize>(&self) -> Result<Option<Vec<f64>>, Error> {
        let (Some(body_rotations), Some(corrections)) = (&self.rotations, &self.corrections) else {
            let only = self.rotations.as_ref().or(self.corrections.as_ref());
            return only.map(|only| memory::copied(only)).transpose();
        };
        let mut all = memory::filled(0.0, body_rotations.len())?;
        let pairs = body_rotations.chunks_exact(A * A).zip(corrections.chunks_exact(A * A));
        for (product, (r, c)) in all.chunks_exact_mut(A * A).zip(pairs) {
            for (index, x) in product.iter_mut().enumerate() {
                let (i, j) = (index / A, index % A);
                *x = (0..A).map(|k| r[i * A + k] * c[k * A + j]).sum();
            }
        }
        Ok(Some(all))
    }

    pub(super) fn check(&self, axes: usize) -> Result<(), Error> {
        check_rate(self.rate)?;
        let n = self.sensors;
        if n == 0 || n > MAX_SENSORS {
            let expected = "from 1 to 256";
            return Err(Error::Parameter { name: "sensors", expected, value: n as f64 });
        }
        if self.labels.len() != n {
            let (name, value) = ("labels", self.labels.len() as f64);
            return Err(Error::Parameter { name, expected: "one a sensor", value });
        }
        if !(0.0..=1.0).contains(&self.scale_error) {
            let (name, value) = ("scale_error", self.scale_error);
            return Err(Error::Parameter { name, expected: "from 0 to 1", value });
        }
        self.limit.map_or(Ok(()), |limit| check_positive("limit", "a positive number", limit))?;
        self.limits.validate()?;
        self.check_rotations(axes)?;
        self.check_corrections(axes)?;
        self.check_weights(axes)
    }

    fn check_rotations(&self, axes: usize) -> Result<(), Error> {
        let Some(rotations) = &self.rotations else { return Ok(()) };
        let name = "rotations";
        if rotations.len() != self.sensors * axes * axes {
            let expected = "one matrix a sensor";
            return Err(Error::Parameter { name, expected, value: rotations.len() as f64 });
        }
        for (sensor, r) in rotations.chunks_exact(axes * axes).enumerate() {
            if !is_orthonormal(r, axes) {
                let expected =
                    "orthonormal to 1e-6 (the number is that of the first sensor whose is not)";
                return Err(Error::Parameter { name, expected, value: (sensor + 1) as f64 });
            }
        }
        Ok(())
    }

    fn check_corrections(&self, axes: usize) -> Result<(), Error> {
        let Some(corrections) = &self.corrections else { return Ok(()) };
        let name = "calibrations";
        if corrections.len() != self.sensors * axes * axes {
            let expected = "one a sensor";
            let value = (corrections.len() / (axes * axes)) as f64;
            return Err(Error::Parameter { name, expected, value });
        }
        let usual = |index: usize| if index.is_multiple_of(axes + 1) { 1.0 } else { 0.0 };
        for (sensor, c) in corrections.chunks_exact(axes * axes).enumerate() {
            // The comparison is false for NaN.
            if !c.iter().enumerate().all(|(index, x)| (x - usual(index)).abs() <= MAX_CORRECTION) {
                let expected = "within 0.5 of the unit matrix (the number is that of the first sensor whose is not)";
                return Err(Error::Parameter { name, expected, value: (sensor + 1) as f64 });
            }
        }
        Ok(())
    }

    fn check_weights(&self, axes: usize) -> Result<(), Error> {
        let Weights::Given(weights) = &self.weights else { return Ok(()) };
        let (name, valid) = ("weights", |w: &f64| (-1.0..=1.0).contains(w));
        if weights.len() != self.sensors * axes || !weights.iter().all(valid) {
            let expected = "from -1 to 1, one a sensor";
            return Err(Error::Parameter { name, expected, value: weights.len() as f64 });
        }
        for axis in 0..axes {
            let sum: f64 = weights.iter().skip(axis).step_by(axes).sum();
            if sum <= 1e-9 {
                let expected = "such that their sum is above zero on every axis";
                return Err(Error::Parameter { name, expected, value: sum });
            }
        }
        Ok(())
    }
}

fn is_orthonormal(r: &[f64], axes: usize) -> bool {
    let product =
        |i: usize, j: usize| -> f64 { (0..axes).map(|k| r[i * axes + k] * r[j * axes + k]).sum() };
    let expected = |i, j| if i == j { 1.0 } else { 0.0 };
    (0..axes).all(|i| {
        (0..axes).all(|j| (product(i, j) - expected(i, j)).abs() <= MAX_ORTHONORMALITY_ERROR)
    })
}
