//! The scalar of every filter: `f32`, `f64`, or SIMD lanes of them.

use core::ops::Neg;

use nalgebra::{
    ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign, RealField, Scalar,
    SimdBool, SimdPartialOrd, SimdRealField, SimdValue,
};
use num_traits::{One, Zero};

use super::Elementary;

/// Bounds that keep every finite input finite, in units of the start-up deviation.
///
/// They lie many orders of magnitude beyond what a sensor can do and shape nothing in normal use.
pub trait Limits: RealField + Copy + Elementary {
    /// Largest raw sample and the largest reciprocal of a scale.
    const MAX_RAW: Self;
    /// Largest normalised sample.
    const MAX_INPUT: Self;
    /// Largest normalised sample that the drift model learns from.
    const MAX_LEARNED: Self;
    /// Largest raw sample of which differences are squared.
    const MAX_DIFFERENCE: Self;
    /// Largest trace of a covariance.
    const MAX_COVARIANCE: Self;
    /// Smallest noise variance, process or measurement.
    const VARIANCE_FLOOR: Self;
    /// The smallest positive normal number.
    const TINY: Self;
    /// The largest finite number.
    const MAX: Self;
    /// Relative addition to a variance, so that rounding cannot cost definiteness.
    const ROUNDING: Self;
}

impl Limits for f64 {
    const MAX_RAW: Self = 1e300;
    const MAX_INPUT: Self = 1e30;
    const MAX_LEARNED: Self = 1e9;
    const MAX_DIFFERENCE: Self = 1e150;
    const MAX_COVARIANCE: Self = 1e36;
    const VARIANCE_FLOOR: Self = 1e-12;
    const TINY: Self = f64::MIN_POSITIVE;
    const MAX: Self = f64::MAX;
    const ROUNDING: Self = 8.0 * f64::EPSILON;
}

impl Limits for f32 {
    const MAX_RAW: Self = 1e36;
    const MAX_INPUT: Self = 1e5;
    const MAX_LEARNED: Self = 1e4;
    const MAX_DIFFERENCE: Self = 1e18;
    const MAX_COVARIANCE: Self = 1e12;
    const VARIANCE_FLOOR: Self = 1e-6;
    const TINY: Self = f32::MIN_POSITIVE;
    const MAX: Self = f32::MAX;
    const ROUNDING: Self = 8.0 * f32::EPSILON;
}

/// Work that [`Real::aside`] does. Not a closure: only what is always inlined has the instructions of
/// the processor that it runs on.
pub trait Aside {
    /// Its output.
    type Output;

    /// Does it; always inlined.
    fn run(self) -> Self::Output;
}

/// A real number, or several in SIMD lanes: the arithmetic that a step needs, and no more.
pub trait Real:
    SimdPartialOrd<Element: Limits>
    + Scalar
    + Copy
    + Zero
    + One
    + ClosedAddAssign
    + ClosedSubAssign
    + ClosedMulAssign
    + ClosedDivAssign
    + Neg<Output = Self>
{
    /// The magnitude.
    fn simd_abs(self) -> Self;

    /// The square root.
    fn simd_sqrt(self) -> Self;

    /// Work in a function of its own, for what is seldom needed and would crowd a step.
    #[cold]
    #[inline(never)]
    fn aside<W: Aside>(work: W) -> W::Output {
        work.run()
    }

    /// The constant `x` in every lane.
    #[inline(always)]
    fn of(x: f64) -> Self {
        Self::splat(nalgebra::convert(x))
    }

    /// One bound of [`Limits`] in every lane.
    #[inline(always)]
    fn limit(bound: Self::Element) -> Self {
        Self::splat(bound)
    }

    /// The smallest positive normal number.
    #[inline(always)]
    fn tiny() -> Self {
        Self::limit(Self::Element::TINY)
    }

    /// Neither NaN nor infinite.
    #[inline(always)]
    fn finite(self) -> Self::SimdBool {
        self.simd_abs().simd_le(Self::limit(Self::Element::MAX))
    }

    /// `self`, but not below `bound`; `bound` for NaN.
    #[inline(always)]
    fn at_least(self, bound: Self) -> Self {
        self.select(self.simd_gt(bound), bound)
    }

    /// `self`, but not above `bound`; `bound` for NaN.
    #[inline(always)]
    fn at_most(self, bound: Self) -> Self {
        self.select(self.simd_lt(bound), bound)
    }

    /// `self` limited to `±bound`.
    #[inline(always)]
    fn within(self, bound: Self) -> Self {
        self.at_most(bound).at_least(-bound)
    }
}

impl<T: SimdRealField<Element: Limits> + Copy> Real for T {
    #[inline(always)]
    fn simd_abs(self) -> Self {
        nalgebra::SimdComplexField::simd_abs(self)
    }

    #[inline(always)]
    fn simd_sqrt(self) -> Self {
        nalgebra::SimdComplexField::simd_sqrt(self)
    }
}

/// `value` where `condition` holds, else `other`: reads in the order in which it is said.
#[inline(always)]
pub(crate) fn choose<T: SimdValue>(condition: T::SimdBool, value: T, other: T) -> T {
    value.select(condition, other)
}

/// One where `condition` holds, else zero. Of a single number it is counted as an integer, for which
/// no compiler makes a branch.
#[inline(always)]
pub(crate) fn indicator<T: Real>(condition: T::SimdBool) -> T {
    match T::LANES {
        1 => T::of(f64::from(condition.bitmask() as u32)),
        _ => choose(condition, T::one(), T::zero()),
    }
}
