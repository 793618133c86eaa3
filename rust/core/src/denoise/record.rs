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
        let goes_on = |level, d: &[f64]| self.level.goes_on(level, d, sigma, first);
        while sigma > 0.0 && parts.level() < deepest && parts.deepen(self.wavelet, goes_on) {}
        let threshold = sigma * (2.0 * (z.len() as f64).ln()).sqrt();
        let level = parts.level();
        let signal = if threshold == 0.0 {
            work::gathered(z.iter().copied())
        } else {
            if self.approximation {
                parts.shrink_rest(self.mode, threshold, origin);
            }
            parts.synthesise(self.wavelet, (self.mode, threshold), Units { scale, origin })
        };
        Denoised { signal, level, sigma: sigma * scale, threshold: threshold * scale }
    }
}

/// A record taken apart.
struct Parts {
    /// From the first level to the last.
    details: Vec<Vec<f64>>,
    /// Approximations of even levels, of which that of none is the record, and of odd ones: each is
    /// made of one on the other side, and fresh memory would take longer than all else.
    sides: [Vec<f64>; 2],
}

impl Parts {
    /// The first level.
    fn new(z: &[f64], units: Units, wavelet: Wavelet) -> Self {
        let (n, k) = (z.len(), length(z.len(), wavelet));
        let mut sides = [work::filled(0.0, n), work::filled(0.0, k)];
        let mut first = work::filled(0.0, k);
        analyse(z, units, wavelet, &mut sides[1], &mut first);
        Self { details: vec![first], sides }
    }

    /// The last level.
    fn level(&self) -> usize {
        self.details.len()
    }

    /// How many approximations a level has.
    fn length(&self, level: usize) -> usize {
        if level == 0 { self.sides[0].len() } else { self.details[level - 1].len() }
    }

    /// The approximations of a level, and room for those of the ones next to it.
    fn sides(&mut self, level: usize) -> (&[f64], &mut [f64]) {
        let n = self.length(level);
        let [even, odd] = &mut self.sides;
        if level.is_multiple_of(2) { (&even[..n], odd) } else { (&odd[..n], even) }
    }

    /// One level more, if it is to be; returns whether it is.
    fn deepen(&mut self, wavelet: Wavelet, goes_on: impl Fn(usize, &[f64]) -> bool) -> bool {
        let (level, k) = (self.level(), length(self.length(self.level()), wavelet));
        let mut details = work::filled(0.0, k);
        let (from, to) = self.sides(level);
        analyse(from, Units::OWN, wavelet, &mut to[..k], &mut details);
        let deeper = goes_on(level + 1, &details);
        if deeper {
            self.details.push(details);
        }
        deeper
    }

    /// What is below the last level.
    fn rest(&mut self) -> &mut [f64] {
        let n = self.length(self.level());
        &mut self.sides[self.details.len() % 2][..n]
    }

    fn shrink_rest(&mut self, mode: Mode, threshold: f64, origin: f64) {
        // Each level makes a constant √2 times as large.
        let offset = origin * 2f64.powf(0.5 * self.level() as f64);
        for a in self.rest() {
            *a = mode.shrink(*a + offset, threshold) - offset;
        }
    }

    fn synthesise(mut self, wavelet: Wavelet, how: (Mode, f64), units: Units) -> Vec<f64> {
        while let Some(details) = self.details.pop() {
            let level = self.level();
            let units = if level == 0 { units } else { Units::OWN };
            let (n, k) = (self.length(level), details.len());
            let [even, odd] = &mut self.sides;
            let (from, to) = if level.is_multiple_of(2) { (odd, even) } else { (even, odd) };
            synthesise(&from[..k], &details, how, wavelet, units, &mut to[..n]);
        }
        let [record, _] = self.sides;
        record
    }
}

/// What is left below so many levels, then the details from the last level to the first.
pub fn decompose(z: &[f64], wavelet: Wavelet, levels: usize) -> Vec<Vec<f64>> {
    let mut parts = Parts::new(z, Units::OWN, wavelet);
    while parts.level() < levels {
        parts.deepen(wavelet, |_, _| true);
    }
    let rest = work::gathered(parts.rest().iter().copied());
    std::iter::once(rest).chain(parts.details.into_iter().rev()).collect()
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
