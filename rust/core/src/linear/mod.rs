//! The linear Kalman filter for any linear model with an input:
//!
//! x ← F x + B u + w, z = H x + v; w has covariance Q and v has covariance R.
//!
//! The covariance is always corrected in Joseph's form, P ← (I - K H) P (I - K H)ᵀ + K R Kᵀ. It
//! stays definite where shorter forms fail (R. S. Bucy, P. D. Joseph, *Filtering for Stochastic
//! Processes with Applications to Guidance*, 1968).
//!
//! - An element of a measurement is missing if it is not finite or beyond [`MAX_SAMPLE`]. The other
//!   elements of its vector still correct the state. A missing input counts as zero.
//! - A measurement corrects nothing if earlier elements of its vector determine it to rounding, or
//!   if it has no variance.
//! - The initial state is valid before the first sample: each sample begins with a prediction.
//!
//! [`LinearKalman`] is a filter of fixed size and needs neither `std` nor an allocator.
//! `LinearBank` has sizes known at run time, channels, and batches of whole records.
//!
//! Its matrices are slices, because matrices of nalgebra have a compiled size or allocate in a
//! step. The bank is not a [`Stream`](crate::Stream), because the input of a stream has a compiled
//! size. It is not a `Bank`, because the channels share one covariance and its n³ work.

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
