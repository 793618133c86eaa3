//! Rest by limits of the samples, before a calmer rest is known: samples stay near their mean.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{DEGREE, Seen};
use crate::attitude::auto::strapdown::Sums;

/// Largest distance of samples from their mean at rest: gyro, rad/s, and accelerometer, m/s².
pub const MAX_GYRO_RAD_S: f64 = 2.0 * DEGREE;
const MAX_ACCEL_M_S2: f64 = 0.5;
/// Time of the means, s.
pub const MEAN_S: f64 = 0.5;
/// Time after which apparent rest counts as rest, s.
pub const MIN_REST_S: f64 = 1.5;

/// Means of the last half second, and time within the limits.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    gyro: Vector3<f64>,
    accel: Vector3<f64>,
    /// Mean of the accelerometer at the beginning.
    first_accel: Vector3<f64>,
    /// Time within the limits, s; negative before the first tick.
    since: f64,
}

impl Default for Limits {
    fn default() -> Self {
        let zero = Vector3::zeros();
        Self { gyro: zero, accel: zero, first_accel: zero, since: -1.0 }
    }
}

impl Limits {
    /// Mean rate, rad/s.
    pub fn level(&self) -> &Vector3<f64> {
        &self.gyro
    }

    /// Time within the limits, s.
    pub fn since(&self) -> f64 {
        self.since.max(0.0)
    }

    /// Ends an apparent rest: the tick has no information.
    pub fn end(&mut self) {
        self.since = self.since.min(0.0);
    }

    /// Processes a tick.
    #[inline(always)]
    pub fn observe(&mut self, sums: &Sums, seen: &Seen) {
        if self.since < 0.0 {
            (self.gyro, self.accel, self.since) = (seen.gyro, seen.accel, 0.0);
            self.first_accel = seen.accel;
        }
        let (of_gyro, of_accel) = sums.spread(&self.gyro, &self.accel);
        let weight = (seen.span / MEAN_S).min(1.0);
        self.gyro += (seen.gyro - self.gyro) * weight;
        self.accel += (seen.accel - self.accel) * weight;
        // A rotation about any axis but the vertical changes gravity, even if it is slow.
        let moved = (self.accel - self.first_accel).norm_squared();
        if of_gyro > MAX_GYRO_RAD_S * MAX_GYRO_RAD_S
            || of_accel.max(moved) > MAX_ACCEL_M_S2 * MAX_ACCEL_M_S2
        {
            (self.since, self.first_accel) = (0.0, self.accel);
        } else {
            self.since += seen.span;
        }
    }

    pub fn is_valid(&self) -> bool {
        let finite = |v: &Vector3<f64>| v.iter().all(|x| x.abs() <= 2e3);
        finite(&self.gyro)
            && finite(&self.accel)
            && finite(&self.first_accel)
            && (-1.0..1e18).contains(&self.since)
    }
}
