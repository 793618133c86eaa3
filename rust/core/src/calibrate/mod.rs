//! Calibration: the steps that run once per sample of a record, or live.
//!
//! The fit of a sensor's errors runs once per record and is not part of this crate. It uses
//! [`propagate_turn`], the rotation between two static intervals with its sensitivities.
//! [`ImuCorrector`] applies the fit. [`TemperatureFilter`] learns bias and temperature slope while
//! samples arrive. [`integrate`] computes an orientation from rates.
//!
//! The model is `z = W ω + b + G f`: `z` is a raw sample of the gyro, ω the rate, f the specific
//! force. The correction is `ω = M (z - b - G f)`.

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

/// Largest number of a rate, a step or a matrix: all products are finite.
const MAX_NUMBER: f64 = 1e30;

/// A number in the range of any sensor, else NaN.
#[inline(always)]
fn clamp(x: f64) -> f64 {
    x.clamp(-MAX_NUMBER, MAX_NUMBER)
}

/// A sample of three axes.
#[inline(always)]
fn axes(sample: &[f64; 3]) -> Vector3<f64> {
    Vector3::from(sample.map(clamp))
}
