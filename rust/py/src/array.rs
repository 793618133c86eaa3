//! Arrays of gyros for Python.

use std::any::Any;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use zerorate_core::array::{ArrayParams, Fusion, GyroArray as Core, Health, Weights};
use zerorate_core::checkpoint::{self, Label};
use zerorate_core::stream::{Field, Shape};
use zerorate_core::{Bank, Error, RestLimits, memory};

use crate::common::arrays;
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::streaming::{self, AnyBank, Shared, call, exclusive, reading, streaming, text};
use crate::common::work::in_pieces;

/// One array; its number of axes is known only inside the box.
trait ArrayBank: AnyBank {
    fn params(&self) -> &ArrayParams;
    fn axes(&self) -> usize;
    fn biases(&self) -> Vec<f64>;
    fn bias_sigmas(&self) -> Vec<f64>;
    fn weights(&self) -> Vec<f64>;
    fn used(&self) -> Vec<bool>;
    fn excluded(&self) -> Vec<bool>;
    fn is_disputed(&self) -> bool;
    fn at_rest(&self) -> Vec<bool>;
    fn health(&self) -> Vec<Health>;
    fn samples_seen(&self) -> u64;
    fn power_on(&mut self);
    fn covariances(&self, axis: usize) -> Covariances;
}

/// Averaging times in s, covariances, and the number of differences in each covariance.
struct Covariances {
    taus: Vec<f64>,
    matrices: Vec<f64>,
    counts: Vec<f64>,
}

/// A bank of one.
struct One<const A: usize>(Bank<Core<A>>);

impl<const A: usize> One<A> {
    fn new(params: ArrayParams) -> Result<Self, Error> {
        Ok(Self(Bank::of(vec![Core::new(params)?])))
    }

    fn array(&self) -> &Core<A> {
        &self.0.streams()[0]
    }
}

const NUMBER: [Field; 1] = [Field { name: "rate", shape: Shape::Number }];
const VECTOR: [Field; 1] = [Field { name: "rate", shape: Shape::Vector(3) }];

impl<const A: usize> AnyBank for One<A> {
    fn width(&self) -> usize {
        self.array().params().sensors * A
    }

    fn fields(&self) -> &'static [Field] {
        if A == 1 { &NUMBER } else { &VECTOR }
    }

    fn channels(&self) -> usize {
        1
    }

    fn bytes(&self) -> usize {
        size_of::<Core<A>>()
    }

    fn try_clone(&self) -> Result<Box<dyn Any + Send>, Error> {
        Ok(Box::new(Self(self.0.clone())))
    }

    fn replace_with(&mut self, other: Box<dyn Any + Send>) {
        if let Ok(other) = other.downcast::<Self>() {
            *self = *other;
        }
    }

    fn update(&mut self, row: &[f64], numbers: &mut [f64], _: &mut [bool]) {
        self.0.streams_mut()[0].update(row, numbers);
    }

    fn process(
        &mut self,
        rows: &[f64],
        numbers: &mut [f64],
        _: &mut [bool],
        _: usize,
    ) -> Result<(), Error> {
        let (width, array) = (self.width(), &mut self.0.streams_mut()[0]);
        for (row, rate) in rows.chunks_exact(width).zip(numbers.chunks_exact_mut(A)) {
            array.update(row, rate);
        }
        Ok(())
    }

    fn reset(&mut self) {
        self.0.streams_mut()[0].reset();
    }

    fn save(&self, channels: Option<usize>) -> Result<Vec<u8>, Error> {
        checkpoint::save(channels, &self.0)
    }
}

impl<const A: usize> ArrayBank for One<A> {
    fn params(&self) -> &ArrayParams {
        self.array().params()
    }

    fn axes(&self) -> usize {
        A
    }

    fn biases(&self) -> Vec<f64> {
        self.array().biases().collect()
    }

    fn bias_sigmas(&self) -> Vec<f64> {
        self.array().bias_sigmas().collect()
    }

    fn weights(&self) -> Vec<f64> {
        self.array().weights().to_vec()
    }

    fn used(&self) -> Vec<bool> {
        self.array().used().to_vec()
    }

    fn excluded(&self) -> Vec<bool> {
        self.array().excluded().collect()
    }

    fn is_disputed(&self) -> bool {
        self.array().is_disputed()
    }

    fn at_rest(&self) -> Vec<bool> {
        self.array().at_rest().to_vec()
    }

    fn health(&self) -> Vec<Health> {
        self.array().health().collect()
    }

    fn samples_seen(&self) -> u64 {
        self.array().samples_seen()
    }

    fn power_on(&mut self) {
        self.0.streams_mut()[0].power_on();
    }

    fn covariances(&self, axis: usize) -> Covariances {
        let (array, n) = (self.array(), self.params().sensors);
        let tick = f64::from(array.tick_length()) / self.params().rate;
        let mut found = Covariances { taus: vec![], matrices: vec![], counts: vec![] };
        for octave in array.covariances(axis) {
            if (0..n).all(|i| octave.count(i, i) == 0) {
                continue;
            }
            found.taus.push(f64::from(octave.ticks) * tick);
            for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
                found.matrices.push(octave.of(i, j));
                found.counts.push(f64::from(octave.count(i, j)));
            }
        }
        found
    }
}

/// Fusion of many gyros of one body, live or in batches.
///
/// The array learns the drift of each axis of each sensor, as a ``DriftFilter`` does. Then all
/// rates are rotated into the axes of the body. At rest the weights follow the sensors' noise, from
/// Allan variances over 1/8 s, 1 s and 4 s. In motion, where scale errors dominate, the weights are
/// nearly equal.
///
/// A sample far from the median of the other sensors is not used. A sensor is excluded if it
/// disagrees with the other sensors over a quarter of a second. The fault may be an offset, a wrong
/// sign, a scale error, exchanged axes or noise. The sensor is used again after it has agreed for
/// 10 s in total. Times with less than 30 % of the angular rate at the last disagreement are not
/// counted. If only two sensors are left and they disagree, both are used, and ``health`` is
/// ``"disputed"``.
///
/// The fused noise of N sensors is about the noise of one sensor divided by sqrt(N), seldom more
/// than 20 % above this value. An array of one sensor gives results that are bit-identical to a
/// ``DriftFilter``. A sample that is not finite is missing. A sample of a stuck sensor counts as
/// missing. The rate is NaN if no sample is left. One object serves one thread at a time.
///
/// Parameters
/// ----------
/// rate : float
///     Samples per second.
/// sensors : int, optional
///     Number of gyros, 1 to 256; optional if ``rotations`` or ``calibrations`` are given.
/// axes : {3, 1}
///     Number of axes of each gyro.
/// rotations : array_like, shape (sensors, 3, 3), optional
///     Rotation matrices from each sensor's axes to the body's; by default all axes are aligned.
/// calibrations : sequence of Calibration or of array_like, shape (3, 3), optional
///     One calibration per sensor, for samples in the unit of the array. Scale and misalignment are
///     corrected in the sensor's own axes. Biases are learned. g-sensitivity is not corrected;
///     ``Calibration.apply`` corrects it.
/// limit : float, optional
///     Saturation level: a sample of this size or more counts as missing.
/// rest_limit, bias_limit : float, optional
///     As in ``DriftFilter``.
/// weights : {"auto", "mean", "white"} or array_like, shape (sensors,) or (sensors, axes)
///     ``"auto"`` weights the sensors by noise and scale error, ``"mean"`` equally, ``"white"`` by
///     white noise alone. Numbers are the weights themselves, for example from
///     ``allan_covariance(z, rate).virtual_gyro()``.
/// scale_error : float
///     Standard deviation of the sensors' scale factors, from 0 to 1.
/// method : {"auto", "centralised"}
///     ``"auto"`` is described above. ``"centralised"`` is a published filter of two stages, for
///     comparison. It models the rate itself as a random walk, removes no bias, and lags behind
///     every motion.
/// labels : sequence of str, optional
///     Names of the sensors; by default ``"1"``, ``"2"``, ….
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range, or an array has a wrong shape.
///
/// References
/// ----------
/// Method ``"centralised"``: J. Liu, B. He, Y. Zhao. Only the abstract was available. The
/// process noise and the sequence of the two stages are chosen to match the abstract's results at
/// rest.
///
/// Examples
/// --------
/// Four gyros at rest, one of which fails:
///
/// >>> import numpy as np, zerorate as zr
/// >>> rng = np.random.default_rng(1)
/// >>> z = [0.5, -0.2, 0.1] + 0.1 * rng.standard_normal((6000, 4, 3))
/// >>> array = zr.GyroArray(rate=100.0, sensors=4)
/// >>> rate = array.process(z)
/// >>> bool(rate[1000:].std() < 0.06), array.health
/// (True, ('good', 'good', 'good', 'good'))
/// >>> z[:, 2, 0] *= -1.0
/// >>> z[::2, :, 0] += 20.0 * np.sign(np.array([1.0, 1.0, -1.0, 1.0]))
/// >>> _ = array.process(z)
/// >>> array.health
/// ('good', 'good', 'excluded', 'good')
#[pyclass(module = "zerorate", generic)]
#[derive(Debug)]
pub struct GyroArray {
    shared: Shared<dyn ArrayBank>,
}

streaming!(GyroArray);
streaming!(
    @process GyroArray,
    "Process each sample of a batch and return what ``update`` returns for each of them.

    Samples (n, sensors, 3) give a result (n, 3). With one axis, samples (n, sensors) give a result
    (n,). ``threads`` has no effect, because all gyros together are one signal. The interpreter lock
    is released.",
    out
);

#[pymethods]
impl GyroArray {
    #[new]
    #[pyo3(signature = (
        rate, sensors=None, *, axes=3, rotations=None, calibrations=None, limit=None, rest_limit=None, bias_limit=None,
        weights=None, scale_error=0.01, method="auto", labels=None
    ), text_signature = "(rate, sensors=None, *, axes=3, rotations=None, calibrations=None, limit=None, rest_limit=None, \
        bias_limit=None, weights='auto', scale_error=0.01, method='auto', labels=None)")]
    // The arguments are the same as in the Python class.
    #[allow(clippy::too_many_arguments)]
    fn new(
        rate: f64,
        sensors: Option<i128>,
        axes: i128,
        rotations: Option<&Bound<'_, PyAny>>,
        calibrations: Option<&Bound<'_, PyAny>>,
        limit: Option<f64>,
        rest_limit: Option<f64>,
        bias_limit: Option<f64>,
        weights: Option<&Bound<'_, PyAny>>,
        scale_error: f64,
        method: &str,
        labels: Option<Vec<String>>,
    ) -> PyResult<Self> {
        if !matches!(axes, 1 | 3) {
            return Err(PyValueError::new_err(format!("axes must be 1 or 3, got {axes}")));
        }
        let axes = axes as usize;
        let rotations = rotations.map(|given| matrices("rotations", given, axes)).transpose()?;
        let corrections = calibrations.map(|given| corrections_of(given, axes)).transpose()?;
        let given_sensors = rotations
            .as_ref()
            .or(corrections.as_ref())
            .map(|all| all.len() / (axes * axes))
            .or(labels.as_ref().map(Vec::len));
        let sensors = match (sensors, given_sensors) {
            (Some(given), _) => streaming::positive("sensors", given)?,
            (None, Some(given_sensors)) => given_sensors,
            (None, None) => {
                return Err(PyTypeError::new_err(
                    "sensors must be given, or rotations or calibrations, which say it",
                ));
            }
        };
        let labels =
            labels.unwrap_or_else(|| (1..=sensors.min(256)).map(|k| k.to_string()).collect());
        let limits = RestLimits { rest: rest_limit, bias: bias_limit };
        let weights =
            weights.map_or(Ok(Weights::Auto), |given| weights_of(given, sensors, axes))?;
        let fusion = fusion_of(method)?;
        let params = ArrayParams {
            rate,
            sensors,
            labels,
            rotations,
            corrections,
            limit,
            limits,
            weights,
            scale_error,
            fusion,
        };
        Ok(Self::of(params, axes).map_err(NativeError::from)?)
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let bank = &this.shared.bank;
        let (params, axes) = (bank.params(), bank.axes());
        let optional = |x: Option<f64>| x.map_or("None".to_owned(), text);
        let usual: Vec<String> = (1..=params.sensors).map(|k| k.to_string()).collect();
        let matrices = |given: &Option<Vec<f64>>| {
            let one = |r: &[f64]| list(r.chunks_exact(axes).map(row));
            let all = |all: &Vec<f64>| list(all.chunks_exact(axes * axes).map(one));
            given.as_ref().map_or("None".to_owned(), all)
        };
        let weights = match &params.weights {
            Weights::Given(all) if axes == 1 => row(all),
            Weights::Given(all) => list(all.chunks_exact(axes).map(row)),
            known => format!("'{}'", weights_name(known)),
        };
        let arguments = [
            ("rate", text(params.rate), ""),
            ("sensors", params.sensors.to_string(), ""),
            ("axes", axes.to_string(), "3"),
            ("rotations", matrices(&params.rotations), "None"),
            ("calibrations", matrices(&params.corrections), "None"),
            ("limit", optional(params.limit), "None"),
            ("rest_limit", optional(params.limits.rest), "None"),
            ("bias_limit", optional(params.limits.bias), "None"),
            ("weights", weights, "'auto'"),
            ("scale_error", text(params.scale_error), "0.01"),
            ("method", format!("'{}'", method_name(params.fusion)), "'auto'"),
            (
                "labels",
                format!("{:?}", params.labels).replace('"', "'"),
                &format!("{usual:?}").replace('"', "'"),
            ),
        ];
        Ok(call("GyroArray", &arguments, None))
    }

    /// Process one sample of every sensor and return the rate of the body.
    ///
    /// The sample is (sensors, 3), the rate (3,). With one axis the sample is (sensors,), the rate
    /// a float. The rate is NaN if no sensor is left.
    fn update<'py>(slf: &Bound<'py, Self>, z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        exclusive(slf)?.shared.update(z)
    }

    /// Process a batch and return all estimates after each sample, as arrays by name.
    ///
    /// ``rate`` is (n, 3). ``bias`` is (n, sensors, 3), in each sensor's own axes. ``weights`` and
    /// ``used`` are (n, sensors, 3), ``excluded`` is (n, sensors), ``disputed`` is (n,), and
    /// ``at_rest`` is (n, 3). With one axis the last axis is omitted.
    fn trace<'py>(slf: &Bound<'py, Self>, z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
        let (py, [z]) = (z.py(), arrays::taken(slf, ["z"], [Some(z)])?);
        let mut this = exclusive(slf)?;
        let axes = this.shared.axes().to_vec();
        let samples = arrays::samples(&z, &axes)?;
        let (n, rows, bank) = (samples.shape()[0], samples.values()?, &mut *this.shared.bank);
        let (width, count) = (bank.width(), bank.axes());
        let mut seen = Seen::new(n, bank.params().sensors, count).map_err(NativeError::from)?;
        in_pieces(py, bank, n, 1, |bank, piece| {
            for i in piece {
                seen.add(bank, &rows[i * width..][..width]);
            }
            Ok::<(), Error>(())
        })?;
        seen.named(py, n, &axes)
    }

    /// Forget the biases and keep the noise, for sensors that were switched off and on.
    fn power_on(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.shared.bank.power_on();
        Ok(())
    }

    /// Return the Allan covariances at rest to date, for one axis of the body.
    ///
    /// The result is a tuple:
    ///
    /// - averaging times, s, (m,);
    /// - covariances, samples' unit squared, (m, sensors, sensors);
    /// - number of differences in each covariance, (m, sensors, sensors).
    #[pyo3(signature = (axis=0))]
    fn covariance<'py>(slf: &Bound<'py, Self>, axis: i128) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        let this = reading(slf)?;
        let (bank, axes) = (&this.shared.bank, this.shared.bank.axes());
        let Some(axis) = usize::try_from(axis).ok().filter(|axis| *axis < axes) else {
            return Err(PyValueError::new_err(format!("axis must be below {axes}, got {axis}")));
        };
        let Covariances { taus, matrices, counts } = bank.covariances(axis);
        let (m, n) = (taus.len(), bank.params().sensors);
        let shape = [m, n, n];
        let parts = [
            arrays::array(py, taus, &[m])?,
            arrays::array(py, matrices, &shape)?,
            arrays::array(py, counts, &shape)?,
        ];
        PyTuple::new(py, parts)
    }
}

getters! { GyroArray, slf, py, this;
    /// Samples per second.
    rate: f64 = this.shared.bank.params().rate;
    /// Number of gyros.
    sensors: usize = this.shared.bank.params().sensors;
    /// Number of axes of each gyro.
    axes: usize = this.shared.bank.axes();
    /// Names of the sensors.
    labels: Bound<'py, PyTuple> = PyTuple::new(py, &this.shared.bank.params().labels)?;
    /// Bias of each sensor in its own axes.
    ///
    /// An array (sensors, 3), or (sensors,) for one axis.
    bias: Object<'py> = arrays::array(py, this.shared.bank.biases(), this.shared.axes())?;
    /// Standard deviation of ``bias``, with the shape of ``bias``.
    ///
    /// It is for the mean bias over the next 10 s, as in `DriftFilter`. With "centralised", which
    /// removes no bias, it is each sensor's own standard deviation.
    bias_sigma: Object<'py> = arrays::array(py, this.shared.bank.bias_sigmas(), this.shared.axes())?;
    /// Weight of each sensor in the last rate, 0 if it was not used; with the shape of ``bias``.
    weights: Object<'py> = arrays::array(py, this.shared.bank.weights(), this.shared.axes())?;
    /// Health of each sensor, a tuple of str.
    ///
    /// Values are ``"good"``, ``"missing"``, ``"saturated"``, ``"stuck"``, ``"excluded"`` and
    /// ``"disputed"``.
    health: Bound<'py, PyTuple> = {
        let health = this.shared.bank.health();
        PyTuple::new(py, health.into_iter().map(Health::name))?
    };
    /// True for each axis at rest, shape (3,), or (1,) for one axis.
    at_rest: Object<'py> = arrays::small(py, &this.shared.bank.at_rest());
    /// Samples to date, missing ones included.
    samples_seen: u64 = this.shared.bank.samples_seen();
}

impl GyroArray {
    fn of(params: ArrayParams, axes: usize) -> Result<Self, Error> {
        let sensors = params.sensors;
        let bank: Box<dyn ArrayBank> = match axes {
            1 => Box::new(One::<1>::new(params)?),
            _ => Box::new(One::<3>::new(params)?),
        };
        Self::shared(bank, sensors, axes)
    }

    fn shared(bank: Box<dyn ArrayBank>, sensors: usize, axes: usize) -> Result<Self, Error> {
        let row = if axes == 1 { vec![sensors] } else { vec![sensors, axes] };
        Ok(Self { shared: Shared::with_axes(row, bank)? })
    }

    fn restored(bytes: &[u8]) -> Result<Self, Error> {
        let one = Label::of::<Core<1>>();
        if checkpoint::label(bytes)? == one {
            let bank = One::<1>(checkpoint::restore(bytes)?.1);
            let sensors = bank.params().sensors;
            return Self::shared(Box::new(bank), sensors, 1);
        }
        let bank = One::<3>(checkpoint::restore(bytes)?.1);
        let sensors = bank.params().sensors;
        Self::shared(Box::new(bank), sensors, 3)
    }
}

/// State after each sample.
struct Seen {
    rate: Vec<f64>,
    bias: Vec<f64>,
    weights: Vec<f64>,
    used: Vec<bool>,
    excluded: Vec<bool>,
    disputed: Vec<bool>,
    at_rest: Vec<bool>,
    axes: usize,
}

impl Seen {
    fn new(n: usize, sensors: usize, axes: usize) -> Result<Self, Error> {
        let all = n.saturating_mul(sensors).saturating_mul(axes);
        Ok(Self {
            rate: memory::room(n * axes)?,
            bias: memory::room(all)?,
            weights: memory::room(all)?,
            used: memory::room(all)?,
            excluded: memory::room(n * sensors)?,
            disputed: memory::room(n)?,
            at_rest: memory::room(n * axes)?,
            axes,
        })
    }

    fn add(&mut self, bank: &mut dyn ArrayBank, row: &[f64]) {
        let mut rate = [0.0; 3];
        bank.update(row, &mut rate[..self.axes], &mut []);
        self.rate.extend(&rate[..self.axes]);
        self.bias.extend(bank.biases());
        self.weights.extend(bank.weights());
        self.used.extend(bank.used());
        self.excluded.extend(bank.excluded());
        self.disputed.push(bank.is_disputed());
        self.at_rest.extend(bank.at_rest());
    }

    fn named<'py>(self, py: Python<'py>, n: usize, axes: &[usize]) -> PyResult<Bound<'py, PyDict>> {
        let all: Vec<usize> = [&[n], axes].concat();
        let one: Vec<usize> = [&[n], &axes[1..]].concat();
        let named = PyDict::new(py);
        named.set_item("rate", arrays::array(py, self.rate, &one)?)?;
        named.set_item("bias", arrays::array(py, self.bias, &all)?)?;
        named.set_item("weights", arrays::array(py, self.weights, &all)?)?;
        named.set_item("used", arrays::array(py, self.used, &all)?)?;
        named.set_item("excluded", arrays::array(py, self.excluded, &all[..2])?)?;
        named.set_item("disputed", arrays::array(py, self.disputed, &[n])?)?;
        named.set_item("at_rest", arrays::array(py, self.at_rest, &one)?)?;
        Ok(named)
    }
}

fn fusion_of(method: &str) -> PyResult<Fusion> {
    match method {
        "auto" => Ok(Fusion::Voted),
        "centralised" => Ok(Fusion::Centralised),
        other => Err(PyValueError::new_err(format!(
            "method must be 'auto' or 'centralised', got '{other}'"
        ))),
    }
}

fn method_name(fusion: Fusion) -> &'static str {
    match fusion {
        Fusion::Voted => "auto",
        Fusion::Centralised => "centralised",
    }
}

fn weights_name(weights: &Weights) -> &'static str {
    match weights {
        Weights::Auto => "auto",
        Weights::Mean => "mean",
        Weights::White => "white",
        Weights::Given(_) => "given",
    }
}

fn weights_of(given: &Bound<'_, PyAny>, sensors: usize, axes: usize) -> PyResult<Weights> {
    if let Ok(name) = given.extract::<&str>() {
        return match name {
            "auto" => Ok(Weights::Auto),
            "mean" => Ok(Weights::Mean),
            "white" => Ok(Weights::White),
            "drift" => Err(PyValueError::new_err(
                "weights='drift' needs a long record at rest, which a live array does not have: give \
                 the weights of allan_covariance(z, rate).virtual_gyro()",
            )),
            other => Err(PyValueError::new_err(format!(
                "weights must be 'auto', 'mean', 'white' or an array, got '{other}'"
            ))),
        };
    }
    let expected = format!("({sensors},) or ({sensors}, {axes})");
    let found = arrays::named("weights", given, &expected, |shape| {
        shape == [sensors] || shape == [sensors, axes]
    })?;
    let all: Vec<f64> = match found.values.len() == sensors {
        true => found.values.iter().flat_map(|w| std::iter::repeat_n(*w, axes)).collect(),
        false => found.values,
    };
    if !all.iter().all(|w| w.is_finite()) {
        return Err(PyValueError::new_err("weights must be finite"));
    }
    let largest = all.iter().fold(0.0_f64, |most, w| most.max(w.abs()));
    Ok(Weights::Given(if largest > 1.0 { all.iter().map(|w| w / largest).collect() } else { all }))
}

fn matrices(name: &str, given: &Bound<'_, PyAny>, axes: usize) -> PyResult<Vec<f64>> {
    if axes != 3 {
        return Err(PyValueError::new_err(format!("{name} are for three axes")));
    }
    let fits = |shape: &[usize]| shape.len() == 3 && shape[0] > 0 && shape[1..] == [3, 3];
    Ok(arrays::named(name, given, "(sensors, 3, 3)", fits)?.values)
}

/// Matrices C in `rate = C (sample - bias)`, from calibrations or as given.
fn corrections_of(given: &Bound<'_, PyAny>, axes: usize) -> PyResult<Vec<f64>> {
    const ASK: &str = "__gyro_correction__";
    if given.hasattr(ASK)? {
        return Err(PyValueError::new_err(format!(
            "calibrations must be a sequence of one a sensor, got a single {}",
            given.get_type().name()?
        )));
    }
    let mut found = Vec::new();
    for (number, one) in given.try_iter()?.enumerate() {
        let (one, name) = (one?, format!("calibration {}", number + 1));
        let matrix = match one.getattr_opt(ASK)? {
            Some(ask) => ask.call1((&name,))?,
            None => one,
        };
        found.extend(arrays::named(&name, &matrix, "(3, 3)", |shape| shape == [3, 3])?.values);
    }
    let matrices = arrays::array(given.py(), found.clone(), &[found.len() / 9, 3, 3])?;
    self::matrices("calibrations", &matrices, axes)
}

fn row(numbers: &[f64]) -> String {
    list(numbers.iter().map(|x| text(*x)))
}

fn list(parts: impl Iterator<Item = String>) -> String {
    format!("[{}]", parts.collect::<Vec<_>>().join(", "))
}
