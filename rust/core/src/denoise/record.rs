//! Denoising of a whole record.

use super::bank::{analyse, synthesise};
use super::level::LevelRule;
use super::median::median_size;
use super::{Mode, NORMAL_MEDIAN, Wavelet};
use crate::work;

/// How a record is denoised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shrinkage {
    /// The wavelet.
    pub wavelet: Wavelet,
    /// How deep it goes.
    pub level: LevelRule,
    /// What becomes of details above the threshold.
    pub mode: Mode,
    /// Whether what is below the last octave is thresholded as well.
    pub approximation: bool,
}

/// A record without the details that are no larger than noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Denoised {
    /// The record.
    pub signal: Vec<f64>,
    /// The last level that was thresholded.
    pub level: usize,
    /// The deviation of white noise, from the first level.
    pub sigma: f64,
    /// What is taken off details, σ√(2 ln n).
    pub threshold: f64,
}

/// Exponent of two beyond which a record is not scaled.
const EXPONENT_MAX: i64 = 1000;

impl Shrinkage {
    /// Denoises a record of finite samples, enough for one level and for a level that is fixed.
    ///
    /// The work is done on the samples less the first of them, in units of the power of two of the
    /// largest: neither an offset nor a unit costs precision, and nothing overflows.
    pub fn denoise(&self, z: &[f64]) -> Denoised {
        let scale = power_of_two(z);
        let origin = z[0] / scale;
        let y = work::gathered(z.iter().map(|z| z / scale - origin));
        let mut parts = self.decompose(y);
        let threshold = parts.sigma * (2.0 * (z.len() as f64).ln()).sqrt();
        let (level, sigma) = (parts.details.len(), parts.sigma * scale);
        let done = |signal| Denoised { signal, level, sigma, threshold: threshold * scale };
        if threshold == 0.0 {
            return done(work::gathered(z.iter().copied()));
        }
        parts.shrink(self, threshold, origin);
        let mut signal = parts.synthesise(self.wavelet);
        for x in &mut signal {
            *x = ((*x + origin) * scale).clamp(-f64::MAX, f64::MAX);
        }
        done(signal)
    }

    fn decompose(&self, y: Vec<f64>) -> Parts {
        let deepest = self.wavelet.deepest(y.len());
        let n = y.len();
        let [mut rest, first] = analyse(&y, self.wavelet);
        drop(y);
        let sigma = median_size(&first) / NORMAL_MEDIAN;
        let (mut lengths, mut details) = (vec![n], vec![first]);
        while details.len() < deepest && sigma > 0.0 {
            let [a, d] = analyse(&rest, self.wavelet);
            if !self.level.goes_on(details.len() + 1, &d, sigma, details[0].len()) {
                break;
            }
            lengths.push(rest.len());
            details.push(d);
            rest = a;
        }
        Parts { sigma, lengths, details, rest }
    }
}

/// A record taken apart.
struct Parts {
    sigma: f64,
    /// Of what each level was made of.
    lengths: Vec<usize>,
    details: Vec<Vec<f64>>,
    rest: Vec<f64>,
}

impl Parts {
    fn shrink(&mut self, how: &Shrinkage, threshold: f64, origin: f64) {
        for d in self.details.iter_mut().flatten() {
            *d = how.mode.shrink(*d, threshold);
        }
        if how.approximation {
            // Each level makes a constant √2 times as large.
            let offset = origin * 2f64.powf(0.5 * self.details.len() as f64);
            for a in &mut self.rest {
                *a = how.mode.shrink(*a + offset, threshold) - offset;
            }
        }
    }

    fn synthesise(self, wavelet: Wavelet) -> Vec<f64> {
        let levels = self.details.into_iter().zip(self.lengths).rev();
        levels.fold(self.rest, |a, (d, n)| synthesise(&a, &d, n, wavelet))
    }
}

/// What is left below so many levels, then the details from the last level to the first.
pub fn decompose(z: &[f64], wavelet: Wavelet, levels: usize) -> Vec<Vec<f64>> {
    let mut parts = Vec::new();
    let mut rest = work::gathered(z.iter().copied());
    for _ in 0..levels {
        let [a, d] = analyse(&rest, wavelet);
        parts.push(d);
        rest = a;
    }
    parts.push(rest);
    parts.reverse();
    parts
}

/// A power of two near the largest size of finite numbers.
fn power_of_two(z: &[f64]) -> f64 {
    let largest = z.iter().fold(0.0, |largest: f64, z| largest.max(z.abs()));
    let exponent = (largest.to_bits() >> 52) as i64 - 1023;
    let exponent = exponent.clamp(-EXPONENT_MAX, EXPONENT_MAX);
    f64::from_bits(((exponent + 1023) as u64) << 52)
}
