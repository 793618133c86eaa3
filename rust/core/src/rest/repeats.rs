//! Samples equal to the previous sample, and stuck sensors.

use serde::{Deserialize, Serialize};

use crate::math::{Limits, Real};

/// Largest probability that a working sensor gives a run that counts as stuck.
const FALSE_RUN_PROBABILITY: f64 = 1e-9;

/// Number of changes from which the probability of a repetition is known.
const MIN_CHANGES: u32 = 32;

/// Smallest number of samples in a run.
const MIN_RUN: u32 = 4;

/// Number of pairs of samples after which earlier pairs have half the weight.
pub(super) const HALVING_PAIRS: u32 = 20_000;

/// Frequency of samples equal to the previous sample, and length of the current run.
///
/// A working sensor repeats a sample by chance. The frequency depends on its resolution relative to
/// its noise, and is learned. A run with a probability below one in a thousand million is a stuck
/// sensor. A working sensor may be so coarse that its output is constant. It then leaves a value by
/// a single step, and the run was none, at any length.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Repeats {
    /// Number of equal samples in a row.
    pub(super) run: u32,
    /// Number of these samples in this tick that are not yet in a sum.
    pub(super) held: u32,
    /// Number of this tick's samples from a stuck sensor.
    pub(super) dropped: u32,
    /// Smallest number of equal samples in a row of a stuck sensor.
    pub(super) limit: u32,
    pub(super) equal: u32,
    pub(super) pairs: u32,
}

impl Repeats {
    pub(super) fn new() -> Self {
        // Before some samples have changed, a constant output may come from a working sensor.
        Self { run: 0, held: 0, dropped: 0, limit: u32::MAX, equal: 1, pairs: 2 }
    }

    /// Notes that the sample equals the previous sample.
    #[inline(always)]
    pub(super) fn go_on(&mut self) {
        self.run = self.run.saturating_add(1);
        self.held += 1;
    }

    /// Notes that the sample differs from the previous sample, by one step of the sensor or more.
    #[inline(always)]
    pub(super) fn begin(&mut self, one_step: bool) {
        // The first sample, and the first after a missing sample, have no previous sample.
        self.learn(one_step, u32::from(self.run > 0));
        (self.run, self.held) = (1, 1);
    }

    /// Notes that a sample is missing.
    pub(super) fn interrupt(&mut self) {
        self.learn(false, 0);
        (self.run, self.held) = (0, 0);
    }

    /// Returns the number of samples that are in no sum, and zero if the sensor is stuck.
    #[inline(always)]
    pub(super) fn take(&mut self) -> u32 {
        let held = core::mem::take(&mut self.held);
        if self.is_stuck() {
            self.dropped += held;
            return 0;
        }
        held
    }

    #[inline(always)]
    pub(super) fn is_stuck(&self) -> bool {
        self.run >= self.limit
    }

    /// True if one more equal sample means a stuck sensor.
    pub(super) fn is_stuck_by_one_more(&self) -> bool {
        self.run.saturating_add(1) >= self.limit
    }

    /// Ends a tick; returns the number of its samples from a stuck sensor.
    pub(super) fn end_tick<T: Limits + Real<Element = T>>(&mut self) -> u32 {
        if self.pairs - self.equal >= MIN_CHANGES {
            self.set_limit::<T>();
        }
        core::mem::take(&mut self.dropped)
    }

    /// Computes the limit from the learned frequency.
    fn set_limit<T: Limits + Real<Element = T>>(&mut self) {
        if self.pairs > HALVING_PAIRS {
            (self.equal, self.pairs) = (self.equal / 2, self.pairs / 2);
        }
        // Neither zero nor one.
        let chance = T::of(f64::from(self.equal.max(1)) / f64::from(self.pairs));
        let least: Option<f64> = (T::of(FALSE_RUN_PROBABILITY).ln() / chance.ln()).to_subset();
        // A run has one pair less than samples.
        let least = least.map_or(u32::MAX, |least| least as u32).saturating_add(2);
        self.limit = least.max(MIN_RUN);
    }

    #[inline(always)]
    fn learn(&mut self, one_step: bool, change: u32) {
        let most = if one_step { HALVING_PAIRS } else { self.limit.min(HALVING_PAIRS) };
        let run = self.run.min(most);
        self.equal += run.saturating_sub(1);
        self.pairs += run.saturating_sub(1) + change;
    }
}

impl Repeats {
    /// Number of this tick's samples that may come from a stuck sensor.
    pub(super) fn pending(&self) -> u32 {
        self.dropped.saturating_add(self.held)
    }

    /// Number of this tick's samples that are in no sum.
    pub(super) fn held(&self) -> u32 {
        self.held
    }

    /// True if samples can have led to this state, at most `position` of them in this tick. `known`
    /// is false if the last sample was missing.
    pub(super) fn is_valid(&self, position: u32, known: bool) -> bool {
        (self.run > 0) == known
            && self.held <= self.run.min(position)
            && self.dropped <= position
            && self.limit >= MIN_RUN
            && self.equal < self.pairs
            // While there are too few changes, no earlier pair is forgotten.
            && self.pairs <= (MIN_CHANGES + 1) * HALVING_PAIRS + position
    }
}

#[cfg(test)]
mod tests {
    use super::Repeats;

    #[test]
    fn a_missing_sample_has_no_run() {
        let mut repeats = Repeats::new();
        assert!(repeats.is_valid(0, false) && !repeats.is_valid(0, true));
        repeats.begin(false);
        assert!(repeats.is_valid(1, true) && !repeats.is_valid(1, false));
        repeats.interrupt();
        assert!(repeats.is_valid(1, false));
    }
}
