//! Model of one sensor: its noise, and its drift as learned at rest.

mod validity;

use serde::{Deserialize, Serialize};

use super::flicker::FlickerBank;
use super::multiple_model::{BlockMean, KalmanBank, Mixture};
use crate::allan::{AllanKind, AllanNoise};
use crate::error::Error;
use crate::math::{Limits, Real, choose};
use crate::rest::Tick;
use crate::stream::Scaling;

/// Number of ticks in a block: two seconds of quarters.
const BLOCK: f64 = 8.0;

/// Standard deviations beyond which a sample does not move the drift before its tick is complete.
const MAX_SAMPLE_SIGMAS: f64 = 4.0;

/// Factor on the interval from the walks alone: no sensor's drift is exactly a walk.
const SIGMA_FACTOR: f64 = 1.15;

/// Ratio of the stated standard deviation to the walks' value, before the first block.
const FRESH_FACTOR: f64 = 2.0;

/// Noise and drift, in units of the start-up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct SensorModel<T> {
    scaling: Scaling<T>,
    /// Number of samples in a tick.
    length: T,
    noise: TickNoise<T>,
    block: Block<T>,
    bank: KalmanBank<T>,
    flicker: FlickerBank<T>,
    /// Variance of the mean drift over the next ten seconds, at the last block.
    variance: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> SensorModel<T> {
    /// The model after a start-up of `samples` samples at `rate`; its noise is assumed to be white.
    ///
    /// # Errors
    /// None for the present constants.
    pub fn new(scaling: Scaling<T>, length: T, samples: T, rate: f64) -> Result<Self, Error> {
        let block = length * T::of(BLOCK);
        let seconds = block.to_subset().map_or(0.0, |samples: f64| samples / rate);
        let mut learned = Self {
            scaling,
            length,
            noise: TickNoise::white(length, samples / length)?,
            block: Block::new(block),
            bank: KalmanBank::new(T::one() / block),
            flicker: FlickerBank::new(T::one() / block, seconds, rate),
            variance: T::zero(),
        };
        learned.begin(T::zero(), samples);
        Ok(learned)
    }

    /// Begins a new drift with the mean of `samples` samples; keeps the estimate of the noise.
    pub fn begin(&mut self, mean: T, samples: T) {
        let variance = self.sample_noise() / samples.at_least(T::one());
        self.bank.begin(mean, variance);
        self.flicker.begin(mean, variance);
        self.state(&self.bank.predicted());
        self.block.restart();
        self.noise.interrupt();
    }

    /// [`begin`](Self::begin) with a mean in the samples' unit.
    pub fn begin_at(&mut self, mean: T, samples: T) {
        self.begin(self.scaling.normalise(mean), samples);
    }

    /// Standard deviation of the start-up, in the samples' unit.
    pub fn scale(&self) -> T {
        self.scaling.scale()
    }

    /// True if a tick's noise is far from the learned noise: there was no rest.
    pub fn is_another(&self, tick: &Tick<T>) -> bool {
        self.noise.is_another(self.scaling.normalised_difference(tick.deviation))
    }

    /// Begins new noise with its first tick; keeps the estimate of the drift.
    pub fn relearn_noise(&mut self, tick: &Tick<T>) {
        self.noise.relearn(self.scaling.normalised_difference(tick.deviation));
    }

    /// Learns from a tick at rest and returns the drift.
    pub fn learn(&mut self, tick: &Tick<T>) -> DriftNow<T> {
        let present = T::of(f64::from(tick.count));
        let mean = self.scaling.normalise(tick.mean);
        if present + present >= self.length {
            self.noise.observe(mean, self.scaling.normalised_difference(tick.deviation));
        } else {
            self.noise.interrupt();
        }
        self.block.add(self.length, present, mean);
        let now = match self.block.is_full() {
            true => self.finish_block(),
            false => self.now(),
        };
        self.drift_of(&now)
    }

    /// A tick in motion: the drift and the missing part of the block propagate without a
    /// measurement.
    pub fn wait(&mut self) {
        self.noise.interrupt();
        let lost = self.block.restart();
        self.pass(lost + T::of(1.0 / BLOCK));
    }

    /// Lets time pass without a measurement, in blocks.
    fn pass(&mut self, blocks: T) {
        self.bank.wait(blocks);
        if self.flicker.wait(blocks) {
            self.state(&self.bank.predicted());
        }
    }

    /// Stores the stated standard deviation from now on, from the mixture of the walks.
    fn state(&mut self, all: &Mixture<T>) {
        self.variance = self.flicker.stated(&self.bank, all).variance;
    }

    /// Standard deviation of the mean drift over the next `seconds`; zero is the present drift.
    pub fn sigma_over(&self, seconds: f64) -> T {
        let of_walks = self.now().variance.simd_sqrt() * T::of(SIGMA_FACTOR);
        self.stated(self.flicker.over(seconds, &self.bank).variance, of_walks)
    }

    /// Bias instability B, for flicker with the two-sided density B²/(2πf).
    pub fn bias_instability(&self) -> T {
        self.scaling.raw_difference(self.flicker.over(0.0, &self.bank).flicker.simd_sqrt())
    }

    /// Stated standard deviation, from the walks' standard deviation. Before the first block it is
    /// twice the walks' value, which is then too small.
    fn stated(&self, variance: T, of_walks: T) -> T {
        self.scaling.raw_difference(match self.bank.is_fresh() {
            true => of_walks * T::of(FRESH_FACTOR),
            false => variance.simd_sqrt(),
        })
    }

    /// Drift estimated by the walks.
    #[inline]
    fn now(&self) -> Mixture<T> {
        match self.block.mean(self.sample_noise()) {
            Some(block) => self.bank.filtered(&block),
            None => self.bank.predicted(),
        }
    }

    /// Present drift.
    #[inline]
    pub fn drift(&self) -> DriftNow<T> {
        self.drift_of(&self.now())
    }

    #[inline]
    fn drift_of(&self, now: &Mixture<T>) -> DriftNow<T> {
        let noise = self.sample_noise();
        let of_walks = now.variance.simd_sqrt() * T::of(SIGMA_FACTOR);
        let most = self.noise.of_sample().simd_sqrt() * T::of(MAX_SAMPLE_SIGMAS);
        let interim =
            Interim { gain: now.P / (now.P + noise), most: self.scaling.raw_difference(most) };
        DriftNow {
            mean: self.scaling.raw(now.mean),
            sigma: self.stated(self.variance, of_walks),
            walk_sigma: self.scaling.raw_difference(of_walks),
            interim,
        }
    }

    /// Variance of a sample's white noise, without coloured noise that averages out within a tick.
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
        self.scaling.raw_variance(self.bank.process_noise() / samples)
    }

    /// Variance of a sample if the noise of the ticks' means were white.
    #[inline]
    fn sample_noise(&self) -> T {
        self.noise.of_mean() * self.length
    }

    fn finish_block(&mut self) -> Mixture<T> {
        let block = self.block.mean(self.sample_noise());
        let time = self.block.restart();
        let Some(block) = block else {
            self.pass(time);
            return self.bank.predicted();
        };
        let degrees = self.bank.degrees();
        let best = self.bank.correct(&block);
        self.flicker.correct(&block, degrees, best);
        let all = self.bank.predicted();
        self.state(&all);
        all
    }
}

/// Number of ticks after which a noise level has the weight 1/e: a minute of quarter seconds.
const TIME_CONSTANT_TICKS: f64 = 240.0;

/// Ratio of variances that no sensor at rest has.
const MAX_VARIANCE_RATIO: f64 = 9.0;

/// Weight, in ticks, of a noise level from a single tick.
const FIRST_NOISE_TICKS: u64 = 8;

/// Variances of ticks' means and of samples, in units of the start-up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
struct TickNoise<T> {
    /// R of the ticks' means, without noise that averages out within a tick.
    of_means: AllanNoise<T>,
    /// Variance of a sample about its tick's mean.
    of_samples: T,
    /// Number of ticks averaged in `of_samples`.
    ticks: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> TickNoise<T> {
    /// White noise of unit variance, with the confidence of `ticks` ticks of `length` samples.
    ///
    /// # Errors
    /// None for the present constants.
    fn white(length: T, ticks: T) -> Result<Self, Error> {
        let fading = 1.0 - 1.0 / TIME_CONSTANT_TICKS;
        let mut of_means = AllanNoise::with_floor(fading, AllanKind::Allan, T::VARIANCE_FLOOR)?;
        of_means.set_known(T::one() / length, ticks.to_subset().map_or(0, |n: f64| n as u64));
        Ok(Self { of_means, of_samples: T::one(), ticks })
    }

    /// Learns from the mean and standard deviation of a tick.
    fn observe(&mut self, mean: T, deviation: T) {
        self.of_means.observe(mean);
        self.ticks = (self.ticks + T::one()).at_most(T::of(TIME_CONSTANT_TICKS));
        self.of_samples += (deviation * deviation - self.of_samples) / self.ticks;
    }

    /// Notes that the next tick does not follow the last tick.
    fn interrupt(&mut self) {
        self.of_means.interrupt();
    }

    /// True if the standard deviation of samples is too far from the learned value for a rest.
    fn is_another(&self, deviation: T) -> bool {
        let (now, known) = (deviation * deviation, self.of_samples);
        now > known * T::of(MAX_VARIANCE_RATIO) || now * T::of(MAX_VARIANCE_RATIO) < known
    }

    /// Begins new noise with the standard deviation of a tick.
    fn relearn(&mut self, deviation: T) {
        let variance = (deviation * deviation).at_least(T::VARIANCE_FLOOR);
        let louder = variance / self.of_samples.at_least(T::VARIANCE_FLOOR);
        let of_means = (self.of_means.variance() * louder).at_most(Self::most_of_means());
        self.of_means.set_known(of_means, FIRST_NOISE_TICKS);
        self.of_samples = variance;
        self.ticks = T::one();
    }

    /// Largest variance of ticks' means: the variance of the largest differences.
    fn most_of_means() -> T {
        T::MAX_INPUT * T::MAX_INPUT * T::of(4.0)
    }

    /// Variance of a tick's mean.
    #[inline]
    fn of_mean(&self) -> T {
        self.of_means.variance()
    }

    /// Variance of a sample.
    fn of_sample(&self) -> T {
        self.of_samples
    }
}

/// Samples of a block to date, centred and scaled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Block<T> {
    /// Number of samples in a full block.
    length: T,
    /// Samples to date, missing ones included.
    elapsed: T,
    /// Number of samples that were present.
    present: T,
    sum: T,
}

impl<T: Real + PartialOrd> Block<T> {
    /// An empty block that is full at `length` samples.
    fn new(length: T) -> Self {
        Self { length, elapsed: T::zero(), present: T::zero(), sum: T::zero() }
    }

    /// Begins an empty block; returns the time that is discarded, in blocks.
    fn restart(&mut self) -> T {
        let time = self.elapsed / self.length;
        *self = Self::new(self.length);
        time
    }

    /// Adds `present` samples of mean `mean`, gathered over `elapsed` samples.
    fn add(&mut self, elapsed: T, present: T, mean: T) {
        self.elapsed += elapsed;
        if present > T::zero() {
            self.present += present;
            self.sum += present * mean;
        }
    }

    /// True if all samples of the block have passed.
    fn is_full(&self) -> bool {
        self.elapsed >= self.length
    }

    /// Mean to date, if a sample was present, with the noise of a single sample.
    fn mean(&self, noise: T) -> Option<BlockMean<T>> {
        (self.present > T::zero()).then(|| BlockMean {
            mean: self.sum / self.present,
            noise: noise / self.present,
            time: self.elapsed / self.length,
        })
    }
}

/// Drift after a tick, in the samples' unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DriftNow<T> {
    /// Mean.
    pub mean: T,
    /// Standard deviation of the mean drift over the next ten seconds.
    pub sigma: T,
    /// Standard deviation of the drift from the walks alone, as in the Kalman step.
    pub walk_sigma: T,
    /// Propagation until the next tick.
    pub interim: Interim<T>,
}

/// Effect of a sample on the drift before its tick is complete and known to be rest or motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interim<T> {
    /// Weight of a sample.
    pub gain: T,
    /// Largest difference that is used, in the samples' unit.
    pub most: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Interim<T> {
    /// A drift that is held.
    pub fn held() -> Self {
        Self { gain: T::zero(), most: T::zero() }
    }

    /// The drift after a sample.
    #[inline(always)]
    pub fn step(&self, drift: T, z: T) -> T {
        let surprise = z - drift;
        let counts = surprise.simd_abs() <= self.most;
        drift + self.gain * choose(counts, surprise, T::zero())
    }
}
