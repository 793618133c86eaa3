//! Calibration for Python.

mod corrector;
mod record;
mod temperature;

pub use corrector::ImuCorrector;
pub use record::{integrate_rates, propagate_turns};
pub use temperature::TemperatureFilter;
