//! State of a drift filter, under the names of its fields.

use pyo3::prelude::*;

use super::DriftFilter;
use crate::common::streaming::reading;

/// Getters of fields with the core's names.
macro_rules! readings {
    ($class:ident; $($(#[$doc:meta])* $name:ident;)*) => {
        #[pymethods]
        impl $class {
            $(
                $(#[$doc])*
                #[getter]
                fn $name<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
                    reading(slf)?.reading(slf.py(), stringify!($name))
                }
            )*
        }
    };
}

readings! { DriftFilter;
    /// Smoothed rate after the last sample, in the samples' unit; for ``"auto"`` the bias.
    ///
    /// ``update`` returns it with ``output="estimate"``. A float, or an array (k,) with k channels.
    estimate;
    /// The last sample minus its prediction, in the samples' unit.
    ///
    /// Zero if the sample was missing. A float, or an array (k,) with k channels.
    innovation;
    /// Predicted variance of the innovation, samples' unit squared.
    ///
    /// A float, or an array (k,) with k channels.
    innovation_variance;
    /// Bias that is subtracted from the samples, in their unit.
    ///
    /// It is learned at rest and held in motion. In the first second it is the mean to date, and 0
    /// before the first sample. A float, or an array (k,) with k channels.
    bias;
    /// Standard deviation of the bias, in the samples' unit.
    ///
    /// For ``"auto"`` it is the standard deviation of the mean bias over the next 10 s, relative to
    /// ``bias``. ``bias_sigma_over`` gives other spans. It is updated every two seconds. While
    /// little is known, it is as large as the samples. For other methods it follows from their
    /// model. It is 0 before the first sample. A float, or an array (k,) with k channels.
    bias_sigma;
    /// True while no motion is detected and the filter learns.
    ///
    /// Without ``rest_limit`` the start counts as rest until motion is detected (see ``status``).
    /// With ``motion="ignore"`` it is always True. A bool, or an array (k,) with k channels.
    at_rest;
    /// True if the last sample was at or beyond ``limit``.
    ///
    /// A bool, or an array (k,) with k channels.
    saturated;
    /// True if the sensor repeats one sample for longer than can be chance.
    ///
    /// A bool, or an array (k,) with k channels.
    stuck;
    /// Measurement noise variance R, samples' unit squared.
    ///
    /// For ``"auto"`` it is the variance of the samples about the bias. A float, or an array (k,)
    /// with k channels.
    measurement_noise;
    /// Kalman gain.
    ///
    /// p is 0 for ``"auto"``: its state is the bias alone. An array (p + 1,), or (k, p + 1) with k
    /// channels.
    gain;
    /// Process noise covariance G of a sample, in the samples' unit squared.
    ///
    /// The shape is (p + 1, p + 1); k channels add a first axis of length k. For ``"auto"`` the
    /// shape is (1, 1): the variance of the bias's random step between samples.
    process_noise;
    /// Model ``[φ…, θ…, c]``, c in the samples' unit.
    ///
    /// For ``"auto"``, which has no ARMA model, it is [1]. An array (p + q + 1,), or (k, p + q + 1)
    /// with k channels.
    coefficients;
    /// State covariance P, samples' unit squared.
    ///
    /// For ``"auto"`` it is (1, 1). An array (p + 1, p + 1), or (k, p + 1, p + 1) with k channels.
    covariance;
}
