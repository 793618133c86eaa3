//! The linear Kalman filter for models of any kind, with an input:
//!
//! x ← F x + B u + w, z = H x + v, with w of covariance Q and v of covariance R.
//!
//! The covariance is corrected by Joseph's form, P ← (I - K H) P (I - K H)ᵀ + K R Kᵀ, always: it
//! stays definite where the shorter forms collapse (R. S. Bucy, P. D. Joseph, *Filtering for
//! Stochastic Processes with Applications to Guidance*, 1968).
//!
//! - A measurement is missing where it is not finite or beyond [`MAX_SAMPLE`]; what is left of a
//!   vector corrects. An input that is missing counts as zero.
//! - A measurement that those before it in its vector determine to rounding, and one without any
//!   variance, cannot be weighed and corrects nothing.
//! - The initial state belongs to the time before the first sample: each begins with a prediction.
//!
//! [`LinearKalman`] holds a filter of fixed size and needs neither `std` nor an allocator.
//! `LinearBank` has sizes known at run time, channels, and batches of whole records.
//!
//! Its matrices are slices, not nalgebra's, since one arithmetic serves both: those of nalgebra
//! have a size that is compiled, or allocate in a step. It is no [`Stream`](crate::Stream), whose
//! input has a size that is compiled too, nor a `Bank` of them: channels of one model share one
//! covariance, and its n³ work, which a stream a channel would each do alone.

#[cfg(feature = "std")]
mod bank;
#[cfg(feature = "std")]
mod check;
mod fixed;
#[cfg(feature = "std")]
mod saved;
#[cfg(feature = "std")]
mod smooth;
mod step;

#[cfg(feature = "std")]
pub use bank::{Batch, Known, LinearBank, Model, Varying};
#[cfg(feature = "std")]
pub use check::{check_matrix, settle_covariance};
pub use fixed::{Correction, LinearKalman};
#[cfg(feature = "std")]
pub use smooth::{Filtered, Smoothed};
pub use step::{MAX_ELEMENT, MAX_SAMPLE, MAX_STATE, MAX_VARIANCE};
