//! States whose numbers may each represent several channels.

use nalgebra::{SMatrix, Scalar, SimdValue};
use pulp::Simd;

use super::lane::Lane;

/// A state of several channels, with one lane per channel in each number.
pub trait Laned: Sized {
    /// The state of one channel.
    type One;

    /// The same state in every lane.
    fn splat(one: &Self::One) -> Self;

    /// The state of one lane.
    fn lane(&self, i: usize) -> Self::One;

    /// Copies a state into one lane; common fields stay.
    fn set_lane(&mut self, i: usize, one: &Self::One);
}

impl<S: Simd> Laned for Lane<S> {
    type One = f64;

    #[inline(always)]
    fn splat(one: &f64) -> Self {
        <Self as SimdValue>::splat(*one)
    }

    #[inline(always)]
    fn lane(&self, i: usize) -> f64 {
        self.extract(i)
    }

    #[inline(always)]
    fn set_lane(&mut self, i: usize, one: &f64) {
        self.replace(i, *one);
    }
}

impl<L: Laned + Scalar, const R: usize, const C: usize> Laned for SMatrix<L, R, C>
where
    L::One: Scalar,
{
    type One = SMatrix<L::One, R, C>;

    // Loops, not closures: a closure called from a function that is not inlined has no vector
    // instructions.
    #[inline(always)]
    fn splat(one: &Self::One) -> Self {
        let mut numbers = Self::from_element(L::splat(&one[0]));
        for (numbers, number) in numbers.iter_mut().zip(one.iter()) {
            *numbers = L::splat(number);
        }
        numbers
    }

    fn lane(&self, i: usize) -> Self::One {
        self.map(|numbers| numbers.lane(i))
    }

    fn set_lane(&mut self, i: usize, one: &Self::One) {
        self.zip_apply(one, |numbers, number| numbers.set_lane(i, &number));
    }
}

impl<L: Laned, const N: usize> Laned for [L; N] {
    type One = [L::One; N];

    #[inline(always)]
    fn splat(one: &Self::One) -> Self {
        one.each_ref().map(L::splat)
    }

    fn lane(&self, i: usize) -> Self::One {
        self.each_ref().map(|numbers| numbers.lane(i))
    }

    fn set_lane(&mut self, i: usize, one: &Self::One) {
        self.iter_mut().zip(one).for_each(|(numbers, number)| numbers.set_lane(i, number));
    }
}

/// Implements [`Laned`] from the names of fields: fields with numbers, and common fields.
macro_rules! laned {
    ($state:ident [$($size:ident),*] { $($number:ident),* } common { $($common:ident),* }) => {
        impl<S: pulp::Simd, $(const $size: usize),*> $crate::math::Laned
            for $state<$crate::math::Lane<S>, $($size),*>
        {
            type One = $state<f64, $($size),*>;

            #[inline(always)]
            fn splat(one: &Self::One) -> Self {
                use $crate::math::Laned;
                Self { $($number: Laned::splat(&one.$number),)* $($common: one.$common),* }
            }

            fn lane(&self, i: usize) -> Self::One {
                use $crate::math::Laned;
                $state { $($number: Laned::lane(&self.$number, i),)* $($common: self.$common),* }
            }

            fn set_lane(&mut self, i: usize, one: &Self::One) {
                use $crate::math::Laned;
                $(Laned::set_lane(&mut self.$number, i, &one.$number);)*
            }
        }
    };
}
pub(crate) use laned;
