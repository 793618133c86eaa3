//! Allan variances: of a record, at all octaves of a stream, and recursively as the measurement
//! noise of a filter.

#[cfg(feature = "std")]
mod deviation;
#[cfg(feature = "std")]
mod differences;
#[cfg(feature = "std")]
mod phases;
mod recursive;
#[cfg(feature = "std")]
mod streaming;

#[cfg(feature = "std")]
pub use deviation::{OverlappingAllan, overlapping_allan_deviation};
pub use recursive::{AllanKind, AllanNoise};
#[cfg(feature = "std")]
pub use streaming::StreamingAllan;
