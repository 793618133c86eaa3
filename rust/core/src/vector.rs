//! Vectors element by element.

use nalgebra::SVector;

use crate::real::Real;

/// The vector of `element(i)`.
///
/// Inlined whatever its size, as nalgebra's own is not: what is compiled apart from a step lacks
/// the instructions of its lanes.
#[inline(always)]
pub(crate) fn vector<T: Real, const N: usize>(element: impl Fn(usize) -> T) -> SVector<T, N> {
    let mut vector = SVector::zeros();
    for i in 0..N {
        vector[i] = element(i);
    }
    vector
}
