//! Denoising of a whole record.

use super::bank::{Units, analyse, length, synthesise};
use super::level::LevelRule;
use super::median::median_size;
use super::{Mode, NORMAL_MEDIAN, Wavelet};
use crate::work;

/// Parameters of a record's denoising.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shrinkage {
    /// Wavelet of the filter bank.
    pub wavelet: Wavelet,
    /// Rule for the last level.
    pub level: LevelRule,
    /// Treatment of details above the threshold.
    pub mode: Mode,
    /// True if the approximation below the last octave is thresholded, too.
    pub approximation: bool,
}

/// Result of denoising a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Denoised {
    /// Last level that was thresholded.
    pub level: usize,
    /// Standard deviation of white noise, from the first level.
    pub sigma: f64,
    /// Threshold of details, σ√(2 ln n).
    pub threshold: f64,
}

/// Largest exponent of two for which a record is scaled.
const MAX_EXPONENT: i64 = 1000;

impl Shrinkage {
    /// Number of values in the working memory for a record of `n` samples, without the result.
    pub fn room(&self, n: usize) -> usize {
        room(n, self.wavelet, self.wavelet.deepest(n))
    }

    /// Denoises a record of finite samples into as many places of `signal`; [`room`](Self::room)
    /// gives the size of the working memory. The record must be long enough for one level, or for
    /// the fixed level.
    ///
    /// Samples are relative to the first sample, in units of the power of two of the largest.
    /// Neither an offset nor a unit reduces precision, and nothing overflows.
    pub fn denoise(&self, z: &[f64], signal: &mut [f64], room: &mut [f64]) -> Denoised {
        let scale = power_of_two(z);
        let origin = z[0] / scale;
        let units = Units { scale: 1.0 / scale, origin };
        let mut parts = Parts::new(z, units, self.wavelet, signal, room);
        let first = parts.lengths[0];
        let sigma = median_size(&parts.details[..first]) / NORMAL_MEDIAN;
        let deepest = self.wavelet.deepest(z.len());
        let goes_on = |level, d: &[f64]| self.level.goes_on(level, d, sigma, first);
        while sigma > 0.0 && parts.level() < deepest && parts.deepen(self.wavelet, goes_on) {}
        let threshold = sigma * (2.0 * (z.len() as f64).ln()).sqrt();
        let level = parts.level();
        if threshold == 0.0 {
            signal.copy_from_slice(z);
        } else {
            if self.approximation {
                parts.shrink_rest(self.mode, threshold, origin);
            }
            parts.synthesise(self.wavelet, (self.mode, threshold), Units { scale, origin });
        }
        Denoised { level, sigma: sigma * scale, threshold: threshold * scale }
    }
}

/// Size for the approximations of the first level and all details.
fn room(n: usize, wavelet: Wavelet, levels: usize) -> usize {
    let first = length(n, wavelet);
    let lengths = std::iter::successors(Some(first), |k| Some(length(*k, wavelet)));
    first + lengths.take(levels).sum::<usize>()
}

/// A decomposed record.
struct Parts<'a> {
    /// Number of details of each level.
    lengths: Vec<usize>,
    /// Details from the first level to the last.
    details: &'a mut [f64],
    /// Approximations of even levels, with the record as level zero, and of odd levels. Each is
    /// made from one on the other side: fresh memory would take longer than all other steps.
    sides: [&'a mut [f64]; 2],
}

impl<'a> Parts<'a> {
    /// Decomposes to the first level.
    fn new(
        z: &[f64],
        units: Units,
        wavelet: Wavelet,
        record: &'a mut [f64],
        room: &'a mut [f64],
    ) -> Self {
        let k = length(z.len(), wavelet);
        let (first, details) = room.split_at_mut(k);
        analyse(z, units, wavelet, first, &mut details[..k]);
        Self { lengths: vec![k], details, sides: [record, first] }
    }

    /// Last level.
    fn level(&self) -> usize {
        self.lengths.len()
    }

    /// Number of approximations of a level.
    fn length(&self, level: usize) -> usize {
        if level == 0 { self.sides[0].len() } else { self.lengths[level - 1] }
    }

    /// Adds a level if `goes_on` allows it; returns true if it does.
    fn deepen(&mut self, wavelet: Wavelet, goes_on: impl Fn(usize, &[f64]) -> bool) -> bool {
        let (level, n) = (self.level(), self.length(self.level()));
        let (begin, k) = (self.lengths.iter().sum::<usize>(), length(n, wavelet));
        let details = &mut self.details[begin..begin + k];
        let [even, odd] = &mut self.sides;
        let (from, to) = if level.is_multiple_of(2) { (even, odd) } else { (odd, even) };
        analyse(&from[..n], Units::IDENTITY, wavelet, &mut to[..k], details);
        let deeper = goes_on(level + 1, details);
        if deeper {
            self.lengths.push(k);
        }
        deeper
    }

    /// The approximation below the last level.
    fn rest(&mut self) -> &mut [f64] {
        let (level, n) = (self.level(), self.length(self.level()));
        &mut self.sides[level % 2][..n]
    }

    fn shrink_rest(&mut self, mode: Mode, threshold: f64, origin: f64) {
        // Each level multiplies a constant by √2.
        let offset = origin * 2f64.powf(0.5 * self.level() as f64);
        for a in self.rest() {
            *a = mode.shrink(*a + offset, threshold) - offset;
        }
    }

    /// Reconstructs the record in place, in its own units.
    fn synthesise(mut self, wavelet: Wavelet, how: (Mode, f64), units: Units) {
        while let Some(k) = self.lengths.pop() {
            let (level, n) = (self.level(), self.length(self.level()));
            let units = if level == 0 { units } else { Units::IDENTITY };
            let begin = self.lengths.iter().sum::<usize>();
            let details = &self.details[begin..begin + k];
            let [even, odd] = &mut self.sides;
            let (from, to) = if level.is_multiple_of(2) { (odd, even) } else { (even, odd) };
            synthesise(&from[..k], details, how, wavelet, units, &mut to[..n]);
        }
    }
}

/// The approximation below this number of levels, then the details from the last level to the
/// first.
pub fn decompose(z: &[f64], wavelet: Wavelet, levels: usize) -> Vec<Vec<f64>> {
    let mut record = work::filled(0.0, z.len());
    let mut room = work::filled(0.0, room(z.len(), wavelet, levels));
    let mut parts = Parts::new(z, Units::IDENTITY, wavelet, &mut record, &mut room);
    while parts.level() < levels {
        parts.deepen(wavelet, |_, _| true);
    }
    let copied = |values: &[f64]| work::collect(values.iter().copied());
    let mut found = Vec::new();
    let mut rest: &[f64] = parts.details;
    for k in &parts.lengths {
        let (details, others) = rest.split_at(*k);
        found.push(copied(details));
        rest = others;
    }
    found.push(copied(parts.rest()));
    found.reverse();
    found
}

/// A power of two near the largest size of the numbers, all finite.
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
    let exponent = exponent.clamp(-MAX_EXPONENT, MAX_EXPONENT);
    f64::from_bits(((exponent + 1023) as u64) << 52)
}
