//! All that a drift filter knows now, under the names of its fields.

use pyo3::prelude::*;

use super::DriftFilter;
use crate::common::streaming::reading;

/// Getters of fields that the core names.
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
    /// Estimate after the last sample, in the samples' unit: float, with channels (k,). What
    /// ``update`` returns with ``output="estimate"``; for ``"auto"`` it is ``bias``.
    estimate;
    /// The last sample minus its prediction, in the samples' unit, zero if it was missing: float,
    /// with channels (k,).
    innovation;
    /// Predicted variance of the innovation, samples' unit squared: float, with
    /// channels (k,).
    innovation_variance;
    /// Bias subtracted in the compensated rate, in the samples' unit: float, with channels (k,).
    /// Learned at rest and held in motion; in the first second the mean to date, 0 before the first
    /// sample.
    bias;
    /// Standard deviation in the samples' unit: float, with channels (k,). For ``"auto"`` it is
    /// that of the mean bias over the next 10 s about ``bias`` (other spans: ``bias_sigma_over``),
    /// updated every two seconds, and as large as the samples while little is known; for other
    /// methods it is their model's. 0 before the first sample.
    bias_sigma;
    /// True while the filter learns because no motion is detected: bool, with channels (k,).
    /// Without ``rest_limit`` the start counts as rest until motion is detected (see ``status``);
    /// with ``motion="ignore"`` it is always True.
    at_rest;
    /// True if the last sample was at or beyond ``limit``: bool, with channels (k,).
    saturated;
    /// True if the sensor repeats one sample for longer than chance explains: bool, with channels
    /// (k,).
    stuck;
    /// Measurement noise variance R, samples' unit squared: float, with channels (k,). For
    /// ``"auto"`` the variance of a sample about the bias.
    measurement_noise;
    /// Kalman gain: (p + 1,), with channels (k, p + 1). For ``"auto"``, whose state is the bias
    /// alone, p is 0.
    gain;
    /// Process noise covariance G of a sample, samples' unit squared: (p + 1, p + 1), with channels
    /// (k, p + 1, p + 1). For ``"auto"`` (1, 1): variance of the bias's random step from one sample
    /// to the next.
    process_noise;
    /// Model ``[φ…, θ…, c]``, c in the samples' unit: (p + q + 1,), with channels (k, p + q + 1).
    /// For ``"auto"``, which has no ARMA model, [1].
    coefficients;
    /// State covariance P, samples' unit squared: (p + 1, p + 1), with channels (k, p + 1, p + 1).
    /// For ``"auto"`` (1, 1).
    covariance;
}
