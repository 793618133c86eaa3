//! Validity of the zones' state.

use super::zones::{Gate, Moments};
use crate::math::validity::{is_count, is_size, is_within};
use crate::math::{Limits, Real};

impl<T: Limits + Real<Element = T, SimdBool = bool>> Gate<T> {
    /// True if at most `samples_seen` samples can have changed `fresh` to this state.
    pub(super) fn is_after(&self, fresh: &Self, samples_seen: u64) -> bool {
        self.law == fresh.law
            && self.exit == fresh.exit
            && self.taken.is_valid(Self::most())
            && self.outliers.is_valid(Self::most())
            && T::of(self.row.unsigned_abs() as f64) <= self.outliers.count
            && is_count(self.outlier_count)
            && self.outlier_count <= samples_seen
            && self.exit_count <= samples_seen
    }
}

impl<T: Limits> Moments<T> {
    fn is_valid(&self, most: T) -> bool {
        is_size(self.count, T::MAX)
            && is_within(self.mean, T::MAX_INPUT * nalgebra::convert(16.0))
            && is_size(self.variance, most)
    }
}
