//! Stated limits of a sensor's rest.

use serde::{Deserialize, Serialize};

use super::RestLimits;
use super::ticker::TickSums;
use crate::math::validity::is_within;
use crate::math::{Limits, Real};

/// Number of ticks that must stay within the limits: one and a half seconds.
const MIN_TICKS: usize = 6;

/// Largest spread of the means as a share of the samples' limit. Vibration shakes samples and
/// averages out, rotation does not.
const MAX_MEAN_SPREAD: f64 = 0.3;

/// Ticks in a row that may be rest, in the samples' unit.
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

    /// Adds a tick; returns true if it can be rest.
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

    /// True if enough ticks in a row can have been rest for a rest to begin.
    pub(super) fn lasts(&self) -> bool {
        self.ticks == MIN_TICKS as u32
    }

    /// True if a limit of the variation at rest is stated.
    pub(super) fn is_limited(&self) -> bool {
        self.rest.is_some()
    }

    /// Difference of the largest and the smallest of the last means.
    fn spread(&self) -> T {
        let means = &self.means[..(self.ticks as usize).min(MIN_TICKS)];
        let least = means.iter().fold(T::MAX, |least, mean| least.at_most(*mean));
        let greatest = means.iter().fold(-T::MAX, |greatest, mean| greatest.at_least(*mean));
        greatest - least
    }

    /// True if ticks can have changed `fresh` to this state.
    pub(super) fn is_after(&self, fresh: &Self) -> bool {
        // A mean may be wrong by some rounding errors.
        let most = T::MAX_RAW * T::of(8.0);
        (self.rest, self.bias) == (fresh.rest, fresh.bias)
            && self.means.iter().all(|mean| is_within(*mean, most))
            && self.ticks <= MIN_TICKS as u32
    }
}
