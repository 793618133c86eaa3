//! The arithmetic of a step, for sizes known when it is compiled or when it runs.
//!
//! Matrices stand row after row. Where channels have one model and miss the same samples, they have one
//! covariance, and [`advance`] takes several of them at once.
#![allow(non_snake_case)]

use core::ops::{Add, Mul, Sub};

use nalgebra::ComplexField;
use wide::{f64x2, f64x4};

use crate::math::{Fours, OnRows, Pairs, widest};

/// Largest element of F, B and H.
pub const MAX_ELEMENT: f64 = 1e30;
/// Largest element of Q, R and the initial covariance, and largest trace of a covariance.
pub const MAX_VARIANCE: f64 = 1e60;
/// Largest measurement and input; what is larger is missing.
pub const MAX_SAMPLE: f64 = 1e150;
/// Largest state; what would be larger is held there.
pub const MAX_STATE: f64 = 1e150;
/// Variance of an innovation that none can have: nothing is divided by a smaller one.
const MIN_PIVOT: f64 = 1e-100;
/// Variance too small to be computed with.
pub(super) const MIN_VARIANCE: f64 = 1e-250;
/// What one rounding costs, relative to the terms of a sum; and what may have cost a covariance its
/// definiteness, relative to its variances, a state.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Channels of one covariance that are taken at once.
pub(super) const LANES: usize = 4;

/// States and measurements.
pub(super) trait Size: Copy {
    /// The same states, whatever is measured: what needs no more is compiled once for them.
    type States: Size;
    /// A number for each state, and one for each measurement: in registers where the compiler knows
    /// how many.
    type Column<'a, T: Copy + 'a>: AsMut<[T]>;
    type Row<'a, T: Copy + 'a>: AsMut<[T]>;
    /// Whether so little is done for them that a call would take longer.
    const IS_SMALL: bool;

    fn n(self) -> usize;
    fn m(self) -> usize;
    fn states(self) -> Self::States;
    /// Both to write into, in this room if the size is not known before it runs.
    fn column<'a, T: Copy + 'a>(self, zero: T, room: &'a mut [T]) -> Self::Column<'a, T>;
    fn row<'a, T: Copy + 'a>(self, zero: T, room: &'a mut [T]) -> Self::Row<'a, T>;
}

/// Sizes that the compiler knows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fixed<const N: usize, const M: usize>;

impl<const N: usize, const M: usize> Size for Fixed<N, M> {
    type States = Fixed<N, 1>;
    type Column<'a, T: Copy + 'a> = [T; N];
    type Row<'a, T: Copy + 'a> = [T; M];
    const IS_SMALL: bool = N <= 4;

    #[inline(always)]
    fn n(self) -> usize {
        N
    }

    #[inline(always)]
    fn states(self) -> Fixed<N, 1> {
        Fixed
    }

    #[inline(always)]
    fn m(self) -> usize {
        M
    }

    #[inline(always)]
    fn column<'a, T: Copy + 'a>(self, zero: T, _: &'a mut [T]) -> [T; N] {
        [zero; N]
    }

    #[inline(always)]
    fn row<'a, T: Copy + 'a>(self, zero: T, _: &'a mut [T]) -> [T; M] {
        [zero; M]
    }
}

/// Room for what a step computes on its way.
#[derive(Debug)]
pub(super) struct Work<'a> {
    /// n × n: I - K H, room for two, K R Kᵀ.
    pub a: &'a mut [f64],
    pub b: &'a mut [f64],
    pub c: &'a mut [f64],
    pub d: &'a mut [f64],
    /// m × n: H P, L⁻¹ H P, the transposed gain, the rows of H that count, R Kᵀ.
    pub hp: &'a mut [f64],
    pub v: &'a mut [f64],
    pub k: &'a mut [f64],
    pub h: &'a mut [f64],
    /// m × m: the factor L, R of what counts.
    pub l: &'a mut [f64],
    pub r: &'a mut [f64],
    pub rk: &'a mut [f64],
    /// m: reciprocals of the diagonal D, and what counts.
    pub inverse: &'a mut [f64],
    pub counts: &'a mut [bool],
    /// n: variances before the step.
    pub before: &'a mut [f64],
    /// n, n and m: states, those predicted, and D⁻¹ L⁻¹ y of one channel and
    /// of several; empty where they are [columns](Size::Column) of their own.
    pub one: [&'a mut [f64]; 3],
    #[cfg_attr(not(feature = "std"), allow(dead_code))]
    pub several: [&'a mut [f64x4]; 3],
}

/// Room of a fixed size.
#[derive(Debug)]
pub(super) struct FixedRoom<const N: usize, const M: usize> {
    a: [[f64; N]; N],
    b: [[f64; N]; N],
    c: [[f64; N]; N],
    d: [[f64; N]; N],
    hp: [[f64; N]; M],
    v: [[f64; N]; M],
    k: [[f64; N]; M],
    h: [[f64; N]; M],
    l: [[f64; M]; M],
    r: [[f64; M]; M],
    rk: [[f64; N]; M],
    inverse: [f64; M],
    counts: [bool; M],
    before: [f64; N],
}

impl<const N: usize, const M: usize> FixedRoom<N, M> {
    #[inline(always)]
    pub fn new() -> Self {
        Self {
            a: [[0.0; N]; N],
            b: [[0.0; N]; N],
            c: [[0.0; N]; N],
            d: [[0.0; N]; N],
            hp: [[0.0; N]; M],
            v: [[0.0; N]; M],
            k: [[0.0; N]; M],
            h: [[0.0; N]; M],
            l: [[0.0; M]; M],
            r: [[0.0; M]; M],
            rk: [[0.0; N]; M],
            inverse: [0.0; M],
            counts: [false; M],
            before: [0.0; N],
        }
    }

    #[inline(always)]
    pub fn work(&mut self) -> Work<'_> {
        Work {
            a: self.a.as_flattened_mut(),
            b: self.b.as_flattened_mut(),
            c: self.c.as_flattened_mut(),
            d: self.d.as_flattened_mut(),
            hp: self.hp.as_flattened_mut(),
            v: self.v.as_flattened_mut(),
            k: self.k.as_flattened_mut(),
            h: self.h.as_flattened_mut(),
            l: self.l.as_flattened_mut(),
            r: self.r.as_flattened_mut(),
            rk: self.rk.as_flattened_mut(),
            inverse: &mut self.inverse,
            counts: &mut self.counts,
            before: &mut self.before,
            one: [&mut [], &mut [], &mut []],
            several: [&mut [], &mut [], &mut []],
        }
    }
}

/// What the variances of the innovations say beside the gain.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weighed {
    /// -½ log det(2π S) of what corrects.
    pub log_density: f64,
}

/// P ← F P Fᵀ + Q.
#[inline(always)]
pub(super) fn predict_covariance<S: Size>(
    size: S,
    F: &[f64],
    Q: &[f64],
    P: &mut [f64],
    work: &mut Work<'_>,
) {
    transform(size.states(), F, Q, P, work.b, work.c, work.before);
}

/// The gain of the measurements that count, and P ← (I - K H) P (I - K H)ᵀ + K R Kᵀ.
///
/// With S = H P Hᵀ + R = L D Lᵀ, Cholesky's factors without roots, `v` is L⁻¹ H P and `k` the transposed
/// gain L⁻ᵀ D⁻¹ v.
#[inline(always)]
pub(super) fn correct_covariance<S: Size>(
    size: S,
    H: &[f64],
    R: &[f64],
    P: &mut [f64],
    work: &mut Work<'_>,
) -> Weighed {
    let (n, m) = (size.n(), size.m());
    let Work { a, b, c, d, hp, v, k, h, l, r, rk, inverse, counts, before, .. } = work;
    let (mut H, mut R) = (&H[..m * n], &R[..m * m]);
    if counts.iter().any(|counts| !counts) {
        h.copy_from_slice(H);
        r.copy_from_slice(R);
        choose(n, m, counts, h, r);
        (H, R) = (h, r);
    }
    product(Pairs, false, [m, n, n], H, P, hp);
    innovation_covariance(n, m, H, R, P, hp, l);
    let weighed = factorise(n, m, counts, l, inverse);
    gain(n, m, hp, l, inverse, v, k);
    transpose(m, n, k, hp);
    let joseph = Joseph { size, H, R, k: hp, kt: k, rk, a, d };
    if S::IS_SMALL {
        joseph.run(Pairs)
    } else {
        apart(joseph)
    }
    transform(size.states(), a, d, P, b, c, before);
    weighed
}

/// Does work in the widest registers, in a function of its own.
#[inline(never)]
fn apart<W: OnRows<Output = ()>>(work: W) {
    widest(work);
}

/// I - K H and the upper triangle of K R Kᵀ.
struct Joseph<'a, S> {
    size: S,
    H: &'a [f64],
    R: &'a [f64],
    k: &'a [f64],
    kt: &'a [f64],
    rk: &'a mut [f64],
    a: &'a mut [f64],
    d: &'a mut [f64],
}

impl<S: Size> OnRows for Joseph<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run<F: Fours>(self, fours: F) {
        let Self { size, H, R, k, kt, rk, a, d } = self;
        let (n, m) = (size.n(), size.m());
        product(fours, false, [m, m, n], R, kt, rk);
        product(fours, true, [n, m, n], k, rk, d);
        product(fours, false, [n, m, n], k, H, a);
        for i in 0..n {
            for j in 0..n {
                let one = if i == j { 1.0 } else { 0.0 };
                a[i * n + j] = one - a[i * n + j];
            }
        }
    }
}

/// P ← A P Aᵀ + D, of D the upper triangle.
#[inline(always)]
fn transform<S: Size>(
    size: S,
    A: &[f64],
    D: &[f64],
    P: &mut [f64],
    ap: &mut [f64],
    room: &mut [f64],
    before: &mut [f64],
) {
    if S::IS_SMALL {
        transform_by(Pairs, size, A, D, P, ap, room, before);
    } else {
        apart(Transform { size, A, D, P, ap, room, before });
    }
}

struct Transform<'a, S> {
    size: S,
    A: &'a [f64],
    D: &'a [f64],
    P: &'a mut [f64],
    ap: &'a mut [f64],
    room: &'a mut [f64],
    before: &'a mut [f64],
}

impl<S: Size> OnRows for Transform<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run<F: Fours>(self, fours: F) {
        let Self { size, A, D, P, ap, room, before } = self;
        transform_by(fours, size, A, D, P, ap, room, before);
    }
}

#[inline(always)]
#[expect(
    clippy::too_many_arguments,
    reason = "parts of a structure would be read anew after each write, which few states would feel"
)]
fn transform_by<S: Size, F: Fours>(
    fours: F,
    size: S,
    A: &[f64],
    D: &[f64],
    P: &mut [f64],
    ap: &mut [f64],
    room: &mut [f64],
    before: &mut [f64],
) {
    let n = size.n();
    let (A, D, P) = (&A[..n * n], &D[..n * n], &mut P[..n * n]);
    let (ap, room) = (&mut ap[..n * n], &mut room[..n * n]);
    for i in 0..n {
        before[i] = P[i * n + i];
    }
    product(fours, false, [n; 3], A, P, ap);
    transpose(n, n, A, room);
    product(fours, true, [n; 3], ap, room, P);
    // Row by row, as it is read again: what stands in pieces is late.
    let mut trace = 0.0;
    for i in 0..n {
        for j in i..n {
            room[i * n + j] = P[i * n + j] + D[i * n + j];
        }
        trace += room[i * n + i];
    }
    for i in 0..n {
        for j in 0..n {
            P[i * n + j] = room[i.min(j) * n + i.max(j)];
        }
    }
    if trace > MAX_VARIANCE {
        shrink(P, MAX_VARIANCE / trace);
    }
    if !is_left(n, P, n as f64 * ROUNDING, room) {
        repair(n, A, D, before, P, room);
    }
}

/// Makes of measurements that do not count some that say nothing: H = 0, R = 1.
#[cold]
#[inline(never)]
fn choose(n: usize, m: usize, counts: &[bool], H: &mut [f64], R: &mut [f64]) {
    for i in (0..m).filter(|i| !counts[*i]) {
        H[i * n..][..n].fill(0.0);
        for j in 0..m {
            (R[i * m + j], R[j * m + i]) = (0.0, 0.0);
        }
        R[i * m + i] = 1.0;
    }
}

/// S = H P Hᵀ + R, of which the lower triangle.
#[inline(always)]
fn innovation_covariance(
    n: usize,
    m: usize,
    H: &[f64],
    R: &[f64],
    P: &[f64],
    hp: &[f64],
    S: &mut [f64],
) {
    let (P, hp, S) = (&P[..n * n], &hp[..m * n], &mut S[..m * m]);
    for i in 0..m {
        for j in 0..=i {
            let mut sum = R[i * m + j];
            for h in 0..n {
                sum += hp[i * n + h] * H[j * n + h];
            }
            S[i * m + j] = sum;
        }
        // What rounding leaves of states that cancel each other is no knowledge.
        let mut terms = 0.0;
        for h in 0..n {
            terms += H[i * n + h] * H[i * n + h] * P[h * n + h];
        }
        S[i * m + i] += (n * n) as f64 * f64::EPSILON * terms;
    }
}

/// L D Lᵀ = S in place of it, D on the diagonal; a row that is left out has a reciprocal of zero.
#[inline(always)]
fn factorise(n: usize, m: usize, counts: &[bool], S: &mut [f64], inverse: &mut [f64]) -> Weighed {
    let mut log_density = 0.0;
    let S = &mut S[..m * m];
    for j in 0..m {
        let variance = S[j * m + j];
        let mut pivot = variance;
        for h in 0..j {
            pivot -= S[j * m + h] * S[j * m + h] * S[h * m + h];
        }
        let known = (n + m) as f64 * ROUNDING * variance;
        if !(pivot > known && pivot > MIN_PIVOT) {
            inverse[j] = 0.0;
            for i in j..m {
                S[i * m + j] = 0.0;
            }
            continue;
        }
        if counts[j] {
            log_density -= 0.5 * ComplexField::ln(core::f64::consts::TAU * pivot);
        }
        (S[j * m + j], inverse[j]) = (pivot, 1.0 / pivot);
        for i in j + 1..m {
            let mut sum = S[i * m + j];
            for h in 0..j {
                sum -= S[i * m + h] * S[j * m + h] * S[h * m + h];
            }
            S[i * m + j] = sum * inverse[j];
        }
    }
    Weighed { log_density }
}

/// v = L⁻¹ H P and k = L⁻ᵀ D⁻¹ v, the transposed gain.
#[inline(always)]
fn gain(n: usize, m: usize, hp: &[f64], l: &[f64], inverse: &[f64], v: &mut [f64], k: &mut [f64]) {
    let (hp, l) = (&hp[..m * n], &l[..m * m]);
    let (v, k) = (&mut v[..m * n], &mut k[..m * n]);
    for j in 0..m {
        for i in 0..n {
            let mut sum = hp[j * n + i];
            for h in 0..j {
                sum -= l[j * m + h] * v[h * n + i];
            }
            v[j * n + i] = sum;
        }
    }
    for j in (0..m).rev() {
        for i in 0..n {
            let mut sum = v[j * n + i] * inverse[j];
            for h in j + 1..m {
                sum -= l[h * m + j] * k[h * n + i];
            }
            k[j * n + i] = sum;
        }
    }
}

/// What a step does to the states of channels with one covariance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Advance<'a> {
    /// F, B and the inputs, p a channel, of a prediction.
    pub predict: Option<(&'a [f64], &'a [f64], &'a [f64])>,
    /// H, the measurements and what was weighed, of a correction; if none counts nothing was.
    pub correct: Option<(&'a [f64], &'a [f64], Option<Weighed>)>,
}

/// What becomes of channels: states, innovations, sums of the squares of the whitened innovations,
/// log-likelihoods.
#[derive(Debug)]
pub(super) struct ChannelOutputs<'a> {
    pub state: &'a mut [f64],
    pub innovation: &'a mut [f64],
    pub nis: &'a mut [f64],
    pub log_likelihood: &'a mut [f64],
}

/// x ← F x + B u, then x ← x + K (z - H x), of one channel.
#[inline(never)]
pub(super) fn advance_one<S: Size>(
    size: S,
    channel: usize,
    step: &Advance<'_>,
    outputs: &mut ChannelOutputs<'_>,
    work: &mut Work<'_>,
) {
    let Work { counts, l, inverse, v, one, .. } = work;
    advance(size, channel, step, &Gain { counts, l, inverse, v }, outputs, one);
}

/// The same of so many times [`LANES`] channels, that many at once.
#[cfg(feature = "std")]
#[inline(never)]
pub(super) fn advance_several<S: Size>(
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

/// What [`correct_covariance`] leaves for the states.
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

/// x ← x + K (z - H x); the square of the innovation relative to S.
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

/// The number of one channel, or those of several: to each the same is done.
trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    const COUNT: usize;

    fn of(x: f64) -> Self;
    /// The number at a place of each channel's row, of `width` numbers.
    fn read(width: usize, index: usize, rows: &[f64]) -> Self;
    /// The same of an input; a missing one is none.
    fn read_input(width: usize, index: usize, rows: &[f64]) -> Self;
    fn write(self, width: usize, index: usize, rows: &mut [f64]);
    /// Within ±[`MAX_STATE`].
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

/// Whether a measurement or an input is there.
#[inline(always)]
pub(super) fn is_known(z: f64) -> bool {
    z.abs() <= MAX_SAMPLE
}

/// c = a b, of sizes rows × inner and inner × columns; of a square the `upper` triangle at least.
#[inline(always)]
pub(super) fn product<F: Fours>(
    fours: F,
    upper: bool,
    [rows, inner, columns]: [usize; 3],
    a: &[f64],
    b: &[f64],
    c: &mut [f64],
) {
    let (a, b, c) = (&a[..rows * inner], &b[..inner * columns], &mut c[..rows * columns]);
    for i in 0..rows {
        let row = &a[i * inner..][..inner];
        let out = &mut c[i * columns..][..columns];
        let mut j = if upper { i - i % 4 } else { 0 };
        while j + 4 <= columns {
            four(fours, row, b, columns, j, out);
            j += 4;
        }
        // In smaller ones a number written alone would be read with its neighbour too soon.
        if j + 2 <= columns && columns > 3 {
            tile(row, b, columns, j, out, f64x2::from, f64x2::to_array);
            j += 2;
        }
        while j < columns {
            tile(row, b, columns, j, out, |[b]: [f64; 1]| b, |b| [b]);
            j += 1;
        }
    }
}

/// Four elements of a row of a product, summed in registers.
#[inline(always)]
fn four<F: Fours>(fours: F, row: &[f64], b: &[f64], columns: usize, j: usize, out: &mut [f64]) {
    let mut sum = fours.splat(0.0);
    for (h, factor) in row.iter().enumerate() {
        let Some(b) = b.get(h * columns + j..).and_then(|b| b.first_chunk()) else { return };
        sum = fours.add_product(sum, fours.splat(*factor), fours.of(*b));
    }
    if let Some(out) = out.get_mut(j..).and_then(|out| out.first_chunk_mut()) {
        *out = fours.numbers(sum);
    }
}

/// Two, or one.
#[inline(always)]
fn tile<T, const W: usize>(
    row: &[f64],
    b: &[f64],
    columns: usize,
    j: usize,
    out: &mut [f64],
    of: impl Fn([f64; W]) -> T,
    array: impl Fn(T) -> [f64; W],
) where
    T: Copy + Add<Output = T> + Mul<Output = T>,
{
    let mut sum = of([0.0; W]);
    for (h, factor) in row.iter().enumerate() {
        let Some(b) = b.get(h * columns + j..).and_then(|b| b.first_chunk()) else { return };
        sum = sum + of([*factor; W]) * of(*b);
    }
    if let Some(out) = out.get_mut(j..).and_then(|out| out.first_chunk_mut()) {
        *out = array(sum);
    }
}

/// b = aᵀ, of size rows × columns.
#[inline(always)]
pub(super) fn transpose(rows: usize, columns: usize, a: &[f64], b: &mut [f64]) {
    let (a, b) = (&a[..rows * columns], &mut b[..rows * columns]);
    for i in 0..rows {
        for j in 0..columns {
            b[j * rows + i] = a[i * columns + j];
        }
    }
}

#[cold]
#[inline(never)]
fn shrink(P: &mut [f64], factor: f64) {
    P.iter_mut().for_each(|p| *p *= factor);
}

/// Whether P and `tolerance` times its diagonal are a covariance, by elimination: no size of a state
/// hides another one. A state without variance must have no covariances.
#[inline(always)]
pub(super) fn is_semidefinite(n: usize, P: &[f64], tolerance: f64, room: &mut [f64]) -> bool {
    room.copy_from_slice(P);
    is_left(n, P, tolerance, room)
}

/// The same with the upper triangle of P, or of a multiple of it, in the room.
#[inline(always)]
fn is_left(n: usize, P: &[f64], tolerance: f64, room: &mut [f64]) -> bool {
    let (P, room) = (&P[..n * n], &mut room[..n * n]);
    let mut so = true;
    for j in 0..n {
        room[j * n + j] += tolerance * room[j * n + j].abs();
    }
    for j in 0..n {
        let pivot = room[j * n + j];
        if pivot <= 0.0 || pivot.is_nan() {
            let none = P[j * n..][..n].iter().all(|p| *p == 0.0);
            so &= none;
            continue;
        }
        so &= P[j * n + j] > 0.0;
        let inverse = 1.0 / pivot;
        let (above, below) = room.split_at_mut((j + 1) * n);
        let above = &above[j * n..];
        for i in j + 1..n {
            let factor = above[i] * inverse;
            // From an even place on: two at once.
            for h in i - i % 2..n {
                below[(i - j - 1) * n + h] -= factor * above[h];
            }
        }
    }
    so
}

/// Makes a covariance of A P Aᵀ + D, which rounding has made indefinite: adds to each variance what
/// rounding may have cost it, then weakens the correlations until it is one.
#[cold]
#[inline(never)]
fn repair(n: usize, A: &[f64], D: &[f64], before: &[f64], P: &mut [f64], room: &mut [f64]) {
    for i in 0..n {
        let mut spread = 0.0;
        for h in 0..n {
            spread += A[i * n + h].abs() * ComplexField::sqrt(before[h].max(0.0));
        }
        let lost = n as f64 * ROUNDING * (spread * spread + D[i * n + i].max(0.0));
        let variance = P[i * n + i].max(0.0) + lost;
        P[i * n + i] = variance.min(MAX_VARIANCE);
        if variance < MIN_VARIANCE {
            for h in 0..n {
                (P[i * n + h], P[h * n + i]) = (0.0, 0.0);
            }
        }
    }
    let mut weaker = n as f64 * ROUNDING;
    // At last nothing is left but the variances.
    while weaker < 4.0 && !is_semidefinite(n, P, 0.5 * n as f64 * ROUNDING, room) {
        for i in 0..n {
            for j in 0..n {
                if i != j {
                    P[i * n + j] *= (1.0 - weaker).max(0.0);
                }
            }
        }
        weaker *= 4.0;
    }
}
