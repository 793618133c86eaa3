//! The correction of an IMU for Python.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use zerorate_core::calibrate::{self as core, Correction, TemperatureCurve};
use zerorate_core::checkpoint::{self, Checkpoint, Label};
use zerorate_core::{Bank, Error, Stream};

use crate::common::arrays::{self, named};
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::streaming::{self, AnyBank, Shared, call, reading, streaming, text};

/// Correctors for one number of inputs.
trait CorrectorBank: AnyBank {
    fn correction(&self) -> &Correction;
    fn biases(&self) -> Vec<f64>;
    fn forces(&self) -> Vec<f64>;
}

impl<const N: usize> CorrectorBank for Bank<core::ImuCorrector<N>>
where
    core::ImuCorrector<N>: Stream + Checkpoint,
{
    fn correction(&self) -> &Correction {
        self.streams()[0].correction()
    }

    fn biases(&self) -> Vec<f64> {
        self.streams().iter().flat_map(core::ImuCorrector::bias).collect()
    }

    fn forces(&self) -> Vec<f64> {
        self.streams().iter().flat_map(core::ImuCorrector::force).collect()
    }
}

/// Live correction of an IMU for bias, scale error, misalignment and g-sensitivity.
///
/// ``force = accel_matrix @ (accel - accel_bias)`` and
/// ``rate = gyro_matrix @ (gyro - gyro_bias - g_sensitivity @ force)``. The matrices are the
/// inverses of the sensors' responses. ``Calibration.corrector()`` creates a corrector. The output
/// has the units of the arguments.
///
/// A sample has three numbers (gyro), six (gyro and accelerometer) or seven (gyro, accelerometer
/// and temperature, degC). If an axis of the gyro is missing, the three rates are NaN. If an axis
/// of the accelerometer is missing, the three forces are NaN. The gyro is then corrected with the
/// last known force, and with zero before the first force. A missing temperature is replaced by the
/// last temperature. Before the first temperature the bias is ``gyro_bias``. One object serves one
/// thread at a time.
///
/// Parameters
/// ----------
/// gyro_matrix : array_like, shape (3, 3)
///     Matrix from the raw gyro minus its bias to the rate.
/// gyro_bias : array_like, shape (3,)
///     Bias of the gyro if no temperature is known, in the raw unit.
/// accel_matrix, accel_bias : array_like, shape (3, 3) and (3,), optional
///     Matrix and bias of the accelerometer; by default its samples are unchanged.
/// g_sensitivity : array_like, shape (3, 3), optional
///     Response of the gyro to a force, in the gyro's raw unit per unit of the corrected force;
///     zero by default.
/// temperature : dict, optional
///     Bias of the gyro over temperature. ``"coefficients"``, shape (3, 1) to (3, 4), are c_0, c_1,
///     … of each axis in ``sum(c_k * ((T - reference) / 10)**k)``. At the temperature
///     ``"reference"`` the bias is c_0. ``"range"`` gives the lowest and highest temperature of the
///     data. Outside this range the curve continues along its tangent for the length of the range,
///     then stays constant.
/// inputs : {3, 6, 7}, optional
///     Number of values in a sample; by default as many as the other arguments need. With 7 inputs
///     and without ``temperature``, the seventh number is not used.
/// channels : int, optional
///     Number of sensors with this correction; ``None`` is a single sensor without a channel axis.
///
/// Raises
/// ------
/// ValueError
///     A shape is wrong, a number is not finite or beyond 1e50, or ``inputs`` is too small for an
///     argument.
///
/// Examples
/// --------
/// >>> import numpy as np, zerorate as zr
/// >>> corrector = zr.ImuCorrector(np.eye(3) / 1.02, [0.1, 0.0, -0.1])
/// >>> corrector.update([1.12, 0.0, -0.1]).round(6).tolist()
/// [1.0, 0.0, 0.0]
/// >>> both = zr.ImuCorrector(np.eye(3), np.zeros(3), g_sensitivity=0.1 * np.eye(3))
/// >>> gyro, accel = both.process([[0.0, 0.0, 0.1, 0.0, 0.0, 1.0]])
/// >>> gyro.tolist(), accel.tolist()
/// ([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
#[pyclass(generic, module = "zerorate")]
#[derive(Debug)]
pub struct ImuCorrector {
    shared: Shared<dyn CorrectorBank>,
}

streaming!(
    ImuCorrector,
    update: "Process one sample and return the corrected rate, or rate and force.

    A sample (3,) gives the rate, (3,). A sample (6,) or (7,) gives rate and force, each (3,). With
    k channels all arrays have a first axis of length k.",
    process: "Process each sample of a batch and return the corrected rates, or rates and forces.

    Samples (n, 3) give the rates, (n, 3). Samples (n, 6) or (n, 7) give rates and forces, each
    (n, 3). With k channels all arrays have a second axis of length k. ``out`` can be used
    only if ``inputs`` is 3. The interpreter lock is released.",
    out
);

#[pymethods]
impl ImuCorrector {
    #[new]
    #[pyo3(signature = (
        gyro_matrix, gyro_bias, *, accel_matrix=None, accel_bias=None, g_sensitivity=None,
        temperature=None, inputs=None, channels=None
    ))]
    // The arguments are the same as in the Python class.
    #[allow(clippy::too_many_arguments)]
    fn new(
        gyro_matrix: &Bound<'_, PyAny>,
        gyro_bias: &Bound<'_, PyAny>,
        accel_matrix: Option<&Bound<'_, PyAny>>,
        accel_bias: Option<&Bound<'_, PyAny>>,
        g_sensitivity: Option<&Bound<'_, PyAny>>,
        temperature: Option<&Bound<'_, PyAny>>,
        inputs: Option<i128>,
        channels: Option<i128>,
    ) -> PyResult<Self> {
        let channels = streaming::channels(channels)?;
        let given = [
            ("accel_matrix", accel_matrix.is_some(), 6),
            ("accel_bias", accel_bias.is_some(), 6),
            ("g_sensitivity", g_sensitivity.is_some(), 6),
            ("temperature", temperature.is_some(), 7),
        ];
        let inputs = checked_inputs(inputs, &given)?;
        let usual = Correction::default();
        let matrix_or =
            |name, given: Option<_>, usual| given.map_or(Ok(usual), |z| matrix(name, z));
        let correction = Correction {
            gyro_matrix: matrix("gyro_matrix", gyro_matrix)?,
            gyro_bias: vector("gyro_bias", gyro_bias)?,
            accel_matrix: matrix_or("accel_matrix", accel_matrix, usual.accel_matrix)?,
            accel_bias: accel_bias.map_or(Ok(usual.accel_bias), |z| vector("accel_bias", z))?,
            g_sensitivity: matrix_or("g_sensitivity", g_sensitivity, usual.g_sensitivity)?,
            temperature: temperature.map(curve).transpose()?,
        };
        let bank = match inputs {
            3 => new_bank::<3>(correction, channels),
            6 => new_bank::<6>(correction, channels),
            _ => new_bank::<7>(correction, channels),
        };
        let shared = bank.and_then(|bank| Shared::new(channels, bank));
        Ok(Self { shared: shared.map_err(NativeError::from)? })
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let (correction, usual) = (this.shared.bank.correction(), Correction::default());
        let accel = (correction.accel_matrix, correction.accel_bias, correction.g_sensitivity);
        let least = match (correction.temperature, accel) {
            (Some(_), _) => "7",
            (None, accel)
                if accel == (usual.accel_matrix, usual.accel_bias, usual.g_sensitivity) =>
            {
                "3"
            }
            _ => "6",
        };
        let arguments = [
            ("gyro_matrix", rows(&correction.gyro_matrix), ""),
            ("gyro_bias", row(&correction.gyro_bias), ""),
            ("accel_matrix", rows(&correction.accel_matrix), &rows(&usual.accel_matrix)),
            ("accel_bias", row(&correction.accel_bias), &row(&usual.accel_bias)),
            ("g_sensitivity", rows(&correction.g_sensitivity), &rows(&usual.g_sensitivity)),
            ("temperature", correction.temperature.map_or("None".to_owned(), curve_text), "None"),
            ("inputs", this.shared.bank.width().to_string(), least),
        ];
        Ok(call("ImuCorrector", &arguments, this.shared.channels))
    }

    /// Matrix from the raw gyro minus its bias to the rate, shape (3, 3).
    #[getter]
    fn gyro_matrix<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        square(slf, |correction| &correction.gyro_matrix)
    }

    /// Matrix from the raw accelerometer minus its bias to the force, shape (3, 3).
    #[getter]
    fn accel_matrix<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        square(slf, |correction| &correction.accel_matrix)
    }

    /// Response of the raw gyro to a force, shape (3, 3).
    #[getter]
    fn g_sensitivity<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        square(slf, |correction| &correction.g_sensitivity)
    }
}

getters! { ImuCorrector, slf, py, this;
    /// Bias of the raw gyro if no temperature is known, shape (3,).
    gyro_bias: Object<'py> = arrays::small(py, &this.shared.bank.correction().gyro_bias);
    /// Bias of the raw accelerometer, shape (3,).
    accel_bias: Object<'py> = arrays::small(py, &this.shared.bank.correction().accel_bias);
    /// Bias of the gyro over temperature, as given; None if it was not given.
    temperature: Option<Bound<'py, PyDict>> = {
        let Some(curve) = this.shared.bank.correction().temperature else { return Ok(None) };
        let found = PyDict::new(py);
        found.set_item("reference", curve.reference)?;
        found.set_item("range", (curve.range[0], curve.range[1]))?;
        let coefficients = curve.coefficients.as_flattened().to_vec();
        found.set_item("coefficients", arrays::array(py, coefficients, &[3, 4])?)?;
        Some(found)
    };
    /// Present bias of the raw gyro.
    ///
    /// An array (3,), or (k, 3) with k channels.
    bias: Object<'py> = this.shared.arrays(py, this.shared.bank.biases(), &[3])?;
    /// Last known force; zero before the first force.
    ///
    /// An array (3,), or (k, 3) with k channels.
    force: Object<'py> = this.shared.arrays(py, this.shared.bank.forces(), &[3])?;
    /// Number of values in a sample: 3, 6 or 7.
    inputs: usize = this.shared.bank.width();
}

impl ImuCorrector {
    fn restored(bytes: &[u8]) -> Result<Self, Error> {
        let is =
            |label: Label| checkpoint::label(bytes).is_ok_and(|found| found.tag() == label.tag());
        if is(Label::of::<core::ImuCorrector<6>>()) {
            restored::<6>(bytes)
        } else if is(Label::of::<core::ImuCorrector<7>>()) {
            restored::<7>(bytes)
        } else {
            // Refuses any other type.
            restored::<3>(bytes)
        }
    }
}

fn new_bank<const N: usize>(
    correction: Correction,
    channels: Option<usize>,
) -> Result<Box<dyn CorrectorBank>, Error>
where
    core::ImuCorrector<N>: Stream + Checkpoint,
{
    let corrector = core::ImuCorrector::<N>::new(correction)?;
    Ok(Box::new(Bank::new(&corrector, channels.unwrap_or(1))?))
}

fn restored<const N: usize>(bytes: &[u8]) -> Result<ImuCorrector, Error>
where
    core::ImuCorrector<N>: Stream + Checkpoint,
{
    let (channels, bank) = checkpoint::restore::<core::ImuCorrector<N>>(bytes)?;
    Ok(ImuCorrector { shared: Shared::new(channels, Box::new(bank) as Box<dyn CorrectorBank>)? })
}

/// Number of a sample's inputs, if the stated arguments can use it; each argument needs a minimum.
fn checked_inputs(inputs: Option<i128>, given: &[(&str, bool, i128)]) -> PyResult<i128> {
    let needed = given.iter().filter(|(_, given, _)| *given).map(|(_, _, needs)| *needs).max();
    let inputs = inputs.unwrap_or(needed.unwrap_or(3));
    if ![3, 6, 7].contains(&inputs) {
        return Err(PyValueError::new_err(format!("inputs must be 3, 6 or 7, got {inputs}")));
    }
    match given.iter().find(|(_, given, needs)| *given && *needs > inputs) {
        None => Ok(inputs),
        Some((name, _, needs)) => Err(PyValueError::new_err(format!(
            "{name} is for samples of {needs} numbers or more, got inputs={inputs}"
        ))),
    }
}

fn vector(name: &str, z: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    let found = named(name, z, "(3,)", |shape| shape == [3])?;
    Ok(std::array::from_fn(|i| found.values[i]))
}

fn matrix(name: &str, z: &Bound<'_, PyAny>) -> PyResult<[[f64; 3]; 3]> {
    let found = named(name, z, "(3, 3)", |shape| shape == [3, 3])?;
    Ok(std::array::from_fn(|i| std::array::from_fn(|j| found.values[3 * i + j])))
}

/// A curve over temperature from its dict.
fn curve(given: &Bound<'_, PyAny>) -> PyResult<TemperatureCurve> {
    const KEYS: [&str; 3] = ["reference", "range", "coefficients"];
    let wrong = || {
        let keys = KEYS.map(|key| format!("'{key}'")).join(", ");
        PyTypeError::new_err(format!("temperature must be a dict of {keys}, got {given}"))
    };
    let dict = given.cast::<PyDict>().map_err(|_| wrong())?;
    let value = |key: &str| dict.get_item(key)?.ok_or_else(wrong);
    if dict.len() != KEYS.len() {
        return Err(wrong());
    }
    let number = |x: &Bound<'_, PyAny>| x.extract::<f64>().map_err(|_| wrong());
    let range = named("range", &value("range")?, "(2,)", |shape| shape == [2])?.values;
    let fits = |shape: &[usize]| matches!(shape, [3, 1..=4]);
    let expected = "(3, 1) to (3, 4)";
    let found = named("coefficients", &value("coefficients")?, expected, fits)?;
    let terms = found.shape[1];
    let mut coefficients = [[0.0; 4]; 3];
    for (axis, given) in coefficients.iter_mut().zip(found.values.chunks_exact(terms)) {
        axis[..terms].copy_from_slice(given);
    }
    let reference = number(&value("reference")?)?;
    Ok(TemperatureCurve { reference, range: [range[0], range[1]], coefficients })
}

fn square<'py>(
    corrector: &Bound<'py, ImuCorrector>,
    of: fn(&Correction) -> &[[f64; 3]; 3],
) -> PyResult<Bound<'py, PyAny>> {
    let this = reading(corrector)?;
    let values = of(this.shared.bank.correction()).as_flattened().to_vec();
    arrays::array(corrector.py(), values, &[3, 3])
}

fn row(numbers: &[f64]) -> String {
    let texts: Vec<String> = numbers.iter().map(|x| text(*x)).collect();
    format!("[{}]", texts.join(", "))
}

fn rows<const N: usize>(matrix: &[[f64; N]; 3]) -> String {
    format!("[{}]", matrix.each_ref().map(|numbers| row(numbers)).join(", "))
}

fn curve_text(curve: TemperatureCurve) -> String {
    let TemperatureCurve { reference, range: [low, high], coefficients } = curve;
    let (reference, low, high) = (text(reference), text(low), text(high));
    let coefficients = rows(&coefficients);
    format!(
        "{{'reference': {reference}, 'range': ({low}, {high}), 'coefficients': {coefficients}}}"
    )
}
