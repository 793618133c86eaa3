//! Calibration for Python.

mod corrector;
mod record;
mod temperature;

pub use corrector::ImuCorrector;
pub use record::{carry_turns, integrate_rates};
pub use temperature::TemperatureFilter;
