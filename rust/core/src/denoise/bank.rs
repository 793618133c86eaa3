//! One level of the filter bank on a whole record whose borders are half-point symmetric:
//! a_k = Σ_j h_j x_{2k+2-F+j}, d_k likewise with g, and back.

use pulp::{Arch, Simd, WithSimd};

use super::Wavelet;
use super::wavelet::{Taps, with_taps};
use crate::work;

/// Outputs that are worked on side by side: what they need stays in the first-level cache.
const BLOCK: usize = 128;

/// The most pairs of taps.
const PAIRS: usize = 8;

/// Approximation and details of a record of at least F - 1 samples.
pub(super) fn analyse(x: &[f64], wavelet: Wavelet) -> [Vec<f64>; 2] {
    let length = (x.len() + wavelet.taps() - 1) / 2;
    let (mut a, mut d) = (work::filled(0.0, length), work::filled(0.0, length));
    with_taps!(wavelet, analyse_with, x, &mut a, &mut d);
    [a, d]
}

/// The `n` samples that [`analyse`] took, from its results.
pub(super) fn synthesise(a: &[f64], d: &[f64], n: usize, wavelet: Wavelet) -> Vec<f64> {
    let mut x = work::filled(0.0, n);
    with_taps!(wavelet, synthesise_with, a, d, &mut x);
    x
}

fn analyse_with<const F: usize>(taps: &Taps<F>, x: &[f64], a: &mut [f64], d: &mut [f64]) {
    let arch = Arch::new();
    let blocks = a.chunks_mut(BLOCK).zip(d.chunks_mut(BLOCK)).enumerate();
    for (block, (a, d)) in blocks {
        work::pause();
        let first = 2 * block * BLOCK;
        arch.dispatch(Analysis { taps, x, first, a, d });
    }
}

fn synthesise_with<const F: usize>(taps: &Taps<F>, a: &[f64], d: &[f64], x: &mut [f64]) {
    let arch = Arch::new();
    for (block, x) in x.chunks_mut(2 * BLOCK).enumerate() {
        work::pause();
        let first = block * BLOCK;
        arch.dispatch(Synthesis { taps, a: &a[first..], d: &d[first..], x });
    }
}

/// A block of coefficients, of which the first needs the samples from `first + 2 - F` on.
struct Analysis<'a, const F: usize> {
    taps: &'a Taps<F>,
    x: &'a [f64],
    first: usize,
    a: &'a mut [f64],
    d: &'a mut [f64],
}

impl<const F: usize> WithSimd for Analysis<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut phases = [[0.0; BLOCK + PAIRS]; 2];
        let pairs = self.a.len() + F / 2 - 1;
        self.take_apart(&mut phases, pairs);
        let [even, odd] = &phases;
        filter::<F>(even, odd, &self.taps.low, self.a);
        filter::<F>(even, odd, &self.taps.high, self.d);
    }
}

impl<const F: usize> Analysis<'_, F> {
    /// Even and odd samples apart, those beyond the borders reflected.
    #[inline(always)]
    fn take_apart(&self, [even, odd]: &mut [[f64; BLOCK + PAIRS]; 2], pairs: usize) {
        let begin = (self.first + 2).checked_sub(F);
        let inside = begin.and_then(|begin| self.x.get(begin..begin + 2 * pairs));
        if let Some(samples) = inside {
            let places = even.iter_mut().zip(odd.iter_mut());
            for ((even, odd), pair) in places.zip(samples.as_chunks::<2>().0) {
                (*even, *odd) = (pair[0], pair[1]);
            }
            return;
        }
        for i in 0..pairs {
            even[i] = self.reflected(self.first + 2 * i);
            odd[i] = self.reflected(self.first + 2 * i + 1);
        }
    }

    /// The sample at `place + 2 - F`.
    fn reflected(&self, place: usize) -> f64 {
        let n = self.x.len();
        let inside = match (place + 2).checked_sub(F) {
            Some(i) if i < n => i,
            Some(i) => (2 * n - 1).saturating_sub(i),
            None => F - 3 - place,
        };
        self.x[inside]
    }
}

/// Sums of taps times samples, term by term in the order of the taps.
#[inline(always)]
fn filter<const F: usize>(
    even: &[f64; BLOCK + PAIRS],
    odd: &[f64; BLOCK + PAIRS],
    taps: &[f64; F],
    out: &mut [f64],
) {
    for (k, out) in out.iter_mut().take(BLOCK).enumerate() {
        let mut sum = 0.0;
        for i in 0..F / 2 {
            sum += taps[2 * i] * even[k + i];
            sum += taps[2 * i + 1] * odd[k + i];
        }
        *out = sum;
    }
}

/// Samples x_{2p} and x_{2p+1}, of which the first needs the first coefficient.
struct Synthesis<'a, const F: usize> {
    taps: &'a Taps<F>,
    a: &'a [f64],
    d: &'a [f64],
    x: &'a mut [f64],
}

impl<const F: usize> WithSimd for Synthesis<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let pairs = self.x.len().div_ceil(2);
        let length = pairs + F / 2 - 1;
        let (mut even, mut odd) = ([0.0; BLOCK], [0.0; BLOCK]);
        let (a, d) = (&self.a[..length], &self.d[..length]);
        merge::<F>(a, d, self.taps, 2, &mut even[..pairs]);
        merge::<F>(a, d, self.taps, 1, &mut odd[..pairs]);
        for (pair, (even, odd)) in self.x.chunks_mut(2).zip(even.iter().zip(&odd)) {
            pair[0] = *even;
            if let Some(second) = pair.get_mut(1) {
                *second = *odd;
            }
        }
    }
}

/// Sums of every second tap, backwards from the `last`th from the end.
#[inline(always)]
fn merge<const F: usize>(a: &[f64], d: &[f64], taps: &Taps<F>, last: usize, out: &mut [f64]) {
    let (a, d) = (&a[..out.len() + F / 2 - 1], &d[..out.len() + F / 2 - 1]);
    for (p, out) in out.iter_mut().enumerate() {
        let mut sum = 0.0;
        for i in 0..F / 2 {
            sum += taps.low[F - last - 2 * i] * a[p + i];
            sum += taps.high[F - last - 2 * i] * d[p + i];
        }
        *out = sum;
    }
}

#[cfg(test)]
mod tests {
    use super::{Wavelet, analyse, synthesise};

    fn record(n: usize) -> Vec<f64> {
        (0..n).map(|k| ((k * k * 7 + 3 * k) % 101) as f64 - 50.0).collect()
    }

    #[test]
    fn what_was_taken_apart_is_put_together() {
        for (wavelet, name) in Wavelet::NAMES {
            for n in (wavelet.taps() - 1..70).chain([255, 256, 257, 1000, 1023]) {
                let x = record(n);
                let [a, d] = analyse(&x, wavelet);
                let back = synthesise(&a, &d, n, wavelet);
                let off = x.iter().zip(&back).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
                assert!(off < 1e-13, "{name} {n}: {off}");
            }
        }
    }

    #[test]
    fn borders_are_reflected_at_half_points() {
        let [a, d] = analyse(&[1.0, 2.0, 4.0], Wavelet::Haar);
        let root = std::f64::consts::SQRT_2;
        let close = |x: f64, y: f64| (x - y).abs() < 1e-15;
        assert!(close(a[0], 3.0 / root) && close(a[1], 8.0 / root));
        assert!(close(d[0], -1.0 / root) || close(d[0], 1.0 / root));
        assert_eq!(d[1], 0.0);
    }
}
