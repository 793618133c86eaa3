//! States of channels in a prediction and a correction, for one channel or several at once.
#![allow(non_snake_case)]

use core::ops::{Add, Mul, Sub};

use wide::f64x4;

use super::covariance::Weighed;
use super::size::{Size, Work};
use super::{LANES, MAX_SAMPLE, MAX_STATE};

/// Effect of a step on the states of channels with one covariance.
#[derive(Debug, Clone, Copy)]
pub(in crate::linear) struct Advance<'a> {
    /// F, B and the inputs, p per channel, of a prediction.
    pub predict: Option<(&'a [f64], &'a [f64], &'a [f64])>,
    /// H, the measurements and their weights, of a correction; `None` if no measurement is used.
    pub correct: Option<(&'a [f64], &'a [f64], Option<Weighed>)>,
}

/// Outputs of channels: states, innovations, sums of the squared whitened innovations, and
/// log-likelihoods.
#[derive(Debug)]
pub(in crate::linear) struct ChannelOutputs<'a> {
    pub state: &'a mut [f64],
    pub innovation: &'a mut [f64],
    pub nis: &'a mut [f64],
    pub log_likelihood: &'a mut [f64],
}

/// x ← F x + B u, then x ← x + K (z - H x), for one channel.
#[inline(never)]
pub(in crate::linear) fn advance_one<S: Size>(
    size: S,
    channel: usize,
    step: &Advance<'_>,
    outputs: &mut ChannelOutputs<'_>,
    work: &mut Work<'_>,
) {
    let Work { counts, l, inverse, v, one, .. } = work;
    advance(size, channel, step, &Gain { counts, l, inverse, v }, outputs, one);
}

/// Advances a multiple of [`LANES`] channels, several at once.
#[cfg(feature = "std")]
#[inline(never)]
pub(in crate::linear) fn advance_several<S: Size>(
    size: S,
    channels: core::ops::Range<usize>,
    step: &Advance<'_>,
    outputs: &mut ChannelOutputs<'_>,
    work: &mut Work<'_>,
) {
    let Work { counts, l, inverse, v, several, .. } = work;
    let gain = Gain { counts, l, inverse, v };
    for first in channels.step_by(LANES) {
        advance(size, first, step, &gain, outputs, several);
    }
}

/// Results of [`correct_covariance`] for the states.
#[derive(Debug, Clone, Copy)]
struct Gain<'a> {
    counts: &'a [bool],
    l: &'a [f64],
    inverse: &'a [f64],
    v: &'a [f64],
}

#[inline(always)]
fn advance<S: Size, T: Lanes>(
    size: S,
    first: usize,
    step: &Advance<'_>,
    gain: &Gain<'_>,
    outputs: &mut ChannelOutputs<'_>,
    [x, next, w]: &mut [&mut [T]; 3],
) {
    let (n, m) = (size.n(), size.m());
    let state = &mut outputs.state[first * n..][..T::COUNT * n];
    let zero = T::of(0.0);
    let (mut x, mut next) = (size.column(zero, x), size.column(zero, next));
    let mut w = size.row(zero, w);
    let (x, next) = (&mut x.as_mut()[..n], &mut next.as_mut()[..n]);
    let w = &mut w.as_mut()[..m];
    for i in 0..n {
        x[i] = T::read(n, i, state);
    }
    if let Some((F, B, u)) = step.predict {
        let (F, p) = (&F[..n * n], B.len() / n);
        for i in 0..n {
            let mut sum = T::of(0.0);
            for j in 0..n {
                sum = sum + T::of(F[i * n + j]) * x[j];
            }
            for j in 0..p {
                let u = T::read_input(p, j, &u[first * p..][..T::COUNT * p]);
                sum = sum + T::of(B[i * p + j]) * u;
            }
            next[i] = sum.bound();
        }
        x.copy_from_slice(next);
    }
    if let Some((H, z, weighed)) = step.correct {
        let z = &z[first * m..][..T::COUNT * m];
        let innovation = &mut outputs.innovation[first * m..][..T::COUNT * m];
        let nis = &mut outputs.nis[first..][..T::COUNT];
        let log_likelihood = &mut outputs.log_likelihood[first..][..T::COUNT];
        if let Some(weighed) = weighed {
            let squares = correct(size, H, z, gain, innovation, x, w);
            squares.write(1, 0, nis);
            let density = T::of(weighed.log_density) - T::of(0.5) * squares;
            density.write(1, 0, log_likelihood);
        } else {
            innovation.fill(f64::NAN);
            nis.fill(f64::NAN);
            log_likelihood.fill(0.0);
        }
    }
    for i in 0..n {
        x[i].write(n, i, state);
    }
}

/// x ← x + K (z - H x); returns the square of the innovation relative to S.
#[inline(always)]
fn correct<S: Size, T: Lanes>(
    size: S,
    H: &[f64],
    z: &[f64],
    gain: &Gain<'_>,
    innovation: &mut [f64],
    x: &mut [T],
    w: &mut [T],
) -> T {
    let (n, m) = (size.n(), size.m());
    let (H, v, l) = (&H[..m * n], &gain.v[..m * n], &gain.l[..m * m]);
    let mut squares = T::of(0.0);
    for j in 0..m {
        if !gain.counts[j] {
            T::of(f64::NAN).write(m, j, innovation);
            w[j] = T::of(0.0);
            continue;
        }
        let mut y = T::of(0.0);
        for h in 0..n {
            y = y + T::of(H[j * n + h]) * x[h];
        }
        y = T::read(m, j, z) - y;
        y.write(m, j, innovation);
        for h in 0..j {
            y = y - T::of(l[j * m + h] * l[h * m + h]) * w[h];
        }
        let whitened = y.bound();
        w[j] = (whitened * T::of(gain.inverse[j])).bound();
        squares = squares + whitened * w[j];
    }
    for i in 0..n {
        let mut sum = T::of(0.0);
        for j in 0..m {
            sum = sum + T::of(v[j * n + i]) * w[j];
        }
        x[i] = (x[i] + sum).bound();
    }
    squares
}

/// The number of one channel, or the numbers of several; each number is treated in the same way.
trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    const COUNT: usize;

    fn of(x: f64) -> Self;
    /// The number at an index of each channel's row, which has `width` numbers.
    fn read(width: usize, index: usize, rows: &[f64]) -> Self;
    /// The input at an index of each channel's row; a missing input is zero.
    fn read_input(width: usize, index: usize, rows: &[f64]) -> Self;
    fn write(self, width: usize, index: usize, rows: &mut [f64]);
    /// The number limited to ±[`MAX_STATE`].
    fn bound(self) -> Self;
}

impl Lanes for f64 {
    const COUNT: usize = 1;

    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn read(_: usize, index: usize, rows: &[f64]) -> Self {
        rows[index]
    }

    #[inline(always)]
    fn read_input(_: usize, index: usize, rows: &[f64]) -> Self {
        if is_known(rows[index]) { rows[index] } else { 0.0 }
    }

    #[inline(always)]
    fn write(self, _: usize, index: usize, rows: &mut [f64]) {
        rows[index] = self;
    }

    #[inline(always)]
    fn bound(self) -> Self {
        self.clamp(-MAX_STATE, MAX_STATE)
    }
}

impl Lanes for f64x4 {
    const COUNT: usize = LANES;

    #[inline(always)]
    fn of(x: f64) -> Self {
        Self::splat(x)
    }

    #[inline(always)]
    fn read(width: usize, index: usize, rows: &[f64]) -> Self {
        let rows = &rows[..LANES * width];
        Self::from([0, 1, 2, 3].map(|lane| rows[lane * width + index]))
    }

    #[inline(always)]
    fn read_input(width: usize, index: usize, rows: &[f64]) -> Self {
        let rows = &rows[..LANES * width];
        Self::from([0, 1, 2, 3].map(|lane| {
            let u = rows[lane * width + index];
            if is_known(u) { u } else { 0.0 }
        }))
    }

    #[inline(always)]
    fn write(self, width: usize, index: usize, rows: &mut [f64]) {
        let rows = &mut rows[..LANES * width];
        for (lane, x) in self.to_array().into_iter().enumerate() {
            rows[lane * width + index] = x;
        }
    }

    #[inline(always)]
    fn bound(self) -> Self {
        self.fast_max(Self::splat(-MAX_STATE)).fast_min(Self::splat(MAX_STATE))
    }
}

/// True if a measurement or an input is present.
#[inline(always)]
pub(in crate::linear) fn is_known(z: f64) -> bool {
    z.abs() <= MAX_SAMPLE
}
