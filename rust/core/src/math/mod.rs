//! Numbers, matrices and distributions that several modules share: scalars and SIMD lanes,
//! symmetric matrices, rotations, segments of a record.

#[cfg(feature = "std")]
pub mod distributions;
mod elementary;
#[cfg(feature = "std")]
mod lane;
#[cfg(feature = "std")]
mod laned;
#[cfg(feature = "std")]
pub(crate) mod parallel;
mod real;
pub mod rotation;
mod rows;
#[cfg(feature = "std")]
pub(crate) mod segments;
mod symmetric;
pub(crate) mod validity;

pub use elementary::Elementary;
#[cfg(feature = "std")]
pub(crate) use lane::{Lane, MAX_LANES, Mask};
#[cfg(feature = "std")]
pub(crate) use laned::{Laned, laned};
pub use real::{Aside, Limits, Real};
pub(crate) use real::{choose, indicator};
pub(crate) use rows::{Fours, OnRows, Pairs, widest};
pub use symmetric::Symmetric;
pub(crate) use symmetric::vector;
