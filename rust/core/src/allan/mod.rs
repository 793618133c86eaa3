//! Allan variances: of a record, at all octaves of a stream, and recursively as the measurement
//! noise of a filter.

#[cfg(feature = "std")]
mod curves;
#[cfg(feature = "std")]
mod differences;
#[cfg(feature = "std")]
mod kind;
#[cfg(feature = "std")]
mod lanes;
#[cfg(feature = "std")]
mod modified;
#[cfg(feature = "std")]
mod modified_total;
#[cfg(feature = "std")]
mod noise_type;
#[cfg(feature = "std")]
mod parabolic;
#[cfg(feature = "std")]
mod record;
mod recursive;
#[cfg(feature = "std")]
mod streaming;
#[cfg(feature = "std")]
mod stretches;
#[cfg(feature = "std")]
mod theo1;
#[cfg(feature = "std")]
mod total;

#[cfg(feature = "std")]
pub use curves::{Curve, Estimate, curves};
#[cfg(feature = "std")]
pub use kind::Kind;
#[cfg(feature = "std")]
pub use record::Record;
pub use recursive::{AllanKind, AllanNoise};
#[cfg(feature = "std")]
pub use streaming::StreamingAllan;
