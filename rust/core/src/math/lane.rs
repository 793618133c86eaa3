//! One number of each of several channels in a SIMD register, with the arithmetic of [`Real`].
//!
//! The registers and instructions are `pulp`'s, which detects them at run time; `wide` fixes them
//! at compile time.

use core::mem::size_of;
use core::ops::{
    Add, AddAssign, BitAnd, BitOr, BitXor, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign,
};

use nalgebra::{SimdBool, SimdPartialOrd, SimdValue};
use num_traits::{One, Zero};
use pulp::bytemuck;
use pulp::{Simd, WithSimd};

use crate::math::{Aside, Real};

/// Number of lanes in the widest register.
pub const MAX_LANES: usize = 8;

/// One `f64` per lane. Only code that `pulp` dispatched to the processor may use it.
#[derive(Debug, Clone, Copy)]
pub struct Lane<S: Simd>(S::f64s);

/// A condition for each lane.
#[derive(Debug, Clone, Copy)]
pub struct Mask<S: Simd>(S::m64s);

/// Token that allows the use of the registers.
#[inline(always)]
#[allow(unsafe_code)]
fn simd<S: Simd>() -> S {
    const { assert!(size_of::<S>() == 0) };
    // SAFETY: the token has no content. `Lane` and `Mask` do not leave this crate. They occur only
    // below `WithSimd::with_simd`, which received the same token.
    unsafe { core::mem::zeroed() }
}

impl<S: Simd> Lane<S> {
    /// The first numbers of a row.
    #[inline(always)]
    pub fn load(numbers: &[f64; MAX_LANES]) -> Self {
        Self(S::as_simd_f64s(numbers).0[0])
    }

    /// All lanes in a row, then zeros.
    #[inline(always)]
    pub fn store(self) -> [f64; MAX_LANES] {
        let mut numbers = [0.0; MAX_LANES];
        S::as_mut_simd_f64s(&mut numbers).0[0] = self.0;
        numbers
    }
}

macro_rules! arithmetic {
    ($($trait:ident $method:ident $assign:ident $assign_method:ident $operation:ident;)*) => {$(
        impl<S: Simd> $trait for Lane<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(simd::<S>().$operation(self.0, other.0))
            }
        }

        impl<S: Simd> $assign for Lane<S> {
            #[inline(always)]
            fn $assign_method(&mut self, other: Self) {
                *self = $trait::$method(*self, other);
            }
        }
    )*};
}

arithmetic! {
    Add add AddAssign add_assign add_f64s;
    Sub sub SubAssign sub_assign sub_f64s;
    Mul mul MulAssign mul_assign mul_f64s;
    Div div DivAssign div_assign div_f64s;
}

impl<S: Simd> Neg for Lane<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(simd::<S>().neg_f64s(self.0))
    }
}

impl<S: Simd> Zero for Lane<S> {
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }

    fn is_zero(&self) -> bool {
        *self == Self::zero()
    }
}

impl<S: Simd> One for Lane<S> {
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }
}

/// Equal in every lane.
impl<S: Simd> PartialEq for Lane<S> {
    fn eq(&self, other: &Self) -> bool {
        self.simd_eq(*other).all()
    }
}

impl<S: Simd> Real for Lane<S> {
    #[inline(always)]
    fn simd_abs(self) -> Self {
        Self(simd::<S>().abs_f64s(self.0))
    }

    #[inline(always)]
    fn simd_sqrt(self) -> Self {
        Self(simd::<S>().sqrt_f64s(self.0))
    }

    fn aside<W: Aside>(work: W) -> W::Output {
        simd::<S>().vectorize(OfItsOwn(work))
    }

    // On x86 this is one instruction; other processors treat NaN differently.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn at_least(self, bound: Self) -> Self {
        Self(simd::<S>().max_f64s(self.0, bound.0))
    }

    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn at_most(self, bound: Self) -> Self {
        Self(simd::<S>().min_f64s(self.0, bound.0))
    }
}

struct OfItsOwn<W>(W);

impl<W: Aside> WithSimd for OfItsOwn<W> {
    type Output = W::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> W::Output {
        self.0.run()
    }
}

#[allow(unsafe_code)]
impl<S: Simd> SimdValue for Lane<S> {
    const LANES: usize = S::F64_LANES;
    type Element = f64;
    type SimdBool = Mask<S>;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(simd::<S>().splat_f64s(value))
    }

    #[inline(always)]
    fn extract(&self, i: usize) -> f64 {
        bytemuck::cast_slice(core::slice::from_ref(&self.0))[i]
    }

    #[inline(always)]
    fn replace(&mut self, i: usize, value: f64) {
        bytemuck::cast_slice_mut(core::slice::from_mut(&mut self.0))[i] = value;
    }

    unsafe fn extract_unchecked(&self, i: usize) -> f64 {
        self.extract(i)
    }

    unsafe fn replace_unchecked(&mut self, i: usize, value: f64) {
        self.replace(i, value);
    }

    #[inline(always)]
    fn select(self, condition: Mask<S>, other: Self) -> Self {
        Self(simd::<S>().select_f64s(condition.0, self.0, other.0))
    }
}

impl<S: Simd> SimdPartialOrd for Lane<S> {
    #[inline(always)]
    fn simd_gt(self, other: Self) -> Mask<S> {
        Mask(simd::<S>().greater_than_f64s(self.0, other.0))
    }

    #[inline(always)]
    fn simd_lt(self, other: Self) -> Mask<S> {
        Mask(simd::<S>().less_than_f64s(self.0, other.0))
    }

    #[inline(always)]
    fn simd_ge(self, other: Self) -> Mask<S> {
        Mask(simd::<S>().greater_than_or_equal_f64s(self.0, other.0))
    }

    #[inline(always)]
    fn simd_le(self, other: Self) -> Mask<S> {
        Mask(simd::<S>().less_than_or_equal_f64s(self.0, other.0))
    }

    #[inline(always)]
    fn simd_eq(self, other: Self) -> Mask<S> {
        Mask(simd::<S>().equal_f64s(self.0, other.0))
    }

    #[inline(always)]
    fn simd_ne(self, other: Self) -> Mask<S> {
        !self.simd_eq(other)
    }

    #[inline(always)]
    fn simd_max(self, other: Self) -> Self {
        Self(simd::<S>().max_f64s(self.0, other.0))
    }

    #[inline(always)]
    fn simd_min(self, other: Self) -> Self {
        Self(simd::<S>().min_f64s(self.0, other.0))
    }

    fn simd_clamp(self, min: Self, max: Self) -> Self {
        self.simd_max(min).simd_min(max)
    }

    fn simd_horizontal_min(self) -> f64 {
        simd::<S>().reduce_min_f64s(self.0)
    }

    fn simd_horizontal_max(self) -> f64 {
        simd::<S>().reduce_max_f64s(self.0)
    }
}

macro_rules! conditions {
    ($($trait:ident $method:ident $operation:ident;)*) => {$(
        impl<S: Simd> $trait for Mask<S> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(simd::<S>().$operation(self.0, other.0))
            }
        }
    )*};
}

conditions! {
    BitAnd bitand and_m64s;
    BitOr bitor or_m64s;
    BitXor bitxor xor_m64s;
}

impl<S: Simd> Not for Mask<S> {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        self ^ Self::every()
    }
}

impl<S: Simd> Mask<S> {
    /// A condition that is true in every lane, known to the compiler.
    #[inline(always)]
    pub fn every() -> Self {
        let zero = simd::<S>().splat_u64s(0);
        Self(simd::<S>().equal_u64s(zero, zero))
    }

    /// True if the condition is true in lane `i`.
    pub fn holds(self, i: usize) -> bool {
        Lane::<S>::one().select(self, Lane::zero()).extract(i) != 0.0
    }
}

impl<S: Simd> SimdBool for Mask<S> {
    fn bitmask(self) -> u64 {
        (0..S::F64_LANES).fold(0, |bits, i| bits | u64::from(self.holds(i)) << i)
    }

    fn and(self) -> bool {
        self.all()
    }

    fn or(self) -> bool {
        self.any()
    }

    fn xor(self) -> bool {
        self.bitmask().count_ones() % 2 == 1
    }

    #[inline(always)]
    fn all(self) -> bool {
        !Lane::<S>::zero().select(self, Lane::one()).simd_gt(Lane::zero()).any()
    }

    #[inline(always)]
    fn any(self) -> bool {
        simd::<S>().first_true_m64s(self.0) < S::F64_LANES
    }

    #[inline(always)]
    fn none(self) -> bool {
        !self.any()
    }

    #[inline(always)]
    fn if_else<R: SimdValue<SimdBool = Self>>(
        self,
        value: impl FnOnce() -> R,
        other: impl FnOnce() -> R,
    ) -> R {
        value().select(self, other())
    }

    fn if_else2<R: SimdValue<SimdBool = Self>>(
        self,
        value: impl FnOnce() -> R,
        second: (impl FnOnce() -> Self, impl FnOnce() -> R),
        other: impl FnOnce() -> R,
    ) -> R {
        self.if_else(value, || second.0().if_else(second.1, other))
    }

    fn if_else3<R: SimdValue<SimdBool = Self>>(
        self,
        value: impl FnOnce() -> R,
        second: (impl FnOnce() -> Self, impl FnOnce() -> R),
        third: (impl FnOnce() -> Self, impl FnOnce() -> R),
        other: impl FnOnce() -> R,
    ) -> R {
        self.if_else(value, || second.0().if_else2(second.1, third, other))
    }
}
