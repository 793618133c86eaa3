//! Denoising of a whole record.

use super::bank::{Units, analyse, length, synthesise};
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
    /// What details are held to, σ√(2 ln n).
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
        let mut parts = Parts::new(z, Units { scale: 1.0 / scale, origin }, self.wavelet);
        let first = parts.details[0].len();
        let sigma = median_size(&parts.details[0]) / NORMAL_MEDIAN;
        let deepest = self.wavelet.deepest(z.len());
        while parts.details.len() < deepest && sigma > 0.0 {
            let goes_on = |level, d: &[f64]| self.level.goes_on(level, d, sigma, first);
            if !parts.deepen(self.wavelet, goes_on) {
                break;
            }
        }
        let threshold = sigma * (2.0 * (z.len() as f64).ln()).sqrt();
        let (level, mut signal) = (parts.details.len(), work::filled(0.0, z.len()));
        if threshold == 0.0 {
            signal.copy_from_slice(z);
        } else {
            if self.approximation {
                parts.shrink_rest(self.mode, threshold, origin);
            }
            let units = Units { scale, origin };
            parts.synthesise(self.wavelet, (self.mode, threshold), units, &mut signal);
        }
        Denoised { signal, level, sigma: sigma * scale, threshold: threshold * scale }
    }
}

/// A record taken apart.
struct Parts {
    /// From the first level to the last.
    details: Vec<Vec<f64>>,
    /// What is below them.
    rest: Vec<f64>,
    /// Room for what comes of it.
    next: Vec<f64>,
}

impl Parts {
    /// The first level.
    fn new(z: &[f64], units: Units, wavelet: Wavelet) -> Self {
        let k = length(z.len(), wavelet);
        let (mut rest, mut first) = (work::filled(0.0, k), work::filled(0.0, k));
        analyse(z, units, wavelet, &mut rest, &mut first);
        Self { details: vec![first], rest, next: Vec::new() }
    }

    /// One level more, if it is to be; returns whether it is.
    fn deepen(&mut self, wavelet: Wavelet, goes_on: impl Fn(usize, &[f64]) -> bool) -> bool {
        let k = length(self.rest.len(), wavelet);
        let mut details = work::filled(0.0, k);
        if self.next.is_empty() {
            self.next = work::filled(0.0, k);
        }
        self.next.truncate(k);
        analyse(&self.rest, Units::OWN, wavelet, &mut self.next, &mut details);
        let deeper = goes_on(self.details.len() + 1, &details);
        if deeper {
            self.details.push(details);
            std::mem::swap(&mut self.rest, &mut self.next);
        }
        deeper
    }

    fn shrink_rest(&mut self, mode: Mode, threshold: f64, origin: f64) {
        // Each level makes a constant √2 times as large.
        let offset = origin * 2f64.powf(0.5 * self.details.len() as f64);
        for a in &mut self.rest {
            *a = mode.shrink(*a + offset, threshold) - offset;
        }
    }

    fn synthesise(mut self, wavelet: Wavelet, how: (Mode, f64), units: Units, out: &mut [f64]) {
        for level in (1..self.details.len()).rev() {
            let n = self.details[level - 1].len();
            let mut x = work::filled(0.0, n);
            let (a, d) = (&self.rest, &self.details[level]);
            synthesise(a, d, how, wavelet, Units::OWN, &mut x);
            self.rest = x;
        }
        synthesise(&self.rest, &self.details[0], how, wavelet, units, out);
    }
}

/// What is left below so many levels, then the details from the last level to the first.
pub fn decompose(z: &[f64], wavelet: Wavelet, levels: usize) -> Vec<Vec<f64>> {
    let mut parts = Parts::new(z, Units::OWN, wavelet);
    while parts.details.len() < levels {
        parts.deepen(wavelet, |_, _| true);
    }
    let details = parts.details.into_iter().rev();
    std::iter::once(parts.rest).chain(details).collect()
}

/// A power of two near the largest size of finite numbers.
fn power_of_two(z: &[f64]) -> f64 {
    let (eights, rest) = z.as_chunks::<8>();
    let mut largest = [0.0_f64; 8];
    for eight in eights {
        for (largest, z) in largest.iter_mut().zip(eight) {
            *largest = largest.max(z.abs());
        }
    }
    let largest = largest.iter().chain(rest).fold(0.0, |largest: f64, z| largest.max(z.abs()));
    let exponent = (largest.to_bits() >> 52) as i64 - 1023;
    let exponent = exponent.clamp(-EXPONENT_MAX, EXPONENT_MAX);
    f64::from_bits(((exponent + 1023) as u64) << 52)
}
