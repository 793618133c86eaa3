//! Process noise by Sage-Husa (FH 25), as the rank-one update that it is.
//!
//! With `P = P⁻ - S K Kᵀ` and `P⁻ = A P Aᵀ + G`, FH 25 is exactly
//! `G ← G + ((e² - S)/k) K Kᵀ`. Only `e² < S` can cost definiteness. `G + α K Kᵀ` stays above a
//! floor as long as `1 + α Kᵀ (G - floor)⁻¹ K ≥ 0`, which bounds the negative step.

use nalgebra::{SVector, SimdBool};

use super::Correction;
use crate::real::{Real, choose};
use crate::symmetric::Symmetric;

/// How far `G` may sink along `K Kᵀ`: by `height / slope`.
#[derive(Debug, Clone, Copy)]
pub struct Room<T> {
    /// Positive as long as `G` lies inside the floor.
    pub height: T,
    /// Not negative.
    pub slope: T,
}

/// The room between `G` and `floor` times the identity in the direction of `K`.
///
/// `Kᵀ (G - floor)⁻¹ K` by symmetric elimination without a division: each row is multiplied by the
/// pivot instead, which leaves a fraction whose denominator is a sum of squares.
#[inline(always)]
pub fn room_below<T: Real, const N: usize>(
    G: &Symmetric<T, N>,
    floor: T,
    K: &SVector<T, N>,
) -> Room<T> {
    let large = G.is_large();
    if large.any() { room_below_large(G, large, floor, K) } else { eliminate(G, floor, K) }
}

/// The same on a scale on which the products do not overflow.
#[inline(always)]
fn room_below_large<T: Real, const N: usize>(
    G: &Symmetric<T, N>,
    large: T::SimdBool,
    floor: T,
    K: &SVector<T, N>,
) -> Room<T> {
    let size = choose(large, T::one() / G.trace(), T::one());
    let mut scaled = *G;
    scaled.scale(size);
    let room = eliminate(&scaled, floor * size, K);
    Room { slope: room.slope * size, ..room }
}

#[inline(always)]
fn eliminate<T: Real, const N: usize>(G: &Symmetric<T, N>, floor: T, K: &SVector<T, N>) -> Room<T> {
    let mut rest = Symmetric::<T, N>::from_upper(|i, j| match i == j {
        true => G.at(i, i) - floor,
        false => G.at(i, j),
    });
    let mut k = *K;
    let mut room = Room { height: rest.at(0, 0), slope: k[0] * k[0] };
    let mut lowest = room.height;
    for j in 1..N {
        let pivot = rest.at(j - 1, j - 1);
        for i in j..N {
            for h in i..N {
                rest.set(i, h, pivot * rest.at(i, h) - rest.at(j - 1, i) * rest.at(j - 1, h));
            }
            k[i] = pivot * k[i] - rest.at(j - 1, i) * k[j - 1];
        }
        room.slope = room.slope * rest.at(j, j) + k[j] * k[j];
        room.height *= rest.at(j, j);
        lowest = lowest.at_most(rest.at(j, j));
    }
    let outside = lowest.simd_le(T::zero());
    Room {
        height: choose(outside, T::zero(), room.height),
        slope: choose(outside, T::one(), room.slope),
    }
}

/// Updates `G` by one corrected sample with weight `1/k`, never below `floor`; answers where the
/// step had to be shortened.
#[inline(always)]
pub fn adapt<T: Real, const N: usize>(
    G: &mut Symmetric<T, N>,
    floor: T,
    sample: &Correction<T, N>,
    weight: T,
) -> T::SimdBool {
    let mut step = (sample.innovation * sample.innovation - sample.variance) * weight;
    let room = room_below(G, floor, &sample.gain);
    let guarded = step.simd_lt(T::zero()) & (-step * room.slope).simd_ge(room.height);
    if guarded.any() {
        step = choose(guarded, -room.height / room.slope.at_least(T::tiny()), step);
    }
    add_rank_one(G, step, &sample.gain);
    G.settle();
    guarded
}

/// `G + step K Kᵀ`.
#[inline(always)]
fn add_rank_one<T: Real, const N: usize>(G: &mut Symmetric<T, N>, step: T, K: &SVector<T, N>) {
    for i in 0..N {
        let scaled = step * K[i];
        for j in i..N {
            G.set(i, j, G.at(i, j) + scaled * K[j]);
        }
    }
}
