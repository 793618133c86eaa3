//! The arithmetic of a step, for sizes known when it is compiled or when it runs.
//!
//! Matrices stand row after row. Where channels have one model and miss the same samples, they have one
//! covariance, and [`advance_several`] takes several of them at once.

mod covariance;
mod definiteness;
mod product;
mod size;
mod states;

pub(super) use self::covariance::{correct_covariance, predict_covariance};
#[cfg(feature = "std")]
pub(super) use self::definiteness::{is_semidefinite, is_settled};
#[cfg(feature = "std")]
pub(super) use self::product::{product, transpose};
pub(super) use self::size::{Fixed, FixedRoom};
#[cfg(feature = "std")]
pub(super) use self::size::{Size, Work};
#[cfg(feature = "std")]
pub(super) use self::states::advance_several;
pub(super) use self::states::{Advance, ChannelOutputs, advance_one, is_known};

/// Largest element of F, B and H.
pub const MAX_ELEMENT: f64 = 1e30;
/// Largest element of Q, R and the initial covariance, and largest trace of a covariance.
pub const MAX_VARIANCE: f64 = 1e60;
/// Largest measurement and input; what is larger is missing.
pub const MAX_SAMPLE: f64 = 1e150;
/// Largest state; what would be larger is held there.
pub const MAX_STATE: f64 = 1e150;
/// Variance of an innovation that none can have: nothing is divided by a smaller one.
const MIN_PIVOT: f64 = 1e-100;
/// Variance too small to be computed with.
pub(super) const MIN_VARIANCE: f64 = 1e-250;
/// Error of one rounding, relative to the terms of a sum; and the loss that may have cost a
/// covariance its definiteness, relative to its variances, a state.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Channels of one covariance that are taken at once.
pub(super) const LANES: usize = 4;
