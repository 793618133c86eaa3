//! The temperature of a tick.

use serde::{Deserialize, Serialize};

use crate::math::validity::{is_sample, is_within};

/// Largest distance from the reference, K; a larger one is missing.
pub const MAX_KELVIN: f64 = 1e4;

/// Largest number of ticks in an average of the temperature, and share of the ticks that remains at
/// the next change.
const MAX_PACE: f64 = 240.0;
const PACE_SHARE: f64 = 0.75;

/// Temperature relative to the reference, K, averaged over the ticks between two changes.
///
/// For a thermometer with fine steps this is the mean of a tick. A thermometer with whole degrees
/// is constant and then jumps, while the bias changes smoothly. Without the average the bias would
/// not seem to follow the temperature.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Thermometer {
    /// Last raw temperature, and temperature of the last tick; NaN before the first.
    last: f64,
    kelvin: f64,
    /// Sum of the present tick.
    sum: f64,
    count: u32,
    changed: bool,
    /// Number of ticks since the last change, and number of ticks in an average.
    since: u32,
    pace: f64,
}

impl Thermometer {
    pub fn new() -> Self {
        Self {
            last: f64::NAN,
            kelvin: f64::NAN,
            sum: 0.0,
            count: 0,
            changed: false,
            since: 0,
            pace: 1.0,
        }
    }

    /// Temperature of the last tick; `None` before the first.
    pub fn kelvin(&self) -> Option<f64> {
        (!self.kelvin.is_nan()).then_some(self.kelvin)
    }

    /// Adds a temperature, if it is in range.
    #[inline(always)]
    pub fn observe(&mut self, kelvin: f64) {
        if kelvin.abs() <= MAX_KELVIN {
            self.changed |= kelvin != self.last && !self.last.is_nan();
            self.last = kelvin;
            self.sum += kelvin;
            self.count += 1;
        }
    }

    /// Ends a tick.
    pub fn end_tick(&mut self) {
        if self.count > 0 {
            self.since = self.since.saturating_add(1);
            if self.changed {
                self.pace = f64::from(self.since).max(PACE_SHARE * self.pace).min(MAX_PACE);
                self.since = 0;
            }
            let mean = self.sum / f64::from(self.count);
            let before = self.kelvin().unwrap_or(mean);
            self.kelvin = before + (mean - before) / self.pace;
        }
        (self.sum, self.count, self.changed) = (0.0, 0, false);
    }

    /// True if temperatures can have led to this state, in ticks of this number of samples.
    pub fn is_valid(&self, length: u32) -> bool {
        // A mean has some rounding errors.
        let most = MAX_KELVIN * (1.0 + 1e-6);
        is_sample(self.last, MAX_KELVIN)
            && is_sample(self.kelvin, most)
            && self.count < length
            && is_within(self.sum, most * f64::from(self.count))
            && self.pace >= 1.0
            && self.pace <= MAX_PACE
    }
}
