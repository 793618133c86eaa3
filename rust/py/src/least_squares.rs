//! Recursive least squares for Python.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::checkpoint::{self, Label};
use zerorate_core::{Bank, Error, RecursiveLeastSquares as Core, RlsParams};

use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::streaming::{self, AnyBank, Shared, call, reading, streaming, text};
use crate::drift::{Order, for_order, order_error};

/// A bank of models of one order.
trait ModelBank: AnyBank {
    fn order(&self) -> (usize, usize);
    fn params(&self) -> RlsParams;
    fn samples_seen(&self) -> u64;
    fn ready(&self) -> Vec<bool>;
    fn coefficients(&self) -> Vec<f64>;
    fn covariance(&self) -> Vec<f64>;

    fn size(&self) -> usize {
        self.order().0 + self.order().1 + 1
    }
}

impl<const N: usize, const M: usize> ModelBank for Bank<Core<f64, N, M>> {
    fn order(&self) -> (usize, usize) {
        (N - 1, M - N)
    }

    fn params(&self) -> RlsParams {
        *self.streams()[0].params()
    }

    fn samples_seen(&self) -> u64 {
        self.streams()[0].samples_seen()
    }

    fn ready(&self) -> Vec<bool> {
        self.streams().iter().map(Core::ready).collect()
    }

    fn coefficients(&self) -> Vec<f64> {
        let models = self.streams().iter();
        models.flat_map(|model| model.coefficients().as_slice().to_vec()).collect()
    }

    fn covariance(&self) -> Vec<f64> {
        let models = self.streams().iter();
        models.flat_map(|model| model.covariance().as_slice().to_vec()).collect()
    }
}

fn new_sized<const N: usize, const M: usize>(
    params: RlsParams,
    channels: usize,
) -> PyResult<Box<dyn ModelBank>> {
    let model = Core::<f64, N, M>::new(params).map_err(NativeError::from)?;
    Ok(Box::new(Bank::new(&model, channels).map_err(NativeError::from)?))
}

type Restored = (Option<usize>, Box<dyn ModelBank>);

fn restored_sized<const N: usize, const M: usize>(bytes: &[u8]) -> Result<Restored, Error> {
    let (channels, bank) = checkpoint::restore::<Core<f64, N, M>>(bytes)?;
    Ok((channels, Box::new(bank)))
}

/// ARMA(p, q) model with a constant, learned while samples arrive.
///
/// The method is recursive extended least squares of ``y[k] = φ y[k-1…] + θ a[k-1…] + c + a[k]``
/// with a-posteriori residuals a (Fu & Han 2019, equations 8 to 13). Samples are centred and scaled
/// by the mean and standard deviation of a start-up window. A sample that is not finite (or
/// ``update(None)``) is missing and changes nothing. One object serves one thread at a time.
///
/// Parameters
/// ----------
/// order : (int, int), default (2, 1)
///     Orders p from 1 to 3 and q from 0 to 3; (p, 0) is AR(p).
/// forgetting_factor : float, default 1.0
///     Forgetting factor λ in (0, 1]: a small λ forgets old samples quickly, 1 never forgets. The
///     initial covariance is an upper limit for the covariance.
/// channels : int, optional
///     Number of parallel signals; None is a single signal without a channel axis.
/// startup : int, default 100
///     Number of samples from which offset and scale are learned. The start-up is extended until
///     two samples differ.
/// scale : float, optional
///     Standard deviation of the signal in its own unit; by default it is learned.
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
/// >>> model = zr.identification.RecursiveLeastSquares(order=(1, 0))
/// >>> residuals = model.process(y)
/// >>> bool(abs(model.coefficients[0] - 0.8) < 0.02)
/// True
#[pyclass(generic, module = "zerorate.identification")]
#[derive(Debug)]
pub struct RecursiveLeastSquares {
    shared: Shared<dyn ModelBank>,
}

streaming!(
    RecursiveLeastSquares,
    update: "Process one sample and return its a-posteriori residual.

    Sample and residual are floats, or arrays (k,) with k channels. The residual of a missing
    sample is zero.",
    process: "Return the a-posteriori residual of each sample of a batch.

    Samples and residuals are (n,), or (n, k) with k channels. The interpreter lock is released.",
    out
);

#[pymethods]
impl RecursiveLeastSquares {
    #[new]
    #[pyo3(
        signature = (order=Order::default(), forgetting_factor=1.0, *, channels=None, startup=100, scale=None),
        text_signature = "(order=(2, 1), forgetting_factor=1.0, *, channels=None, startup=100, scale=None)"
    )]
    fn new(
        order: Order,
        forgetting_factor: f64,
        channels: Option<i128>,
        startup: i128,
        scale: Option<f64>,
    ) -> PyResult<Self> {
        let channels = streaming::channels(channels)?;
        let startup = u64::try_from(startup).ok().filter(|n| *n > 1).ok_or_else(|| {
            PyValueError::new_err(format!(
                "startup must be at least two samples long, got {startup}"
            ))
        })?;
        let params = RlsParams { forgetting_factor, startup, scale };
        let (order, channel_count) = (order.0, channels.unwrap_or(1));
        let model = for_order!(order, new_sized(params, channel_count), Err(order_error(order)))?;
        Ok(Self { shared: Shared::new(channels, model).map_err(NativeError::from)? })
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let bank = &this.shared.bank;
        let RlsParams { forgetting_factor, startup, scale } = bank.params();
        let arguments = [
            ("order", format!("{:?}", bank.order()), "(2, 1)"),
            ("forgetting_factor", text(forgetting_factor), "1.0"),
            ("startup", startup.to_string(), "100"),
            ("scale", text(scale), "None"),
        ];
        Ok(call("RecursiveLeastSquares", &arguments, this.shared.channels))
    }
}

getters! { RecursiveLeastSquares, slf, py, this;
    /// Model ``[φ…, θ…, c]``, c in the samples' unit.
    ///
    /// An array (p + q + 1,), or (k, p + q + 1) with k channels.
    coefficients: Object<'py> = {
        let values = this.shared.bank.coefficients();
        this.shared.arrays(py, values, &[this.shared.bank.size()])?
    };
    /// Covariance of the coefficients, for centred and scaled samples.
    ///
    /// It is divided by the variance of the residuals. The shape is (p + q + 1, p + q + 1); k
    /// channels add a first axis of length k.
    covariance: Object<'py> = {
        let values = this.shared.bank.covariance();
        this.shared.arrays(py, values, &[this.shared.bank.size(); 2])?
    };
    /// Samples to date, missing ones included.
    samples_seen: u64 = this.shared.bank.samples_seen();
    /// True after the start-up.
    ///
    /// A bool, or an array (k,) with k channels.
    ready: Object<'py> = {
        let ready = this.shared.bank.ready();
        this.shared.numbers(py, ready)?
    };
    /// Orders (p, q) of the model.
    order: (usize, usize) = this.shared.bank.order();
}

impl RecursiveLeastSquares {
    fn restored(bytes: &[u8]) -> Result<Self, Error> {
        let found = checkpoint::label(bytes)?;
        let expected = Label::of::<Core<f64, 3, 4>>();
        if found.tag() != expected.tag() {
            return Err(Error::Type { found, expected });
        }
        let order = (found.sizes[0], found.sizes[1]);
        let (channels, bank) = for_order!(order, restored_sized(bytes), Err(Error::Content))?;
        Ok(Self { shared: Shared::new(channels, bank)? })
    }
}
