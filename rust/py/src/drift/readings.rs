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
    /// Estimate after the last sample, in the samples' unit: float, with channels (k,).
    ///
    /// ``update`` returns it with ``output="estimate"``. For ``"auto"`` it equals ``bias``.
    estimate;
    /// The last sample minus its prediction, in the samples' unit: float, with channels (k,).
    ///
    /// Zero if the sample was missing.
    innovation;
    /// Predicted variance of the innovation, samples' unit squared: float, with channels (k,).
    innovation_variance;
    /// Bias subtracted in the compensated rate, in the samples' unit: float, with channels (k,).
    ///
    /// Learned at rest and held in motion. It is the mean to date in the first second, and 0 before
    /// the first sample.
    bias;
    /// Standard deviation in the samples' unit: float, with channels (k,).
    ///
    /// For ``"auto"`` it is the standard deviation of the mean bias over the next 10 s, relative to
    /// ``bias``. ``bias_sigma_over`` gives other spans. It is updated every two seconds, and as
    /// large as the samples while little is known. For other methods it follows from their model. 0
    /// before the first sample.
    bias_sigma;
    /// True while the filter learns because no motion is detected: bool, with channels (k,).
    ///
    /// Without ``rest_limit`` the start counts as rest until motion is detected (see ``status``).
    /// With ``motion="ignore"`` it is always True.
    at_rest;
    /// True if the last sample was at or beyond ``limit``: bool, with channels (k,).
    saturated;
    /// True if the sensor repeats one sample for longer than chance explains: bool, with channels
    /// (k,).
    stuck;
    /// Measurement noise variance R, samples' unit squared: float, with channels (k,).
    ///
    /// For ``"auto"`` it is the variance of a sample about the bias.
    measurement_noise;
    /// Kalman gain: (p + 1,), with channels (k, p + 1).
    ///
    /// p is 0 for ``"auto"``: its state is the bias alone.
    gain;
    /// Process noise covariance G of a sample, in the samples' unit squared.
    ///
    /// The shape is (p + 1, p + 1), with channels (k, p + 1, p + 1). For ``"auto"`` it is (1, 1):
    /// the variance of the bias's random step between samples.
    process_noise;
    /// Model ``[φ…, θ…, c]``, c in the samples' unit: (p + q + 1,), with channels (k, p + q + 1).
    ///
    /// For ``"auto"``, which has no ARMA model, it is [1].
    coefficients;
    /// State covariance P, samples' unit squared: (p + 1, p + 1), with channels (k, p + 1, p + 1).
    ///
    /// For ``"auto"`` it is (1, 1).
    covariance;
}
