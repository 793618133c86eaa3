//! Validity of a published filter's state.

use super::{DriftFilter, DriftLoop};
use crate::math::validity::{is_count, is_size, is_within};
use crate::math::{Limits, Real};

impl<T, const N: usize, const M: usize> DriftFilter<T, N, M>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// True if samples can have changed `fresh` to this state.
    pub(super) fn is_after(&self, fresh: &Self) -> bool {
        let scaling = if self.start.is_some() { fresh.scaling } else { self.startup.finished() };
        let reach = self.scaling.map_or(T::MAX_INPUT, |scaling| scaling.reach());
        self.start == fresh.start
            && is_count(self.samples_seen)
            && self.startup.is_after(&fresh.startup, self.samples_seen)
            && self.scaling == scaling
            && self.inner.is_after(&fresh.inner, reach)
            && is_within(self.estimate, T::MAX_RAW * T::of(32.0))
            && self.watch.is_valid()
            && self.restarts <= self.samples_seen
    }
}

impl<T, const N: usize, const M: usize> DriftLoop<T, N, M>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// True if samples within `reach` can have changed `fresh` to this state.
    fn is_after(&self, fresh: &Self, reach: T) -> bool {
        self.adapts_measurement_noise == fresh.adapts_measurement_noise
            && self.adapts_process_noise == fresh.adapts_process_noise
            && self.learning_left <= fresh.learning_left
            && self.model.is_after(&fresh.model)
            && self.measurement_noise.is_after(&fresh.measurement_noise, T::MAX_INPUT * T::of(4.0))
            // A single outlier raises it beyond the limit of a covariance; the next sample corrects
            // it.
            && self.process_noise.is_covariance(T::MAX_DIFFERENCE)
            && self.state.is_valid()
            && self.last.is_valid()
            && self.count >= fresh.count
            && self.count <= T::MAX
            && is_size(self.peak, reach)
            && is_size(self.guards, T::MAX_RAW)
    }
}
