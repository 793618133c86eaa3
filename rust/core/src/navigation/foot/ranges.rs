//! Range of a live gyro, detected if the flanks of its peaks predict more than it shows.

use serde::{Deserialize, Serialize};

use super::DEGREE;
use crate::math::validity::is_size;

/// Largest rate, rad/s, below which no range is searched.
pub(super) const MIN_FAST_RATE_RAD_S: f64 = 100.0 * DEGREE;
/// Limits as shares of the largest rate: of samples at the limit, of samples below it, and of
/// restored samples.
pub(super) const LIMIT_SHARE: f64 = 0.96;
pub(super) const NEAR_SHARE: f64 = 0.88;
pub(super) const RUN_SHARE: f64 = 0.965;
/// Smallest time at the limit, s, and smallest ratio to the samples below it.
pub(super) const MIN_LIMIT_S: f64 = 0.1;
pub(super) const MIN_LIMIT_RATIO: f64 = 0.5;
/// Smallest mean excess of the flanks' prediction over the limit, as a share of the limit.
pub(super) const MIN_EXCESS: f64 = 0.015;
/// Longest run of a peak, s; a cubic cannot restore a longer run.
pub(super) const MAX_RUN_S: f64 = 0.5;
/// Bounds of a valid state.
const MAX_SUM: f64 = 1e18;

/// Counts for one axis and sign to date.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Side {
    /// Largest rate, and rate for which the counts are valid, rad/s.
    largest: f64,
    counted: f64,
    /// Numbers of samples at the limit, and below it.
    at: f64,
    near: f64,
    /// Number of samples in runs, and their predicted excess, rad/s.
    samples: f64,
    excess: f64,
}

impl Side {
    pub const NONE: Self =
        Self { largest: 0.0, counted: 0.0, at: 0.0, near: 0.0, samples: 0.0, excess: 0.0 };

    /// Adds a rate of this side, rad/s.
    #[inline(always)]
    pub fn look(&mut self, x: f64) {
        if x > self.largest {
            self.largest = x;
            // Samples at the earlier limit are not at the new limit.
            if x * LIMIT_SHARE > self.counted {
                *self = Self { largest: x, counted: x, ..Self::NONE };
            }
        }
        if x > NEAR_SHARE * self.largest {
            let count = if x > LIMIT_SHARE * self.largest { &mut self.at } else { &mut self.near };
            *count += 1.0;
        }
    }

    /// True if a rate is at the largest rate to date.
    pub fn is_at_limit(&self, x: f64) -> bool {
        x > RUN_SHARE * self.largest && self.largest > MIN_FAST_RATE_RAD_S
    }

    /// Adds a run: its number of samples, and the excess that its flanks predict.
    pub fn take(&mut self, samples: f64, excess: f64) {
        self.samples += samples;
        self.excess += excess;
    }

    /// Range, rad/s, if this side is clipped.
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
