//! The temperature of a tick.

use serde::{Deserialize, Serialize};

use crate::math::validity::{is_sample, is_within};

/// Kelvins from the reference beyond which there is no temperature.
pub const MAX_KELVIN: f64 = 1e4;

/// Ticks at most over which temperature is averaged, and what is left of them at the next change.
const MAX_PACE: f64 = 240.0;
const PACE_SHARE: f64 = 0.75;

/// Kelvins from the reference, averaged over as many ticks as lie between two changes.
///
/// Of a thermometer of fine steps that is the mean of a tick. One of whole degrees stands still and
/// jumps while the bias glides: taken as it is, it would show a bias that does not follow.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Thermometer {
    /// The last one raw, and that of the last tick; NaN before them.
    last: f64,
    kelvin: f64,
    /// Of the tick to date.
    sum: f64,
    count: u32,
    changed: bool,
    /// Ticks since the last change, and those of an average.
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

    /// That of the last tick; None before the first.
    pub fn kelvin(&self) -> Option<f64> {
        (!self.kelvin.is_nan()).then_some(self.kelvin)
    }

    /// Takes one that is within the bounds.
    #[inline(always)]
    pub fn observe(&mut self, kelvin: f64) {
        if kelvin.abs() <= MAX_KELVIN {
            self.changed |= kelvin != self.last && !self.last.is_nan();
            self.last = kelvin;
            self.sum += kelvin;
            self.count += 1;
        }
    }

    /// A tick is over.
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

    /// True if temperatures can have made it, in ticks of so many samples.
    pub fn is_valid(&self, length: u32) -> bool {
        // A mean is off by some roundings.
        let most = MAX_KELVIN * (1.0 + 1e-6);
        is_sample(self.last, MAX_KELVIN)
            && is_sample(self.kelvin, most)
            && self.count < length
            && is_within(self.sum, most * f64::from(self.count))
            && self.pace >= 1.0
            && self.pace <= MAX_PACE
    }
}
