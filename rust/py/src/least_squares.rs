//! Recursive least squares for Python.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::checkpoint::{self, Kind};
use zerorate_core::{Bank, Error, RecursiveLeastSquares as Core, RlsParams};

use crate::drift::any::{Order, for_order, label, order_error};
use crate::errors::NativeError;
use crate::shared::{self, Shared, exclusive, reading};
use crate::stream::{Labelled, Stream};

/// A bank of models whose order only the box knows.
trait AnyModel: Stream + std::fmt::Debug {
    fn clone_box(&self) -> Box<dyn AnyModel>;
    fn order(&self) -> (usize, usize);
    fn forgetting_factor(&self) -> f64;
    fn samples_seen(&self) -> u64;
    fn ready(&self) -> Vec<bool>;
    fn coefficients(&self) -> Vec<f64>;
    fn covariance(&self) -> Vec<f64>;
}

impl<const N: usize, const M: usize> AnyModel for Labelled<Core<f64, N, M>> {
    fn clone_box(&self) -> Box<dyn AnyModel> {
        Box::new(self.clone())
    }

    fn order(&self) -> (usize, usize) {
        (N - 1, M - N)
    }

    fn forgetting_factor(&self) -> f64 {
        self.bank.filters()[0].params().forgetting_factor
    }

    fn samples_seen(&self) -> u64 {
        self.bank.filters()[0].samples_seen()
    }

    fn ready(&self) -> Vec<bool> {
        self.bank.filters().iter().map(Core::ready).collect()
    }

    fn coefficients(&self) -> Vec<f64> {
        let models = self.bank.filters().iter();
        models.flat_map(|model| model.coefficients().as_slice().to_vec()).collect()
    }

    fn covariance(&self) -> Vec<f64> {
        let models = self.bank.filters().iter();
        models.flat_map(|model| model.covariance().as_slice().to_vec()).collect()
    }
}

fn new_sized<const N: usize, const M: usize>(
    params: RlsParams,
    channels: usize,
) -> PyResult<Box<dyn AnyModel>> {
    let model = Core::<f64, N, M>::new(params).map_err(NativeError::from)?;
    let label = label(Kind::RecursiveLeastSquares, N, M);
    Ok(Box::new(Labelled { label, bank: Bank::new(&model, channels) }))
}

type Saved = (Option<usize>, Box<dyn AnyModel>);

fn from_bytes_sized<const N: usize, const M: usize>(bytes: &[u8]) -> Result<Saved, Error> {
    let label = label(Kind::RecursiveLeastSquares, N, M);
    let (channels, bank): (Option<usize>, Bank<Core<f64, N, M>>) =
        checkpoint::read::<(_, Bank<Core<f64, N, M>>)>(label, bytes)?;
    if bank.filters().len() != channels.unwrap_or(1) || bank.filters().is_empty() {
        return Err(Error::Content);
    }
    Ok((channels, Box::new(Labelled { label, bank })))
}

/// ARMA(p, q) model with a constant, learned while samples arrive.
///
/// Recursive extended least squares of ``y[k] = φ y[k-1…] + θ a[k-1…] + c + a[k]`` with
/// a-posteriori residuals a (Fu & Han 2019, equations 8 to 13), on samples centred and scaled by
/// what a start-up window says. A sample that is not finite (or ``update(None)``) is missing and teaches
/// nothing. One object serves one thread at a time.
///
/// Parameters
/// ----------
/// order : (int, int), default (2, 1)
///     Orders p from 1 to 3 and q from 0 to 3; (p, 0) is AR(p).
/// forgetting_factor : float, default 1.0
///     λ in (0, 1]: small forgets old samples quickly, 1 never forgets. The covariance never grows
///     beyond its start.
/// channels : int, optional
///     Number of signals side by side; None is a single one.
/// startup : int, default 100
///     Samples from which offset and scale are learned (and until two samples differ).
/// scale : float, optional
///     Deviation of the signal in its own unit where it is known; else it is learned.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range.
///
/// Examples
/// --------
/// >>> import numpy as np, zerorate as zr
/// >>> e = np.random.default_rng(1).standard_normal(20_000)
/// >>> y = np.zeros_like(e)
/// >>> for k in range(1, len(e)):
/// ...     y[k] = 0.8 * y[k - 1] + e[k]
/// >>> model = zr.RecursiveLeastSquares(order=(1, 0))
/// >>> residuals = model.process(y)
/// >>> bool(abs(model.coefficients[0] - 0.8) < 0.02)
/// True
#[pyclass(module = "zerorate")]
#[derive(Debug)]
pub struct RecursiveLeastSquares {
    order: (usize, usize),
    forgetting_factor: f64,
    shared: Shared<dyn AnyModel>,
}

#[pymethods]
impl RecursiveLeastSquares {
    #[new]
    #[pyo3(
        signature = (order=Order::default(), forgetting_factor=1.0, channels=None, *, startup=100, scale=None),
        text_signature = "(order=(2, 1), forgetting_factor=1.0, channels=None, *, startup=100, scale=None)"
    )]
    fn new(
        order: Order,
        forgetting_factor: f64,
        channels: Option<i128>,
        startup: i128,
        scale: Option<f64>,
    ) -> PyResult<Self> {
        let channels = shared::channels(channels)?;
        let startup = u64::try_from(startup).ok().filter(|n| *n > 1).ok_or_else(|| {
            PyValueError::new_err(format!(
                "startup must be at least two samples long, got {startup}"
            ))
        })?;
        let params = RlsParams { forgetting_factor, startup, scale };
        let (order, channel_count) = (order.0, channels.unwrap_or(1));
        let model = for_order!(order, new_sized(params, channel_count), Err(order_error(order)))?;
        Ok(Self::wrap(channels, model))
    }

    /// Takes one sample, answers its a-posteriori residual, zero if it is missing: float to float,
    /// with channels (k,) to (k,).
    #[inline]
    fn update<'py>(slf: &Bound<'py, Self>, z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        exclusive(slf)?.shared.update(z)
    }

    /// The residual of each sample of a batch: (n,) to (n,), with channels (n, k) to (n, k); the
    /// interpreter lock is released.
    #[pyo3(signature = (z, out=None, threads=None))]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        z: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        exclusive(slf)?.shared.process(z, out, threads)
    }

    /// Back to before the first sample.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.shared.filter.reset();
        Ok(())
    }

    /// Parameters and state as bytes, with a format version and a checksum.
    fn to_bytes<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyBytes>> {
        reading(slf)?.shared.to_bytes(slf.py())
    }

    /// The object that ``to_bytes`` saved; ValueError if the bytes are not one.
    #[staticmethod]
    fn from_bytes(b: &[u8]) -> PyResult<Self> {
        let found =
            checkpoint::label_of(Kind::RecursiveLeastSquares, b).map_err(NativeError::from)?;
        let (channels, model) =
            for_order!((found.p, found.q), from_bytes_sized(b), Err(Error::Content))
                .map_err(NativeError::from)?;
        Ok(Self::wrap(channels, model))
    }

    /// An independent object in the same state.
    fn copy(slf: &Bound<'_, Self>) -> PyResult<Self> {
        let this = reading(slf)?;
        Ok(Self::wrap(this.shared.channels, this.shared.filter.clone_box()))
    }

    fn __copy__(slf: &Bound<'_, Self>) -> PyResult<Self> {
        Self::copy(slf)
    }

    fn __deepcopy__(slf: &Bound<'_, Self>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        Self::copy(slf)
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let bytes = Self::to_bytes(slf)?;
        Ok((slf.get_type().getattr("from_bytes")?, (bytes,)))
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let channels = this.shared.channels.map_or(String::new(), |k| format!(", channels={k}"));
        Ok(format!(
            "RecursiveLeastSquares(order={:?}, forgetting_factor={:?}{channels})",
            this.order, this.forgetting_factor
        ))
    }

    /// Model ``[φ…, θ…, c]``, c in the unit of the samples: (p + q + 1,), with channels
    /// (k, p + q + 1).
    #[getter]
    fn coefficients<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        let values = this.shared.filter.coefficients();
        this.shared.arrays(py, values, &[this.size()])
    }

    /// Covariance of the coefficients of the centred and scaled samples, over the variance of the
    /// residuals: (p + q + 1, p + q + 1), with channels (k, p + q + 1, p + q + 1).
    #[getter]
    fn covariance<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        let values = this.shared.filter.covariance();
        this.shared.arrays(py, values, &[this.size(); 2])
    }

    /// Samples given so far, missing ones included.
    #[getter]
    fn samples_seen(slf: &Bound<'_, Self>) -> PyResult<u64> {
        Ok(reading(slf)?.shared.filter.samples_seen())
    }

    /// The start-up is over: bool, with channels (k,).
    #[getter]
    fn ready<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), reading(slf)?);
        let ready = this.shared.filter.ready();
        this.shared.numbers(py, ready)
    }

    /// Orders (p, q) of the model.
    #[getter]
    fn order(slf: &Bound<'_, Self>) -> PyResult<(usize, usize)> {
        Ok(reading(slf)?.order)
    }

    /// Number of signals, None for a single one.
    #[getter]
    fn channels(slf: &Bound<'_, Self>) -> PyResult<Option<usize>> {
        Ok(reading(slf)?.shared.channels)
    }
}

impl RecursiveLeastSquares {
    fn wrap(channels: Option<usize>, model: Box<dyn AnyModel>) -> Self {
        Self {
            order: model.order(),
            forgetting_factor: model.forgetting_factor(),
            shared: Shared::new(channels, model),
        }
    }

    fn size(&self) -> usize {
        self.order.0 + self.order.1 + 1
    }
}
