//! Validity of a running filter's numbers: they stay within bounds, from which a filter computes no
//! NaN.

use nalgebra::SMatrix;

use super::Limits;

/// Samples that can be counted on from without an overflow.
pub(crate) fn is_count(samples: u64) -> bool {
    samples < 1 << 60
}

/// From `-bound` to `bound`; NaN is not.
pub(crate) fn is_within<T: Limits>(x: T, bound: T) -> bool {
    -bound <= x && x <= bound
}

/// All of a vector or a matrix; a largest element would pass over NaN.
pub(crate) fn are_within<const R: usize, const C: usize>(
    numbers: &SMatrix<f64, R, C>,
    bound: f64,
) -> bool {
    numbers.iter().all(|x| is_within(*x, bound))
}

/// From zero to `bound`; NaN is not.
pub(crate) fn is_size<T: Limits>(x: T, bound: T) -> bool {
    T::zero() <= x && x <= bound
}

/// A whole number from zero to `bound`: of another one below 1 the inverse may be infinite.
pub(crate) fn is_whole(x: f64, bound: f64) -> bool {
    is_size(x, bound) && (x as u64) as f64 == x
}

/// From `-bound` to `bound`, or NaN where a sample is missing.
pub(crate) fn is_sample<T: Limits>(z: T, bound: T) -> bool {
    is_nan(z) || is_within(z, bound)
}

/// Not a number.
pub(crate) fn is_nan<T: Limits>(x: T) -> bool {
    x.partial_cmp(&x).is_none()
}
