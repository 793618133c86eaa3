//! What Python sees of the core: conversion of arguments, errors, release of the interpreter lock.
#![forbid(unsafe_code)]

mod allan;
mod common;
mod deviations;
mod drift;
mod ema;
mod identify;
mod least_squares;
mod rest;
mod scores;
mod statistics;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::allan::{AllanNoise, StreamingAllan};
    #[pymodule_export]
    use crate::deviations::{allan_deviations, longest_factor};
    #[pymodule_export]
    use crate::drift::{DriftFilter, Trace, filter_options};
    #[pymodule_export]
    use crate::ema::exponential_mean;
    #[pymodule_export]
    use crate::identify::arma::{arma_fit, arma_grid, arma_likelihood};
    #[pymodule_export]
    use crate::identify::autoregression::{autoregression_variances, fit_autoregression};
    #[pymodule_export]
    use crate::identify::outliers::without_outliers;
    #[pymodule_export]
    use crate::identify::products::lagged_products;
    #[pymodule_export]
    use crate::identify::residuals::arma_residuals;
    #[pymodule_export]
    use crate::identify::reversals::reversals;
    #[pymodule_export]
    use crate::least_squares::RecursiveLeastSquares;
    #[pymodule_export]
    use crate::rest::RestDetector;
    #[pymodule_export]
    use crate::scores::ReplayScores;
    #[pymodule_export]
    use crate::statistics::{chi_squared_quantile, chi_squared_survival, log_normal_cdf};
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
