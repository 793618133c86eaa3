//! The core for Python: conversion of arguments, errors, release of the interpreter lock.
#![forbid(unsafe_code)]

mod allan;
mod array;
mod attitude;
mod blackbox;
mod calibrate;
mod checks;
mod common;
mod dataflash;
mod denoise;
mod deviations;
mod drift;
mod foot;
mod gopro;
mod identification;
mod least_squares;
mod linear;
mod magnet;
mod math;
mod mcap;
mod navigation;
mod position;
mod rest;
mod score;
mod text;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::allan::{AllanNoise, StreamingAllan};
    #[pymodule_export]
    use crate::array::GyroArray;
    #[pymodule_export]
    use crate::attitude::{Attitude, Tilt, attitude_options, tilt_options};
    #[pymodule_export]
    use crate::blackbox::read_blackbox;
    #[pymodule_export]
    use crate::calibrate::{ImuCorrector, TemperatureFilter, integrate_rates, propagate_turns};
    #[pymodule_export]
    use crate::checks::{check_field, check_fit, check_gyro, check_ticks};
    #[pymodule_export]
    use crate::common::rules::register;
    #[pymodule_export]
    use crate::dataflash::dataflash_index;
    #[pymodule_export]
    use crate::denoise::{WaveletDenoiser, denoise, wavelet_decomposition};
    #[pymodule_export]
    use crate::deviations::{allan_deviations, longest_factor};
    #[pymodule_export]
    use crate::drift::{DriftFilter, filter_options};
    #[pymodule_export]
    use crate::foot::{FootFilter, foot_lead, foot_track, restore_clipped_rates};
    #[pymodule_export]
    use crate::gopro::read_gopro;
    #[pymodule_export]
    use crate::identification::{
        arma_fit, arma_grid, arma_likelihood, arma_residuals, autoregression_variances,
        fit_autoregression, lagged_products, reversals, without_outliers,
    };
    #[pymodule_export]
    use crate::least_squares::RecursiveLeastSquares;
    #[pymodule_export]
    use crate::linear::{LinearKalman, smooth_linear};
    #[pymodule_export]
    use crate::magnet::{magnet_covariance, magnet_fit, magnet_partition};
    #[pymodule_export]
    use crate::math::{chi_squared_quantile, chi_squared_survival, log_normal_cdf};
    #[pymodule_export]
    use crate::mcap::{pack_lz4, read_mcap};
    #[pymodule_export]
    use crate::navigation::{NavigationBank, NavigationFilter, NavigationRecord};
    #[pymodule_export]
    use crate::position::{PositionFilter, position_options};
    #[pymodule_export]
    use crate::rest::{MotionDetector, RestDetector, longest_quiet};
    #[pymodule_export]
    use crate::score::{ReplayScores, exponential_mean};
    #[pymodule_export]
    use crate::text::parse_rows;
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        let py = module.py();
        // If NumPy is not imported yet, the first array that is read imports it.
        if py.import("sys")?.getattr("modules")?.contains("numpy")? {
            crate::common::arrays::find_numpy(py)?;
        }
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
