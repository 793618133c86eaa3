//! Bias and temperature slope while samples arrive, for Python.

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use zerorate_core::calibrate::{TemperatureFilter as Core, TemperatureParams};
use zerorate_core::{Bank, RestLimits};

use crate::common::arrays::{self, Record, Samples};
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::streaming::{self, Shared, call, exclusive, reading, streaming, text};

/// Bias of a gyro and its change with temperature, learned live at rest.
///
/// `update` returns the bias at the current temperature. A `RestDetector` detects rest, in ticks of
/// a quarter of a second. At rest the bias is learned; in motion it follows only the temperature.
/// Several Kalman filters have the states bias and slope, and ``H = [1, T - reference]``. They
/// differ in the random walk of the bias. Their likelihoods are their weights, and no parameter
/// needs tuning.
///
/// A temperature in whole degrees is averaged over the ticks between two changes of its value. A
/// rate or temperature that is not finite is missing. If the rate is missing, the bias is held. If
/// the temperature is missing, the last temperature is used. Before the first rest the bias is
/// zero. One object serves one thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Samples per second.
/// reference : float, default 25.0
///     Temperature of the bias state, degC. It has no effect once the slope is known.
/// slope : float, optional
///     Prior of the slope, the gyro's unit per kelvin. The default is zero, with a standard
///     deviation of one sample's noise per kelvin.
/// slope_sigma : float, optional
///     Standard deviation of ``slope``; the default for a stated slope is 0.
/// walk : float, optional
///     Random walk of the bias, the gyro's unit per root second; by default it is learned.
/// rest_limit, bias_limit : float, optional
///     As in `RestDetector`.
/// channels : int, optional
///     Number of signals; ``None`` is a single signal without a channel axis.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range.
///
/// Examples
/// --------
/// >>> import numpy as np, zerorate as zr
/// >>> t = np.arange(60_000) / 100.0
/// >>> temperature = 20.0 + 10.0 * (1.0 - np.exp(-t / 200.0))
/// >>> z = 0.5 + 0.03 * (temperature - 25.0)
/// >>> z += 0.1 * np.random.default_rng(1).standard_normal(t.size)
/// >>> f = zr.TemperatureFilter(100.0)
/// >>> bias = f.process(z, temperature)
/// >>> round(float(bias[-1]), 2), round(f.slope, 3)
/// (0.63, 0.03)
#[pyclass(generic, module = "zerorate")]
#[derive(Debug)]
pub struct TemperatureFilter {
    shared: Shared<Bank<Core>>,
}

streaming!(TemperatureFilter);
streaming!(@bank TemperatureFilter, Core);

#[pymethods]
impl TemperatureFilter {
    #[new]
    #[pyo3(signature = (
        rate, *, reference=25.0, slope=None, slope_sigma=None, walk=None, rest_limit=None,
        bias_limit=None, channels=None
    ))]
    // The arguments are the same as in the Python class.
    #[allow(clippy::too_many_arguments)]
    fn new(
        rate: f64,
        reference: f64,
        slope: Option<f64>,
        slope_sigma: Option<f64>,
        walk: Option<f64>,
        rest_limit: Option<f64>,
        bias_limit: Option<f64>,
        channels: Option<i128>,
    ) -> PyResult<Self> {
        let channels = streaming::channels(channels)?;
        let limits = RestLimits { rest: rest_limit, bias: bias_limit };
        let params = TemperatureParams { rate, reference, slope, slope_sigma, walk, limits };
        let filter = Core::new(params).map_err(NativeError::from)?;
        let bank = Bank::new(&filter, channels.unwrap_or(1)).map_err(NativeError::from)?;
        Ok(Self::of(channels, bank).map_err(NativeError::from)?)
    }

    /// Process one sample and its temperature, degC or None, and return the bias.
    ///
    /// The sample is a float, and the bias a float. With k channels, samples and biases are (k,);
    /// the temperature is one number or (k,).
    #[pyo3(signature = (z, temperature=None))]
    fn update<'py>(
        slf: &Bound<'py, Self>,
        z: &Bound<'py, PyAny>,
        temperature: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut this = exclusive(slf)?;
        let missing = slf.py().None().into_bound(slf.py());
        let temperature = temperature.unwrap_or(&missing);
        let Some(channels) = this.shared.channels else {
            let row = [arrays::sample(z)?, arrays::sample(temperature)?];
            return this.shared.update_row(slf.py(), &row);
        };
        let rates = arrays::row(z, &[channels])?;
        let temperatures = match arrays::sample(temperature) {
            Ok(one) => vec![one],
            Err(_) => arrays::row(temperature, &[channels])?,
        };
        let columns = [(0, 1, &rates[..]), (1, 1, &temperatures)];
        let row = arrays::side_by_side(2, channels, &columns)?;
        this.shared.update_row(slf.py(), &row)
    }

    /// Process each sample of a batch and return the biases.
    ///
    /// Samples, temperatures and biases are (n,). With k channels, samples and biases are (n, k).
    /// The temperatures are then (n, k), or (n,) for all channels. The interpreter lock is
    /// released.
    #[pyo3(signature = (z, temperature, out=None, threads=None))]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        z: &Bound<'py, PyAny>,
        temperature: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let given = [Some(z), Some(temperature)];
        let [z, temperature] = arrays::taken(slf, ["z", "temperature"], given)?;
        let mut this = exclusive(slf)?;
        let axes: Vec<usize> = this.shared.channels.into_iter().collect();
        let rates = arrays::samples(&z, &axes)?;
        let shape = rates.shape().to_vec();
        let temperatures = temperatures(&temperature, &shape)?;
        let columns = [(0, 1, rates.values()?), (1, 1, &temperatures)];
        let values = arrays::side_by_side(2, shape.iter().product(), &columns)?;
        let record = Record { values, shape: [shape.as_slice(), &[2]].concat() };
        drop(rates);
        this.shared.process_samples(slf.py(), Samples::Copied(record), out, threads)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let params = this.first().params();
        let TemperatureParams { rate, reference, slope, slope_sigma, walk, limits } = *params;
        let arguments = [
            ("rate", text(rate), ""),
            ("reference", text(reference), "25.0"),
            ("slope", text(slope), "None"),
            ("slope_sigma", text(slope_sigma), "None"),
            ("walk", text(walk), "None"),
            ("rest_limit", text(limits.rest), "None"),
            ("bias_limit", text(limits.bias), "None"),
        ];
        Ok(call("TemperatureFilter", &arguments, this.shared.channels))
    }
}

getters! { TemperatureFilter, slf, py, this;
    /// Bias at the last temperature; zero before the first rest.
    ///
    /// A float, or an array (k,) with k channels.
    bias: Object<'py> = this.shared.each(py, Core::bias)?;
    /// Standard deviation of the mean bias over the next 10 s.
    ///
    /// It is for the last temperature. Before the first rest it is the largest sample to date.
    /// While rest cannot be distinguished from a constant motion, it is at least as large as the
    /// bias. A float, or an array (k,) with k channels.
    bias_sigma: Object<'py> = this.shared.each(py, Core::bias_sigma)?;
    /// Change of the bias per kelvin.
    ///
    /// A float, or an array (k,) with k channels.
    slope: Object<'py> = this.shared.each(py, Core::slope)?;
    /// Standard deviation of ``slope``; zero before the slope is known.
    ///
    /// A float, or an array (k,) with k channels.
    slope_sigma: Object<'py> = this.shared.each(py, Core::slope_sigma)?;
    /// True if the gyro rests and the bias is being learned.
    ///
    /// A bool, or an array (k,) with k channels.
    at_rest: Object<'py> = this.shared.each(py, Core::at_rest)?;
    /// Samples to date, missing ones included.
    samples_seen: u64 = this.first().samples_seen();
    /// Samples per second.
    rate: f64 = this.first().params().rate;
    /// Temperature of the bias state, degC.
    reference: f64 = this.first().params().reference;
}

/// Temperatures for rates of a known shape: one for each rate, or one for each row.
fn temperatures(z: &Bound<'_, PyAny>, shape: &[usize]) -> PyResult<Vec<f64>> {
    let (whole, rows) = (arrays::tuple(shape), arrays::tuple(&shape[..1]));
    let expected = if shape.len() == 1 { whole } else { format!("{whole} or {rows}") };
    let fits = |found: &[usize]| found == shape || found == &shape[..1];
    Ok(arrays::named("temperature", z, &expected, fits)?.values)
}
