//! Model of a sensor at rest: its level, and the variation of its ticks.

use serde::{Deserialize, Serialize};

use super::bounds::{
    CERTAIN_SIGMAS, MAX_MEAN_SIGMAS, MAX_TICK_SIGMAS, MIN_MOTION_RATIO, chi_squared_bound, flips,
    one_step,
};
use super::candidate::Candidate;
use super::ticker::{TickSums, level_max};
use crate::math::validity::{is_size, is_within};
use crate::math::{Limits, Real};

/// Averages of 4, 16 and 64 ticks.
const SCALES: usize = 3;

/// Time constant of the noise in ticks: a minute.
const TIME_CONSTANT_TICKS: f64 = 240.0;

/// Largest usual ratio of a square to its mean.
const MAX_SQUARE_RATIO: f64 = 9.0;

/// Variation of ticks and samples at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Noise<T> {
    /// Mean of the ticks' variances.
    pub variance: T,
    /// Variance of the ticks' variances.
    spread: T,
    weight: T,
    /// Mean squares of the differences of successive [`Levels`].
    differences: [T; SCALES],
    weights: [T; SCALES],
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Noise<T> {
    fn new(candidate: &Candidate<T>, length: u32) -> Self {
        let variance = candidate.variance;
        let freedom = T::of((f64::from(length) - 2.0).min(8.0));
        let known = T::of(f64::from(candidate.ticks.min(16)));
        Self {
            variance,
            spread: T::of(2.0) * variance * variance / freedom,
            weight: T::of(8.0),
            // As if the mean of many ticks were no quieter than one tick: never too small.
            differences: [T::of(2.0) * candidate.level_variance(); SCALES],
            weights: core::array::from_fn(|i| known * ticks_of::<T>(i)),
        }
    }

    /// Standard deviation of a tick's level.
    fn deviation(&self) -> T {
        self.differences[0].simd_sqrt()
    }

    fn is_quiet(&self, seen: &TickSums<T>) -> bool {
        let most = self.variance * T::of(MIN_MOTION_RATIO) + flips(seen.step);
        if seen.variance <= most {
            return true;
        }
        let freedom = T::of(2.0) * self.variance * self.variance / self.spread.at_least(T::TINY);
        // A tick with fewer samples than the learned ticks varies more.
        let few = seen.weight < T::one();
        let freedom = if few { freedom.at_most(seen.freedom()) } else { freedom };
        let bound = chi_squared_bound(freedom.at_least(T::one()), CERTAIN_SIGMAS);
        seen.variance <= self.variance * bound + flips(seen.step)
    }

    /// True if the differences are as at rest; `youth` is the additional variance of averages
    /// over few ticks, as a share of a tick's variance.
    fn is_steady(&self, differences: &[T; SCALES], youth: T, step: T) -> bool {
        (0..SCALES).all(|i| {
            if differences[i] * differences[i] <= T::of(MAX_SQUARE_RATIO) * self.differences[i] {
                return true;
            }
            let freedom = self.weights[i] / (T::of(2.0) * ticks_of::<T>(i));
            // Approximately Student's distribution: a variance of few terms may be far too small.
            let unsure = T::one() + T::of(8.0) / (freedom + T::one());
            let square = self.differences[i] * unsure + self.differences[0] * youth;
            let limit = T::of(CERTAIN_SIGMAS) * square.simd_sqrt();
            differences[i].simd_abs() <= limit + one_step(step)
        })
    }

    fn learn(&mut self, variance: T, differences: &[T; SCALES], step: T) {
        self.weight = (self.weight + T::one()).at_most(T::of(TIME_CONSTANT_TICKS));
        let before = variance - self.variance;
        self.variance += before / self.weight;
        let square = before * (variance - self.variance);
        self.spread += (square - self.spread) / self.weight;
        for i in 0..SCALES {
            let most = T::of(TIME_CONSTANT_TICKS) * ticks_of::<T>(i);
            self.weights[i] = (self.weights[i] + T::one()).at_most(most);
            // A slow start of motion must not widen its own bounds.
            let likely = T::of(MAX_SQUARE_RATIO) * self.differences[i] + step * step;
            let square = (differences[i] * differences[i]).at_most(likely);
            self.differences[i] += (square - self.differences[i]) / self.weights[i];
        }
    }
}

/// Number of ticks averaged in the level before scale `i`.
fn ticks_of<T: Limits + Real<Element = T>>(i: usize) -> T {
    T::of(f64::from(1 << (2 * i)))
}

/// Averages of the ticks' levels, each over four times as many ticks as the previous one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Levels<T> {
    averages: [T; SCALES],
    ticks: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Levels<T> {
    fn at(level: T, ticks: u32) -> Self {
        Self { averages: [level; SCALES], ticks: T::of(f64::from(ticks.clamp(1, 64))) }
    }

    /// Additional variance of averages over few ticks, as a share of a tick's variance.
    fn youth(&self) -> T {
        T::one() / self.ticks - T::one() / ticks_of::<T>(SCALES)
    }

    /// Processes a tick's level; returns the difference from each average.
    fn follow(&mut self, level: T) -> [T; SCALES] {
        let fresh = T::one() / (self.ticks + T::one());
        let mut shorter = level;
        let differences = core::array::from_fn(|i| {
            let difference = shorter - self.averages[i];
            let share = (T::one() / ticks_of::<T>(i + 1)).at_least(fresh);
            self.averages[i] += difference * share;
            shorter = self.averages[i];
            difference
        });
        self.ticks = (self.ticks + T::one()).at_most(ticks_of(SCALES));
        differences
    }
}

/// Noise and level of a sensor at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct RestModel<T> {
    pub noise: Noise<T>,
    levels: Levels<T>,
    /// Level to which the sensor returns after motion.
    reference: T,
    /// Number of ticks since this rest began.
    rested: u32,
    /// Number of ticks at rest in total.
    pub trust: u32,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> RestModel<T> {
    /// The model of a candidate that has lasted, with the confidence of `trust` ticks of rest.
    pub(super) fn new(candidate: &Candidate<T>, length: u32, trust: u32) -> Self {
        Self {
            noise: Noise::new(candidate, length),
            levels: Levels::at(candidate.level, candidate.ticks),
            reference: candidate.level,
            rested: 0,
            trust,
        }
    }

    /// True if a tick looks like rest; the model then learns from it.
    pub(super) fn holds(&mut self, seen: &TickSums<T>) -> bool {
        let mut levels = self.levels;
        let mut differences = levels.follow(seen.level);
        differences[0] *= seen.weight;
        let youth = self.levels.youth();
        let calm =
            self.noise.is_quiet(seen) && self.noise.is_steady(&differences, youth, seen.step);
        if calm {
            self.noise.learn(seen.variance, &differences, seen.step);
            self.levels = levels;
            self.rested = self.rested.saturating_add(1);
            self.trust = self.trust.saturating_add(1);
        }
        calm
    }

    /// Begins a rest at the level of these ticks in a row.
    pub(super) fn resume(&mut self, level: T, ticks: u32) {
        self.levels = Levels::at(level, ticks);
        self.rested = 0;
    }

    /// Ends a rest. A rest shorter than `ticks` is no reference for the next rest.
    pub(super) fn leave(&mut self, ticks: u32) {
        if self.rested >= ticks {
            self.reference = self.levels.averages[1];
        }
    }

    /// True if a tick of motion looks like the previous rest.
    pub(super) fn is_near(&self, seen: &TickSums<T>) -> bool {
        let distance = (seen.level - self.reference).simd_abs() * seen.weight;
        let limit = T::of(MAX_TICK_SIGMAS) * self.noise.deviation() + one_step(seen.step);
        self.noise.is_quiet(seen) && distance <= limit
    }

    /// True if the mean level of several ticks equals the previous rest's level.
    pub(super) fn is_level(&self, level: T, step: T) -> bool {
        self.is_near_level(self.distance(level), step)
    }

    /// True if a mean level at this distance equals the previous rest's level.
    pub(super) fn is_near_level(&self, distance: T, step: T) -> bool {
        distance <= T::of(MAX_MEAN_SIGMAS) * self.noise.deviation() + one_step(step)
    }

    /// True if the levels of other ticks vary about as much as at rest.
    pub(super) fn is_as_steady(&self, level_variance: T, step: T) -> bool {
        let limit = T::of(2.0) * self.noise.deviation() + T::of(0.5) * one_step(step);
        level_variance <= limit * limit
    }

    /// Distance from the previous rest's level.
    pub(super) fn distance(&self, level: T) -> T {
        (level - self.reference).simd_abs()
    }

    /// Present level, averaged over 64 ticks.
    pub(super) fn slow_level(&self) -> T {
        self.levels.averages[SCALES - 1]
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> RestModel<T> {
    /// True if ticks can have led to this state.
    pub(super) fn is_valid(&self) -> bool {
        let most = level_max::<T>() + level_max();
        let levels = &self.levels;
        self.noise.is_valid(most)
            && levels.averages.iter().all(|level| is_within(*level, most))
            && levels.ticks >= T::one()
            && levels.ticks <= ticks_of(SCALES)
            && is_within(self.reference, most)
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Noise<T> {
    /// True if ticks with levels within `most` can have led to this state.
    fn is_valid(&self, most: T) -> bool {
        let square = most * most;
        is_size(self.variance, square)
            && is_size(self.spread, square * square + square * square)
            && self.weight >= T::one()
            && self.weight <= T::of(TIME_CONSTANT_TICKS)
            && (0..SCALES).all(|i| {
                is_size(self.differences[i], square * T::of(16.0))
                    && self.weights[i] >= T::one()
                    && self.weights[i] <= T::of(TIME_CONSTANT_TICKS) * ticks_of(i)
            })
    }
}
