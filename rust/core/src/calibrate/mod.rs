//! Calibration: what is done sample by sample of a record of three axes, and in a loop.
//!
//! The fit of the errors of a sensor is done elsewhere, once a record; it asks here for the turn
//! between two rests with its sensitivities, [`propagate_turn`]. [`ImuCorrector`] removes what the fit has
//! found, [`TemperatureFilter`] learns bias and temperature slope while samples arrive. [`integrate`]
//! makes an orientation of rates.
//!
//! The model is `z = W ω + b + G f`: `z` a raw sample of the gyro, ω the rate, f the specific force;
//! corrected is `ω = M (z - b - G f)`.

mod angle;
mod corrector;
pub mod magnet;
mod temperature;
mod turn;

pub use angle::{Integration, integrate};
pub use corrector::{Correction, Imu, ImuCorrector, TemperatureCurve};
pub use temperature::{TemperatureFilter, TemperatureParams};
pub use turn::{Turn, propagate_turn};

use nalgebra::Vector3;

/// Largest number of a rate, a step or a matrix: products of all of them are finite.
const MAX_NUMBER: f64 = 1e30;

/// A number within what is expected of any sensor; NaN where it is missing.
#[inline(always)]
fn clamp(x: f64) -> f64 {
    x.clamp(-MAX_NUMBER, MAX_NUMBER)
}

/// A sample of three axes.
#[inline(always)]
fn axes(sample: &[f64; 3]) -> Vector3<f64> {
    Vector3::from(sample.map(clamp))
}
