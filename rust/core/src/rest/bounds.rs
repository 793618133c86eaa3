//! Bounds of what chance does at rest.

use crate::math::{Limits, Real};

/// Deviations that chance exceeds once in a million: four tests a tick, one false alarm a day.
pub(super) const CERTAIN_SIGMAS: f64 = 4.9;

/// Variance over that of rest, at least, that is motion: no noise keeps its variance to a hair.
pub(super) const MIN_MOTION_RATIO: f64 = 3.0;

/// Ratio of variances that the noise of one sensor at rest does not have.
pub(super) const MAX_NOISE_RATIO: f64 = 9.0;

/// Deviations from the level of the last rest that a tick, and the mean of all that make a new one,
/// may have: of 468 poses between turns of MEMS gyros, 99 in 100 begin within two.
pub(super) const MAX_TICK_SIGMAS: f64 = 6.0;
pub(super) const MAX_MEAN_SIGMAS: f64 = 2.0;

/// Variance of the levels over that of the samples, at most, of a sensor that may be at rest: motion
/// slower than a tick moves its level more than its samples.
pub(super) const MAX_LEVEL_RATIO: f64 = 0.25;

/// Degrees of freedom of a tick's variance at most, whatever its length: vibration is coloured.
pub(super) const MAX_FREEDOM: f64 = 14.0;

/// Bound of a mean of `freedom` squares of unit normal numbers that lies `deviations` off, after
/// Wilson & Hilferty, *Proc. Natl. Acad. Sci.* 17, 684 (1931).
pub(super) fn chi_squared_bound<T: Limits + Real<Element = T>>(freedom: T, deviations: f64) -> T {
    let a = T::of(2.0) / (T::of(9.0) * freedom);
    let root = (T::one() - a + T::of(deviations) * a.simd_sqrt()).at_least(T::zero());
    root * root * root
}

/// Largest variance of samples that lie on two neighbouring steps, and a hair more.
pub(super) fn flips<T: Limits + Real<Element = T>>(step: T) -> T {
    T::of(0.26) * step * step
}

/// One step, and a hair more.
pub(super) fn one_step<T: Limits + Real<Element = T>>(step: T) -> T {
    T::of(1.01) * step
}

/// True if one variance is that of a rest, compared with the other.
pub(super) fn is_quieter<T: Limits + Real<Element = T>>(quiet: T, loud: T, step: T) -> bool {
    loud > T::of(MAX_NOISE_RATIO) * quiet + flips(step)
}
