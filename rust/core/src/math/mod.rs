//! Numbers, distributions and parts of records that several modules share.

#[cfg(feature = "std")]
pub mod distributions;
#[cfg(feature = "std")]
pub(crate) mod parallel;
#[cfg(feature = "std")]
pub(crate) mod segments;
