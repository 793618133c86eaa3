//! Samples that equal the one before, and a sensor that is stuck at one.

use serde::{Deserialize, Serialize};

use crate::math::{Limits, Real};

/// Chance of a run of equal samples that is none.
const FALSE_RUN_PROBABILITY: f64 = 1e-9;

/// Changes that tell how often there is one.
const MIN_CHANGES: u32 = 32;

/// Samples that are a run at least.
const MIN_RUN: u32 = 4;

/// Pairs of samples after which those before count half.
pub(super) const HALVING_PAIRS: u32 = 20_000;

/// Frequency of samples that equal the one before, and length of the current run.
///
/// A sensor that works repeats a sample by chance: so often as its resolution is coarse compared
/// with its noise, which is learned. A run that chance makes once in a thousand million times is a
/// stuck sensor. One that works but is so coarse that its output stands still leaves a value by a
/// single step; such a run was none, however long it was.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Repeats {
    /// Equal samples in a row.
    pub(super) run: u32,
    /// Those of them in this tick that are not yet in any sum.
    pub(super) held: u32,
    /// Samples of this tick that a stuck sensor gave.
    pub(super) dropped: u32,
    /// Equal samples in a row at least of a sensor that is stuck.
    pub(super) limit: u32,
    pub(super) equal: u32,
    pub(super) pairs: u32,
}

impl Repeats {
    pub(super) fn new() -> Self {
        // Until some have changed, even a constant output may be one of a sensor that works.
        Self { run: 0, held: 0, dropped: 0, limit: u32::MAX, equal: 1, pairs: 2 }
    }

    /// The sample equals the one before.
    #[inline(always)]
    pub(super) fn go_on(&mut self) {
        self.run = self.run.saturating_add(1);
        self.held += 1;
    }

    /// The sample differs from the one before, by one step of the sensor or more.
    #[inline(always)]
    pub(super) fn begin(&mut self, one_step: bool) {
        // The first sample, and the first after a missing one, differ from none.
        self.learn(one_step, u32::from(self.run > 0));
        (self.run, self.held) = (1, 1);
    }

    /// A sample is missing.
    pub(super) fn interrupt(&mut self) {
        self.learn(false, 0);
        (self.run, self.held) = (0, 0);
    }

    /// Takes the samples that no sum has; none if they are of a sensor that is stuck.
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

    /// True if one more equal sample is a stuck sensor's.
    pub(super) fn is_stuck_by_one_more(&self) -> bool {
        self.run.saturating_add(1) >= self.limit
    }

    /// Ends a tick; returns how many samples of it a stuck sensor gave.
    pub(super) fn end_tick<T: Limits + Real<Element = T>>(&mut self) -> u32 {
        if self.pairs - self.equal >= MIN_CHANGES {
            self.set_limit::<T>();
        }
        core::mem::take(&mut self.dropped)
    }

    /// Derives the limit from what is learned.
    fn set_limit<T: Limits + Real<Element = T>>(&mut self) {
        if self.pairs > HALVING_PAIRS {
            (self.equal, self.pairs) = (self.equal / 2, self.pairs / 2);
        }
        // Never zero, never one.
        let chance = T::of(f64::from(self.equal.max(1)) / f64::from(self.pairs));
        let least: Option<f64> = (T::of(FALSE_RUN_PROBABILITY).ln() / chance.ln()).to_subset();
        // A run has a pair less than samples.
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
    /// Samples of this tick that may turn out to be of a stuck sensor.
    pub(super) fn pending(&self) -> u32 {
        self.dropped.saturating_add(self.held)
    }

    /// Samples of this tick that no sum has.
    pub(super) fn held(&self) -> u32 {
        self.held
    }

    /// True if samples can have made it, at most `position` of them of this tick; the last one is
    /// `known`, or it was missing.
    pub(super) fn is_valid(&self, position: u32, known: bool) -> bool {
        (self.run > 0) == known
            && self.held <= self.run.min(position)
            && self.dropped <= position
            && self.limit >= MIN_RUN
            && self.equal < self.pairs
            // As long as there are too few changes, none of the pairs before is forgotten.
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
