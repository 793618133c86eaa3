//! Test of a covariance for positive semidefiniteness, and its repair after rounding.
#![allow(non_snake_case)]

use nalgebra::ComplexField;

use super::{MAX_VARIANCE, MIN_VARIANCE, ROUNDING};

#[cold]
#[inline(never)]
pub(super) fn shrink(P: &mut [f64], factor: f64) {
    P.iter_mut().for_each(|p| *p *= factor);
}

/// True if P plus `tolerance` times its diagonal is a covariance. It is tested by elimination, and
/// does not depend on the sizes of the states. A state without variance must have no covariances.
#[inline(always)]
pub(in crate::linear) fn is_semidefinite(
    n: usize,
    P: &[f64],
    tolerance: f64,
    room: &mut [f64],
) -> bool {
    room.copy_from_slice(P);
    is_semidefinite_in(n, P, tolerance, room)
}

/// True if P is a covariance after a step and valid in a checkpoint. The tolerance is `n` times one
/// rounding, and once more for the factor by which a step may shrink P.
#[cfg(feature = "std")]
pub(in crate::linear) fn is_settled(n: usize, P: &[f64], room: &mut [f64]) -> bool {
    is_semidefinite(n, P, 2.0 * n as f64 * ROUNDING, room)
}

/// [`is_semidefinite`] with the upper triangle of P, or of a multiple of it, in the working memory.
#[inline(always)]
pub(super) fn is_semidefinite_in(n: usize, P: &[f64], tolerance: f64, room: &mut [f64]) -> bool {
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
            // From an even index: two at once.
            for h in i - i % 2..n {
                below[(i - j - 1) * n + h] -= factor * above[h];
            }
        }
    }
    so
}

/// Repairs a covariance A P Aᵀ + D that rounding has made indefinite. It adds the possible rounding
/// error to each variance, then reduces the correlations until the matrix is a covariance.
#[cold]
#[inline(never)]
pub(super) fn repair(
    n: usize,
    A: &[f64],
    D: &[f64],
    before: &[f64],
    P: &mut [f64],
    room: &mut [f64],
) {
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
    // In the end only the variances remain.
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
