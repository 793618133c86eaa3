//! What is known of one sensor: its noise, and its drift as far as it has been at rest.

use serde::{Deserialize, Serialize};

use super::block::Block;
use super::following::{Drift, Following};
use super::noise::Noise;
use super::walks::Walks;
use crate::error::Error;
use crate::real::{Limits, Real};
use crate::rest::Tick;
use crate::startup::Scaling;

/// Ticks of a block: two seconds of quarters.
const BLOCK: f64 = 8.0;

/// Deviations of a sample beyond which it moves the drift no further until its tick is judged.
const SURPRISE: f64 = 4.0;

/// Widens the interval of the drift: no sensor's drift is quite a walk. So chosen that over the
/// simulated gyros of the package two thirds of all errors lie within one deviation.
const CAUTION: f64 = 1.15;

/// Noise and drift, in units of the start-up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct Learned<T> {
    scaling: Scaling<T>,
    /// Samples of a tick.
    length: T,
    noise: Noise<T>,
    block: Block<T>,
    walks: Walks<T>,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Learned<T> {
    /// What `samples` samples of a start-up say, their noise taken to be white.
    ///
    /// # Errors
    /// None for the constants in use.
    pub fn new(scaling: Scaling<T>, length: T, samples: T) -> Result<Self, Error> {
        let block = length * T::of(BLOCK);
        let mut learned = Self {
            scaling,
            length,
            noise: Noise::white(length, samples / length)?,
            block: Block::new(block),
            walks: Walks::new(T::one() / block),
        };
        learned.begin(T::zero(), samples);
        Ok(learned)
    }

    /// The drift anew, from the mean of `samples` samples; what is known of the noise stays.
    pub fn begin(&mut self, mean: T, samples: T) {
        let variance = self.sample_noise() / samples.at_least(T::one());
        self.walks.begin(mean, variance);
        self.block.restart();
        self.noise.interrupt();
    }

    /// [`begin`](Self::begin) with a mean in the unit of the samples.
    pub fn begin_at(&mut self, mean: T, samples: T) {
        self.begin(self.scaling.normalise(mean), samples);
    }

    /// Whether a tick's noise is far from what is known: what was learned was not rest.
    pub fn is_another(&self, tick: &Tick<T>) -> bool {
        self.noise.is_another(self.scaling.normalised_difference(tick.deviation))
    }

    /// The noise anew, from the first tick of it; what is known of the drift stays.
    pub fn listen_anew(&mut self, tick: &Tick<T>) {
        self.noise.listen_anew(self.scaling.normalised_difference(tick.deviation));
    }

    /// A tick at rest.
    pub fn learn(&mut self, tick: &Tick<T>) {
        let present = T::of(f64::from(tick.count));
        let mean = self.scaling.normalise(tick.mean);
        if present + present >= self.length {
            self.noise.observe(mean, self.scaling.normalised_difference(tick.deviation));
        } else {
            self.noise.interrupt();
        }
        self.block.add(self.length, present, mean);
        if self.block.is_full() {
            self.finish_block();
        }
    }

    /// A tick in motion: the drift goes on unseen, and so does what the block has lost.
    pub fn wait(&mut self) {
        self.noise.interrupt();
        let lost = self.block.restart();
        self.walks.wait(lost + T::of(1.0 / BLOCK));
    }

    /// The drift now.
    #[inline]
    pub fn drift(&self) -> Drift<T> {
        let noise = self.sample_noise();
        let now = match self.block.mean(noise) {
            Some(block) => self.walks.filtered(&block),
            None => self.walks.predicted(),
        };
        let sigma = now.variance.simd_sqrt() * T::of(CAUTION);
        let most = self.noise.of_sample().simd_sqrt() * T::of(SURPRISE);
        let following =
            Following { gain: now.P / (now.P + noise), most: self.scaling.raw_difference(most) };
        Drift {
            mean: self.scaling.raw(now.mean),
            sigma: self.scaling.raw_difference(sigma),
            following,
        }
    }

    /// Variance of a sample's white noise: colour that averages out within a tick is not in it.
    pub fn white_noise(&self) -> T {
        self.scaling.raw_variance(self.sample_noise())
    }

    /// Variance of a sample about the drift.
    pub fn measurement_noise(&self) -> T {
        self.scaling.raw_variance(self.noise.of_sample())
    }

    /// Process noise of one sample.
    pub fn process_noise(&self) -> T {
        let samples = self.length * T::of(BLOCK);
        self.scaling.raw_variance(self.walks.process_noise() / samples)
    }

    /// Variance of a sample, were the noise of the ticks' means white.
    #[inline]
    fn sample_noise(&self) -> T {
        self.noise.of_mean() * self.length
    }

    fn finish_block(&mut self) {
        match self.block.mean(self.sample_noise()) {
            Some(block) => {
                self.walks.correct(&block);
                self.block.restart();
            }
            None => {
                let time = self.block.restart();
                self.walks.wait(time);
            }
        }
    }
}
