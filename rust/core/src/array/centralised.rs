//! The two stages of Liu, He & Zhao: a Kalman filter for each gyro, then one for all of them. The
//! two stages model the rate itself as a random walk.

use serde::{Deserialize, Serialize};

use super::MAX_SAMPLE;
use crate::error::Error;
use crate::memory;

/// Variance of the walk's step over the variance of the measurement, in the two stages. At rest the
/// first stage then leaves a quarter of the standard deviation, about as its authors report.
const PROCESS_NOISE: f64 = 0.014;

/// Filters of all sensors and axes, and of all axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Centralised {
    pub(super) first: Vec<Walk>,
    pub(super) second: Vec<Walk>,
    pub(super) took: Vec<bool>,
}

/// A random walk; variances are relative to the variance of its measurement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Walk {
    /// NaN before the first sample.
    pub(super) level: f64,
    pub(super) variance: f64,
}

const INITIAL_WALK: Walk = Walk { level: f64::NAN, variance: 1.0 };

impl Centralised {
    pub(super) fn new(sensors: usize, axes: usize) -> Result<Self, Error> {
        Ok(Self {
            first: memory::filled(INITIAL_WALK, sensors * axes)?,
            second: memory::filled(INITIAL_WALK, axes)?,
            took: memory::filled(false, sensors * axes)?,
        })
    }

    pub(super) fn restart(&mut self) {
        self.first.fill(INITIAL_WALK);
        self.second.fill(INITIAL_WALK);
    }

    /// Processes the samples of an axis; returns the number of present samples.
    #[inline(always)]
    pub(super) fn take(&mut self, axis: usize, axes: usize, z: &[f64], limit: Option<f64>) -> u32 {
        let (mut sum, mut count) = (0.0, 0);
        for index in (axis..z.len()).step_by(axes) {
            let there = z[index].is_finite() && limit.is_none_or(|limit| z[index].abs() < limit);
            self.took[index] = there;
            self.first[index].step(if there {
                z[index].clamp(-MAX_SAMPLE, MAX_SAMPLE)
            } else {
                f64::NAN
            });
            if there {
                (sum, count) = (sum + self.first[index].level, count + 1);
            }
        }
        self.second[axis].step(if count > 0 { sum / f64::from(count) } else { f64::NAN });
        count
    }

    pub(super) fn rate(&self, axis: usize) -> f64 {
        self.second[axis].level
    }

    pub(super) fn took(&self, index: usize) -> bool {
        self.took[index]
    }
}

impl Walk {
    #[inline(always)]
    fn step(&mut self, z: f64) {
        if self.level.is_nan() {
            self.level = z;
            return;
        }
        self.variance = (self.variance + PROCESS_NOISE).min(1e6);
        if !z.is_nan() {
            let gain = self.variance / (self.variance + 1.0);
            self.level += gain * (z - self.level);
            self.variance = gain;
        }
    }
}
