//! Check of the scale learned in a start-up.

use serde::{Deserialize, Serialize};

use crate::math::validity::is_sample;
use crate::math::{Limits, Real};

/// Smallest ratio of a change of samples to the scale that proves the scale wrong. 24 bits hardly
/// span this range, and no motion does for long.
const MIN_CHANGE_RATIO: f64 = 1e6;

/// Smallest ratio for a standard deviation within a tick: motion has little of its size in a
/// quarter of a second.
const MIN_TICK_RATIO: f64 = 1e5;

/// Largest ratio of a change or standard deviation that is too small: two orders above the smallest
/// noise of a filter.
const MAX_QUIET_RATIO: f64 = 1e-4;

/// Number of changes in a row that prove it: neither a spike nor a pause does.
const MIN_CHANGES: u8 = 16;

/// Number of samples between two checks: the check takes almost no time per sample.
const CHECK_INTERVAL_SAMPLES: u64 = 64;

/// Compares changes of the samples with the scale at intervals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Watch<T> {
    /// Last checked sample, NaN before the first.
    last: T,
    /// Number of changes in a row that are far too large, or, as a negative number, far too small.
    far: i8,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Watch<T> {
    pub(crate) fn new() -> Self {
        Self { last: T::of(f64::NAN), far: 0 }
    }

    /// True if the sample with the number `samples_seen` is to be checked.
    #[inline(always)]
    pub(crate) fn is_due(samples_seen: u64) -> bool {
        Self::turn(samples_seen) == 0
    }

    /// Number of samples since the last check.
    #[inline(always)]
    pub(crate) fn turn(samples_seen: u64) -> u64 {
        samples_seen % CHECK_INTERVAL_SAMPLES
    }

    /// Checks a sample; returns true if the scale is proved wrong.
    pub(crate) fn disproves(&mut self, z: T, scale: T) -> bool {
        if !z.finite() {
            return false;
        }
        let z = z.within(T::MAX_RAW);
        let change = (z - self.last).simd_abs();
        self.last = z;
        self.test(change, scale, MIN_CHANGE_RATIO)
    }

    /// Checks the standard deviation of a tick; returns true if the scale is proved wrong.
    pub(crate) fn disproves_by_tick(&mut self, deviation: T, scale: T) -> bool {
        self.test(deviation, scale, MIN_TICK_RATIO)
    }

    /// Checks the size of a change; a change that is zero or unknown has no effect.
    fn test(&mut self, change: T, scale: T, louder: f64) -> bool {
        if change > T::zero() {
            self.count(change, scale, T::of(louder).at_most(T::MAX_INPUT));
        }
        self.has_disproved()
    }

    /// True if samples can have led to this state.
    pub(crate) fn is_valid(&self) -> bool {
        is_sample(self.last, T::MAX_RAW) && !self.has_disproved()
    }

    fn count(&mut self, change: T, scale: T, louder: T) {
        let quieter = T::of(MAX_QUIET_RATIO).at_least(T::VARIANCE_FLOOR.simd_sqrt());
        self.far = match (change > louder * scale, change < quieter * scale) {
            (true, _) => self.far.max(0) + 1,
            (_, true) => self.far.min(0) - 1,
            _ => 0,
        };
    }

    /// True if the scale is proved wrong.
    pub(crate) fn has_disproved(&self) -> bool {
        self.far.unsigned_abs() >= MIN_CHANGES
    }
}
