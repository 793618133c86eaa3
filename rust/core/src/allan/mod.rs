//! Allan variances: of a record, and recursively as the measurement noise of a filter.

#[cfg(feature = "std")]
mod deviation;
mod recursive;

#[cfg(feature = "std")]
pub use deviation::{OverlappingAllan, overlapping_allan_deviation};
pub use recursive::{AllanKind, AllanNoise};
