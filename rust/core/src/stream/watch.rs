//! Check of the scale that a start-up has learned.

use serde::{Deserialize, Serialize};

use crate::math::validity::is_sample;
use crate::math::{Limits, Real};

/// A change of samples over the scale at least that proves the scale wrong: 24 bits hardly span as
/// much, and no motion does so for long.
const MIN_CHANGE_RATIO: f64 = 1e6;

/// A deviation within a tick that does: motion has little of its size in a quarter of a second.
const MIN_TICK_RATIO: f64 = 1e5;

/// Either at most: two orders above the least noise that a filter tells from none.
const MAX_QUIET_RATIO: f64 = 1e-4;

/// Changes in a row that prove it: neither a spike nor a pause does.
const MIN_CHANGES: u8 = 16;

/// Samples between two that are looked at: the watch costs a sample next to nothing.
const CHECK_INTERVAL_SAMPLES: u64 = 64;

/// Compares now and then how much the samples change with the scale.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Watch<T> {
    /// The sample looked at last, NaN before the first.
    last: T,
    /// Changes in a row that are far too large, or, below zero, far too small.
    far: i8,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Watch<T> {
    pub(crate) fn new() -> Self {
        Self { last: T::of(f64::NAN), far: 0 }
    }

    /// True if to look at the sample that is the `samples_seen`th.
    #[inline(always)]
    pub(crate) fn is_due(samples_seen: u64) -> bool {
        Self::turn(samples_seen) == 0
    }

    /// Samples since one was looked at.
    #[inline(always)]
    pub(crate) fn turn(samples_seen: u64) -> u64 {
        samples_seen % CHECK_INTERVAL_SAMPLES
    }

    /// Looks at a sample; returns whether the scale is proved wrong.
    pub(crate) fn disproves(&mut self, z: T, scale: T) -> bool {
        if !z.finite() {
            return false;
        }
        let z = z.within(T::MAX_RAW);
        let change = (z - self.last).simd_abs();
        self.last = z;
        self.test(change, scale, MIN_CHANGE_RATIO)
    }

    /// Looks at the deviation of a tick; returns whether the scale is proved wrong.
    pub(crate) fn disproves_by_tick(&mut self, deviation: T, scale: T) -> bool {
        self.test(deviation, scale, MIN_TICK_RATIO)
    }

    /// Looks at the size of a change; one of zero, or not known, says nothing.
    fn test(&mut self, change: T, scale: T, louder: f64) -> bool {
        if change > T::zero() {
            self.count(change, scale, T::of(louder).at_most(T::MAX_INPUT));
        }
        self.has_disproved()
    }

    /// True if samples can have made it.
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

    /// The scale is proved wrong.
    pub(crate) fn has_disproved(&self) -> bool {
        self.far.unsigned_abs() >= MIN_CHANGES
    }
}
