//! The methods that have names in textbooks, as they were published but for safety: no input leads
//! to NaN, and each starts from the first force and the first field instead of the identity.
//!
//! A magnetometer corrects the heading only, except in [`Madgwick`], which takes its field as a
//! vector. None of them knows rest, motion or a disturbed field.

mod body;
mod complementary;
mod extended;
mod kalman;
mod madgwick;
mod mahony;
mod options;
mod unscented;

pub use complementary::Complementary;
pub use kalman::{Ekf, Kalman, Linearised, Ukf};
pub use madgwick::Madgwick;
pub use mahony::Mahony;
pub use options::{
    BIAS_METHODS, BIAS_SIGMA_METHODS, CONSTANTS, Constant, Constants, METHODS, NamedOptions,
};

use super::auto::{Auto, AutoOptions};
use super::stream::Tagged;

/// A method that has a name and options that can be read.
pub trait Named: Tagged {
    /// As people write it.
    const METHOD: &'static str;

    /// What was chosen.
    fn options(&self) -> NamedOptions;

    /// Whether scale and misalignment of the gyro were given too.
    fn is_calibrated(&self) -> bool {
        false
    }
}

impl Named for Auto {
    const METHOD: &'static str = METHODS[0];

    fn options(&self) -> NamedOptions {
        let AutoOptions { mag, bias, bias_sigma, .. } = *self.options();
        NamedOptions { mag, bias, bias_sigma, constants: Constants::default() }
    }

    fn is_calibrated(&self) -> bool {
        let (given, usual) = (self.options(), AutoOptions::default());
        (given.matrix, given.matrix_sigma) != (usual.matrix, usual.matrix_sigma)
    }
}
