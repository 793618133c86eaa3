//! Validity of a sensor model's state.

use super::{Block, Interim, SensorModel, TickNoise};
use crate::math::validity::{is_size, is_within};
use crate::math::{Limits, Real};
use crate::rest::MIN_SAMPLES;

impl<T: Limits + Real<Element = T, SimdBool = bool>> SensorModel<T> {
    /// True if ticks of `length` samples can have led to this state.
    pub(crate) fn is_valid(&self, length: T, known_scale: Option<f64>, rate: f64) -> bool {
        let reach = self.scaling.reach() + self.scaling.reach();
        let fresh = Self::new(self.scaling, length, T::one(), rate);
        self.scaling.is_valid(known_scale)
            && fresh.is_ok_and(|fresh| {
                self.length == fresh.length
                    && self.noise.is_after(&fresh.noise)
                    && self.sample_noise() <= T::MAX_DIFFERENCE
                    && self.block.is_after(&fresh.block, reach)
                    && self.bank.is_after(&fresh.bank, reach)
                    && self.flicker.is_after(&fresh.flicker)
                    && is_size(self.variance, T::MAX_RAW)
            })
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> TickNoise<T> {
    fn is_after(&self, fresh: &Self) -> bool {
        self.of_means.is_after(&fresh.of_means, T::MAX_INPUT)
            && self.of_mean() <= Self::most_of_means()
            && is_size(self.of_samples, T::MAX_DIFFERENCE)
            && is_size(self.ticks, T::MAX_RAW)
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Block<T> {
    fn is_after(&self, fresh: &Self, reach: T) -> bool {
        self.length == fresh.length
            && is_size(self.elapsed, self.length)
            // Samples of the previous tick, and a few more, may have waited for each tick.
            && is_size(self.present, self.elapsed * T::of(2.0 + f64::from(MIN_SAMPLES)))
            && (self.present == T::zero() || self.present >= T::one())
            && is_within(self.sum, reach * self.present)
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Interim<T> {
    /// True if a model can have reported this drift.
    pub(crate) fn is_valid(&self) -> bool {
        is_size(self.gain, T::one()) && is_size(self.most, T::MAX_RAW)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Block, TickNoise};
    use crate::math::Limits;

    #[test]
    fn a_block_has_no_more_samples_than_its_ticks() {
        let fresh = Block::new(32.0_f64);
        let after = |elapsed, present| Block { elapsed, present, ..fresh }.is_after(&fresh, 1.0);
        assert!(after(0.0, 0.0) && after(4.0, 7.0));
        assert!(!after(0.0, 8.0) && !after(4.0, 25.0));
    }

    #[test]
    fn noise_learned_anew_stays_within_that_of_the_inputs() {
        let fresh = TickNoise::white(4.0, 4.0).expect("a fading below one");
        let mut noise = fresh;
        noise.of_means.set_known(TickNoise::<f64>::most_of_means(), 8);
        assert!(noise.is_after(&fresh));
        noise.relearn(f64::MAX_INPUT);
        assert!(noise.is_after(&fresh));
        noise.of_means.set_known(1e121, 8);
        assert!(!noise.is_after(&fresh));
    }
}
