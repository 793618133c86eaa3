//! Several channels in the lanes of SIMD registers, each to the last bit as if it were alone.

mod lane;
mod laned;

pub(crate) use lane::{Lane, Mask, WIDEST};
pub(crate) use laned::{Laned, laned};
