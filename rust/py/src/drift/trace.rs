//! All that a filter knew after each sample, as named arrays.

use pyo3::prelude::*;
use zerorate_core::Snapshot;

use crate::arrays;

/// What one channel's filter knows; matrices row after row.
#[derive(Debug)]
pub struct Readings {
    pub estimate: f64,
    pub innovation: f64,
    pub innovation_variance: f64,
    pub measurement_noise: f64,
    pub bias: f64,
    pub bias_sigma: f64,
    pub at_rest: bool,
    pub gain: Vec<f64>,
    pub process_noise: Vec<f64>,
    pub coefficients: Vec<f64>,
    pub covariance: Vec<f64>,
}

/// Snapshots, one after the other.
#[derive(Debug, Default)]
pub struct Record {
    samples: usize,
    estimate: Vec<f64>,
    innovation: Vec<f64>,
    innovation_variance: Vec<f64>,
    gain: Vec<f64>,
    measurement_noise: Vec<f64>,
    process_noise: Vec<f64>,
    coefficients: Vec<f64>,
    covariance: Vec<f64>,
    missing: Vec<bool>,
    guarded: Vec<bool>,
    pub bias: Vec<f64>,
    pub bias_sigma: Vec<f64>,
    pub at_rest: Vec<bool>,
}

impl Record {
    /// Room for `samples` snapshots of state size `n` and model size `m`.
    pub fn with_capacity(samples: usize, n: usize, m: usize) -> Self {
        Self {
            samples: 0,
            estimate: Vec::with_capacity(samples),
            innovation: Vec::with_capacity(samples),
            innovation_variance: Vec::with_capacity(samples),
            gain: Vec::with_capacity(samples * n),
            measurement_noise: Vec::with_capacity(samples),
            process_noise: Vec::with_capacity(samples * n * n),
            coefficients: Vec::with_capacity(samples * m),
            covariance: Vec::with_capacity(samples * n * n),
            missing: Vec::with_capacity(samples),
            guarded: Vec::with_capacity(samples),
            bias: Vec::with_capacity(samples),
            bias_sigma: Vec::with_capacity(samples),
            at_rest: Vec::with_capacity(samples),
        }
    }

    /// Adds one snapshot.
    pub fn push<const N: usize, const M: usize>(&mut self, now: &Snapshot<f64, N, M>) {
        self.samples += 1;
        self.estimate.push(now.estimate);
        self.innovation.push(now.innovation);
        self.innovation_variance.push(now.innovation_variance);
        self.gain.extend_from_slice(now.gain.as_slice());
        self.measurement_noise.push(now.measurement_noise);
        self.process_noise.extend_from_slice(now.process_noise.as_slice());
        self.coefficients.extend_from_slice(now.coefficients.as_slice());
        self.covariance.extend_from_slice(now.covariance.as_slice());
        self.missing.push(now.missing);
        self.guarded.push(now.guarded);
        self.bias.push(now.bias);
        self.bias_sigma.push(now.bias_sigma);
        self.at_rest.push(now.at_rest);
    }
}

/// What a filter knew after each of n samples; with k channels every array has a second axis k.
///
/// Attributes
/// ----------
/// estimate : ndarray, float64, (n,)
///     Filtered rate, in the unit of the samples.
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
///     The step of the process noise was shortened to keep it positive semidefinite.
/// bias : ndarray, float64, (n,)
///     Drift learned at rest and held in motion, in the unit of the samples.
/// bias_sigma : ndarray, float64, (n,)
///     Its standard deviation as the filter sees it.
/// at_rest : ndarray, bool, (n,)
///     The filter learned; always true with ``motion="ignore"``.
#[pyclass(frozen, get_all, module = "zerorate")]
#[derive(Debug)]
pub struct Trace {
    estimate: Py<PyAny>,
    innovation: Py<PyAny>,
    innovation_variance: Py<PyAny>,
    gain: Py<PyAny>,
    measurement_noise: Py<PyAny>,
    process_noise: Py<PyAny>,
    coefficients: Py<PyAny>,
    covariance: Py<PyAny>,
    missing: Py<PyAny>,
    guarded: Py<PyAny>,
    bias: Py<PyAny>,
    bias_sigma: Py<PyAny>,
    at_rest: Py<PyAny>,
}

impl Trace {
    /// The arrays of a record of `channels` channels.
    pub fn new(
        py: Python<'_>,
        record: Record,
        channels: Option<usize>,
        (n, m): (usize, usize),
    ) -> PyResult<Self> {
        let axes = match channels {
            None => vec![record.samples],
            Some(k) => vec![record.samples / k, k],
        };
        let floats = |values: Vec<f64>, more: &[usize]| -> PyResult<Py<PyAny>> {
            Ok(arrays::array(py, values, &[&axes, more].concat())?.unbind())
        };
        let flags = |values: Vec<bool>| -> PyResult<Py<PyAny>> {
            Ok(arrays::array(py, values, &axes)?.unbind())
        };
        Ok(Self {
            estimate: floats(record.estimate, &[])?,
            innovation: floats(record.innovation, &[])?,
            innovation_variance: floats(record.innovation_variance, &[])?,
            gain: floats(record.gain, &[n])?,
            measurement_noise: floats(record.measurement_noise, &[])?,
            process_noise: floats(record.process_noise, &[n, n])?,
            coefficients: floats(record.coefficients, &[m])?,
            covariance: floats(record.covariance, &[n, n])?,
            missing: flags(record.missing)?,
            guarded: flags(record.guarded)?,
            bias: floats(record.bias, &[])?,
            bias_sigma: floats(record.bias_sigma, &[])?,
            at_rest: flags(record.at_rest)?,
        })
    }
}

#[pymethods]
impl Trace {
    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.estimate.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("Trace of {} samples", self.__len__(py)?))
    }
}
