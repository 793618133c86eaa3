//! A magnetometer's hard and soft iron from ordinary motion: the gyro gives the expected rotation
//! of the field.
//!
//! A tick is a tenth of a second. It has three means: B, the rotation from the sensor to a frame
//! that the gyro holds; y, the field in the sensor's axes; and e, the field rotated by each
//! sample's own rotation. The model is `y = D Bᵀ h + b` with hard iron b, soft iron D and the field
//! h in that frame. All values are in units of the field's median size.

#[cfg(feature = "std")]
mod covariance;
#[cfg(feature = "std")]
mod fit;
#[cfg(feature = "std")]
mod normal;
#[cfg(feature = "std")]
mod partition;
mod span;
mod together;

#[cfg(feature = "std")]
pub use covariance::{Doubt, covariance};
#[cfg(feature = "std")]
pub use fit::{Fit, Ticks, fit};
#[cfg(feature = "std")]
pub use normal::Element;
#[cfg(feature = "std")]
pub use partition::{Partition, Piece, Turned, partition};
pub(crate) use span::{Cost, MAX_EXTRA_COST, MAX_OUTLIER_S, OUTLIER_COST, SPAN_COST, Seen, Span};
pub(crate) use together::step_all;
