//! Bounds of chance at rest.

use crate::math::{Limits, Real};

/// Standard deviations that chance exceeds once in a million: with four tests per tick, one false
/// alarm a day.
pub(super) const CERTAIN_SIGMAS: f64 = 4.9;

/// Smallest ratio of the variance to the variance at rest that is motion: the variance of noise
/// also changes slightly.
pub(super) const MIN_MOTION_RATIO: f64 = 3.0;

/// Ratio of variances that the noise of one sensor at rest does not have.
pub(super) const MAX_NOISE_RATIO: f64 = 9.0;

/// Largest distance from the last rest's level, in standard deviations, of a tick and of the mean
/// of all ticks in a new rest. Of 468 poses between rotations of MEMS gyros, 99 in 100 begin within
/// two.
pub(super) const MAX_TICK_SIGMAS: f64 = 6.0;
pub(super) const MAX_MEAN_SIGMAS: f64 = 2.0;

/// Largest ratio of the levels' variance to the samples' variance at rest. Motion slower than a
/// tick moves its level more than its samples.
pub(super) const MAX_LEVEL_RATIO: f64 = 0.25;

/// Largest number of degrees of freedom of a tick's variance at any length: vibration is coloured.
pub(super) const MAX_FREEDOM: f64 = 14.0;

/// Upper bound of the mean of `freedom` squares of unit normal numbers, `deviations` standard
/// deviations away; after Wilson & Hilferty, *Proc. Natl. Acad. Sci.* 17, 684 (1931).
pub(super) fn chi_squared_bound<T: Limits + Real<Element = T>>(freedom: T, deviations: f64) -> T {
    let a = T::of(2.0) / (T::of(9.0) * freedom);
    let root = (T::one() - a + T::of(deviations) * a.simd_sqrt()).at_least(T::zero());
    root * root * root
}

/// Largest variance of samples on two neighbouring steps, with a margin for rounding.
pub(super) fn flips<T: Limits + Real<Element = T>>(step: T) -> T {
    T::of(0.26) * step * step
}

/// One step, with a margin for rounding.
pub(super) fn one_step<T: Limits + Real<Element = T>>(step: T) -> T {
    T::of(1.01) * step
}

/// True if one variance belongs to a rest, compared with the other.
pub(super) fn is_quieter<T: Limits + Real<Element = T>>(quiet: T, loud: T, step: T) -> bool {
    loud > T::of(MAX_NOISE_RATIO) * quiet + flips(step)
}
