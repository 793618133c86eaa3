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
const VARIANCE_MIN: f64 = 1e-250;
/// What one rounding costs, relative to the terms of a sum; and what may have cost a covariance its
/// definiteness, relative to its variances, a state.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Channels of one covariance that are taken at once.
pub(super) const LANES: usize = 8;

/// States and measurements.
pub(super) trait Size: Copy {
    fn n(self) -> usize;
    fn m(self) -> usize;
}

/// Sizes that the compiler knows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fixed<const N: usize, const M: usize>;

impl<const N: usize, const M: usize> Size for Fixed<N, M> {
    #[inline(always)]
    fn n(self) -> usize {
        N
    }

    #[inline(always)]
    fn m(self) -> usize {
        M
    }
}

/// Room for what a step computes on its way.
#[derive(Debug)]
pub(super) struct Work<'a> {
    /// Two n × n matrices, and one for the test of definiteness.
    pub a: &'a mut [f64],
    pub b: &'a mut [f64],
    pub c: &'a mut [f64],
    /// m × n: H P, the gain before L⁻¹, the gain, the rows of H that count.
    pub hp: &'a mut [f64],
    pub v: &'a mut [f64],
    pub k: &'a mut [f64],
    pub h: &'a mut [f64],
    /// m × m: the factor L, R of what counts, R K.
    pub l: &'a mut [f64],
    pub r: &'a mut [f64],
    pub rk: &'a mut [f64],
    /// m: reciprocals of the diagonal of L, and what counts.
    pub inverse: &'a mut [f64],
    pub counts: &'a mut [bool],
    /// n: variances before the step.
    pub before: &'a mut [f64],
    /// n, n and m: states and whitened innovations of some channels.
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
    let n = size.n();
    keep_diagonal(n, P, work.before);
    times(n, n, n, F, P, work.a);
    transpose(n, F, work.b);
    P.copy_from_slice(Q);
    add_times(n, n, n, work.a, work.b, P);
    if !settle(n, P, work.c) {
        repair(n, F, work.before, &[], &[], P, work.c);
    }
}

/// The gain of the measurements that count, and P ← (I - K H) P (I - K H)ᵀ + K R Kᵀ.
///
/// With L the Cholesky factor of S = H P Hᵀ + R, `v` is L⁻¹ H P and `k` the transposed gain.
#[inline(always)]
pub(super) fn correct_covariance<S: Size>(
    size: S,
    H: &[f64],
    R: &[f64],
    P: &mut [f64],
    work: &mut Work<'_>,
) -> Weighed {
    let (n, m) = (size.n(), size.m());
    if work.counts.iter().any(|counts| !counts) {
        choose(n, m, H, R, work);
    } else {
        work.h.copy_from_slice(H);
        work.r.copy_from_slice(R);
    }
    times(m, n, n, work.h, P, work.hp);
    let weighed = factorise(n, m, work);
    gain(n, m, work);
    // I - K H.
    work.a.fill(0.0);
    for i in 0..n {
        work.a[i * n + i] = 1.0;
        for j in 0..m {
            let k = work.k[j * n + i];
            for h in 0..n {
                work.a[i * n + h] -= k * work.h[j * n + h];
            }
        }
    }
    keep_diagonal(n, P, work.before);
    times(n, n, n, work.a, P, work.b);
    transpose(n, work.a, work.c);
    P.fill(0.0);
    add_times(n, n, n, work.b, work.c, P);
    times(m, m, n, work.r, work.k, work.rk);
    for i in 0..n {
        for j in 0..m {
            let k = work.k[j * n + i];
            for h in 0..n {
                P[i * n + h] += k * work.rk[j * n + h];
            }
        }
    }
    if !settle(n, P, work.c) {
        repair(n, work.a, work.before, work.k, work.r, P, work.c);
    }
    weighed
}

/// Makes of measurements that do not count some that say nothing: H = 0, R = 1.
#[cold]
#[inline(never)]
fn choose(n: usize, m: usize, H: &[f64], R: &[f64], work: &mut Work<'_>) {
    for i in 0..m {
        for h in 0..n {
            work.h[i * n + h] = if work.counts[i] { H[i * n + h] } else { 0.0 };
        }
        for j in 0..m {
            let both = work.counts[i] && work.counts[j];
            let alone = if i == j { 1.0 } else { 0.0 };
            work.r[i * m + j] = if both { R[i * m + j] } else { alone };
        }
    }
}

/// S = H P Hᵀ + R and its factor L, in place; a row that is left out has a reciprocal of zero.
#[inline(always)]
fn factorise(n: usize, m: usize, work: &mut Work<'_>) -> Weighed {
    let mut log_density = 0.0;
    for i in 0..m {
        for j in 0..=i {
            let mut sum = work.r[i * m + j];
            for h in 0..n {
                sum += work.hp[i * n + h] * work.h[j * n + h];
            }
            work.l[i * m + j] = sum;
        }
    }
    for j in 0..m {
        let variance = work.l[j * m + j];
        let mut pivot = variance;
        for h in 0..j {
            pivot -= work.l[j * m + h] * work.l[j * m + h];
        }
        let known = (n + m) as f64 * ROUNDING * variance;
        if !(pivot > known && pivot > PIVOT_MIN) {
            work.inverse[j] = 0.0;
            for i in j..m {
                work.l[i * m + j] = 0.0;
            }
            continue;
        }
        if work.counts[j] {
            log_density -= 0.5 * ComplexField::ln(core::f64::consts::TAU * pivot);
        }
        let root = ComplexField::sqrt(pivot);
        let inverse = 1.0 / root;
        (work.l[j * m + j], work.inverse[j]) = (root, inverse);
        for i in j + 1..m {
            let mut sum = work.l[i * m + j];
            for h in 0..j {
                sum -= work.l[i * m + h] * work.l[j * m + h];
            }
            work.l[i * m + j] = sum * inverse;
        }
    }
    Weighed { log_density }
}

/// v = L⁻¹ H P and k = L⁻ᵀ v, the transposed gain.
#[inline(always)]
fn gain(n: usize, m: usize, work: &mut Work<'_>) {
    for j in 0..m {
        for i in 0..n {
            work.v[j * n + i] = work.hp[j * n + i];
        }
        for h in 0..j {
            let l = work.l[j * m + h];
            for i in 0..n {
                work.v[j * n + i] -= l * work.v[h * n + i];
            }
        }
        for i in 0..n {
            work.v[j * n + i] *= work.inverse[j];
        }
    }
    for j in (0..m).rev() {
        for i in 0..n {
            work.k[j * n + i] = work.v[j * n + i];
        }
        for h in j + 1..m {
            let l = work.l[h * m + j];
            for i in 0..n {
                work.k[j * n + i] -= l * work.k[h * n + i];
            }
        }
        for i in 0..n {
            work.k[j * n + i] *= work.inverse[j];
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

/// What becomes of channels from the first one on: states, innovations, sums of the squares of the
/// whitened innovations, log-likelihoods.
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
    step: Advance<'_>,
    places: &mut Places<'_>,
    work: &mut Work<'_>,
) {
    let (n, m) = (size.n(), size.m());
    let states = &mut places.state[first * n..][..L * n];
    for i in 0..n {
        for lane in 0..L {
            work.x[i][lane] = states[lane * n + i];
        }
    }
    if let Some((F, B, u)) = step.predict {
        for i in 0..n {
            let mut sum = [0.0; L];
            for j in 0..n {
                let f = F[i * n + j];
                for lane in 0..L {
                    sum[lane] += f * work.x[j][lane];
                }
            }
            let p = B.len() / n;
            for j in 0..p {
                for lane in 0..L {
                    let u = u[(first + lane) * p + j];
                    // A missing input is none.
                    sum[lane] += B[i * p + j] * if is_known(u) { u } else { 0.0 };
                }
            }
            for lane in 0..L {
                work.next[i][lane] = held(sum[lane]);
            }
        }
        for i in 0..n {
            for lane in 0..L {
                work.x[i][lane] = work.next[i][lane];
            }
        }
    }
    if let Some((H, z, weighed)) = step.correct {
        let z = &z[first * m..][..L * m];
        let innovations = &mut places.innovation[first * m..][..L * m];
        let mut nis = [0.0; L];
        for j in 0..m {
            if weighed.is_none() || !work.counts[j] {
                for lane in 0..L {
                    innovations[lane * m + j] = f64::NAN;
                    work.w[j][lane] = 0.0;
                }
                continue;
            }
            let mut y = [0.0; L];
            for lane in 0..L {
                y[lane] = z[lane * m + j];
            }
            for h in 0..n {
                let factor = H[j * n + h];
                for lane in 0..L {
                    y[lane] -= factor * work.x[h][lane];
                }
            }
            for lane in 0..L {
                innovations[lane * m + j] = y[lane];
            }
            for h in 0..j {
                let l = work.l[j * m + h];
                for lane in 0..L {
                    y[lane] -= l * work.w[h][lane];
                }
            }
            for lane in 0..L {
                let w = held(y[lane] * work.inverse[j]);
                work.w[j][lane] = w;
                nis[lane] += w * w;
            }
        }
        if weighed.is_some() {
            for j in 0..m {
                for i in 0..n {
                    let v = work.v[j * n + i];
                    for lane in 0..L {
                        work.x[i][lane] += v * work.w[j][lane];
                    }
                }
            }
            for i in 0..n {
                for lane in 0..L {
                    work.x[i][lane] = held(work.x[i][lane]);
                }
            }
        }
        for lane in 0..L {
            let (squares, density) = match weighed {
                Some(weighed) => (nis[lane], weighed.log_density - 0.5 * nis[lane]),
                None => (f64::NAN, 0.0),
            };
            places.nis[first + lane] = squares;
            places.log_likelihood[first + lane] = density;
        }
    }
    for i in 0..n {
        for lane in 0..L {
            states[lane * n + i] = work.x[i][lane];
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

#[inline(always)]
fn keep_diagonal(n: usize, P: &[f64], diagonal: &mut [f64]) {
    for i in 0..n {
        diagonal[i] = P[i * n + i];
    }
}

/// c = a b, of sizes rows × inner and inner × columns.
#[inline(always)]
pub(super) fn times(
    rows: usize,
    inner: usize,
    columns: usize,
    a: &[f64],
    b: &[f64],
    c: &mut [f64],
) {
    c[..rows * columns].fill(0.0);
    add_times(rows, inner, columns, a, b, c);
}

/// c += a b.
#[inline(always)]
pub(super) fn add_times(
    rows: usize,
    inner: usize,
    columns: usize,
    a: &[f64],
    b: &[f64],
    c: &mut [f64],
) {
    let (a, b, c) = (&a[..rows * inner], &b[..inner * columns], &mut c[..rows * columns]);
    for i in 0..rows {
        for h in 0..inner {
            let factor = a[i * inner + h];
            for j in 0..columns {
                c[i * columns + j] += factor * b[h * columns + j];
            }
        }
    }
}

#[inline(always)]
pub(super) fn transpose(n: usize, a: &[f64], b: &mut [f64]) {
    let (a, b) = (&a[..n * n], &mut b[..n * n]);
    for i in 0..n {
        for j in 0..n {
            b[j * n + i] = a[i * n + j];
        }
    }
}

/// Mirrors the upper triangle, limits the trace, and tells whether the matrix is semidefinite.
#[inline(always)]
fn settle(n: usize, P: &mut [f64], room: &mut [f64]) -> bool {
    let mut trace = 0.0;
    for i in 0..n {
        trace += P[i * n + i];
        for j in 0..i {
            P[i * n + j] = P[j * n + i];
        }
    }
    if trace > VARIANCE_MAX {
        shrink(P, VARIANCE_MAX / trace);
    }
    is_semidefinite(n, P, n as f64 * ROUNDING, room)
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
    let (P, room) = (&P[..n * n], &mut room[..n * n]);
    room.copy_from_slice(P);
    let mut so = true;
    for j in 0..n {
        room[j * n + j] += tolerance * P[j * n + j].abs();
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
        for i in j + 1..n {
            let factor = room[j * n + i] * inverse;
            for h in i..n {
                room[i * n + h] -= factor * room[j * n + h];
            }
        }
    }
    so
}

/// Makes a covariance of A P Aᵀ + K R Kᵀ, which rounding has made indefinite: adds to each variance
/// what rounding may have cost it, then weakens the correlations until it is one.
#[cold]
#[inline(never)]
fn repair(
    n: usize,
    A: &[f64],
    before: &[f64],
    k: &[f64],
    R: &[f64],
    P: &mut [f64],
    room: &mut [f64],
) {
    let m = k.len() / n;
    for i in 0..n {
        let mut spread = 0.0;
        for h in 0..n {
            spread += A[i * n + h].abs() * ComplexField::sqrt(before[h].max(0.0));
        }
        for j in 0..m {
            spread += k[j * n + i].abs() * ComplexField::sqrt(R[j * m + j].max(0.0));
        }
        let lost = (n + m) as f64 * ROUNDING * spread * spread;
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
