//! What is known of one sensor: its noise, and its drift as far as it has been at rest.

use serde::{Deserialize, Serialize};

use super::block::Block;
use super::walks::Walks;
use crate::allan::{AllanKind, AllanNoise};
use crate::error::Error;
use crate::real::{Limits, Real};
use crate::rest::Tick;
use crate::startup::Scaling;

/// Ticks of a block: two seconds of quarters.
const BLOCK: f64 = 8.0;

/// Ticks after which a noise level counts for 1/e: a minute of quarter seconds.
const NOISE_MEMORY: f64 = 240.0;

/// Deviations of a sample beyond which it moves the drift no further until its tick is judged.
const SURPRISE: f64 = 4.0;

/// Ratio of variances that no noise of one sensor at rest has.
const ANOTHER: f64 = 9.0;

/// Ticks that a noise counts for which one tick has shown.
const FRESH: u64 = 8;

/// Widens the interval of the drift: no sensor's drift is quite a walk. So chosen that over the
/// simulated gyros of the package two thirds of all errors lie within one deviation.
const CAUTION: f64 = 1.15;

/// What a sample does to the drift before its tick is complete.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Following<T> {
    gain: T,
    /// The largest difference that counts, in the unit of the samples.
    most: T,
}

impl<T: Real> Following<T> {
    /// Stands still.
    pub fn held() -> Self {
        Self { gain: T::zero(), most: T::zero() }
    }

    /// Weight of a sample.
    pub fn gain(&self) -> T {
        self.gain
    }

    /// The drift after a sample.
    #[inline(always)]
    pub fn step(&self, drift: T, z: T) -> T {
        drift + self.gain * (z - drift).within(self.most)
    }
}

/// The drift in the unit of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Drift<T> {
    /// Mean.
    pub mean: T,
    /// Standard deviation.
    pub sigma: T,
    /// How it goes on until the next tick.
    pub following: Following<T>,
}

/// Noise and drift, in units of the start-up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct Learned<T> {
    scaling: Scaling<T>,
    /// Samples of a tick.
    length: T,
    block: Block<T>,
    walks: Walks<T>,
    /// R of the ticks' means: noise that averages out within a tick is not in it.
    tick_noise: AllanNoise<T>,
    /// Variance of a sample about its tick's mean.
    sample_noise: T,
    /// Ticks that `sample_noise` averages.
    ticks: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Learned<T> {
    /// What `samples` samples of a start-up say, their noise taken to be white.
    ///
    /// # Errors
    /// None for the constants in use.
    pub fn new(scaling: Scaling<T>, length: T, samples: T) -> Result<Self, Error> {
        let fading = 1.0 - 1.0 / NOISE_MEMORY;
        let floor = T::VARIANCE_FLOOR;
        let mut tick_noise = AllanNoise::with_floor(fading, AllanKind::Allan, floor)?;
        let ticks = samples / length;
        tick_noise.believe(T::one() / length, ticks.to_subset().map_or(0, |n: f64| n as u64));
        let block = Block::new(length * T::of(BLOCK));
        let mut learned = Self {
            scaling,
            length,
            block,
            walks: Walks::new(T::one() / (length * T::of(BLOCK))),
            tick_noise,
            sample_noise: T::one(),
            ticks,
        };
        learned.begin(T::zero(), samples);
        Ok(learned)
    }

    /// The drift anew, from the mean of `samples` samples; what is known of the noise stays.
    pub fn begin(&mut self, mean: T, samples: T) {
        let variance = self.noise() / samples.at_least(T::one());
        self.walks.begin(mean, variance);
        self.block.restart();
        self.tick_noise.interrupt();
    }

    /// [`begin`](Self::begin) with a mean in the unit of the samples.
    pub fn begin_at(&mut self, mean: T, samples: T) {
        self.begin(self.scaling.normalise(mean), samples);
    }

    /// Whether a tick's noise is far from what is known: what was learned was not rest.
    pub fn is_another(&self, tick: &Tick<T>) -> bool {
        let deviation = self.scaling.normalised_difference(tick.deviation);
        let (now, known) = (deviation * deviation, self.sample_noise);
        now > known * T::of(ANOTHER) || now * T::of(ANOTHER) < known
    }

    /// The noise anew, from the first tick of it; what is known of the drift stays.
    pub fn listen_anew(&mut self, tick: &Tick<T>) {
        let deviation = self.scaling.normalised_difference(tick.deviation);
        let variance = (deviation * deviation).at_least(T::VARIANCE_FLOOR);
        let louder = variance / self.sample_noise.at_least(T::VARIANCE_FLOOR);
        self.tick_noise.believe(self.tick_noise.variance() * louder, FRESH);
        self.sample_noise = variance;
        self.ticks = T::one();
    }

    /// A tick at rest.
    pub fn learn(&mut self, tick: &Tick<T>) {
        let present = T::of(f64::from(tick.count));
        let there = present + present >= self.length;
        let mean = self.scaling.normalise(tick.mean);
        self.tick_noise.observe(if there { mean } else { T::of(f64::NAN) });
        if there {
            self.learn_sample_noise(tick.deviation);
        }
        self.block.add(self.length, present, mean);
        if self.block.is_full() {
            self.finish_block();
        }
    }

    /// A tick in motion: the drift goes on unseen, and so does what the block has lost.
    pub fn wait(&mut self) {
        self.tick_noise.interrupt();
        let lost = self.block.restart();
        self.walks.wait(lost + T::of(1.0 / BLOCK));
    }

    /// The drift now.
    #[inline]
    pub fn drift(&self) -> Drift<T> {
        let noise = self.noise();
        let now = match self.block.mean(noise) {
            Some(block) => self.walks.filtered(&block),
            None => self.walks.predicted(),
        };
        let sigma = now.variance.simd_sqrt() * T::of(CAUTION);
        let most = self.sample_noise.simd_sqrt() * T::of(SURPRISE);
        Drift {
            mean: self.scaling.raw(now.mean),
            sigma: self.scaling.raw_difference(sigma),
            following: Following {
                gain: now.P / (now.P + noise),
                most: self.scaling.raw_difference(most),
            },
        }
    }

    /// Variance of a sample whose means have the noise of the ticks' means: colour that averages
    /// out within a tick is not in it.
    pub fn white_noise(&self) -> T {
        self.scaling.raw_variance(self.noise())
    }

    /// Variance of a sample about the drift.
    pub fn measurement_noise(&self) -> T {
        self.scaling.raw_variance(self.sample_noise)
    }

    /// Process noise of one sample.
    pub fn process_noise(&self) -> T {
        let samples = self.length * T::of(BLOCK);
        self.scaling.raw_variance(self.walks.process_noise() / samples)
    }

    /// Variance of one sample whose means have the noise of the ticks' means.
    #[inline]
    fn noise(&self) -> T {
        self.tick_noise.variance() * self.length
    }

    fn learn_sample_noise(&mut self, raw: T) {
        let deviation = self.scaling.normalised_difference(raw);
        let variance = deviation * deviation;
        self.ticks = (self.ticks + T::one()).at_most(T::of(NOISE_MEMORY));
        self.sample_noise += (variance - self.sample_noise) / self.ticks;
    }

    fn finish_block(&mut self) {
        match self.block.mean(self.noise()) {
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
