//! All that a drift filter knows, now or after each sample, under the names of its fields.

use pyo3::prelude::*;
use pyo3::types::PyDict;

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
    /// Estimate after the last sample, in the samples' unit: float, with channels (k,). What ``update``
    /// returns with ``output="estimate"``; for ``"auto"`` it is ``bias``.
    estimate;
    /// The last sample minus its prediction, in the samples' unit, zero if it was missing: float, with
    /// channels (k,).
    innovation;
    /// Variance that the filter expected of the innovation, samples' unit squared: float, with
    /// channels (k,).
    innovation_variance;
    /// What the compensated rate is free of, in the samples' unit: float, with channels (k,). Learned
    /// at rest and held in motion; in the first second the mean so far, 0 before the first sample.
    bias;
    /// Standard deviation of the bias as the filter sees it, in the samples' unit: float, with
    /// channels (k,). Of ``"auto"`` as large as the samples while little is known; 0 before the first
    /// sample, when nothing is.
    bias_sigma;
    /// The filter learns, since the sensor is not seen to move: bool, with channels (k,). True from
    /// the first sample on unless ``rest_limit`` is given, since the start is taken for rest until
    /// motion is seen (``status`` tells), and always with ``motion="ignore"``.
    at_rest;
    /// The last sample was at or beyond ``limit``: bool, with channels (k,).
    saturated;
    /// The sensor gives the same sample for longer than chance does: bool, with channels (k,).
    stuck;
    /// Measurement noise variance R, samples' unit squared: float, with channels (k,). For ``"auto"``
    /// the variance of a sample about the bias.
    measurement_noise;
    /// Kalman gain: (p + 1,), with channels (k, p + 1). For ``"auto"``, whose state is the bias alone,
    /// p is 0.
    gain;
    /// Process noise covariance G of a sample, samples' unit squared: (p + 1, p + 1), with channels
    /// (k, p + 1, p + 1). For ``"auto"`` (1, 1): variance of the bias's random step from one sample to the next.
    process_noise;
    /// Model ``[φ…, θ…, c]``, c in the samples' unit: (p + q + 1,), with channels (k, p + q + 1). For
    /// ``"auto"``, which has no ARMA model, [1].
    coefficients;
    /// State covariance P, samples' unit squared: (p + 1, p + 1), with channels (k, p + 1, p + 1).
    /// For ``"auto"`` (1, 1).
    covariance;
}

/// What a filter knew after each of n samples; with k channels every array has a second axis k.
///
/// Attributes
/// ----------
/// estimate : ndarray, float64, (n,)
///     Estimate of the filter, in the unit of the samples; of "auto" the bias.
/// innovation : ndarray, float64, (n,)
///     Sample minus prediction; zero where the sample is missing.
/// innovation_variance : ndarray, float64, (n,)
///     Variance S that the filter expected of the innovation.
/// gain : ndarray, float64, (n, p + 1)
///     Kalman gain; zero where the sample is missing. The state of "auto" is the drift alone: 1 in
///     place of p + 1, and of p + q + 1 below.
/// measurement_noise : ndarray, float64, (n,)
///     Variance R.
/// process_noise : ndarray, float64, (n, p + 1, p + 1)
///     Covariance G.
/// coefficients : ndarray, float64, (n, p + q + 1)
///     Model [φ…, θ…, c].
/// covariance : ndarray, float64, (n, p + 1, p + 1)
///     State covariance P.
/// missing : ndarray, bool, (n,)
///     The sample was not finite.
/// guarded : ndarray, bool, (n,)
///     The step of the process noise was shortened to keep it positive semidefinite; of "robust":
///     the sample was taken for an outlier.
/// bias : ndarray, float64, (n,)
///     Bias learned at rest and held in motion, in the unit of the samples.
/// bias_sigma : ndarray, float64, (n,)
///     Its standard deviation as the filter sees it.
/// at_rest : ndarray, bool, (n,)
///     The filter learned; always true with ``motion="ignore"``.
/// saturated : ndarray, bool, (n,)
///     The sample was at or beyond ``limit``.
/// stuck : ndarray, bool, (n,)
///     The sensor gives the same sample for longer than chance does.
#[pyclass(frozen, module = "zerorate.run")]
#[derive(Debug)]
pub struct Trace {
    /// One array a field.
    pub arrays: Py<PyDict>,
}

readings! { Trace;
    estimate;
    innovation;
    innovation_variance;
    gain;
    measurement_noise;
    process_noise;
    coefficients;
    covariance;
    missing;
    guarded;
    bias;
    bias_sigma;
    at_rest;
    saturated;
    stuck;
}

#[pymethods]
impl Trace {
    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.reading(py, "estimate")?.len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("Trace of {} samples", self.__len__(py)?))
    }
}

impl Trace {
    fn reading<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.arrays.bind(py).as_any().get_item(name)
    }
}
