//! Allan and Hadamard variances of a stream at all octaves.

mod differences;
mod phases;

use serde::{Deserialize, Serialize};

use self::differences::{Differences, Squares};
use self::phases::{BLOCK, FIRST_BLOCK, Phases};
use crate::error::{Error, check_rate};
use crate::math::validity::is_count;
use crate::stream::Stream;
use crate::stream::checkpoint::{Checkpoint, decode};

/// Fully overlapping Allan and Hadamard variances at `m = 1, 2, 4, …, 2^(octaves-1)` samples.
///
/// They equal those of the whole record: a difference at every sample needs the phases of the last
/// three times the longest averaging time, kept in a ring of `2^(octaves+1)` phases that is
/// reserved once. Partly overlapping variances would need a few numbers per octave, but have fewer
/// terms.
///
/// A sample that is not finite is missing, and every term that would need it is left out.
///
/// The phase sums up distances from the first sample of a piece without missing ones. On a
/// piece of n samples whose mean lies D off its first one, rounding is as noise of deviation
/// `6e-17 n D` on each sample: 3e-7 of the samples' deviation σ for 1e8 samples and D = 40 σ, which
/// moves each result by some 3e-7 of what chance does: 3e-9 of itself at 32768 samples. The
/// sums of squares are of 32 parts, each of which rounds to 1e-16 of itself: 1e9 terms cost some
/// 1e-12.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StreamingAllan {
    rate: f64,
    samples_seen: u64,
    phases: Phases,
    differences: Differences,
}

impl StreamingAllan {
    /// The most octaves: 8 million samples, 256 MiB.
    pub const MAX_OCTAVES: usize = 24;

    /// An estimator for `rate` samples per second; the rate scales only the averaging times.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the rate, or octaves out of 1 to
    /// [`MAX_OCTAVES`](Self::MAX_OCTAVES),
    /// [`Error::Memory`] if there is none for the ring.
    pub fn new(rate: f64, octaves: usize) -> Result<Self, Error> {
        check_rate(rate)?;
        if !(1..=Self::MAX_OCTAVES).contains(&octaves) {
            return Err(Error::Parameter {
                name: "octaves",
                expected: "from 1 to 24",
                value: octaves as f64,
            });
        }
        Ok(Self {
            rate,
            samples_seen: 0,
            phases: Phases::new(distance(octaves))?,
            differences: Differences::new(octaves),
        })
    }

    /// Takes one sample.
    ///
    /// Its phase is kept at once, the differences are taken of 32 phases together, side by side:
    /// what is read does not show it.
    #[inline]
    pub fn observe(&mut self, z: f64) {
        self.samples_seen += 1;
        if !z.is_finite() {
            return self.end_piece();
        }
        let k = self.phases.push(z);
        if k < FIRST_BLOCK {
            self.differences.observe(&self.phases, k);
        } else if (k + 1).is_multiple_of(BLOCK as u64) {
            self.differences.observe_block(&self.phases, k + 1 - BLOCK as u64);
        }
    }

    #[cold]
    fn end_piece(&mut self) {
        self.differences.settle(&self.phases);
        self.phases.clear();
    }

    /// The differences, those of the block that is not whole included.
    fn settled(&self) -> Differences {
        let mut differences = self.differences.clone();
        differences.settle(&self.phases);
        differences
    }

    /// Samples per second.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// Averaging time of an octave in seconds.
    pub fn tau(&self, octave: usize) -> f64 {
        2f64.powi(octave as i32) / self.rate
    }

    /// Number of averaging times.
    pub fn octaves(&self) -> usize {
        self.differences.octaves()
    }

    /// Samples to date, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.samples_seen
    }

    /// Allan variance at an averaging time of `2^octave` samples and the number of its terms; NaN
    /// without one.
    pub fn allan(&self, octave: usize) -> (f64, u64) {
        variance(self.settled().second(octave), octave, 2.0)
    }

    /// Hadamard variance at an averaging time of `2^octave` samples and the number of its terms;
    /// NaN without one.
    pub fn hadamard(&self, octave: usize) -> (f64, u64) {
        variance(self.settled().third(octave), octave, 6.0)
    }
}

impl Stream for StreamingAllan {
    type Input = f64;
    type Output = ();

    #[inline]
    fn update(&mut self, z: f64) {
        self.observe(z);
    }

    fn try_clone(&self) -> Result<Self, Error> {
        let differences = self.differences.clone();
        Ok(Self { phases: self.phases.try_clone()?, differences, ..*self })
    }

    fn bytes(&self) -> usize {
        size_of::<Self>() + self.phases.bytes()
    }

    fn reset(&mut self) {
        self.samples_seen = 0;
        self.phases.clear();
        self.differences.reset();
    }
}

impl Checkpoint for StreamingAllan {
    const TAG: &'static str = "allan-streaming";
    const VERSION: u16 = 1;

    fn take(bytes: &[u8]) -> Result<(Self, &[u8]), Error> {
        let ((rate, samples_seen), bytes) = decode(bytes)?;
        let (phases, bytes) = Phases::take(bytes)?;
        let (differences, bytes) = decode(bytes)?;
        Ok((Self { rate, samples_seen, phases, differences }, bytes))
    }

    fn is_valid(&self) -> bool {
        check_rate(self.rate).is_ok()
            && (1..=Self::MAX_OCTAVES).contains(&self.octaves())
            && is_count(self.samples_seen)
            && self.phases.is_valid(distance(self.octaves()))
            && self.phases.count() <= self.samples_seen + 1
            && self.differences.is_possible(self.samples_seen)
    }

    fn with_reserve(self) -> Result<Self, Error> {
        Ok(Self { phases: self.phases.with_reserve()?, ..self })
    }

    fn is_like(&self, other: &Self) -> bool {
        let common = |allan: &Self| (allan.rate.to_bits(), allan.octaves(), allan.samples_seen);
        common(self) == common(other)
    }
}

/// `weight` is the mean square of the differences of white averages of unit variance.
fn variance(squares: Option<&Squares>, octave: usize, weight: f64) -> (f64, u64) {
    let (mean_square, terms) = squares.map_or((f64::NAN, 0), Squares::mean);
    let m = 2f64.powi(octave as i32);
    (mean_square / (weight * m * m), terms)
}

/// Phases that the longest averaging time looks back by.
fn distance(octaves: usize) -> usize {
    3 << (octaves - 1)
}
