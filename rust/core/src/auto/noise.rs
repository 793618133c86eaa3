//! The white noise of a sensor at rest, as ticks show it.

use serde::{Deserialize, Serialize};

use crate::allan::{AllanKind, AllanNoise};
use crate::error::Error;
use crate::real::{Limits, Real};

/// Ticks after which a noise level counts for 1/e: a minute of quarter seconds.
const MEMORY: f64 = 240.0;

/// Ratio of variances that no noise of one sensor at rest has.
const ANOTHER: f64 = 9.0;

/// Ticks that a noise counts for which one tick has shown.
const FRESH: u64 = 8;

/// Variances of ticks' means and of samples, in units of the start-up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct Noise<T> {
    /// R of the ticks' means: noise that averages out within a tick is not in it.
    of_means: AllanNoise<T>,
    /// Variance of a sample about its tick's mean.
    of_samples: T,
    /// Ticks that `of_samples` averages.
    ticks: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Noise<T> {
    /// White noise of unit variance, as known as after so many ticks of `length` samples.
    ///
    /// # Errors
    /// None for the constants in use.
    pub fn white(length: T, ticks: T) -> Result<Self, Error> {
        let fading = 1.0 - 1.0 / MEMORY;
        let mut of_means = AllanNoise::with_floor(fading, AllanKind::Allan, T::VARIANCE_FLOOR)?;
        of_means.believe(T::one() / length, ticks.to_subset().map_or(0, |n: f64| n as u64));
        Ok(Self { of_means, of_samples: T::one(), ticks })
    }

    /// Takes mean and deviation of a tick.
    pub fn observe(&mut self, mean: T, deviation: T) {
        self.of_means.observe(mean);
        self.ticks = (self.ticks + T::one()).at_most(T::of(MEMORY));
        self.of_samples += (deviation * deviation - self.of_samples) / self.ticks;
    }

    /// The next tick does not follow the last one.
    pub fn interrupt(&mut self) {
        self.of_means.interrupt();
    }

    /// Whether samples of this deviation are so far off that what was learned was not rest.
    pub fn is_another(&self, deviation: T) -> bool {
        let (now, known) = (deviation * deviation, self.of_samples);
        now > known * T::of(ANOTHER) || now * T::of(ANOTHER) < known
    }

    /// The noise anew, from the deviation of a tick.
    pub fn listen_anew(&mut self, deviation: T) {
        let variance = (deviation * deviation).at_least(T::VARIANCE_FLOOR);
        let louder = variance / self.of_samples.at_least(T::VARIANCE_FLOOR);
        self.of_means.believe(self.of_means.variance() * louder, FRESH);
        self.of_samples = variance;
        self.ticks = T::one();
    }

    /// Variance of a tick's mean.
    #[inline]
    pub fn of_mean(&self) -> T {
        self.of_means.variance()
    }

    /// Variance of a sample.
    pub fn of_sample(&self) -> T {
        self.of_samples
    }
}
