//! Ticks in a row that may become a rest: steady ticks at a new level, or ticks near a known level.

use serde::{Deserialize, Serialize};

use super::MIN_SAMPLES;
use super::bounds::{CERTAIN_SIGMAS, MAX_FREEDOM, MAX_LEVEL_RATIO, chi_squared_bound, flips};
use super::model::RestModel;
use super::ticker::{TickSums, level_max};
use crate::math::validity::{is_size, is_within};
use crate::math::{Limits, Real};

/// Number of samples, and largest ratio of their mean's variance to white noise, for even levels.
const MAX_EVEN_RATIO: f64 = 4.0;
const EVEN_SAMPLES: u32 = 25;

/// Successive ticks with similar variance and with levels that vary far less than the samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Candidate<T> {
    pub ticks: u32,
    /// Number of samples in the shortest tick.
    count: u32,
    pub level: T,
    /// Sum of squares of the ticks' levels about their mean.
    squares: T,
    /// Mean of the ticks' variances.
    pub variance: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Candidate<T> {
    pub(super) fn none() -> Self {
        let zero = T::zero();
        Self { ticks: 0, count: MIN_SAMPLES, level: zero, squares: zero, variance: zero }
    }

    pub(super) fn of(seen: &TickSums<T>) -> Self {
        let (level, variance) = (seen.level, seen.variance);
        Self { ticks: 1, count: seen.count, level, squares: T::zero(), variance }
    }

    /// Adds a tick, or starts again with it if it is unlike the previous ticks.
    pub(super) fn take(&mut self, seen: &TickSums<T>) {
        let longer = self.with(seen);
        *self = match self.ticks > 0 && longer.is_alike(seen) && longer.stands(seen) {
            true => longer,
            false => Self::of(seen),
        };
    }

    fn with(&self, seen: &TickSums<T>) -> Self {
        let ticks = self.ticks.saturating_add(1);
        let share = T::one() / T::of(f64::from(ticks));
        let before = seen.level - self.level;
        let level = self.level + before * share;
        Self {
            ticks,
            count: self.count.min(seen.count),
            level,
            squares: self.squares + before * (seen.level - level),
            variance: self.variance + (seen.variance - self.variance) * share,
        }
    }

    /// True if the tick's variance is similar to the others: the strength of shaking changes
    /// between ticks.
    fn is_alike(&self, seen: &TickSums<T>) -> bool {
        let freedom = seen.freedom().at_most(T::of(MAX_FREEDOM));
        let most = chi_squared_bound(freedom, CERTAIN_SIGMAS);
        let least = chi_squared_bound(freedom, -CERTAIN_SIGMAS);
        let flips = flips(seen.step);
        seen.variance <= self.variance * most + flips
            && seen.variance + flips >= self.variance * least
    }

    /// True if the levels are constant: in motion they vary as much as the samples.
    fn stands(&self, seen: &TickSums<T>) -> bool {
        let share = T::of(MAX_LEVEL_RATIO + 4.0 / f64::from(self.count));
        self.level_variance() <= share * self.variance + flips(seen.step)
    }

    /// True if the levels vary no more than means of nearly white noise, or of samples on two
    /// neighbouring steps.
    pub(super) fn is_even(&self, step: T) -> bool {
        let share = T::of(MAX_EVEN_RATIO / f64::from(self.count.min(EVEN_SAMPLES)));
        let (levels, two_steps) = (self.level_variance(), flips(step));
        let coarse = self.variance <= two_steps && levels <= two_steps;
        coarse || levels <= share * self.variance
    }

    /// Standard deviation of the mean level.
    pub(super) fn level_deviation(&self) -> T {
        (self.level_variance() / T::of(f64::from(self.ticks.max(1)))).simd_sqrt()
    }

    /// Variance of the ticks' levels.
    pub(super) fn level_variance(&self) -> T {
        self.squares / T::of(f64::from(self.ticks.max(2) - 1))
    }
}

/// Successive ticks that look like a known rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Run<T> {
    pub ticks: u32,
    /// Mean level of the ticks.
    pub level: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Run<T> {
    pub(super) fn none() -> Self {
        Self { ticks: 0, level: T::zero() }
    }

    pub(super) fn take(&mut self, near: bool, level: T) {
        if !near {
            *self = Self::none();
            return;
        }
        self.ticks = self.ticks.saturating_add(1);
        self.level += (level - self.level) / T::of(f64::from(self.ticks));
    }

    /// True if the run is long enough and at the known level.
    pub(super) fn has_arrived(&self, ticks: u32, known: &RestModel<T>, step: T) -> bool {
        self.ticks >= ticks && known.is_level(self.level, step)
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Candidate<T> {
    /// True if ticks can have led to this state.
    pub(super) fn is_valid(&self) -> bool {
        let most = level_max::<T>() + level_max();
        self.count >= MIN_SAMPLES
            && is_within(self.level, most)
            && is_size(self.squares, most * most * T::of(4.0 * f64::from(self.ticks)))
            && is_size(self.variance, most * most)
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Run<T> {
    /// True if ticks can have led to this state.
    pub(super) fn is_valid(&self) -> bool {
        is_within(self.level, level_max::<T>() + level_max())
    }
}
