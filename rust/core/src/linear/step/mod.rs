//! Arithmetic of a step, for sizes known at compile time or at run time.
//!
//! Matrices are stored row after row. Channels with one model that miss the same samples have one
//! covariance, and [`advance_several`] processes several of them at once.

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
/// Largest measurement and input; a larger value is missing.
pub const MAX_SAMPLE: f64 = 1e150;
/// Largest state; a larger state is limited to it.
pub const MAX_STATE: f64 = 1e150;
/// Smallest variance of an innovation: nothing is divided by a smaller value.
const MIN_PIVOT: f64 = 1e-100;
/// Smallest variance for computations.
pub(super) const MIN_VARIANCE: f64 = 1e-250;
/// Error of one rounding, relative to the terms of a sum; and loss per state, relative to the
/// variances, that may have made a covariance indefinite.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Number of channels with one covariance that are processed at once.
pub(super) const LANES: usize = 4;
