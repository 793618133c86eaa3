//! One level of the filter bank on a whole record with half-point symmetric borders: a_k = Σ_j h_j
//! x_{2k+2-F+j}, d_k in the same way with g, and the inverse.

use pulp::{Arch, Simd, WithSimd};

use super::wavelet::{Taps, with_taps};
use super::{Mode, Wavelet};
use crate::work;

/// Number of sample pairs that are processed together: they stay in the first-level cache.
const BLOCK: usize = 128;

/// Number of pairs with the longest filter that extends into the next block.
const REACH: usize = BLOCK + 8;

/// Samples in another unit, with another origin.
#[derive(Debug, Clone, Copy)]
pub(super) struct Units {
    pub scale: f64,
    /// Origin, in these units.
    pub origin: f64,
}

impl Units {
    /// The samples' own unit and origin.
    pub const IDENTITY: Self = Self { scale: 1.0, origin: 0.0 };
}

/// Number of approximations, and of details, for `n` samples.
pub(super) fn length(n: usize, wavelet: Wavelet) -> usize {
    (n + wavelet.taps() - 1) / 2
}

/// Writes approximation and details of a record of at least F - 1 samples, in other units, to `a`
/// and `d`.
pub(super) fn analyse(x: &[f64], units: Units, wavelet: Wavelet, a: &mut [f64], d: &mut [f64]) {
    with_taps!(wavelet, analyse_with, x, units, a, d);
}

fn analyse_with<const F: usize>(
    taps: &Taps<F>,
    x: &[f64],
    units: Units,
    a: &mut [f64],
    d: &mut [f64],
) {
    let arch = Arch::new();
    for (block, (a, d)) in a.chunks_mut(BLOCK).zip(d.chunks_mut(BLOCK)).enumerate() {
        work::pause();
        arch.dispatch(Analysis { taps, x, units, first: 2 * block * BLOCK, a, d });
    }
}

/// Reconstructs the samples of [`analyse`] from the approximation and the thresholded details.
pub(super) fn synthesise(
    a: &[f64],
    d: &[f64],
    shrinking: (Mode, f64),
    wavelet: Wavelet,
    units: Units,
    x: &mut [f64],
) {
    with_taps!(wavelet, synthesise_with, a, d, shrinking, units, x);
}

fn synthesise_with<const F: usize>(
    taps: &Taps<F>,
    a: &[f64],
    d: &[f64],
    shrinking: (Mode, f64),
    units: Units,
    x: &mut [f64],
) {
    let arch = Arch::new();
    for (block, x) in x.chunks_mut(2 * BLOCK).enumerate() {
        work::pause();
        let (a, d) = (&a[block * BLOCK..], &d[block * BLOCK..]);
        arch.dispatch(Synthesis { taps, a, d, shrinking, units, x });
    }
}

/// A block of coefficients; the first coefficient needs the samples from `first + 2 - F` on.
struct Analysis<'a, const F: usize> {
    taps: &'a Taps<F>,
    x: &'a [f64],
    units: Units,
    first: usize,
    a: &'a mut [f64],
    d: &'a mut [f64],
}

impl<const F: usize> WithSimd for Analysis<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (mut even, mut odd) = ([0.0; REACH], [0.0; REACH]);
        self.take_apart(&mut even, &mut odd);
        let (mut a, mut d) = ([0.0; BLOCK], [0.0; BLOCK]);
        for k in 0..BLOCK {
            let (mut low, mut high) = (0.0, 0.0);
            for i in 0..F / 2 {
                let (x, y) = (even[k + i], odd[k + i]);
                low += self.taps.low[2 * i] * x;
                high += self.taps.high[2 * i] * x;
                low += self.taps.low[2 * i + 1] * y;
                high += self.taps.high[2 * i + 1] * y;
            }
            (a[k], d[k]) = (low, high);
        }
        self.a.copy_from_slice(&a[..self.a.len()]);
        self.d.copy_from_slice(&d[..self.d.len()]);
    }
}

impl<const F: usize> Analysis<'_, F> {
    /// Even and odd samples separately; samples beyond the borders are reflected.
    #[inline(always)]
    fn take_apart(&self, even: &mut [f64; REACH], odd: &mut [f64; REACH]) {
        let Units { scale, origin } = self.units;
        let begin = (self.first + 2).checked_sub(F);
        let inside = begin.and_then(|begin| self.x.get(begin..begin + 2 * REACH));
        if let Some(samples) = inside {
            let pairs = samples.as_chunks::<2>().0;
            for (slot, pair) in even.iter_mut().zip(pairs) {
                *slot = pair[0] * scale - origin;
            }
            for (slot, pair) in odd.iter_mut().zip(pairs) {
                *slot = pair[1] * scale - origin;
            }
            return;
        }
        for i in 0..self.a.len() + F / 2 - 1 {
            even[i] = self.reflected(self.first + 2 * i) * scale - origin;
            odd[i] = self.reflected(self.first + 2 * i + 1) * scale - origin;
        }
    }

    /// The sample at `slot + 2 - F`.
    fn reflected(&self, slot: usize) -> f64 {
        let n = self.x.len();
        let inside = match (slot + 2).checked_sub(F) {
            Some(i) if i < n => i,
            Some(i) => 2 * n - 1 - i,
            None => F - 3 - slot,
        };
        self.x[inside]
    }
}

/// A block of samples; the first sample needs the first coefficient.
struct Synthesis<'a, const F: usize> {
    taps: &'a Taps<F>,
    a: &'a [f64],
    d: &'a [f64],
    shrinking: (Mode, f64),
    units: Units,
    x: &'a mut [f64],
}

impl<const F: usize> WithSimd for Synthesis<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (mut a, mut d) = ([0.0; REACH], [0.0; REACH]);
        let length = self.a.len().min(REACH);
        a[..length].copy_from_slice(&self.a[..length]);
        d[..length].copy_from_slice(&self.d[..length]);
        let (mode, threshold) = self.shrinking;
        match mode {
            Mode::Soft => d.iter_mut().for_each(|d| *d = Mode::Soft.shrink(*d, threshold)),
            Mode::Hard => d.iter_mut().for_each(|d| *d = Mode::Hard.shrink(*d, threshold)),
        }
        let mut pairs = [[0.0; 2]; BLOCK];
        for (p, pair) in pairs.iter_mut().enumerate() {
            let (mut even, mut odd) = (0.0, 0.0);
            for i in 0..F / 2 {
                let last = F - 2 - 2 * i;
                even += self.taps.low[last] * a[p + i];
                odd += self.taps.low[last + 1] * a[p + i];
                even += self.taps.high[last] * d[p + i];
                odd += self.taps.high[last + 1] * d[p + i];
            }
            *pair = [even, odd];
        }
        let Units { scale, origin } = self.units;
        for (slot, x) in self.x.iter_mut().zip(pairs.as_flattened()) {
            *slot = ((*x + origin) * scale).clamp(-f64::MAX, f64::MAX);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Mode, Units, Wavelet, analyse, length, synthesise};

    fn apart(x: &[f64], wavelet: Wavelet) -> [Vec<f64>; 2] {
        let k = length(x.len(), wavelet);
        let (mut a, mut d) = (vec![0.0; k], vec![0.0; k]);
        analyse(x, Units::IDENTITY, wavelet, &mut a, &mut d);
        [a, d]
    }

    #[test]
    fn what_was_taken_apart_is_put_together() {
        for (wavelet, name) in Wavelet::NAMES {
            for n in (wavelet.taps() - 1..70).chain([255, 256, 257, 258, 800, 1000, 1023]) {
                let x: Vec<f64> = (0..n).map(|k| ((k * k * 7 + 3 * k) % 101) as f64).collect();
                let [a, d] = apart(&x, wavelet);
                let mut back = vec![0.0; n];
                synthesise(&a, &d, (Mode::Soft, 0.0), wavelet, Units::IDENTITY, &mut back);
                let off = x.iter().zip(&back).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
                assert!(off < 1e-13, "{name} {n}: {off}");
            }
        }
    }

    #[test]
    fn borders_are_reflected_at_half_points() {
        let [a, d] = apart(&[1.0, 2.0, 4.0], Wavelet::Haar);
        // Numbers up to eight, with some rounding errors.
        let close = |x: f64, y: f64| (x * std::f64::consts::SQRT_2 - y).abs() < 1e-14;
        assert!(close(a[0], 3.0) && close(a[1], 8.0));
        assert!(close(d[0], -1.0) && close(d[1], 0.0));
    }

    #[test]
    fn units_are_those_of_the_record() {
        let x: Vec<f64> = (0..300).map(|k| f64::from(k * k % 37)).collect();
        let scaled: Vec<f64> = x.iter().map(|x| (x + 3.0) * 4.0).collect();
        let wavelet = Wavelet::Db4;
        let expected = apart(&x, wavelet);
        let (mut a, mut d) = (vec![0.0; expected[0].len()], vec![0.0; expected[0].len()]);
        analyse(&scaled, Units { scale: 0.25, origin: 3.0 }, wavelet, &mut a, &mut d);
        assert_eq!([&a, &d], [&expected[0], &expected[1]]);
        let mut back = vec![0.0; 300];
        let units = Units { scale: 4.0, origin: 3.0 };
        synthesise(&a, &d, (Mode::Hard, 0.0), wavelet, units, &mut back);
        assert!(scaled.iter().zip(&back).all(|(x, y)| (x - y).abs() < 1e-12));
    }
}
