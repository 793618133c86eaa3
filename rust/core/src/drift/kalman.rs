//! One Kalman step of the drift model in companion form with a constant (FH 14–24, Table 3).
//!
//! The state is `x = [y_k, …, y_{k-p+1}, c]`. The transition matrix has the row `[φ, 1]` above a
//! shift that keeps the constant. A prediction is one dot product and a shift, without a matrix
//! product.
//! there, never a matrix product.

#![allow(non_snake_case)]

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use crate::math::validity::{is_nan, is_size, is_within};
use crate::math::{Limits, Real, Symmetric, choose, vector};

/// Limit of the trace, in start-up variances; below, the floor of the noise outweighs all rounding.
const TRACE_LARGE: f64 = 10.0;

/// Mean and covariance of the state, predicted or corrected.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct State<T, const N: usize> {
    /// Mean.
    pub x: SVector<T, N>,
    /// Covariance.
    pub P: Symmetric<T, N>,
}

/// Innovation of one sample, and its variance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Correction<T> {
    /// Sample minus prediction, zero for a missing sample (FH 22).
    pub innovation: T,
    /// Variance S of the innovation.
    pub variance: T,
    /// `1/S`, or zero for a missing sample.
    pub inverse: T,
}

#[cfg(feature = "std")]
crate::math::laned!(State [N] { x, P } common {});
#[cfg(feature = "std")]
crate::math::laned!(Correction [] { innovation, variance, inverse } common {});

/// Index in this state of component `i` of the next state: each `y` moves down, `c` stays.
#[inline(always)]
fn source<const N: usize>(i: usize) -> usize {
    if i == N - 1 { i } else { i - 1 }
}

impl<T: Real, const N: usize> State<T, N> {
    /// Zero mean, `variance` for each component.
    pub fn new(variance: T) -> Self {
        Self { x: SVector::zeros(), P: Symmetric::diagonal(variance) }
    }

    /// `x⁻ = A x`, `P⁻ = A P Aᵀ + G` with `row` the first row of A (FH 19, 20).
    ///
    /// The predicted `y` stays within `±peak`, the range of past samples. An unstable model would
    /// otherwise leave it in a long gap.
    #[inline(always)]
    pub fn predict(&self, row: &SVector<T, N>, G: &Symmetric<T, N>, peak: T) -> Self {
        // Loops, not closures: large closures are compiled separately, without the instructions of
        // the lanes.
        let mut x = self.x;
        x[0] = row.dot(&self.x).within(peak);
        for i in 1..N {
            x[i] = self.x[source::<N>(i)];
        }
        let moved = self.P.times(row);
        let mut P = *G;
        for j in 0..N {
            for i in 0..=j {
                let propagated = match (i, j) {
                    (0, 0) => row.dot(&moved),
                    (0, j) => moved[source::<N>(j)],
                    (i, j) => self.P.at(source::<N>(i), source::<N>(j)),
                };
                P.set(i, j, propagated + G.at(i, j));
            }
        }
        Self { x, P }
    }

    /// True if a covariance is large before or after the prediction. The floor of the process noise
    /// then no longer outweighs rounding.
    #[inline(always)]
    pub fn is_large(&self, before: &Self) -> T::SimdBool {
        (self.P.trace() + before.P.trace()).simd_gt(T::of(TRACE_LARGE))
    }

    /// Keeps a large prediction definite and finite. The first variance is a sum whose terms may
    /// cancel: its allowance is proportional to the terms.
    #[inline(always)]
    pub fn settle(&mut self, before: &Self, row: &SVector<T, N>, large: T::SimdBool) {
        let mut terms = T::zero();
        for i in 0..N {
            terms += row[i] * row[i] * before.P.at(i, i);
        }
        let allowance = T::limit(<T::Element as Limits>::ROUNDING) * T::of(N as f64) * terms;
        let raised = self.P.at(0, 0) + choose(large, allowance, T::zero());
        self.P.set(0, 0, raised);
        self.P.settle(large);
    }

    /// `P Hᵀ`, which is `S K` for a prediction (FH 21).
    #[inline(always)]
    pub fn column(&self) -> SVector<T, N> {
        vector(|i| self.P.at(0, i))
    }

    /// Corrects `prior` by the sample `z` with noise variance `R` (FH 21–24); keeps the prior if
    /// the sample was not `seen`.
    #[inline(always)]
    pub fn correct(&mut self, prior: &Self, z: T, seen: T::SimdBool, R: T) -> Correction<T> {
        let innovation = choose(seen, z - prior.x[0], T::zero());
        let variance = prior.P.at(0, 0) + R;
        let inverse = T::one() / variance;
        // 1 - K₀ computed as R/S: the difference would lose all digits if the gain is near one.
        let left = choose(seen, R * inverse, T::one());
        let inverse = choose(seen, inverse, T::zero());
        let gain = prior.column() * inverse;
        self.x = prior.x + gain * innovation;
        self.P.assign(|i, j| match i {
            0 => prior.P.at(0, j) * left,
            _ => prior.P.at(i, j) - gain[i] * prior.P.at(0, j),
        });
        Correction { innovation, variance, inverse }
    }
}

impl<T, const N: usize> State<T, N>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// True if a running filter can have this state.
    pub(super) fn is_valid(&self) -> bool {
        self.x.iter().all(|x| is_within(*x, T::MAX_RAW))
            && self.P.is_covariance(T::MAX_COVARIANCE + T::MAX_COVARIANCE)
    }
}

impl<T: Limits> Correction<T> {
    /// True if a running filter can have this innovation. In a start-up it may be too large for the
    /// scale.
    pub(super) fn is_valid(&self) -> bool {
        !is_nan(self.innovation) && is_size(self.variance, T::MAX) && is_size(self.inverse, T::MAX)
    }
}
