//! Calibration for Python.

mod corrector;
mod record;

pub use corrector::ImuCorrector;
pub use record::{carry_turns, integrate_rates};
