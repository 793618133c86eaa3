//! A symmetric matrix of fixed size that is always symmetric.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::validity::is_size;
use super::{Limits, Real, choose};

/// Symmetric `N × N` matrix; only the upper triangle is used.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct Symmetric<T, const N: usize> {
    upper: SMatrix<T, N, N>,
}

#[cfg(feature = "std")]
crate::math::laned!(Symmetric [N] { upper } common {});

impl<T: Real, const N: usize> Symmetric<T, N> {
    /// `value` times the identity.
    #[inline(always)]
    pub fn diagonal(value: T) -> Self {
        let upper = SMatrix::from_diagonal_element(value);
        Self { upper }
    }

    /// Element `(i, j)`.
    #[inline(always)]
    pub fn at(&self, i: usize, j: usize) -> T {
        self.upper[(i.min(j), i.max(j))]
    }

    /// Sets the elements `(i, j)` and `(j, i)`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, j: usize, value: T) {
        self.upper[(i.min(j), i.max(j))] = value;
    }

    /// The matrix times `v`.
    #[inline(always)]
    pub fn times(&self, v: &SVector<T, N>) -> SVector<T, N> {
        vector(|i| {
            let mut sum = self.at(i, 0) * v[0];
            for j in 1..N {
                sum += self.at(i, j) * v[j];
            }
            sum
        })
    }

    /// Sum of the diagonal.
    #[inline(always)]
    pub fn trace(&self) -> T {
        let mut sum = self.at(0, 0);
        for i in 1..N {
            sum += self.at(i, i);
        }
        sum
    }

    /// Every element times `factor`.
    #[inline(always)]
    pub fn scale(&mut self, factor: T) {
        for j in 0..N {
            for i in 0..=j {
                self.set(i, j, self.at(i, j) * factor);
            }
        }
    }

    /// Keeps a `large` covariance definite and finite: adds the possible rounding error to its
    /// diagonal, and scales the whole matrix if the trace exceeds its bound.
    #[inline(always)]
    pub fn settle(&mut self, large: T::SimdBool) {
        let bound = T::limit(<T::Element as Limits>::MAX_COVARIANCE);
        let factor = (bound / self.trace()).at_most(T::one());
        self.scale(choose(large, factor, T::one()));
        let raise = T::one() + T::limit(<T::Element as Limits>::ROUNDING);
        for i in 0..N {
            self.set(i, i, choose(large, self.at(i, i) * raise, self.at(i, i)));
        }
    }

    /// Replaces every element once, except the lower triangle.
    #[inline(always)]
    pub fn assign(&mut self, element: impl Fn(usize, usize) -> T) {
        for j in 0..N {
            for i in 0..=j {
                self.set(i, j, element(i, j));
            }
        }
    }

    /// Copies another matrix in some lanes.
    #[inline(always)]
    pub fn assign_where(&mut self, lanes: T::SimdBool, other: &Self) {
        let old = *self;
        self.assign(|i, j| choose(lanes, other.at(i, j), old.at(i, j)));
    }

    /// A matrix from the elements of its upper triangle.
    #[inline(always)]
    pub fn from_upper(element: impl Fn(usize, usize) -> T) -> Self {
        let mut matrix = Self::diagonal(T::zero());
        matrix.assign(element);
        matrix
    }

    /// The full matrix.
    pub fn to_matrix(&self) -> SMatrix<T, N, N> {
        SMatrix::from_fn(|i, j| self.at(i, j))
    }
}

/// Bound of a covariance's indefiniteness, in units of [`Limits::ROUNDING`] (8 ε) times the number
/// `N` of rows, for its correlations. An update rounds each element by at most `N + 2` units ε of
/// its variances. Cholesky's method of the test rounds by `N + 1` units, the correlations by 5. The
/// sum is `N (2 N + 8)` ε in norm. The largest `N` is 21, and 16 allows more than two updates
/// before a step restores the rounding errors. Steps that could lose more test this bound first,
/// and are left out if they exceed it.
const MAX_INDEFINITENESS: f64 = 16.0;

impl<T, const N: usize> Symmetric<T, N>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// True if a running filter can have this covariance: its trace is at most `bound`, and it is
    /// semidefinite to [`MAX_INDEFINITENESS`].
    pub(crate) fn is_covariance(&self, bound: T) -> bool {
        let below = (0..N).flat_map(|j| (j + 1..N).map(move |i| (i, j)));
        (0..N).all(|i| is_size(self.at(i, i), bound))
            && below.into_iter().all(|index| self.upper[index] == T::zero())
            && self.trace() <= bound
            && self.semidefinite()
    }
}

impl<T: Real, const N: usize> Symmetric<T, N> {
    /// True if it is semidefinite to [`MAX_INDEFINITENESS`]: tested by Cholesky's method on the
    /// correlations, independent of the components' sizes.
    pub(crate) fn semidefinite(&self) -> T::SimdBool {
        let scale = vector::<T, N>(|i| T::one() / (self.at(i, i) + T::tiny()).simd_sqrt());
        let rounding = T::limit(<T::Element as Limits>::ROUNDING);
        let one = T::one() + rounding * T::of(N as f64 * MAX_INDEFINITENESS);
        let mut rest = Self::from_upper(|i, j| match i == j {
            true => one,
            false => self.at(i, j) * scale[i] * scale[j],
        });
        // A negative variance gives false, NaN gives false, too.
        let mut so = self.at(0, 0).simd_ge(T::zero());
        for j in 0..N {
            let pivot = rest.at(j, j);
            so = so
                & self.at(j, j).simd_ge(T::zero())
                & pivot.simd_gt(T::zero())
                & pivot.simd_le(one);
            for i in j + 1..N {
                for h in i..N {
                    rest.set(i, h, rest.at(i, h) - rest.at(j, i) * rest.at(j, h) / pivot);
                }
            }
        }
        so
    }
}

/// The vector with elements `element(i)`.
///
/// Inlined for any size, unlike nalgebra's own function: separately compiled functions lack the
/// instructions of the lanes.
#[inline(always)]
pub(crate) fn vector<T: Real, const N: usize>(element: impl Fn(usize) -> T) -> SVector<T, N> {
    let mut vector = SVector::zeros();
    for i in 0..N {
        vector[i] = element(i);
    }
    vector
}

#[cfg(test)]
mod tests {
    use super::{MAX_INDEFINITENESS, Symmetric};
    use crate::math::Limits;
    use proptest::prelude::*;

    /// A covariance with equal correlations and a smallest eigenvalue of `-miss`.
    fn missing<const N: usize>(miss: f64, sizes: &[i32], sign: f64) -> Symmetric<f64, N> {
        let r = match sign > 0.0 {
            // With two rows either sign is possible.
            true => 1.0 + miss,
            false => -(1.0 + miss) / (N as f64 - 1.0),
        };
        let alone = |i: usize, j: usize| sign > 0.0 && (i > 1 || j > 1);
        let size = |i: usize| 2f64.powi(sizes[i]);
        Symmetric::from_upper(|i, j| match i == j {
            true => size(i) * size(i),
            false if alone(i, j) => 0.0,
            false => r * size(i) * size(j),
        })
    }

    fn is_bounded<const N: usize>(share: f64, sizes: &[i32]) -> Result<(), TestCaseError> {
        let bound = N as f64 * MAX_INDEFINITENESS * f64::ROUNDING;
        for sign in [1.0, -1.0] {
            // To the rounding of the test itself.
            let within = missing::<N>((1.0 - share) * bound, sizes, sign);
            prop_assert!(within.is_covariance(f64::MAX), "{within:?}");
            let beyond = missing::<N>((1.0 + share) * bound, sizes, sign);
            prop_assert!(!beyond.is_covariance(f64::MAX), "{beyond:?}");
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn covariances_at_either_side_of_the_bound(
            share in 0.1..1.0,
            sizes in prop::collection::vec(-60..60, 8),
        ) {
            is_bounded::<2>(share, &sizes)?;
            is_bounded::<3>(share, &sizes)?;
            is_bounded::<4>(share, &sizes)?;
            is_bounded::<6>(share, &sizes)?;
            is_bounded::<8>(share, &sizes)?;
        }
    }
}
