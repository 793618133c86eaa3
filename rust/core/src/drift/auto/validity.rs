//! Validity of the self-tuning filter's state.

use super::{AutoFilter, begins};
use crate::drift::DriftNumber;
use crate::math::validity::{is_count, is_size, is_within};
use crate::stream::checkpoint::Checkpoint;

impl<T: DriftNumber> AutoFilter<T> {
    /// True if samples can have changed `fresh` to this state.
    pub(super) fn is_after(&self, fresh: &Self) -> bool {
        is_count(self.samples_seen)
            && self.detector.is_valid()
            && self.detector.is_like(&fresh.detector)
            && self.startup.is_after(&fresh.startup, self.samples_seen)
            && self.has_model()
            && self.has_numbers()
            && self.watch.is_valid()
            && self.restarts <= self.samples_seen
            && self.tally.is_within(self.samples_seen, self.detector.pending())
    }

    /// While no drift is known, a model exists only from before the sensor was switched on.
    fn has_model(&self) -> bool {
        let length = T::of(f64::from(self.detector.tick_length()));
        match &self.model {
            Some(model) => {
                (self.experienced || !begins(self.status))
                    && model.is_valid(length, self.params.scale, self.params.rate)
            }
            None => begins(self.status),
        }
    }

    fn has_numbers(&self) -> bool {
        is_within(self.estimate, T::MAX_RAW * T::of(32.0))
            && is_size(self.sigma, T::MAX_RAW)
            && is_size(self.walk_sigma, T::MAX_RAW)
            && self.interim.is_valid()
            && is_within(self.innovation, T::MAX_RAW)
            && is_size(self.reach, T::MAX_RAW)
    }
}
