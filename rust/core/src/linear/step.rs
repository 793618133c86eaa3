//! The arithmetic of a step, for sizes known when it is compiled or when it runs.
//!
//! Matrices stand row after row. Where channels have one model and miss the same samples, they have one
//! covariance, and [`advance`] takes several of them at once.
#![allow(non_snake_case)]

use nalgebra::ComplexField;

/// Largest element of F, B and H.
pub const ELEMENT_MAX: f64 = 1e30;
/// Largest element of Q, R and the initial covariance, and largest trace of a covariance.
pub const VARIANCE_MAX: f64 = 1e60;
/// Largest measurement and input; what is larger is missing.
pub const SAMPLE_MAX: f64 = 1e150;
/// Largest state; what would be larger is held there.
pub const STATE_MAX: f64 = 1e150;
/// Variance of an innovation that none can have: nothing is divided by a smaller one.
const PIVOT_MIN: f64 = 1e-100;
/// Variance too small to be computed with.
pub(super) const VARIANCE_MIN: f64 = 1e-250;
/// What one rounding costs, relative to the terms of a sum; and what may have cost a covariance its
/// definiteness, relative to its variances, a state.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Channels of one covariance that are taken at once.
pub(super) const LANES: usize = 8;

/// States and measurements.
pub(super) trait Size: Copy {
    /// The same states, whatever is measured: what needs no more is compiled once for them.
    type States: Size;
    /// Whether so little is done for them that a call would take longer.
    const FEW: bool;

    fn n(self) -> usize;
    fn m(self) -> usize;
    fn states(self) -> Self::States;
}

/// Sizes that the compiler knows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fixed<const N: usize, const M: usize>;

impl<const N: usize, const M: usize> Size for Fixed<N, M> {
    type States = Fixed<N, 1>;
    const FEW: bool = N <= 4;

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
    /// n, n and m: states, those predicted, and D⁻¹ L⁻¹ y of some channels.
    pub x: &'a mut [[f64; LANES]],
    pub next: &'a mut [[f64; LANES]],
    pub w: &'a mut [[f64; LANES]],
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
    x: [[f64; LANES]; N],
    next: [[f64; LANES]; N],
    w: [[f64; LANES]; M],
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
            x: [[0.0; LANES]; N],
            next: [[0.0; LANES]; N],
            w: [[0.0; LANES]; M],
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
            x: &mut self.x,
            next: &mut self.next,
            w: &mut self.w,
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
    product(false, m, n, n, H, P, hp);
    innovation_covariance(n, m, H, R, P, hp, l);
    let weighed = factorise(n, m, counts, l, inverse);
    gain(n, m, hp, l, inverse, v, k);
    // K R Kᵀ and I - K H, of which `k` is the transposed K.
    product(false, m, m, n, R, k, rk);
    transpose(m, n, k, hp);
    product(true, n, m, n, hp, rk, d);
    product(false, n, m, n, hp, H, a);
    for i in 0..n {
        for j in 0..n {
            let one = if i == j { 1.0 } else { 0.0 };
            a[i * n + j] = one - a[i * n + j];
        }
    }
    transform(size.states(), a, d, P, b, c, before);
    weighed
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
    if S::FEW {
        transform_here(size, A, D, P, ap, room, before);
    } else {
        transform_apart(size, A, D, P, ap, room, before);
    }
}

#[inline(never)]
fn transform_apart<S: Size>(
    size: S,
    A: &[f64],
    D: &[f64],
    P: &mut [f64],
    ap: &mut [f64],
    room: &mut [f64],
    before: &mut [f64],
) {
    widest(
        #[inline(always)]
        || transform_here(size, A, D, P, ap, room, before),
    );
}

/// Does the work with the widest registers that there are; they change no bit.
#[inline(always)]
fn widest(work: impl FnOnce()) {
    #[cfg(feature = "std")]
    pulp::Arch::new().dispatch(work);
    #[cfg(not(feature = "std"))]
    work();
}

#[inline(always)]
fn transform_here<S: Size>(
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
    product(false, n, n, n, A, P, ap);
    transpose(n, n, A, room);
    product(true, n, n, n, ap, room, P);
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
    if trace > VARIANCE_MAX {
        shrink(P, VARIANCE_MAX / trace);
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
        if !(pivot > known && pivot > PIVOT_MIN) {
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
pub(super) struct Places<'a> {
    pub state: &'a mut [f64],
    pub innovation: &'a mut [f64],
    pub nis: &'a mut [f64],
    pub log_likelihood: &'a mut [f64],
}

/// x ← F x + B u, then x ← x + K (z - H x), of `L` channels from `first` on.
#[inline(always)]
pub(super) fn advance<S: Size, const L: usize>(
    size: S,
    first: usize,
    step: &Advance<'_>,
    places: &mut Places<'_>,
    work: &mut Work<'_>,
) {
    let (n, m) = (size.n(), size.m());
    let state = &mut places.state[first * n..][..L * n];
    let Some((H, z, weighed)) = step.correct else {
        let (correct, none) = (None, &mut [0.0; L]);
        return of_lanes::<S, L>(
            size,
            step,
            first,
            correct,
            state,
            &mut [],
            none,
            work.x,
            work.next,
            work.w,
        );
    };
    let innovation = &mut places.innovation[first * m..][..L * m];
    let nis = &mut places.nis[first..][..L];
    let log_likelihood = &mut places.log_likelihood[first..][..L];
    let Some(weighed) = weighed else {
        innovation.fill(f64::NAN);
        nis.fill(f64::NAN);
        log_likelihood.fill(0.0);
        let (correct, none) = (None, &mut [0.0; L]);
        return of_lanes::<S, L>(
            size,
            step,
            first,
            correct,
            state,
            &mut [],
            none,
            work.x,
            work.next,
            work.w,
        );
    };
    let z = &z[first * m..][..L * m];
    let Work { counts, l, inverse, v, .. } = work;
    let correct = Some(Correct { H, z, counts, l, inverse, v });
    of_lanes::<S, L>(size, step, first, correct, state, innovation, nis, work.x, work.next, work.w);
    for (density, nis) in log_likelihood.iter_mut().zip(nis) {
        *density = weighed.log_density - 0.5 * *nis;
    }
}

/// What [`correct_covariance`] leaves for the states of some channels, and what they measured.
#[derive(Debug, Clone, Copy)]
struct Correct<'a> {
    H: &'a [f64],
    z: &'a [f64],
    counts: &'a [bool],
    l: &'a [f64],
    inverse: &'a [f64],
    v: &'a [f64],
}

#[inline(never)]
// Apart from each other, or the compiler would take them for the same.
#[allow(clippy::too_many_arguments)]
fn of_lanes<S: Size, const L: usize>(
    size: S,
    step: &Advance<'_>,
    first: usize,
    correct: Option<Correct<'_>>,
    state: &mut [f64],
    innovation: &mut [f64],
    nis: &mut [f64],
    x: &mut [[f64; LANES]],
    next: &mut [[f64; LANES]],
    w: &mut [[f64; LANES]],
) {
    let (n, m) = (size.n(), size.m());
    let (mut x, next) = (&mut x[..n], &mut next[..n]);
    let (w, nis, state) = (&mut w[..m], &mut nis[..L], &mut state[..L * n]);
    load::<L>(n, state, x);
    if let Some((F, B, u)) = step.predict {
        let (F, p) = (&F[..n * n], B.len() / n);
        let u = &u[first * p..][..L * p];
        for i in 0..n {
            let mut sum = [0.0; L];
            for j in 0..n {
                for lane in 0..L {
                    sum[lane] += F[i * n + j] * x[j][lane];
                }
            }
            for j in 0..p {
                for lane in 0..L {
                    let u = u[lane * p + j];
                    // A missing input is none.
                    sum[lane] += B[i * p + j] * if is_known(u) { u } else { 0.0 };
                }
            }
            for lane in 0..L {
                next[i][lane] = held(sum[lane]);
            }
        }
        x = next;
    }
    let Some(Correct { H, z, counts, l, inverse, v }) = correct else {
        store::<L>(n, x, state);
        return;
    };
    let (H, v, l) = (&H[..m * n], &v[..m * n], &l[..m * m]);
    let (z, innovation) = (&z[..L * m], &mut innovation[..L * m]);
    let mut squares = [0.0; L];
    for j in 0..m {
        if !counts[j] {
            for lane in 0..L {
                innovation[lane * m + j] = f64::NAN;
                w[j][lane] = 0.0;
            }
            continue;
        }
        let mut y = [0.0; L];
        for h in 0..n {
            for lane in 0..L {
                y[lane] += H[j * n + h] * x[h][lane];
            }
        }
        for lane in 0..L {
            y[lane] = z[lane * m + j] - y[lane];
            innovation[lane * m + j] = y[lane];
        }
        for h in 0..j {
            for lane in 0..L {
                y[lane] -= l[j * m + h] * (l[h * m + h] * w[h][lane]);
            }
        }
        for lane in 0..L {
            let whitened = held(y[lane]);
            w[j][lane] = held(whitened * inverse[j]);
            squares[lane] += whitened * w[j][lane];
        }
    }
    nis.copy_from_slice(&squares);
    for i in 0..n {
        let mut sum = [0.0; L];
        for j in 0..m {
            for lane in 0..L {
                sum[lane] += v[j * n + i] * w[j][lane];
            }
        }
        for lane in 0..L {
            x[i][lane] = held(x[i][lane] + sum[lane]);
        }
    }
    store::<L>(n, x, state);
}

#[inline(always)]
fn load<const L: usize>(n: usize, state: &[f64], x: &mut [[f64; LANES]]) {
    let state = &state[..L * n];
    for i in 0..n {
        for lane in 0..L {
            x[i][lane] = state[lane * n + i];
        }
    }
}

#[inline(always)]
fn store<const L: usize>(n: usize, x: &[[f64; LANES]], state: &mut [f64]) {
    let state = &mut state[..L * n];
    for lane in 0..L {
        for i in 0..n {
            state[lane * n + i] = x[i][lane];
        }
    }
}

/// Whether a measurement or an input is there.
#[inline(always)]
pub(super) fn is_known(z: f64) -> bool {
    z.abs() <= SAMPLE_MAX
}

#[inline(always)]
fn held(x: f64) -> f64 {
    x.clamp(-STATE_MAX, STATE_MAX)
}

/// c = a b, of sizes rows × inner and inner × columns; of a square the `upper` triangle at least.
#[inline(always)]
pub(super) fn product(
    upper: bool,
    rows: usize,
    inner: usize,
    columns: usize,
    a: &[f64],
    b: &[f64],
    c: &mut [f64],
) {
    let (a, b, c) = (&a[..rows * inner], &b[..inner * columns], &mut c[..rows * columns]);
    for i in 0..rows {
        let row = &a[i * inner..][..inner];
        let out = &mut c[i * columns..][..columns];
        let mut j = if upper { i - i % 4 } else { 0 };
        while j + 8 <= columns {
            tile::<8>(row, b, columns, j, out);
            j += 8;
        }
        while j + 4 <= columns {
            tile::<4>(row, b, columns, j, out);
            j += 4;
        }
        if j + 2 <= columns {
            tile::<2>(row, b, columns, j, out);
            j += 2;
        }
        if j < columns {
            tile::<1>(row, b, columns, j, out);
        }
    }
}

/// `W` elements of a row of a product, summed in registers.
#[inline(always)]
fn tile<const W: usize>(row: &[f64], b: &[f64], columns: usize, j: usize, out: &mut [f64]) {
    let mut sum = [0.0; W];
    for (h, factor) in row.iter().enumerate() {
        let b = &b[h * columns + j..][..W];
        for w in 0..W {
            sum[w] += factor * b[w];
        }
    }
    out[j..][..W].copy_from_slice(&sum);
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
        P[i * n + i] = variance.min(VARIANCE_MAX);
        if variance < VARIANCE_MIN {
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
