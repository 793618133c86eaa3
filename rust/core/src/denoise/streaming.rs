//! Denoising of a stream by the same filter bank, with the shortest delay.

use serde::{Deserialize, Serialize};

use super::counting::{Counting, MAX_SIZE};
use super::wavelet::{Taps, with_taps};
use super::{Mode, Wavelet};
use crate::error::{Error, check_not_negative, check_rate};
use crate::math::validity::{is_count, is_sample, is_within};
use crate::math::{Limits, Real};
use crate::memory;
use crate::stream::Stream;
use crate::stream::checkpoint::Checkpoint;

/// Weight of the noise per second of details, and largest weight of one detail.
const WEIGHT_PER_SECOND: f64 = 0.2;
const MAX_WEIGHT: f64 = 0.5;

/// Smallest ratio of a detail to its last sample; below, the samples are equal except for rounding.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Largest distance from the first sample; no level of the bank can make it infinite.
const MAX_DISTANCE: f64 = 1e150;

/// Parameters of a denoiser.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WaveletParams {
    /// Samples per second. The time constant of the learned noise depends on it.
    pub rate: f64,
    /// Wavelet of the filter bank.
    pub wavelet: Wavelet,
    /// Number of denoised octaves, from 1 to [`MAX_LEVEL`](WaveletDenoiser::MAX_LEVEL).
    pub level: usize,
    /// Treatment of details above the threshold.
    pub mode: Mode,
    /// Details below this number of standard deviations of the noise are removed; with zero no
    /// detail is removed.
    pub threshold: f64,
}

/// A decimated filter bank that returns each sample denoised after
/// `(2^L - 1)(F - 1) + 1` samples, for L levels and F taps.
///
/// The standard deviation of the noise is learned from the details of the first level: the denoiser
/// counts the details within it. Each detail is compared with the present standard deviation when
/// it is used. Before the first sample the signal is assumed to equal the first sample.
///
/// A missing sample, which is not finite, is replaced by the last sample. Details that contain it
/// do not change the noise. The output is NaN before the first sample.
///
/// A sample needs work at one level and half of the next levels; every 2^L-th sample needs work at
/// all levels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WaveletDenoiser {
    params: WaveletParams,
    samples_seen: u64,
    /// Number of samples since the last missing one.
    unbroken: u64,
    missing: u64,
    /// First sample, NaN before it.
    origin: f64,
    /// Distances from the first sample: of the last sample, and of the next output.
    last: f64,
    next: f64,
    noise: Counting,
    /// For each level: its last samples, approximations and details, the second of a pair of
    /// outputs, and details that wait for the levels below.
    state: Vec<f64>,
}

impl WaveletDenoiser {
    /// Largest number of levels.
    pub const MAX_LEVEL: usize = 10;

    /// A denoiser before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the rate, the level or the threshold is out of range,
    /// [`Error::Memory`] if there is no memory for the details.
    pub fn new(params: WaveletParams) -> Result<Self, Error> {
        check_rate(params.rate)?;
        check_not_negative("threshold", "zero or a positive number", params.threshold)?;
        if !(1..=Self::MAX_LEVEL).contains(&params.level) {
            return Err(Error::Parameter {
                name: "level",
                expected: "from 1 to 10",
                value: params.level as f64,
            });
        }
        let state = memory::filled(0.0, begins(params.level, params.wavelet.taps(), params.level))?;
        Ok(Self::fresh(params, state))
    }

    fn fresh(params: WaveletParams, state: Vec<f64>) -> Self {
        Self {
            params,
            samples_seen: 0,
            unbroken: 0,
            missing: 0,
            origin: f64::NAN,
            last: 0.0,
            next: 0.0,
            noise: Counting::new(),
            state,
        }
    }

    /// Parameters of the denoiser.
    pub fn params(&self) -> &WaveletParams {
        &self.params
    }

    /// Delay of the output in samples. One sample less is possible; with this delay an output is
    /// ready before its sample comes.
    pub fn delay(&self) -> u64 {
        waiting(self.params.level, self.params.wavelet.taps()) as u64 + 1
    }

    /// Standard deviation of the noise; zero before it is known.
    pub fn sigma(&self) -> f64 {
        self.noise.sigma().min(f64::MAX_RAW)
    }

    /// Samples to date, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.samples_seen
    }

    /// Number of missing samples to date.
    pub fn missing(&self) -> u64 {
        self.missing
    }

    /// True if all samples to date were missing.
    fn has_not_begun(&self, fresh: &Self) -> bool {
        (self.missing, self.last, self.next) == (self.samples_seen, 0.0, 0.0)
            && self.noise == fresh.noise
            && self.state == fresh.state
    }

    /// Distance of the sample from the first sample; if it is missing, the distance of the last
    /// sample.
    #[inline(always)]
    fn distance(&mut self, z: f64) -> f64 {
        if !z.is_finite() {
            (self.unbroken, self.missing) = (0, self.missing + 1);
            return self.last;
        }
        let z = z.within(f64::MAX_RAW);
        if self.origin.is_nan() {
            self.origin = z;
        }
        self.unbroken += 1;
        self.last = (z - self.origin).within(MAX_DISTANCE);
        self.last
    }

    /// Processes the next distance; returns the output distance that is due after it.
    #[inline(always)]
    fn step<const F: usize>(taps: &Taps<F>, this: &mut Self, y: f64) -> f64 {
        let (levels, k) = (this.params.level, this.samples_seen);
        // Two samples of a level make one sample of the next level.
        let whole = (k.trailing_ones() as usize).min(levels);
        let mut bank = Levels { taps, levels, state: &mut this.state };
        let (mut x, mut details) = (y, [0.0; Self::MAX_LEVEL]);
        for level in 0..whole {
            let [a, d] = bank.analyse(level, k >> level, x);
            // Equal samples give no information on the noise.
            if level == 0 && this.unbroken >= F as u64 && d.abs() > ROUNDING * y.abs() {
                let gain = (2.0 * WEIGHT_PER_SECOND / this.params.rate).min(MAX_WEIGHT);
                this.noise.take(d.abs(), gain);
            }
            details[level] = bank.exchange(level, k >> (level + 1), d);
            x = a;
        }
        if whole < levels {
            x = bank.first_of_pair(whole, k >> whole, x);
        }
        let threshold = this.params.threshold * this.noise.sigma();
        for level in (0..whole).rev() {
            let d = this.params.mode.shrink(details[level], threshold);
            x = bank.synthesise(level, k >> (level + 1), x, d);
        }
        x
    }
}

/// Delay of a level's details, in its own samples, for this number of levels below it.
fn waiting(below: usize, taps: usize) -> usize {
    ((1 << below) - 1) * (taps - 1)
}

/// Offset of a level in the state, for this number of taps and levels.
#[inline(always)]
fn begins(level: usize, taps: usize, levels: usize) -> usize {
    let details = (taps - 1) * ((1 << levels) - (1 << (levels - level)));
    level * (3 * taps + 2) + details
}

/// The levels during a step. A level has two copies of its last F samples, F / 2 approximations and
/// F / 2 details, one behind the other: from any position on they are contiguous. Then come the
/// second sample of a pair, and the waiting details.
struct Levels<'a, const F: usize> {
    taps: &'a Taps<F>,
    levels: usize,
    state: &'a mut [f64],
}

impl<const F: usize> Levels<'_, F> {
    /// Index of the copy that is written, and start of the last values.
    #[inline(always)]
    fn write(&mut self, begin: usize, length: usize, k: u64, x: f64) -> usize {
        let index = begin + k as usize % length;
        self.state[index] = x;
        self.state[index + length] = x;
        index + 1
    }

    #[inline(always)]
    fn begin(&self, level: usize) -> usize {
        begins(level, F, self.levels)
    }

    /// The second sample of a pair: approximation and detail.
    #[inline(always)]
    fn analyse(&mut self, level: usize, k: u64, x: f64) -> [f64; 2] {
        let from = self.write(self.begin(level), F, k, x);
        let samples = &self.state[from..from + F];
        let mut sums = [0.0; 2];
        for j in 0..F {
            sums[0] += self.taps.low[j] * samples[j];
            sums[1] += self.taps.high[j] * samples[j];
        }
        sums
    }

    /// The first sample of a pair: stores it and returns the remainder of the last pair.
    #[inline(always)]
    fn first_of_pair(&mut self, level: usize, k: u64, x: f64) -> f64 {
        let begin = self.begin(level);
        self.write(begin, F, k, x);
        self.state[begin + 4 * F]
    }

    /// Returns the detail that has waited long enough, and stores the next detail.
    #[inline(always)]
    fn exchange(&mut self, level: usize, j: u64, d: f64) -> f64 {
        match waiting(self.levels - level - 1, F) as u64 {
            0 => d,
            length => {
                let index = self.begin(level) + 4 * F + 1 + (j % length) as usize;
                core::mem::replace(&mut self.state[index], d)
            }
        }
    }

    /// Returns the first of two samples made from an approximation and a detail; stores the second.
    #[inline(always)]
    fn synthesise(&mut self, level: usize, j: u64, a: f64, d: f64) -> f64 {
        let begin = self.begin(level);
        let approximations = self.write(begin + 2 * F, F / 2, j, a);
        let details = self.write(begin + 3 * F, F / 2, j, d);
        let a = &self.state[approximations..approximations + F / 2];
        let d = &self.state[details..details + F / 2];
        let mut pair = [0.0; 2];
        for i in 0..F / 2 {
            let last = F - 2 - 2 * i;
            pair[0] += self.taps.low[last] * a[i] + self.taps.high[last] * d[i];
            pair[1] += self.taps.low[last + 1] * a[i] + self.taps.high[last + 1] * d[i];
        }
        self.state[begin + 4 * F] = pair[1];
        pair[0]
    }
}

impl Stream for WaveletDenoiser {
    type Input = f64;
    type Output = f64;

    #[inline]
    fn update(&mut self, z: f64) -> f64 {
        let y = self.distance(z);
        let x = self.origin + self.next;
        self.next = with_taps!(self.params.wavelet, Self::step, self, y);
        self.samples_seen += 1;
        x
    }

    fn try_clone(&self) -> Result<Self, Error> {
        let state = memory::copied(&self.state)?;
        Ok(Self { state, ..*self })
    }

    fn bytes(&self) -> usize {
        size_of::<Self>() + size_of_val(self.state.as_slice())
    }

    fn reset(&mut self) {
        let mut state = core::mem::take(&mut self.state);
        state.fill(0.0);
        *self = Self::fresh(self.params, state);
    }
}

impl Checkpoint for WaveletDenoiser {
    const TAG: &'static str = "wavelet-denoiser";
    const VERSION: u16 = 1;

    fn is_valid(&self) -> bool {
        let within = |x: f64| is_within(x, MAX_SIZE);
        Self::new(self.params).is_ok_and(|fresh| {
            self.state.len() == fresh.state.len()
                && is_count(self.samples_seen)
                && self.unbroken <= self.samples_seen
                && self.missing <= self.samples_seen - self.unbroken
                && is_sample(self.origin, f64::MAX_RAW)
                && is_within(self.last, MAX_DISTANCE)
                && within(self.next)
                && self.noise.is_valid(self.samples_seen)
                && self.state.iter().all(|x| within(*x))
                && (!self.origin.is_nan() || self.has_not_begun(&fresh))
        })
    }

    fn is_like(&self, other: &Self) -> bool {
        (self.params, self.samples_seen) == (other.params, other.samples_seen)
    }
}
