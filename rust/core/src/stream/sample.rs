//! Samples in arrays: inputs and outputs of a stream.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::math::{Limits, Real};

/// Number type of streams: `f32` or `f64`.
pub trait Number:
    Limits
    + Real<Element = Self, SimdBool = bool>
    + Input
    + Output
    + Into<f64>
    + Serialize
    + DeserializeOwned
{
}

impl Number for f32 {}
impl Number for f64 {}

/// Shape of an output's field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// One number.
    Number,
    /// A vector of this length.
    Vector(usize),
    /// A square matrix with this number of rows.
    Matrix(usize),
    /// True or false.
    Flag,
}

impl Shape {
    /// Count of the field's numbers; a flag has none.
    pub const fn numbers(self) -> usize {
        match self {
            Self::Number => 1,
            Self::Vector(n) => n,
            Self::Matrix(n) => n * n,
            Self::Flag => 0,
        }
    }
}

/// A named part of an output. Numbers and flags are in the order of the fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    /// Name of the field; empty if the output has only this field.
    pub name: &'static str,
    /// Shape of the field.
    pub shape: Shape,
}

/// Input of a stream for one sample: a fixed count of numbers, NaN for a missing number.
pub trait Input: Copy {
    /// Count of the input's numbers.
    const NUMBERS: usize;

    /// Reads a sample from its numbers.
    fn read(numbers: &[f64]) -> Self;
}

/// Output of a stream for one sample: numbers and flags.
pub trait Output: Copy {
    /// Parts of the output.
    const FIELDS: &'static [Field];
    /// Count of the output's numbers.
    const NUMBERS: usize = sizes(Self::FIELDS).0;
    /// Count of the output's flags.
    const FLAGS: usize = sizes(Self::FIELDS).1;

    /// Writes the numbers and flags.
    fn write(self, numbers: &mut [f64], flags: &mut [bool]);
}

/// Counts of numbers and flags in a record of these fields.
pub const fn sizes(fields: &[Field]) -> (usize, usize) {
    let (mut numbers, mut flags, mut i) = (0, 0, 0);
    while i < fields.len() {
        numbers += fields[i].shape.numbers();
        flags += matches!(fields[i].shape, Shape::Flag) as usize;
        i += 1;
    }
    (numbers, flags)
}

const fn unnamed(shape: Shape) -> Field {
    Field { name: "", shape }
}

macro_rules! number {
    ($type:ty) => {
        impl Input for $type {
            const NUMBERS: usize = 1;

            #[inline(always)]
            fn read(numbers: &[f64]) -> Self {
                numbers[0] as $type
            }
        }

        impl<const N: usize> Input for [$type; N] {
            const NUMBERS: usize = N;

            #[inline(always)]
            fn read(numbers: &[f64]) -> Self {
                core::array::from_fn(|i| numbers[i] as $type)
            }
        }

        impl Output for $type {
            const FIELDS: &'static [Field] = &[unnamed(Shape::Number)];

            #[inline(always)]
            fn write(self, numbers: &mut [f64], _: &mut [bool]) {
                numbers[0] = f64::from(self);
            }
        }

        impl<const N: usize> Output for [$type; N] {
            const FIELDS: &'static [Field] = &[unnamed(Shape::Vector(N))];

            #[inline(always)]
            fn write(self, numbers: &mut [f64], _: &mut [bool]) {
                for (slot, number) in numbers.iter_mut().zip(self) {
                    *slot = f64::from(number);
                }
            }
        }
    };
}

number!(f32);
number!(f64);

impl Output for bool {
    const FIELDS: &'static [Field] = &[unnamed(Shape::Flag)];

    #[inline(always)]
    fn write(self, _: &mut [f64], flags: &mut [bool]) {
        flags[0] = self;
    }
}

impl Output for () {
    const FIELDS: &'static [Field] = &[];

    #[inline(always)]
    fn write(self, _: &mut [f64], _: &mut [bool]) {}
}
