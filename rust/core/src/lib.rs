#![doc = include_str!("../README.md")]
//! # Conventions
//!
//! - A sample is one angular rate of one axis, in any unit. The scale is learned from the first
//!   samples: if the input is scaled, the output is scaled equally.
//! - A sample that is not finite is *missing*: the filter predicts and does not correct.
//! - `p` and `q` are the orders of the ARMA drift model. `N = p + 1` is the size of the Kalman
//!   state `[y_k, …, y_{k-p+1}, c]`. `M = p + q + 1` is the size of the parameters `[φ, θ, c]`.
//! - Kalman modules use the letters of the literature: `x`, `P`, `G` (process noise covariance of
//!   the state), `R` (measurement noise variance), `S` (innovation variance), `K` (gain).
//! - "FH n" is equation n of Fu & Han, *Acta Photonica Sinica* 48(12), 1212003, 2019.
//!
//! A step allocates nothing, takes constant time and cannot panic. A lane mask replaces every
//! branch on data, so the steps also run on SIMD lanes.

#![cfg_attr(not(feature = "std"), no_std)]
#![deny(unsafe_code)]

pub mod allan;
#[cfg(feature = "std")]
pub mod array;
pub mod attitude;
#[cfg(feature = "std")]
pub mod blackbox;
pub mod calibrate;
#[cfg(feature = "std")]
pub mod checks;
#[cfg(feature = "std")]
pub mod dataflash;
#[cfg(feature = "std")]
pub mod denoise;
pub mod drift;
mod error;
#[cfg(feature = "std")]
pub mod gopro;
#[cfg(feature = "std")]
pub mod identification;
pub mod linear;
pub mod math;
#[cfg(feature = "std")]
pub mod mcap;
#[cfg(feature = "std")]
pub mod memory;
pub mod navigation;
pub mod position;
mod rest;
pub mod score;
pub mod stream;
#[cfg(feature = "std")]
pub mod text;
#[cfg(feature = "std")]
pub mod work;

pub use drift::{
    AutoFilter, AutoParams, Behaviour, DriftFilter, DriftStream, Method, Params, PublishedFilter,
    RecursiveLeastSquares, RestGated, RlsParams, RobustFilter, RobustParams, Start, Status, Tally,
    Zones,
};
pub use error::Error;
pub use rest::{
    Event, MotionAware, MotionDetector, QuietLimits, RestDetector, RestLimits, Tick, longest_quiet,
};
pub use score::exponential_mean;
#[cfg(feature = "std")]
pub use stream::Bank;
pub use stream::{Stream, Traced, checkpoint};
