//! Allan variances of a record, of a stream at all octaves, and recursively as measurement noise of
//! a filter.

#[cfg(feature = "std")]
mod deviations;
mod noise;
#[cfg(feature = "std")]
mod streaming;

#[cfg(feature = "std")]
pub use deviations::{Curve, Estimate, Kind, Record, curves};
pub use noise::{AllanKind, AllanNoise};
#[cfg(feature = "std")]
pub use streaming::StreamingAllan;
