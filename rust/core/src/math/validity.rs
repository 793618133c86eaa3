//! Validity of a running filter's numbers: within these bounds a filter computes no NaN.

use nalgebra::SMatrix;

use super::Limits;

/// True if the count of samples can continue without overflow.
pub(crate) fn is_count(samples: u64) -> bool {
    samples < 1 << 60
}

/// True from `-bound` to `bound`; false for NaN.
pub(crate) fn is_within<T: Limits>(x: T, bound: T) -> bool {
    -bound <= x && x <= bound
}

/// True if all elements of a vector or matrix are within `bound`; a largest element would ignore
/// NaN.
pub(crate) fn are_within<const R: usize, const C: usize>(
    numbers: &SMatrix<f64, R, C>,
    bound: f64,
) -> bool {
    numbers.iter().all(|x| is_within(*x, bound))
}

/// True from zero to `bound`; false for NaN.
pub(crate) fn is_size<T: Limits>(x: T, bound: T) -> bool {
    T::zero() <= x && x <= bound
}

/// True for a whole number from zero to `bound`: for fractions below 1 the inverse may be infinite.
pub(crate) fn is_whole(x: f64, bound: f64) -> bool {
    is_size(x, bound) && (x as u64) as f64 == x
}

/// True from `-bound` to `bound`, and for NaN, a missing sample.
pub(crate) fn is_sample<T: Limits>(z: T, bound: T) -> bool {
    is_nan(z) || is_within(z, bound)
}

/// True for NaN.
pub(crate) fn is_nan<T: Limits>(x: T) -> bool {
    x.partial_cmp(&x).is_none()
}
