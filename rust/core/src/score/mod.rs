//! Measures of a filter's effect on an axis, and the average as a baseline.
//!
//! Measures work in blocks that begin at fixed samples. The pieces in which a record arrives do not
//! change a digit, and no sum loses digits in a long record.

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

/// Number of samples that are measured together.
#[cfg(feature = "std")]
const BLOCK: usize = 256;
