//! The range of a live gyro, found where flanks of its peaks promise more than it shows.

use serde::{Deserialize, Serialize};

use super::DEGREE;
use crate::math::validity::is_size;

/// A gyro that never turned so fast, rad/s, is not looked at.
pub(super) const MIN_FAST_RATE_RAD_S: f64 = 100.0 * DEGREE;
/// Parts of the largest rate: of samples at the limit, of those below it, and of those restored.
pub(super) const LIMIT_SHARE: f64 = 0.96;
pub(super) const NEAR_SHARE: f64 = 0.88;
pub(super) const RUN_SHARE: f64 = 0.965;
/// Seconds at the limit, and how many there must be of those below it.
pub(super) const MIN_LIMIT_S: f64 = 0.1;
pub(super) const MIN_LIMIT_RATIO: f64 = 0.5;
/// What flanks must promise beyond the limit, on average, as a part of it.
pub(super) const MIN_EXCESS: f64 = 0.015;
/// A run that lasts longer, s, is no peak: no cubic knows what it was.
pub(super) const MAX_RUN_S: f64 = 0.5;
/// Bounds of a valid state.
const MAX_SUM: f64 = 1e18;

/// Counts of one axis and sign to date.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Side {
    /// The largest rate, and that from which the counts on hold, rad/s.
    largest: f64,
    counted: f64,
    /// Samples at the limit, and of those below it.
    at: f64,
    near: f64,
    /// Samples of runs, and what their flanks promised beyond them, rad/s.
    samples: f64,
    excess: f64,
}

impl Side {
    pub const NONE: Self =
        Self { largest: 0.0, counted: 0.0, at: 0.0, near: 0.0, samples: 0.0, excess: 0.0 };

    /// Takes a rate of this side, rad/s.
    #[inline(always)]
    pub fn look(&mut self, x: f64) {
        if x > self.largest {
            self.largest = x;
            // What was at the limit before is not at this one.
            if x * LIMIT_SHARE > self.counted {
                *self = Self { largest: x, counted: x, ..Self::NONE };
            }
        }
        if x > NEAR_SHARE * self.largest {
            let count = if x > LIMIT_SHARE * self.largest { &mut self.at } else { &mut self.near };
            *count += 1.0;
        }
    }

    /// True if a rate is at the largest one to date.
    pub fn is_at_limit(&self, x: f64) -> bool {
        x > RUN_SHARE * self.largest && self.largest > MIN_FAST_RATE_RAD_S
    }

    /// Takes a run: its samples, and what its flanks promise beyond them.
    pub fn take(&mut self, samples: f64, excess: f64) {
        self.samples += samples;
        self.excess += excess;
    }

    /// The range, rad/s, if this side is clipped.
    pub fn range(&self, dt: f64) -> Option<f64> {
        let clipped = self.samples > 0.0
            && self.at * dt >= MIN_LIMIT_S
            && self.at >= MIN_LIMIT_RATIO * self.near
            && self.excess >= MIN_EXCESS * self.largest * self.samples;
        clipped.then_some(self.largest)
    }

    pub fn is_valid(&self) -> bool {
        [self.largest, self.counted, self.at, self.near, self.samples]
            .iter()
            .all(|x| is_size(*x, MAX_SUM))
            && self.excess.abs() <= MAX_SUM
    }
}
