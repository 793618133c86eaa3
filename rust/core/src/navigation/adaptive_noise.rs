//! Noise of a sensor from its innovations.
//!
//! The Allan variance of the innovations over one interval is the measurement's Allan variance, if
//! the inertial sensors remove the motion (Fu & Han, equations 17 and 26 to 31).

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::innovation_gate::MAX_INNOVATION;
use super::params::Adapt;
use crate::math::Real;

/// Longest interval for a difference of innovations, s; fixes usually come once a second.
const MAX_DIFFERENCE_S: f64 = 1.5;
/// Gain of the Allan variance, and number of differences from which it is used.
const FADING: f64 = 0.03;
const MIN_DIFFERENCES: u32 = 10;
/// Smallest noise, as a share of the stated noise.
const MIN_NOISE_SHARE: f64 = 1e-4;
const MAX_SPREAD: f64 = MAX_INNOVATION * MAX_INNOVATION;

/// Allan variance of the innovations of each axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct AdaptiveNoise {
    spread: Vector3<f64>,
    /// Number of differences in the Allan variance.
    count: u32,
    /// Last innovation, and its time; NaN before the first.
    last: Vector3<f64>,
    last_time: f64,
}

impl AdaptiveNoise {
    pub fn new() -> Self {
        Self { spread: Vector3::zeros(), count: 0, last: Vector3::zeros(), last_time: f64::NAN }
    }

    /// Returns the learned noise, for a filter that restarts.
    pub fn restarted(self) -> Self {
        Self { spread: self.spread, count: self.count, ..Self::new() }
    }

    /// Learns from an innovation, accepted or not. Returns the time since the previous innovation,
    /// s, NaN for the first.
    #[inline(always)]
    pub fn learn(&mut self, time: f64, innovation: &Vector3<f64>) -> f64 {
        let difference = innovation - self.last;
        let apart = time - self.last_time;
        if apart <= MAX_DIFFERENCE_S {
            self.count = self.count.saturating_add(1);
            let w = FADING.max(1.0 / f64::from(self.count));
            for i in 0..3 {
                let half = 0.5 * difference[i] * difference[i];
                let a = self.spread[i];
                let new = if self.count > 1 { half.min(4.0 * a) } else { half };
                self.spread[i] = (1.0 - w) * a + w * new.min(MAX_SPREAD);
            }
        }
        (self.last, self.last_time) = (*innovation, time);
        apart
    }

    /// Returns the variance of an axis with the stated variance `stated`.
    pub fn variance(&self, axis: usize, stated: f64, adapt: Adapt) -> f64 {
        match adapt {
            _ if self.count < MIN_DIFFERENCES => stated,
            Adapt::Fixed => stated,
            Adapt::Inflate => stated.max(self.spread[axis]),
            Adapt::Free => self.spread[axis].max(MIN_NOISE_SHARE * stated),
        }
    }

    /// Standard deviations learned from the innovations; NaN before they are known.
    pub fn standard_deviations(&self) -> [f64; 3] {
        let known = self.count >= MIN_DIFFERENCES;
        [0, 1, 2].map(|i| if known { self.spread[i].simd_sqrt() } else { f64::NAN })
    }

    pub fn is_valid(&self) -> bool {
        self.spread.iter().all(|a| (0.0..=MAX_SPREAD).contains(a))
            && self.last.iter().all(|e| e.abs() <= MAX_INNOVATION)
            && (self.last_time.is_nan() || self.last_time.is_finite())
    }
}
