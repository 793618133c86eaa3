//! Allan and Hadamard variances at all octaves while samples flow.

use serde::{Deserialize, Serialize};

use super::differences::{Differences, Squares};
use super::phases::Phases;
use crate::error::Error;

/// Fully overlapping Allan and Hadamard variances at `m = 1, 2, 4, …, 2^(octaves-1)` samples.
///
/// They equal those of the whole record: a difference is taken at every sample, which needs the
/// phases of the last three times the longest averaging time. So there is a ring of `2^(octaves+1)`
/// phases, reserved once. Variances that overlap in part only would do with a few numbers an octave,
/// but with fewer terms.
///
/// A sample that is not finite is missing, and every term that would need it is left out.
///
/// The phase sums up distances from the first sample of a stretch without missing ones. On a
/// stretch of n samples whose mean lies D off its first one, rounding is as noise of deviation
/// `6e-17 n D` on each sample: 3e-7 of the samples' deviation σ for 1e8 samples and D = 40 σ, which
/// moves each result by some 3e-7 of what chance does: 3e-9 of itself at 32768 samples. The
/// sums of squares are of 32 parts, each of which rounds to 1e-16 of itself: 1e9 terms cost some
/// 1e-12.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Saved")]
pub struct StreamingAllan {
    samples_seen: u64,
    phases: Phases,
    differences: Differences,
}

impl StreamingAllan {
    /// The most octaves: 8 million samples, 256 MiB.
    pub const OCTAVES_MAX: usize = 24;

    /// An estimator that has seen nothing.
    ///
    /// # Errors
    /// [`Error::Parameter`] for octaves out of 1 to [`OCTAVES_MAX`](Self::OCTAVES_MAX),
    /// [`Error::Memory`] if there is none for the ring.
    pub fn new(octaves: usize) -> Result<Self, Error> {
        if !(1..=Self::OCTAVES_MAX).contains(&octaves) {
            return Err(Error::Parameter {
                name: "octaves",
                expected: "from 1 to 24",
                value: octaves as f64,
            });
        }
        Ok(Self {
            samples_seen: 0,
            phases: Phases::new(3 << (octaves - 1))?,
            differences: Differences::new(octaves),
        })
    }

    /// Takes one sample.
    #[inline]
    pub fn observe(&mut self, z: f64) {
        self.samples_seen += 1;
        if !z.is_finite() {
            return self.phases.clear();
        }
        let k = self.phases.push(z);
        self.differences.observe(&self.phases, k);
    }

    /// Takes many samples, equal to the last bit to [`observe`](Self::observe) one by one.
    pub fn extend(&mut self, mut samples: &[f64]) {
        while let Some((z, rest)) = samples.split_first() {
            samples = match samples.split_first_chunk() {
                Some((block, rest)) if self.phases.take_block(block) => {
                    self.samples_seen += block.len() as u64;
                    let k = self.phases.count();
                    let recent = self.phases.push_block(block);
                    self.differences.observe_block(&self.phases, &recent, k);
                    rest
                }
                _ => {
                    self.observe(*z);
                    rest
                }
            };
        }
    }

    /// Back to before the first sample.
    pub fn reset(&mut self) {
        self.samples_seen = 0;
        self.phases.clear();
        self.differences.reset();
    }

    /// Averaging times.
    pub fn octaves(&self) -> usize {
        self.differences.octaves()
    }

    /// Samples given so far, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.samples_seen
    }

    /// Allan variance at an averaging time of `2^octave` samples and the number of its terms; NaN
    /// without one.
    pub fn allan(&self, octave: usize) -> (f64, u64) {
        variance(self.differences.second(octave), octave, 2.0)
    }

    /// Hadamard variance at an averaging time of `2^octave` samples and the number of its terms;
    /// NaN without one.
    pub fn hadamard(&self, octave: usize) -> (f64, u64) {
        variance(self.differences.third(octave), octave, 6.0)
    }
}

/// `weight` is the mean square of the differences of white averages of unit variance.
fn variance(squares: Option<&Squares>, octave: usize, weight: f64) -> (f64, u64) {
    let (mean_square, terms) = squares.map_or((f64::NAN, 0), Squares::mean);
    let m = 2f64.powi(octave as i32);
    (mean_square / (weight * m * m), terms)
}

/// What a checkpoint holds, before it is known to fit together.
#[derive(Deserialize)]
struct Saved {
    samples_seen: u64,
    phases: Phases,
    differences: Differences,
}

impl TryFrom<Saved> for StreamingAllan {
    type Error = Error;

    fn try_from(saved: Saved) -> Result<Self, Error> {
        let Saved { samples_seen, phases, differences } = saved;
        let fresh = Self::new(differences.octaves())?;
        let fits = phases.is_like(&fresh.phases)
            && phases.count() <= samples_seen.saturating_add(1)
            && differences.is_possible(samples_seen)
            // So that no count overflows.
            && samples_seen < 1 << 60;
        match fits {
            true => Ok(Self { samples_seen, phases: phases.reserved()?, differences }),
            false => Err(Error::Content),
        }
    }
}
