//! Validity of a start-up and its scaling.

use super::{Scaling, Startup};
use crate::math::validity::{is_size, is_within};
use crate::math::{Limits, Real};

impl<T: Limits + Real<Element = T, SimdBool = bool>> Startup<T> {
    /// True if at most `samples_seen` samples can have changed `fresh` to this state.
    pub(crate) fn is_after(&self, fresh: &Self, samples_seen: u64) -> bool {
        if self.samples == 0 {
            return self == fresh;
        }
        (self.window, self.known_scale) == (fresh.window, fresh.known_scale)
            && self.samples <= samples_seen
            && is_within(self.origin, T::MAX_RAW)
            && self.has_unit()
            && self.has_moments()
            && self.sketch.is_valid()
    }

    fn has_unit(&self) -> bool {
        match self.known_scale {
            Some(scale) => self.unit == scale,
            None => is_size(self.unit, T::MAX_RAW + T::MAX_RAW),
        }
    }

    /// True if the moments are possible: the first sample is zero and another one is at the peak.
    fn has_moments(&self) -> bool {
        let farthest = if self.unit > T::zero() { T::MAX_INPUT } else { T::zero() };
        let (square, samples) = (self.peak * self.peak, T::of(self.samples as f64));
        is_size(self.peak, farthest)
            && is_within(self.mean, self.peak + self.peak)
            && self.sum_of_squares >= square * T::of(0.25)
            && self.sum_of_squares <= square * samples * T::of(4.0)
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Scaling<T> {
    /// True if a start-up can have found this scaling.
    pub(crate) fn is_valid(&self, known_scale: Option<f64>) -> bool {
        let most = T::MAX_RAW * T::of(4.0);
        let most = known_scale.map_or(most, |scale| T::of(scale).at_least(most));
        is_within(self.offset, T::MAX_RAW + T::MAX_RAW)
            && is_size(self.scale, most)
            && *self == Self::new(self.offset, self.scale)
    }

    /// Bounds of all results from normalised samples, raw and normalised.
    pub(crate) fn reach(&self) -> T {
        (T::MAX_RAW * T::of(8.0) * self.inverse).at_most(T::MAX_INPUT * T::of(4.0))
    }
}
