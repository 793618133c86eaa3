//! Ticks of a tenth of a second: mean field in the sensor's axes and in the gyro's frame.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::attitude::sample::MAX_FIELD;
use crate::math::validity::{are_within, is_size};

/// Smallest share of the usual number of samples in a valid tick, and weight of a tick in the mean
/// number. A magnetometer may be slower than the gyro.
const MIN_SAMPLE_SHARE: f64 = 0.5;
const MEAN_GAIN: f64 = 0.05;
/// Largest number of samples in a tick.
const MAX_COUNT: f64 = 9_007_199_254_740_992.0;

/// Sums over the samples of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gathered {
    count: f64,
    usual: f64,
    turned: Vector3<f64>,
    rotation: Matrix3<f64>,
}

impl Default for Gathered {
    fn default() -> Self {
        let (turned, rotation) = (Vector3::zeros(), Matrix3::zeros());
        Self { count: 0.0, usual: 0.0, turned, rotation }
    }
}

/// Means of a tick: e of R m, B of R, and the size of m.
#[derive(Debug, Clone, Copy)]
pub struct Tick {
    pub turned: Vector3<f64>,
    pub rotation: Matrix3<f64>,
    pub size: f64,
}

impl Gathered {
    /// Adds a sample, and the rotation from the sensor to the gyro's frame.
    #[inline(always)]
    pub fn add(&mut self, field: &Vector3<f64>, rotation: &Matrix3<f64>) {
        self.count += 1.0;
        self.turned += rotation * field;
        self.rotation += rotation;
    }

    /// Ends the tick; returns the means if at least half of the usual number of samples came.
    pub fn end(&mut self) -> Option<Tick> {
        let Self { count, turned, rotation, .. } = *self;
        self.interrupt();
        if count == 0.0 {
            return None;
        }
        let usual = if self.usual == 0.0 { count } else { self.usual };
        self.usual = usual + MEAN_GAIN * (count - usual);
        let (turned, rotation) = (turned / count, rotation / count);
        let tick = Tick { turned, rotation, size: turned.norm() };
        (count >= MIN_SAMPLE_SHARE * usual).then_some(tick)
    }

    /// Discards the present tick.
    pub fn interrupt(&mut self) {
        *self = Self { usual: self.usual, ..Self::default() };
    }

    pub fn is_valid(&self) -> bool {
        is_size(self.count, MAX_COUNT)
            && is_size(self.usual, MAX_COUNT)
            && are_within(&self.turned, 2.0 * MAX_FIELD * self.count)
            && are_within(&self.rotation, 2.0 * self.count)
    }
}
