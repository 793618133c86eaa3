//! Options for the sensor.

use serde::{Deserialize, Serialize};

use super::{BIAS_LIMIT, BIAS_SIGMA, MATRIX_SIGMAS, MAX_BIAS, MAX_MATRIX};
use crate::error::{Error, require};

/// Options for the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AutoOptions {
    /// True if there is a magnetometer; without one the initial heading is arbitrary.
    pub mag: bool,
    /// Output of the gyro without rotation, rad/s.
    pub bias: [f64; 3],
    /// Standard deviation of `bias`, rad/s.
    pub bias_sigma: [f64; 3],
    /// Largest bias of this gyro, rad/s: a larger rate never counts as rest.
    pub bias_limit: f64,
    /// Rows of the matrix M in `rate = M (gyro - bias)`.
    pub matrix: [[f64; 3]; 3],
    /// Standard deviations of the elements of `matrix`.
    pub matrix_sigma: [[f64; 3]; 3],
}

impl Default for AutoOptions {
    fn default() -> Self {
        Self {
            mag: true,
            bias: [0.0; 3],
            bias_sigma: [BIAS_SIGMA; 3],
            bias_limit: BIAS_LIMIT,
            matrix: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            matrix_sigma: [0, 1, 2].map(|i| [0, 1, 2].map(|j| MATRIX_SIGMAS[usize::from(i != j)])),
        }
    }
}

impl AutoOptions {
    pub(super) fn validate(self) -> Result<Self, Error> {
        for (x, sigma) in self.bias.into_iter().zip(self.bias_sigma) {
            require(x.abs() <= MAX_BIAS, "bias", "a rate of at most 10 rad/s", x)?;
            let expected = "a positive rate of at most 0.2 rad/s";
            require(sigma > 0.0 && sigma <= 0.2, "bias_sigma", expected, sigma)?;
        }
        let (limit, expected) = (self.bias_limit, "a positive rate of at most 10 rad/s");
        require(limit > 0.0 && limit <= MAX_BIAS, "bias_limit", expected, limit)?;
        for (i, x) in self.matrix.as_flattened().iter().enumerate() {
            let error = x - if i % 4 == 0 { 1.0 } else { 0.0 };
            require(error.abs() <= MAX_MATRIX, "gyro_matrix", "the identity within 0.2", *x)?;
        }
        for sigma in self.matrix_sigma.as_flattened() {
            let expected = "a number from 0 to 0.1";
            require((0.0..=0.1).contains(sigma), "gyro_matrix_sigma", expected, *sigma)?;
        }
        Ok(self)
    }
}
