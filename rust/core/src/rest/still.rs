//! Limits of a sensor's rest, where they are known.

use serde::{Deserialize, Serialize};

use super::RestLimits;
use super::ticker::TickSums;
use crate::math::validity::is_within;
use crate::math::{Limits, Real};

/// Ticks that have to stay within the limits: one and a half seconds.
const MIN_TICKS: usize = 6;

/// Spread of their means at most, as a share of the deviation that samples may have: vibration
/// shakes samples and averages out, turning does not.
const MAX_MEAN_SPREAD: f64 = 0.3;

/// Ticks in a row that may be rest, in the unit of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Still<T> {
    rest: Option<T>,
    bias: Option<T>,
    /// Means of the last ticks, the newest first.
    means: [T; MIN_TICKS],
    ticks: u32,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Still<T> {
    pub(super) fn new(limits: RestLimits) -> Self {
        let size = |limit: f64| T::of(limit).at_most(T::MAX_RAW);
        Self {
            rest: limits.rest.map(size),
            bias: limits.bias.map(size),
            means: [T::zero(); MIN_TICKS],
            ticks: 0,
        }
    }

    /// Takes a tick; returns whether it can be one of rest.
    pub(super) fn take(&mut self, seen: &TickSums<T>) -> bool {
        self.means.rotate_right(1);
        self.means[0] = seen.mean;
        self.ticks = (self.ticks + 1).min(MIN_TICKS as u32);
        let loud = self.rest.is_some_and(|limit| seen.deviation > limit);
        let beyond = self.bias.is_some_and(|limit| seen.mean.simd_abs() > limit);
        let moves = self.rest.is_some_and(|limit| self.spread() > T::of(MAX_MEAN_SPREAD) * limit);
        if loud || beyond {
            self.ticks = 0;
        } else if moves {
            self.ticks = 1;
        }
        !(loud || beyond || moves)
    }

    /// True if so many ticks in a row can have been rest that it may begin.
    pub(super) fn lasts(&self) -> bool {
        self.ticks == MIN_TICKS as u32
    }

    /// True if it is known how much a sensor at rest may vary.
    pub(super) fn is_limited(&self) -> bool {
        self.rest.is_some()
    }

    /// From the least to the greatest of the last means.
    fn spread(&self) -> T {
        let means = &self.means[..(self.ticks as usize).min(MIN_TICKS)];
        let least = means.iter().fold(T::MAX, |least, mean| least.at_most(*mean));
        let greatest = means.iter().fold(-T::MAX, |greatest, mean| greatest.at_least(*mean));
        greatest - least
    }

    /// True if ticks can have made it of `fresh`.
    pub(super) fn is_after(&self, fresh: &Self) -> bool {
        // A mean may be off by some roundings.
        let most = T::MAX_RAW * T::of(8.0);
        (self.rest, self.bias) == (fresh.rest, fresh.bias)
            && self.means.iter().all(|mean| is_within(*mean, most))
            && self.ticks <= MIN_TICKS as u32
    }
}
