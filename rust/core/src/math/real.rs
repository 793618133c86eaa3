//! The number type of every filter: `f32`, `f64`, or SIMD lanes of them.

use core::ops::Neg;

use nalgebra::{
    ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign, RealField, Scalar,
    SimdBool, SimdPartialOrd, SimdRealField, SimdValue,
};
use num_traits::{One, Zero};

use super::Elementary;

/// Bounds that keep every result of finite inputs finite, in units of the start-up's standard
/// deviation.
///
/// They lie many orders of magnitude beyond any sensor, and have no effect in normal use.
pub trait Limits: RealField + Copy + Elementary {
    /// Largest raw sample and the largest reciprocal of a scale.
    const MAX_RAW: Self;
    /// Largest normalised sample.
    const MAX_INPUT: Self;
    /// Largest normalised sample that the drift model learns from.
    const MAX_LEARNED: Self;
    /// Largest raw sample for squared differences.
    const MAX_DIFFERENCE: Self;
    /// Largest trace of a covariance.
    const MAX_COVARIANCE: Self;
    /// Smallest noise variance, process or measurement.
    const VARIANCE_FLOOR: Self;
    /// The smallest positive normal number.
    const TINY: Self;
    /// The largest finite number.
    const MAX: Self;
    /// Relative addition to a variance, so that rounding cannot make a covariance indefinite.
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

/// Work for [`Real::aside`]. Not a closure: only always-inlined functions have the processor's
/// instructions.
pub trait Aside {
    /// Output of the work.
    type Output;

    /// Does the work; always inlined.
    fn run(self) -> Self::Output;
}

/// A real number, or several in SIMD lanes, with the arithmetic of a step.
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

    /// Runs rare work in its own function, to keep the step small.
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

    /// `self`, but at least `bound`; `bound` for NaN.
    #[inline(always)]
    fn at_least(self, bound: Self) -> Self {
        self.select(self.simd_gt(bound), bound)
    }

    /// `self`, but at most `bound`; `bound` for NaN.
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

/// `value` if `condition` is true, else `other`.
#[inline(always)]
pub(crate) fn choose<T: SimdValue>(condition: T::SimdBool, value: T, other: T) -> T {
    value.select(condition, other)
}

/// One if `condition` is true, else zero. For a single number it is converted from an integer, for
/// which no compiler makes a branch.
#[inline(always)]
pub(crate) fn indicator<T: Real>(condition: T::SimdBool) -> T {
    match T::LANES {
        1 => T::of(f64::from(condition.bitmask() as u32)),
        _ => choose(condition, T::one(), T::zero()),
    }
}
