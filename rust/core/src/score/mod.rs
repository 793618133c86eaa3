//! Measures of what a filter does for an axis, and the average that it has to beat.
//!
//! Measures work in blocks that begin at fixed samples, so that the pieces in which a record comes
//! do not change a digit, and no sum loses any in a long one.

#[cfg(feature = "std")]
mod axis;
#[cfg(feature = "std")]
mod coasting;
mod exponential_mean;
#[cfg(feature = "std")]
mod sums;

#[cfg(feature = "std")]
pub use axis::{AxisScores, Score, Totals};
pub use exponential_mean::exponential_mean;

/// Samples that are measured together.
#[cfg(feature = "std")]
const BLOCK: usize = 256;
