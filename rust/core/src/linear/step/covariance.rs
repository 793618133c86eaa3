//! The covariance in a prediction and a correction, and the factors of the gain.
#![allow(non_snake_case)]

use nalgebra::ComplexField;

use super::definiteness::{is_semidefinite_in, repair, shrink};
use super::product::{product, transpose};
use super::size::{Size, Work};
use super::{MAX_VARIANCE, MIN_PIVOT, ROUNDING};
use crate::math::{Fours, OnRows, Pairs, widest};

/// Density from the variances of the innovations, computed with the gain.
#[derive(Debug, Clone, Copy)]
pub(in crate::linear) struct Weighed {
    /// -½ log det(2π S) of the measurements that correct.
    pub log_density: f64,
}

/// P ← F P Fᵀ + Q.
#[inline(always)]
pub(in crate::linear) fn predict_covariance<S: Size>(
    size: S,
    F: &[f64],
    Q: &[f64],
    P: &mut [f64],
    work: &mut Work<'_>,
) {
    transform(size.states(), F, Q, P, work.b, work.c, work.before);
}

/// Computes the gain of the used measurements, and P ← (I - K H) P (I - K H)ᵀ + K R Kᵀ.
///
/// S = H P Hᵀ + R = L D Lᵀ has Cholesky's factors without roots. `v` is L⁻¹ H P, and `k` is the
/// transposed gain L⁻ᵀ D⁻¹ v.
#[inline(always)]
pub(in crate::linear) fn correct_covariance<S: Size>(
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
        run_widest(joseph)
    }
    transform(size.states(), a, d, P, b, c, before);
    weighed
}

/// Does work in the widest registers, in its own function.
#[inline(never)]
fn run_widest<W: OnRows<Output = ()>>(work: W) {
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

/// P ← A P Aᵀ + D, from the upper triangle of D.
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
        run_widest(Transform { size, A, D, P, ap, room, before });
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
    reason = "parts of a structure would be reread after each write, which few states would feel"
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
    // Row by row, in the order in which it is read again: pieces would be read before they are
    // written.
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
    if !is_semidefinite_in(n, P, n as f64 * ROUNDING, room) {
        repair(n, A, D, before, P, room);
    }
}

/// Replaces unused measurements by measurements without information: H = 0, R = 1.
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

/// Lower triangle of S = H P Hᵀ + R.
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
        // If states cancel each other, the remainder is rounding and no information.
        let mut terms = 0.0;
        for h in 0..n {
            terms += H[i * n + h] * H[i * n + h] * P[h * n + h];
        }
        S[i * m + i] += (n * n) as f64 * f64::EPSILON * terms;
    }
}

/// L D Lᵀ = S in place, with D on the diagonal; an unused row has a reciprocal of zero.
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
