//! Process noise by Sage-Husa (FH 25), written as a rank-one update.
//!
//! With `P = P⁻ - S K Kᵀ` and `P⁻ = A P Aᵀ + G`, FH 25 is exactly `G ← G + ((e² - S)/k) K Kᵀ`. `G`
//! can become indefinite only if `e² < S`. `G + α K Kᵀ` stays above a floor while
//! `1 + α Kᵀ (G - floor)⁻¹ K ≥ 0`. This bounds the negative step.
//!
//! The formulas use `S K`, the first column of `P⁻`, instead of `K`. This column is known before
//! the division by `S`, and the guard can be decided early.

#![allow(non_snake_case)]

use nalgebra::{SVector, SimdBool};

use super::kalman::Correction;
use crate::math::{Aside, Real, Symmetric, choose};

/// Headroom of `G` along `v vᵀ`, which is `height / slope`.
#[derive(Debug, Clone, Copy)]
pub struct Headroom<T> {
    /// Numerator, positive while `G` is above the floor.
    pub height: T,
    /// Denominator, not negative.
    pub slope: T,
}

/// The headroom between `G` and `floor` times the identity in the direction of `v`.
///
/// `vᵀ (G - floor)⁻¹ v` is computed by symmetric elimination without a division. Each row is
/// multiplied by the pivot instead; the denominator of the result is a sum of squares. The trace of
/// `G` must not be large, since the products would overflow.
#[inline(always)]
pub fn headroom<T: Real, const N: usize>(
    G: &Symmetric<T, N>,
    floor: T,
    mut v: SVector<T, N>,
) -> Headroom<T> {
    let mut rest = Symmetric::<T, N>::from_upper(|i, j| match i == j {
        true => G.at(i, i) - floor,
        false => G.at(i, j),
    });
    let mut left = Headroom { height: rest.at(0, 0), slope: v[0] * v[0] };
    let mut lowest = left.height;
    for j in 1..N {
        let pivot = rest.at(j - 1, j - 1);
        for i in j..N {
            for h in i..N {
                rest.set(i, h, pivot * rest.at(i, h) - rest.at(j - 1, i) * rest.at(j - 1, h));
            }
            v[i] = pivot * v[i] - rest.at(j - 1, i) * v[j - 1];
        }
        left.slope = left.slope * rest.at(j, j) + v[j] * v[j];
        left.height *= rest.at(j, j);
        lowest = lowest.at_most(rest.at(j, j));
    }
    let outside = lowest.simd_le(T::zero());
    Headroom {
        height: choose(outside, T::zero(), left.height),
        slope: choose(outside, T::one(), left.slope),
    }
}

/// [`headroom`] for a `G` of any size, scaled to keep the products in range.
#[inline(always)]
fn scaled_headroom<T: Real, const N: usize>(
    G: &Symmetric<T, N>,
    floor: T,
    v: &SVector<T, N>,
) -> Headroom<T> {
    let size = T::one() / G.trace();
    let mut scaled = *G;
    scaled.scale(size);
    let mut widest = T::tiny();
    for i in 0..N {
        widest = v[i].simd_abs().at_least(widest);
    }
    let length = T::one() / widest;
    let left = headroom(&scaled, floor * size, v * length);
    Headroom { height: left.height * length * length, slope: left.slope * size }
}

/// Updates `G` by one corrected sample with weight `1/k`, never below `floor`; returns a mask of
/// shortened steps.
///
/// `column` is `S K`; `large` is the mask of [large](super::State::is_large) covariances.
#[inline(always)]
pub fn adapt<T: Real, const N: usize>(
    G: &mut Symmetric<T, N>,
    floor: T,
    column: SVector<T, N>,
    sample: Correction<T>,
    weight: T,
    large: T::SimdBool,
) -> T::SimdBool {
    if large.any() {
        return T::aside(Large { G, floor, column, sample, weight, large });
    }
    let left = ordinary_headroom(G, floor, column);
    let (step, guarded) = bounded_step(&sample, weight, left);
    add_rank_one(G, step, &column);
    guarded
}

/// Headroom above the floor, for a `G` that is not large.
#[inline(always)]
fn ordinary_headroom<T: Real, const N: usize>(
    G: &Symmetric<T, N>,
    floor: T,
    column: SVector<T, N>,
) -> Headroom<T> {
    // The fifteen factors of four rows underflow if G is small.
    match N {
        ..4 => headroom(G, floor, column),
        _ => scaled_headroom(G, floor, &column),
    }
}

/// [`adapt`] if in some lane the floor does not outweigh rounding. `G` is then made definite before
/// and after the step, since the step may remove nearly all of it and leave rounding errors.
struct Large<'a, T: Real, const N: usize> {
    G: &'a mut Symmetric<T, N>,
    floor: T,
    column: SVector<T, N>,
    sample: Correction<T>,
    weight: T,
    large: T::SimdBool,
}

impl<T: Real, const N: usize> Aside for Large<'_, T, N> {
    type Output = T::SimdBool;

    #[inline(always)]
    fn run(self) -> T::SimdBool {
        let Self { G, floor, column, sample, weight, large } = self;
        let (scaled, ordinary) =
            (scaled_headroom(G, floor, &column), ordinary_headroom(G, floor, column));
        let left = Headroom {
            height: choose(large, scaled.height, ordinary.height),
            slope: choose(large, scaled.slope, ordinary.slope),
        };
        let (step, guarded) = bounded_step(&sample, weight, left);
        G.settle(large);
        let before = *G;
        add_rank_one(G, step, &column);
        G.settle(large);
        // The headroom of an almost singular G is only rounding: such a step is left out.
        let broken = large & !G.semidefinite();
        G.assign_where(broken, &before);
        guarded | broken
    }
}

/// `(e² - S)/(k S²)`, the factor of `S K (S K)ᵀ`, limited by the headroom; and a mask of limited
/// factors.
///
/// There is no branch: with white noise a quarter of the samples are guarded, in no predictable
/// pattern. The division does not wait for `S`.
#[inline(always)]
fn bounded_step<T: Real>(sample: &Correction<T>, weight: T, left: Headroom<T>) -> (T, T::SimdBool) {
    let Correction { innovation, variance, inverse } = *sample;
    let lowest = -(left.height / left.slope.at_least(T::tiny()));
    let step = (innovation * innovation - variance) * weight * inverse * inverse;
    (lowest.at_least(step), step.simd_lt(lowest))
}

/// `G + step v vᵀ`.
#[inline(always)]
fn add_rank_one<T: Real, const N: usize>(G: &mut Symmetric<T, N>, step: T, v: &SVector<T, N>) {
    for i in 0..N {
        let scaled = step * v[i];
        for j in i..N {
            G.set(i, j, G.at(i, j) + scaled * v[j]);
        }
    }
}
