//! The sum of squares from a record's spectrum: a guide that takes little time compared with a
//! pass.
//!
//! For a long record the residuals' sum of squares is `Σ P |φ|²/|θ|²` over its periodogram `P`,
//! except for the effect of its ends. Neighbouring frequencies are combined, since no model of low
//! order distinguishes them. Searches descend here first (Whittle 1953), and end on the record
//! itself.

use std::f64::consts::{PI, TAU};
use std::ops::{Range, RangeInclusive};

use pulp::{Arch, Simd, WithSimd};

use super::columns::{BLOCK, HISTORY, Sums, against};
use super::conditional::Conditional;
use super::descent::{Normal, Problem};
use super::series::Series;
use crate::work;

/// Smallest number of samples; for fewer a pass takes little more time than the guide.
const MIN_SAMPLES: usize = 1 << 14;

/// Smallest share of present samples; a missing sample is replaced by the previous one.
const MIN_PRESENT_SHARE: f64 = 0.9;

/// Share of a record over which each end fades in or out. Otherwise the step from the last sample
/// to the first would look like noise of all frequencies.
const FADE_SHARE: f64 = 0.025;

/// Largest ratio of a bin's width to its frequency: smaller than the width of any pole.
const MAX_RELATIVE_WIDTH: f64 = 1.0 / 64.0;

/// Largest width of a bin as a share of the spectrum: a vibration's peak needs this resolution.
const MAX_WIDTH: f64 = 1.0 / 4096.0;

/// Power of a record in bins of frequency; the sum of all bins is its sum of squares.
#[derive(Debug, Clone)]
pub struct Spectrum {
    power: Vec<f64>,
    /// Real and imaginary parts of `e^{-ikω}` in the middle of each bin, for `k` from 0 on.
    delays: [Pair; HISTORY + 1],
    arch: Arch,
}

/// Real and imaginary parts, one number per bin.
type Pair = [Vec<f64>; 2];

impl Spectrum {
    /// The spectrum of a long record with few gaps; `None` for other records.
    pub fn new(series: &Series) -> Option<Self> {
        let n = series.values.len();
        if n < MIN_SAMPLES || (series.present as f64) < MIN_PRESENT_SHARE * n as f64 {
            return None;
        }
        let powers = periodogram(&fade_ends(series));
        let (mut power, mut angles) = (Vec::new(), Vec::new());
        let mut first = 1;
        while first < powers.len() {
            let narrow = (MAX_RELATIVE_WIDTH * first as f64).min(MAX_WIDTH * powers.len() as f64);
            let end = (first + narrow.max(1.0) as usize).min(powers.len());
            power.push(powers[first..end].iter().sum());
            angles.push(PI * 0.5 * (first + end - 1) as f64 / powers.len() as f64);
            first = end;
        }
        let scale = series.present as f64 / power.iter().sum::<f64>();
        power.iter_mut().for_each(|power| *power *= scale);
        let delays = std::array::from_fn(|k| {
            let turned = |by: fn(f64) -> f64| angles.iter().map(|a| by(k as f64 * a)).collect();
            [turned(f64::cos), turned(|angle| -angle.sin())]
        });
        scale.is_finite().then_some(Self { power, delays, arch: Arch::new() })
    }

    /// Sums as from a pass over the record, with the constant that makes the mean zero.
    fn sums(&self, phi: &[f64], theta: &[f64], count: f64) -> Sums {
        let by_lag = self.arch.dispatch(Lagged { spectrum: self, phi, theta });
        let (p, q) = (phi.len(), theta.len());
        let mut sums = Sums::default();
        let (constant, e) = (p + q, p + q + 1);
        for i in 0..p {
            (0..=i).for_each(|j| sums.products[i][j] = by_lag.uu[i - j]);
            sums.products[e][i] = by_lag.eu[i + 1];
        }
        for j in 0..q {
            (0..p).for_each(|i| sums.products[p + j][i] = by_lag.uv(i, j));
            (0..=j).for_each(|i| sums.products[p + j][p + i] = by_lag.vv[j - i]);
            sums.products[e][p + j] = by_lag.ev[j + 1];
        }
        let settled = 1.0 + theta.iter().sum::<f64>();
        sums.products[constant][constant] = count / (settled * settled).max(f64::MIN_POSITIVE);
        sums.products[e][e] = by_lag.ee;
        sums.phi_curvatures = by_lag.ex;
        sums.theta_curvatures = by_lag.ew;
        sums
    }
}

type ByLag = [f64; HISTORY + 1];

/// Sums of products of `u = y/θ(B)`, `v = e/θ(B)`, `w = v/θ(B)`, `x = u/θ(B)` and the residuals
/// `e`; one factor is delayed: in `eu` to `ew` the second.
#[derive(Debug, Clone, Default)]
struct SumsByLag {
    ee: f64,
    uu: ByLag,
    vv: ByLag,
    eu: ByLag,
    ev: ByLag,
    ex: ByLag,
    ew: ByLag,
    u_after_v: ByLag,
    v_after_u: ByLag,
}

impl SumsByLag {
    /// Product of `u` delayed by `i` and `v` delayed by `j`.
    fn uv(&self, i: usize, j: usize) -> f64 {
        if i >= j { self.u_after_v[i - j] } else { self.v_after_u[j - i] }
    }
}

#[derive(Debug, Clone, Copy)]
struct Lagged<'a> {
    spectrum: &'a Spectrum,
    phi: &'a [f64],
    theta: &'a [f64],
}

/// Spectra of pairs of lines in a block of bins: the sum of a spectrum times the delays is a
/// product.
#[derive(Debug)]
struct Cross {
    u: [f64; BLOCK],
    v: [f64; BLOCK],
    e: [f64; BLOCK],
    eu: [[f64; BLOCK]; 2],
    ev: [[f64; BLOCK]; 2],
    ex: [[f64; BLOCK]; 2],
    ew: [[f64; BLOCK]; 2],
    /// Spectrum of `v` after `u`; in the other order it is the conjugate.
    vu: [[f64; BLOCK]; 2],
}

impl WithSimd for Lagged<'_> {
    type Output = SumsByLag;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> SumsByLag {
        let (p, q) = (self.phi.len(), self.theta.len());
        let zero = [0.0; BLOCK];
        let pair = [zero; 2];
        let (u, v, e) = (zero, zero, zero);
        let (eu, ev, ex, ew, vu) = (pair, pair, pair, pair, pair);
        let mut cross = Cross { u, v, e, eu, ev, ex, ew, vu };
        let mut sums = SumsByLag::default();
        for first in (0..self.spectrum.power.len()).step_by(BLOCK) {
            let bins = first..self.spectrum.power.len().min(first + BLOCK);
            self.put(bins.clone(), &mut cross);
            let part = |k: usize, i: usize| &self.spectrum.delays[k][i][bins.clone()];
            let n = bins.len();
            let add = |a: &[f64; BLOCK], i: usize, lags: RangeInclusive<usize>, to: &mut ByLag| {
                add_products(simd, &a[..n], lags, |k| part(k, i), to);
            };
            let add_pair =
                |a: &[[f64; BLOCK]; 2], lags: RangeInclusive<usize>, sign: f64, to: &mut ByLag| {
                    let mut parts = [[0.0; HISTORY + 1]; 2];
                    (0..2).for_each(|i| add(&a[i], i, lags.clone(), &mut parts[i]));
                    lags.for_each(|k| to[k] += parts[0][k] + sign * parts[1][k]);
                };
            sums.ee += cross.e[..n].iter().sum::<f64>();
            if p > 0 {
                add(&cross.u, 0, 0..=p - 1, &mut sums.uu);
                add_pair(&cross.eu, 1..=p, -1.0, &mut sums.eu);
            }
            if q > 0 {
                add(&cross.v, 0, 0..=q - 1, &mut sums.vv);
                add_pair(&cross.ev, 1..=q, -1.0, &mut sums.ev);
                add_pair(&cross.ew, 2..=2 * q, -1.0, &mut sums.ew);
            }
            if p > 0 && q > 0 {
                add_pair(&cross.ex, 2..=p + q, -1.0, &mut sums.ex);
                add_pair(&cross.vu, 0..=q - 1, -1.0, &mut sums.v_after_u);
                add_pair(&cross.vu, 0..=p - 1, 1.0, &mut sums.u_after_v);
            }
        }
        sums
    }
}

impl Lagged<'_> {
    /// The product of `a` and a line delayed by `k` is the sum of `Re(c e^{-ikω})`. c is the
    /// spectrum of the line times the conjugate of the spectrum of `a`.
    #[inline(always)]
    fn put(&self, bins: Range<usize>, cross: &mut Cross) {
        let Spectrum { power, delays, .. } = self.spectrum;
        let n = bins.len();
        let (mut ar, mut ma) = ([[0.0; BLOCK]; 2], [[0.0; BLOCK]; 2]);
        (ar[0], ma[0]) = ([1.0; BLOCK], [1.0; BLOCK]);
        for (part, i) in [(0, 0), (1, 1)] {
            for (k, phi) in self.phi.iter().enumerate() {
                let delay = &delays[k + 1][part][bins.clone()];
                ar[i][..n].iter_mut().zip(delay).for_each(|(ar, delay)| *ar -= phi * delay);
            }
            for (k, theta) in self.theta.iter().enumerate() {
                let delay = &delays[k + 1][part][bins.clone()];
                ma[i][..n].iter_mut().zip(delay).for_each(|(ma, delay)| *ma += theta * delay);
            }
        }
        let power = &power[bins];
        for b in 0..n {
            let gain = (ma[0][b] * ma[0][b] + ma[1][b] * ma[1][b]).max(f64::MIN_POSITIVE).recip();
            let (re, im) = (ma[0][b] * gain, -ma[1][b] * gain);
            let (ar_re, ar_im) = (ar[0][b], ar[1][b]);
            let u = power[b] * gain;
            let e = u * (ar_re * ar_re + ar_im * ar_im);
            (cross.u[b], cross.e[b], cross.v[b]) = (u, e, e * gain);
            (cross.eu[0][b], cross.eu[1][b]) = (u * ar_re, -u * ar_im);
            (cross.ev[0][b], cross.ev[1][b]) = (e * re, e * im);
            (cross.ew[0][b], cross.ew[1][b]) = (e * (re * re - im * im), 2.0 * e * re * im);
            (cross.ex[0][b], cross.ex[1][b]) =
                (u * (ar_re * re + ar_im * im), u * (ar_re * im - ar_im * re));
            (cross.vu[0][b], cross.vu[1][b]) =
                (u * (ar_re * re - ar_im * im), u * (ar_re * im + ar_im * re));
        }
    }
}

/// Adds the products of `a` with the delays at the lags of `of`.
#[inline(always)]
fn add_products<'a, S: Simd>(
    simd: S,
    a: &[f64],
    lags: RangeInclusive<usize>,
    of: impl Fn(usize) -> &'a [f64],
    to: &mut ByLag,
) {
    let mut others: [&[f64]; HISTORY + 1] = [&[]; HISTORY + 1];
    lags.clone().for_each(|k| others[k] = of(k));
    let mut row = [0.0; HISTORY + 1];
    against(simd, a, &others[lags.clone()], &mut row[lags.clone()]);
    lags.for_each(|k| to[k] += row[k]);
}

/// The problem of a record in its spectrum; the constant does not change.
#[derive(Debug, Clone, Copy)]
pub struct Guide<'a> {
    pub spectrum: &'a Spectrum,
    pub problem: &'a Conditional<'a>,
}

impl Guide<'_> {
    /// Only the sum of squares.
    pub fn sum_of_squares(&self, point: &[f64]) -> f64 {
        self.normal(point).sum_of_squares
    }
}

impl Problem for Guide<'_> {
    fn normal(&self, point: &[f64]) -> Normal {
        let coefficients = self.problem.coefficients(point);
        let (phi, rest) = coefficients.split_at(self.problem.p);
        let (theta, constant) = rest.split_at(self.problem.q);
        let mut sums = self.spectrum.sums(phi, theta, self.count() as f64);
        if constant.is_empty() {
            let e = phi.len() + theta.len();
            sums.products[e] = sums.products[e + 1];
            sums.products[e][e] = sums.products[e][e + 1];
        }
        self.problem.at_point(point, &sums)
    }

    fn bounds(&self) -> &[f64] {
        self.problem.bounds()
    }

    fn count(&self) -> usize {
        self.problem.count()
    }
}

/// The samples with filled gaps and faded ends, then zeros to a power of two.
fn fade_ends(series: &Series) -> Vec<f64> {
    let n = series.values.len();
    let mut before = 0.0;
    let samples = series.values.iter().map(|z| {
        before = if z.is_finite() { *z } else { before };
        before
    });
    let ramp = FADE_SHARE * n as f64;
    let weighted = samples.enumerate().map(|(t, z)| {
        let from_end = (t.min(n - 1 - t) as f64 + 0.5) / ramp;
        if from_end < 1.0 { z * 0.5 * (1.0 - (PI * from_end).cos()) } else { z }
    });
    work::collect(weighted.chain(std::iter::repeat_n(0.0, n.next_power_of_two() - n)))
}

/// Squared absolute values of a discrete Fourier transform, from frequency 0 to one half; the
/// number of samples is a power of two.
fn periodogram(samples: &[f64]) -> Vec<f64> {
    let half = samples.len() / 2;
    let pairs = samples.chunks_exact(2).map(|pair| Complex { re: pair[0], im: pair[1] });
    let mut both = work::collect(pairs);
    let twiddles = work::collect((0..half).map(|k| Complex::turned(k, samples.len())));
    transform(&mut both, &twiddles);
    // Even samples are the real parts, odd ones the imaginary parts.
    let power = |k: usize| {
        let (here, there) = (both[k], both[(half - k) % half].conjugate());
        let even = here.plus(there).scaled(0.5);
        let odd = here.plus(there.scaled(-1.0)).times(Complex { re: 0.0, im: -0.5 });
        even.plus(odd.times(twiddles[k])).square()
    };
    work::collect((0..half).map(power))
}

/// Discrete Fourier transform in place, for a power of two (Cooley and Tukey), with the first half
/// of the roots of unity.
fn transform(values: &mut [Complex], twiddles: &[Complex]) {
    let n = values.len();
    let unused = usize::BITS - n.trailing_zeros();
    for i in 0..n {
        let j = i.reverse_bits() >> (unused % usize::BITS);
        if i < j {
            values.swap(i, j);
        }
    }
    let mut width = 1;
    while width < n {
        let stride = n / width;
        work::pause();
        for pair in values.chunks_exact_mut(2 * width) {
            let (low, high) = pair.split_at_mut(width);
            for (k, (a, b)) in low.iter_mut().zip(high).enumerate() {
                let turned = b.times(twiddles[k * stride]);
                (*a, *b) = (a.plus(turned), a.plus(turned.scaled(-1.0)));
            }
        }
        width *= 2;
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Complex {
    re: f64,
    im: f64,
}

impl Complex {
    /// `e^{-2πi k/n}`.
    fn turned(k: usize, n: usize) -> Self {
        let angle = TAU * k as f64 / n as f64;
        Self { re: angle.cos(), im: -angle.sin() }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self { re: self.re + other.re, im: self.im + other.im }
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self {
            re: self.re * other.re - self.im * other.im,
            im: self.re * other.im + self.im * other.re,
        }
    }

    #[inline(always)]
    fn scaled(self, factor: f64) -> Self {
        Self { re: self.re * factor, im: self.im * factor }
    }

    #[inline(always)]
    fn conjugate(self) -> Self {
        Self { re: self.re, im: -self.im }
    }

    /// Square of the absolute value.
    #[inline(always)]
    fn square(self) -> f64 {
        self.re * self.re + self.im * self.im
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::{Guide, MIN_SAMPLES, Spectrum, periodogram};
    use crate::identification::arma::conditional::Conditional;
    use crate::identification::arma::descent::Problem;
    use crate::identification::arma::series::Series;

    /// Uniform numbers from -1 to 1 by a linear congruential generator.
    fn noise(n: usize) -> Vec<f64> {
        let next = |state: &u64| {
            Some(
                state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407),
            )
        };
        let states = std::iter::successors(Some(7_u64), next).skip(1).take(n);
        states.map(|state| (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0).collect()
    }

    #[test]
    fn a_periodogram_is_the_sum_by_its_definition() {
        let samples = noise(64);
        for (k, power) in periodogram(&samples).into_iter().enumerate() {
            let part = |shift: f64| {
                let turned =
                    |(t, z): (usize, &f64)| z * (TAU * (t * k) as f64 / 64.0 + shift).cos();
                samples.iter().enumerate().map(turned).sum::<f64>()
            };
            let (re, im) = (part(0.0), part(-0.25 * TAU));
            // Rounding of 64 terms of size one.
            assert!((power - re * re - im * im).abs() < 1e-11, "{k}");
        }
    }

    /// An ARMA(1, 1) process.
    fn coloured(n: usize) -> Series {
        let (mut z, mut before) = (0.0, 0.0);
        let step = |a: f64| {
            z = 0.7 * z + a + 0.4 * before;
            before = a;
            z
        };
        Series::new(noise(n).into_iter().map(step).collect(), true)
    }

    #[test]
    fn a_guide_has_the_sums_of_a_pass() {
        let series = coloured(40_000);
        let spectrum = Spectrum::new(&series).expect("long and whole");
        for (p, q) in [(1, 0), (0, 1), (1, 1), (2, 1), (1, 2), (3, 3)] {
            let problem = Conditional::new(&series, p, q, true, 3);
            let guide = Guide { spectrum: &spectrum, problem: &problem };
            let coefficient = |i: usize| 0.1 * ((3 * i) % 5) as f64 - 0.2;
            // The guide has no constant.
            let point: Vec<f64> = (0..p + q).map(coefficient).chain([0.0]).collect();
            let (pass, guess) = (problem.normal(&point), guide.normal(&point));
            // Each faded end is a fortieth of the record: a few per cent of the chance error of a
            // sum over so many samples.
            let close = |a: f64, b: f64| (a - b).abs() < 0.02 * pass.sum_of_squares;
            assert!(close(pass.sum_of_squares, guess.sum_of_squares));
            for i in 0..p + q {
                assert!(close(pass.descent[i], guess.descent[i]), "({p}, {q}): {i}");
                for j in 0..p + q {
                    assert!(close(pass.gram[(i, j)], guess.gram[(i, j)]), "({p}, {q}): {i} {j}");
                    let bent = (pass.curvature[(i, j)], guess.curvature[(i, j)]);
                    assert!(close(bent.0, bent.1), "({p}, {q}): {i} {j} {bent:?}");
                }
            }
        }
    }

    #[test]
    fn its_slope_is_that_of_its_sum() {
        let series = coloured(MIN_SAMPLES);
        let spectrum = Spectrum::new(&series).expect("long and whole");
        let problem = Conditional::new(&series, 2, 3, true, 3);
        let guide = Guide { spectrum: &spectrum, problem: &problem };
        let point = [0.3, -0.2, 0.25, 0.1, -0.3, 0.0];
        let slope = guide.normal(&point).descent;
        for i in 0..5 {
            let moved = |step: f64| {
                let mut moved = point;
                moved[i] += step;
                guide.sum_of_squares(&moved)
            };
            let difference = (moved(-1e-5) - moved(1e-5)) / 4e-5;
            // Central differences: their own square times the third derivative.
            assert!((difference / slope[i] - 1.0).abs() < 1e-6, "{i}: {difference} {}", slope[i]);
        }
    }

    #[test]
    fn short_records_and_those_with_gaps_have_none() {
        let mut values = noise(MIN_SAMPLES);
        assert!(Spectrum::new(&Series::new(values[1..].to_vec(), true)).is_none());
        values.iter_mut().step_by(9).for_each(|z| *z = f64::NAN);
        assert!(Spectrum::new(&Series::new(values.clone(), true)).is_none());
        values
            .iter_mut()
            .skip(MIN_SAMPLES / 2)
            .for_each(|z| *z = if z.is_nan() { 0.0 } else { *z });
        assert!(Spectrum::new(&Series::new(values, true)).is_some());
    }
}
