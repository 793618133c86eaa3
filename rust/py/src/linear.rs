//! The linear Kalman filter for Python.
#![allow(non_snake_case)]

use numpy::PyArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyFloat};
use zerorate_core::Error;
use zerorate_core::linear::{
    Batch, Filtered, Known, LinearBank, Model, Varying, check_matrix, settle_covariance,
};

use crate::common::arrays::{self, Record};
use crate::common::elements::usual_row;
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::rules::{self, Rule};
use crate::common::streaming::{self, exclusive, reading, streaming};
use crate::common::work::interruptible;

/// Largest number of states, measurements and inputs.
const MAX_SIZE: usize = 256;
/// Number of multiplications between two checks for signals.
const PIECE: usize = 1 << 21;

/// Linear Kalman filter with an input, for any linear model.
///
/// The model is ``x = F x + B u + w`` and ``z = H x + v``; w has covariance Q and v has covariance
/// R. ``predict`` and ``update`` process one sample. ``process`` processes a record, with identical
/// results. The covariance is always corrected in Joseph's form. ``x0`` and ``P0`` are valid before
/// the first sample: each sample, including the first, begins with a prediction.
///
/// An element of a measurement that is NaN, infinite or beyond 1e150 is missing. The other elements
/// of the vector still correct the state. None is a missing vector. A missing input counts as zero.
/// An element that the previous elements determine to rounding corrects nothing. One object serves
/// one thread at a time.
///
/// Parameters
/// ----------
/// F : array_like, shape (n, n)
///     Transition matrix of a step; n is at most 256. The filter is fastest for up to 8 states and
///     4 measurements.
/// H : array_like, shape (m, n)
///     Measurement matrix.
/// Q, R : array_like, shape (n, n) and (m, m)
///     Covariance Q of the process noise per step, and covariance R of the measurement noise. A
///     small Q smooths and lags. A small R follows the measurements.
/// B : array_like, shape (n, p), optional
///     Input matrix.
/// x0 : array_like, shape (n,) or (k, n), optional
///     Initial state, zero by default. The shape (k, n) gives each of k channels its own state.
/// P0 : array_like, shape (n, n), optional
///     Covariance of ``x0``. By default the state is unknown. Its standard deviation is then ten
///     thousand times the standard deviation of an estimate from n samples.
/// channels : int, optional
///     Number of parallel filters with the same matrices; ``None`` is a single filter without a
///     channel axis. Filters with the same missing samples share one covariance, which is fast.
///
/// Raises
/// ------
/// ValueError
///     A shape is wrong, a matrix is not finite, or a covariance is not symmetric and positive
///     semidefinite. Also if ``P0`` is not given, and a state is not observable or Q and R are
///     zero.
///
/// References
/// ----------
/// R. E. Kalman, *J. Basic Engineering* 82(1), 35-45, 1960. Joseph's form: R. S. Bucy, P. D.
/// Joseph, *Filtering for Stochastic Processes with Applications to Guidance*, 1968.
///
/// Examples
/// --------
/// >>> import numpy as np, zerorate as zr
/// >>> F, B = [[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]]  # position and velocity, 10 Hz
/// >>> kf = zr.LinearKalman(F, [[1.0, 0.0]], 1e-4 * np.eye(2), [[0.25]], B)
/// >>> t = 0.1 * np.arange(1, 101)
/// >>> z = 0.5 * 2.0 * t**2 + 0.5 * np.random.default_rng(1).standard_normal(100)
/// >>> run = kf.process(z, np.full(100, 2.0))  # 2 m/s^2 were commanded
/// >>> kf.predict(2.0).round(1).tolist(), kf.update(None).round(1).tolist()
/// ([101.9, 20.2], [101.9, 20.2])
/// >>> late, best = (abs(found.state[:, 0] - t**2).mean() for found in (run, run.smooth()))
/// >>> bool(best < late)
/// True
#[pyclass(generic, module = "zerorate")]
#[derive(Debug)]
pub struct LinearKalman {
    shared: Filters,
}

/// Interface of a bank for the methods of all streaming classes.
#[derive(Debug)]
struct Filters {
    bank: LinearBank,
    channels: Option<usize>,
}

impl Filters {
    fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.bank.save().map_err(NativeError::from)?))
    }
}

streaming!(LinearKalman);

#[pymethods]
impl LinearKalman {
    #[new]
    #[pyo3(signature = (F, H, Q, R, B=None, x0=None, P0=None, channels=None))]
    // The arguments are the same as in the Python class.
    #[allow(clippy::too_many_arguments)]
    fn new(
        F: &Bound<'_, PyAny>,
        H: &Bound<'_, PyAny>,
        Q: &Bound<'_, PyAny>,
        R: &Bound<'_, PyAny>,
        B: Option<&Bound<'_, PyAny>>,
        x0: Option<&Bound<'_, PyAny>>,
        P0: Option<&Bound<'_, PyAny>>,
        channels: Option<i128>,
    ) -> PyResult<Self> {
        let channels = streaming::channels(channels)?;
        let F = arrays::named("F", F, "(n, n)", square)?;
        let n = side(&F);
        let columns = format!("(m, {n})");
        let H = arrays::named("H", H, &columns, |shape| is_matrix(shape) && shape[1] == n)?;
        let m = H.shape[0];
        let fits =
            |sides: [usize; 2]| move |shape: &[usize]| shape == sides || single(shape, sides);
        let Q = arrays::named("Q", Q, &arrays::tuple(&[n, n]), fits([n, n]))?;
        let R = arrays::named("R", R, &arrays::tuple(&[m, m]), fits([m, m]))?;
        let rows = format!("({n}, p)");
        let B = B.map(|B| arrays::named("B", B, &rows, |shape| is_matrix(shape) && shape[0] == n));
        let B = B.transpose()?.unwrap_or(Record { values: vec![], shape: vec![n, 0] });
        for (name, size) in [("states", n), ("measurements", m), ("inputs", B.shape[1])] {
            if size > MAX_SIZE {
                let text = format!("a filter has at most {MAX_SIZE} {name}, got {size}");
                return Err(PyValueError::new_err(text));
            }
        }
        let x0 = x0.map(|x0| {
            let each = channels.map(|k| [k, n]);
            let expected = match channels {
                None => arrays::tuple(&[n]),
                Some(k) => format!("({n},) or ({k}, {n})"),
            };
            let fits = |shape: &[usize]| shape == [n] || each.is_some_and(|each| shape == each);
            arrays::named("x0", x0, &expected, fits)
        });
        let P0 = P0.map(|P0| arrays::named("P0", P0, &arrays::tuple(&[n, n]), fits([n, n])));
        let (x0, P0) = (x0.transpose()?, P0.transpose()?);
        let sizes = [n, m, B.shape[1]];
        let model =
            Model { sizes, F: F.values, H: H.values, Q: Q.values, R: R.values, B: B.values };
        let values = |given: &Option<Record>| given.as_ref().map(|given| given.values.clone());
        let (x0, P0) = (values(&x0), values(&P0));
        let bank = LinearBank::new(model, x0.as_deref(), P0.as_deref(), channels);
        Ok(Self::of(bank.map_err(NativeError::from)?))
    }

    /// Predict one step, ``x = F x + B u`` and ``P = F P F.T + Q``, and return the state.
    ///
    /// The state is (n,), or (k, n) with k channels. ``u`` is (p,), or (k, p) with k channels, or a
    /// number for one input; None is no input. Stated matrices apply to this step only. A stated B
    /// may have a different number of inputs.
    #[pyo3(signature = (u=None, *, F=None, B=None, Q=None))]
    fn predict<'py>(
        slf: &Bound<'py, Self>,
        u: Option<&Bound<'py, PyAny>>,
        F: Option<&Bound<'py, PyAny>>,
        B: Option<&Bound<'py, PyAny>>,
        Q: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut this = exclusive(slf)?;
        let filters = &mut this.shared;
        let own = filters.bank.model().sizes;
        let (F, Q) = (matrix("F", F, own)?, matrix("Q", Q, own)?);
        let B = matrix("B", B, own)?;
        let p = B.as_ref().map_or(own[2], |B| B.shape[1]);
        let u = match u {
            None => Row::None,
            Some(u) if p == 0 => return Err(no_inputs(u)),
            Some(u) => Row::read("u", u, filters.channels, p)?,
        };
        let batch = Batch {
            steps: 1,
            predicts: true,
            F: F.as_ref().map(|F| Varying::same(&F.values)),
            Q: Q.as_ref().map(|Q| Varying::same(&Q.values)),
            B: B.as_ref().map(|B| Varying::same(&B.values)),
            u: u.values(),
            ..Batch::default()
        };
        filters.bank.run(&batch, &mut Known::nothing());
        filters.state(slf.py())
    }

    /// Correct the state by a measurement and return the state.
    ///
    /// The state is (n,), or (k, n) with k channels. ``z`` is (m,), or (k, m) with k channels, or a
    /// number for one measurement; None is a missing vector. Stated matrices apply to this step
    /// only.
    #[pyo3(signature = (z, *, H=None, R=None))]
    fn update<'py>(
        slf: &Bound<'py, Self>,
        z: &Bound<'py, PyAny>,
        H: Option<&Bound<'py, PyAny>>,
        R: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut this = exclusive(slf)?;
        let filters = &mut this.shared;
        let own = filters.bank.model().sizes;
        let (H, R) = (matrix("H", H, own)?, matrix("R", R, own)?);
        let z = match z.is_none() {
            true => Row::Many(vec![f64::NAN; filters.bank.innovation().len()]),
            false => Row::read("z", z, filters.channels, own[1])?,
        };
        let batch = Batch {
            steps: 1,
            corrects: true,
            H: H.as_ref().map(|H| Varying::same(&H.values)),
            R: R.as_ref().map(|R| Varying::same(&R.values)),
            z: z.values(),
            ..Batch::default()
        };
        filters.bank.run(&batch, &mut Known::nothing());
        filters.state(slf.py())
    }

    /// Process a record from the present state and return a ``zerorate.linear.LinearRun``.
    ///
    /// Each sample is one ``predict`` and one ``update``. ``z`` is (n, m), ``u`` is (n, p). With k
    /// channels they are (n, k, m) and (n, k, p). The last axis may be omitted if its length is 1.
    /// A stated matrix applies to this record only. It is one matrix for all samples, or one per
    /// sample, with n as first axis. ``keep="state"`` keeps only the states, for many filters or
    /// long records. The interpreter lock is released.
    #[pyo3(signature = (z, u=None, *, F=None, H=None, Q=None, R=None, B=None, keep="all"))]
    // The arguments are the same as in the Python method.
    #[allow(clippy::too_many_arguments)]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        z: &Bound<'py, PyAny>,
        u: Option<&Bound<'py, PyAny>>,
        F: Option<&Bound<'py, PyAny>>,
        H: Option<&Bound<'py, PyAny>>,
        Q: Option<&Bound<'py, PyAny>>,
        R: Option<&Bound<'py, PyAny>>,
        B: Option<&Bound<'py, PyAny>>,
        keep: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let all = match keep {
            "all" => true,
            "state" => false,
            _ => {
                let text = format!("keep must be 'all' or 'state', got '{keep}'");
                return Err(PyValueError::new_err(text));
            }
        };
        let [z, u] = arrays::taken(slf, ["z", "u"], [Some(z), u])?;
        let mut this = exclusive(slf)?;
        let filters = &mut this.shared;
        let (channels, own) = (filters.channels, filters.bank.model().sizes);
        let axes: Vec<usize> = channels.into_iter().collect();
        let z = record("z", &z, None, &axes, own[1])?;
        let steps = z.shape[0];
        let (F, Q) = (matrices("F", F, steps, own)?, matrices("Q", Q, steps, own)?);
        let (H, R) = (matrices("H", H, steps, own)?, matrices("R", R, steps, own)?);
        let B = matrices("B", B, steps, own)?;
        let p = B.as_ref().map_or(own[2], |B| B.shape[B.shape.len() - 1]);
        let u = match arrays::present(&u) {
            None => Record { values: vec![], shape: vec![] },
            Some(u) if p == 0 => return Err(no_inputs(u)),
            Some(u) => record("u", u, Some(steps), &axes, p)?,
        };
        let batch = Batch {
            steps,
            predicts: true,
            F: F.as_ref().map(|F| varying(F)),
            Q: Q.as_ref().map(|Q| varying(Q)),
            B: B.as_ref().map(|B| varying(B)),
            u: &u.values,
            corrects: true,
            H: H.as_ref().map(|H| varying(H)),
            R: R.as_ref().map(|R| varying(R)),
            z: &z.values,
        };
        let [n, m, _] = own;
        let covariances = filters.bank.covariances(&z.values);
        let shape = |sizes: &[usize]| [&[steps][..], &axes, sizes].concat();
        let kept = |shape: Vec<usize>| if all { shape } else { vec![0] };
        let state = arrays::zeros::<f64>(py, &shape(&[n]))?;
        // One covariance for all channels is shown for each channel.
        let groups: Vec<usize> = channels.map(|_| covariances).into_iter().collect();
        let shown = [&[steps][..], &groups, &[n, n]].concat();
        let covariance = arrays::zeros::<f64>(py, &kept(shown))?;
        let innovation = arrays::zeros::<f64>(py, &kept(shape(&[m])))?;
        let nis = arrays::zeros::<f64>(py, &kept(shape(&[])))?;
        let log_likelihood = arrays::zeros::<f64>(py, &kept(shape(&[])))?;
        {
            let mut places = [
                state.try_readwrite()?,
                covariance.try_readwrite()?,
                innovation.try_readwrite()?,
                nis.try_readwrite()?,
                log_likelihood.try_readwrite()?,
            ];
            let [state, covariance, innovation, nis, log_likelihood] = &mut places;
            let mut known = Known {
                state: state.as_slice_mut()?,
                covariance: covariance.as_slice_mut()?,
                innovation: innovation.as_slice_mut()?,
                nis: nis.as_slice_mut()?,
                log_likelihood: log_likelihood.as_slice_mut()?,
            };
            filters.process(py, &batch, &mut known)?;
        }
        let found = PyDict::new(py);
        found.set_item("state", state)?;
        if all {
            found.set_item("covariance", across(covariance.into_any(), channels, covariances)?)?;
            found.set_item("innovation", innovation)?;
            found.set_item("nis", nis)?;
            found.set_item("log_likelihood", log_likelihood)?;
            let model = filters.bank.model();
            let given = |given: Option<Record>, own: &[f64], sides: [usize; 2]| match given {
                Some(Record { values, shape }) => arrays::array(py, values, &shape),
                None => arrays::array(py, own.to_vec(), &sides),
            };
            found.set_item("F", given(F, &model.F, [n, n])?)?;
            found.set_item("Q", given(Q, &model.Q, [n, n])?)?;
            if !u.values.is_empty() {
                found.set_item("B", given(B, &model.B, [n, own[2]])?)?;
                found.set_item("u", arrays::array(py, u.values, &u.shape)?)?;
            }
        }
        rules::function(py, Rule::LinearRun)?.call((), Some(&found))
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = reading(slf)?;
        let [n, m, p] = this.shared.bank.model().sizes;
        let channels = this.shared.channels.map_or(String::new(), |k| format!(", {k} channels"));
        let s = |count: usize| if count == 1 { "" } else { "s" };
        Ok(format!(
            "<LinearKalman: {n} state{}, {m} measurement{}, {p} input{}{channels}>",
            s(n),
            s(m),
            s(p)
        ))
    }
}

getters! { LinearKalman, slf, py, this;
    /// Transition matrix of a step, shape (n, n).
    F: Object<'py> = own(slf, |model| (&model.F, [0, 0]))?;
    /// Measurement matrix, shape (m, n).
    H: Object<'py> = own(slf, |model| (&model.H, [1, 0]))?;
    /// Covariance of the process noise of a step, shape (n, n).
    Q: Object<'py> = own(slf, |model| (&model.Q, [0, 0]))?;
    /// Covariance of the noise of a measurement, shape (m, m).
    R: Object<'py> = own(slf, |model| (&model.R, [1, 1]))?;
    /// Input matrix, shape (n, p). Without an input matrix p is 0.
    B: Object<'py> = own(slf, |model| (&model.B, [0, 2]))?;
    /// State.
    ///
    /// An array (n,), or (k, n) with k channels.
    state: Object<'py> = this.shared.state(py)?;
    /// Covariance of ``state``.
    ///
    /// An array (n, n), or (k, n, n) with k channels.
    covariance: Object<'py> = {
        let filters = &this.shared;
        let n = filters.bank.model().sizes[0];
        let P = filters.bank.covariance();
        let groups = P.len() / (n * n);
        let axes: Vec<usize> = filters.channels.map(|_| groups).into_iter().collect();
        let shown = arrays::array(py, P.to_vec(), &[&axes, &[n, n][..]].concat())?;
        // A copy for each channel, not a view of one matrix.
        across(shown, filters.channels, groups)?.call_method0("copy")?
    };
    /// Innovation ``z - H x`` of the last ``update``.
    ///
    /// NaN for a missing measurement, and before the first ``update``. An array (m,), or (k, m)
    /// with k channels.
    innovation: Object<'py> = {
        let filters = &this.shared;
        filters.arrays(py, filters.bank.innovation(), &[filters.bank.model().sizes[1]])?
    };
    /// Normalised innovation squared, ``y.T S^-1 y``.
    ///
    /// Its mean is the number of measurements m if the model is correct. It is NaN if all
    /// measurements were missing. A float, or an array (k,) with k channels.
    nis: Object<'py> = this.shared.arrays(py, this.shared.bank.nis(), &[])?;
    /// Log-likelihood of the last measurements, ``-(nis + log det(2 pi S)) / 2``.
    ///
    /// It is 0 if all measurements were missing. Its sum over the samples is the log-likelihood of
    /// a record. A float, or an array (k,) with k channels.
    log_likelihood: Object<'py> = this.shared.arrays(py, this.shared.bank.log_likelihood(), &[])?;
}

impl LinearKalman {
    fn of(bank: LinearBank) -> Self {
        Self { shared: Filters { channels: bank.channels(), bank } }
    }

    fn restored(bytes: &[u8]) -> Result<Self, Error> {
        LinearBank::restore(bytes).map(Self::of)
    }
}

impl Filters {
    /// States of all channels.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.arrays(py, self.bank.state(), &[self.bank.model().sizes[0]])
    }

    /// Numbers of each channel.
    fn arrays<'py>(
        &self,
        py: Python<'py>,
        values: &[f64],
        shape: &[usize],
    ) -> PyResult<Bound<'py, PyAny>> {
        match (self.channels, shape) {
            (None, []) => Ok(PyFloat::new(py, values[0]).into_any()),
            (None, _) => Ok(arrays::small(py, values)),
            (Some(k), _) => arrays::array(py, values.to_vec(), &[&[k], shape].concat()),
        }
    }

    /// Processes a record piece by piece; after an interrupt the filters return to their earlier
    /// state.
    fn process(
        &mut self,
        py: Python<'_>,
        batch: &Batch<'_>,
        known: &mut Known<'_>,
    ) -> PyResult<()> {
        let [n, m, p] = self.bank.model().sizes;
        let step = self.bank.count() * (n + 1) * (n + m + p);
        let length = (PIECE / step.saturating_mul(n + m)).max(1);
        if batch.steps <= length {
            py.detach(|| self.bank.run(batch, known));
            return Ok(());
        }
        let before = self.bank.try_clone().map_err(NativeError::from)?;
        let count = self.bank.count();
        let inputs = batch.u.len() / batch.steps;
        let rows = |all: usize| all / batch.steps;
        let widths = [
            rows(known.state.len()),
            rows(known.covariance.len()),
            rows(known.innovation.len()),
            rows(known.nis.len()),
            rows(known.log_likelihood.len()),
        ];
        for first in (0..batch.steps).step_by(length) {
            let steps = length.min(batch.steps - first);
            let part = Batch {
                steps,
                F: batch.F.map(|F| F.from(first)),
                Q: batch.Q.map(|Q| Q.from(first)),
                B: batch.B.map(|B| B.from(first)),
                u: &batch.u[first * inputs..][..steps * inputs],
                H: batch.H.map(|H| H.from(first)),
                R: batch.R.map(|R| R.from(first)),
                z: &batch.z[first * count * m..][..steps * count * m],
                ..*batch
            };
            let mut known = Known {
                state: &mut known.state[first * widths[0]..][..steps * widths[0]],
                covariance: &mut known.covariance[first * widths[1]..][..steps * widths[1]],
                innovation: &mut known.innovation[first * widths[2]..][..steps * widths[2]],
                nis: &mut known.nis[first * widths[3]..][..steps * widths[3]],
                log_likelihood: &mut known.log_likelihood[first * widths[4]..][..steps * widths[4]],
            };
            py.detach(|| self.bank.run(&part, &mut known));
            if let Err(error) = py.check_signals() {
                self.bank = before;
                return Err(error);
            }
        }
        Ok(())
    }
}

/// Smooth the states and covariances of a filtered record; ``LinearRun.smooth`` returns them.
///
/// ``state`` is (n, k, N), ``covariance`` (n, k, N, N) or (n, 1, N, N), and ``u`` (n, k, p).
#[pyfunction]
#[pyo3(signature = (state, covariance, F, Q, B=None, u=None))]
pub fn smooth_linear<'py>(
    py: Python<'py>,
    state: &Bound<'py, PyAny>,
    covariance: &Bound<'py, PyAny>,
    F: &Bound<'py, PyAny>,
    Q: &Bound<'py, PyAny>,
    B: Option<&Bound<'py, PyAny>>,
    u: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let state = arrays::named("state", state, "(n, k, N)", |shape| shape.len() == 3)?;
    let [steps, channels, n] = [state.shape[0], state.shape[1], state.shape[2]];
    let fits = |shape: &[usize]| shape == [steps, channels, n, n] || shape == [steps, 1, n, n];
    let covariance = arrays::named("covariance", covariance, "(n, k, N, N)", fits)?;
    let own = [n, n, 0];
    let F = matrices("F", Some(F), steps, own)?.unwrap_or(nothing());
    let Q = matrices("Q", Some(Q), steps, own)?.unwrap_or(nothing());
    let B = matrices("B", B, steps, own)?.unwrap_or(nothing());
    let p = B.shape[B.shape.len() - 1];
    let fits = |shape: &[usize]| shape == [steps, channels, p];
    let u = u.map(|u| arrays::named("u", u, "(n, k, p)", fits));
    let u = u.transpose()?.unwrap_or(nothing());
    let filtered = Filtered {
        n,
        channels,
        state: &state.values,
        covariance: &covariance.values,
        predict: [varying(&F), varying(&Q), varying(&B)],
        u: &u.values,
    };
    let samples = state.values.len().saturating_mul(n);
    let smoothed = interruptible(py, samples, || filtered.smooth())?.map_err(NativeError::from)?;
    Ok((
        arrays::array(py, smoothed.state, &state.shape)?,
        arrays::array(py, smoothed.covariance, &covariance.shape)?,
    ))
}

fn nothing() -> Record {
    Record { values: vec![], shape: vec![0, 0] }
}

/// Numbers of one step.
enum Row {
    None,
    One([f64; 1]),
    Many(Vec<f64>),
}

impl Row {
    /// Vectors for each channel; a plain number is accepted if there is one value.
    fn read(
        name: &str,
        given: &Bound<'_, PyAny>,
        channels: Option<usize>,
        size: usize,
    ) -> PyResult<Self> {
        if size == 1
            && channels.is_none()
            && let Ok(value) = given.cast_exact::<PyFloat>()
        {
            return Ok(Self::One([value.value()]));
        }
        let axes: Vec<usize> = channels.into_iter().chain([size]).collect();
        // The form that loops give most often.
        if let Some(values) = usual_row(given, &axes) {
            return Ok(Self::Many(values));
        }
        let fits =
            |shape: &[usize]| shape == axes || (size == 1 && shape == &axes[..axes.len() - 1]);
        let values = arrays::named(name, given, &arrays::tuple(&axes), fits)?.values;
        Ok(Self::Many(values))
    }

    fn values(&self) -> &[f64] {
        match self {
            Self::None => &[],
            Self::One(value) => value,
            Self::Many(values) => values,
        }
    }
}

/// Rows of a batch, copied: `size` numbers per channel; an axis of length one may be omitted.
fn record(
    name: &str,
    given: &Bound<'_, PyAny>,
    steps: Option<usize>,
    axes: &[usize],
    size: usize,
) -> PyResult<Record> {
    let full = [axes, &[size]].concat();
    let first = steps.map_or("n".to_owned(), |n| n.to_string());
    let rest: Vec<String> = full.iter().map(usize::to_string).collect();
    let expected = format!("({first}, {})", rest.join(", "));
    let mut read = arrays::named(name, given, &expected, |shape| {
        let Some((n, shape)) = shape.split_first() else { return false };
        steps.is_none_or(|steps| steps == *n) && (shape == full || (size == 1 && shape == axes))
    })?;
    read.shape = [&read.shape[..1], &full].concat();
    Ok(read)
}

/// Matrix of a step, checked; `own` are the sizes of the filter.
fn matrix(
    name: &'static str,
    given: Option<&Bound<'_, PyAny>>,
    own: [usize; 3],
) -> PyResult<Option<Record>> {
    given.map(|given| read_matrices(name, given, None, own)).transpose()
}

/// One matrix for all steps, or one per step, checked.
fn matrices(
    name: &'static str,
    given: Option<&Bound<'_, PyAny>>,
    steps: usize,
    own: [usize; 3],
) -> PyResult<Option<Record>> {
    given.map(|given| read_matrices(name, given, Some(steps), own)).transpose()
}

fn read_matrices(
    name: &'static str,
    given: &Bound<'_, PyAny>,
    steps: Option<usize>,
    [n, m, _]: [usize; 3],
) -> PyResult<Record> {
    let (rows, columns) = match name {
        "H" => (m, Some(n)),
        "R" => (m, Some(m)),
        "B" => (n, None),
        _ => (n, Some(n)),
    };
    let column = columns.map_or("p".to_owned(), |columns| columns.to_string());
    let expected = match steps {
        None => format!("({rows}, {column})"),
        Some(steps) => format!("({rows}, {column}) or ({steps}, {rows}, {column})"),
    };
    let is_one = |shape: &[usize]| {
        is_matrix(shape)
            && shape[0] == rows
            && columns.is_none_or(|columns| shape[1] == columns)
            && shape[1] <= MAX_SIZE
    };
    let mut read = arrays::named(name, given, &expected, |shape| match (shape, steps) {
        ([first, shape @ ..], Some(steps)) if shape.len() == 2 => *first == steps && is_one(shape),
        ([], _) => rows == 1 && columns == Some(1),
        _ => is_one(shape),
    })?;
    if read.shape.is_empty() {
        read.shape = vec![1, 1];
    }
    let each = read.shape.len() == 3;
    let size: usize = read.shape[read.shape.len() - 2..].iter().product();
    for (step, matrix) in read.values.chunks_exact_mut(size.max(1)).enumerate() {
        let step = each.then_some(step);
        let checked = match name {
            "Q" | "R" => settle_covariance(name, step, rows, matrix),
            _ => check_matrix(name, step, matrix),
        };
        checked.map_err(NativeError::from)?;
    }
    Ok(read)
}

fn varying(read: &Record) -> Varying<'_> {
    match read.shape[..] {
        [_, rows, columns] => Varying::each(&read.values, rows * columns),
        _ => Varying::same(&read.values),
    }
}

/// One matrix for all channels, shown for each channel.
fn across<'py>(
    found: Bound<'py, PyAny>,
    channels: Option<usize>,
    groups: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let Some(k) = channels.filter(|k| *k != groups) else { return Ok(found) };
    let mut shape: Vec<usize> = found.getattr("shape")?.extract()?;
    let axis = shape.len() - 3;
    shape[axis] = k;
    found.py().import("numpy")?.call_method1("broadcast_to", (found, shape))
}

/// One matrix of the model, with the names of its dimensions.
fn own<'py>(
    filter: &Bound<'py, LinearKalman>,
    of: fn(&Model) -> (&Vec<f64>, [usize; 2]),
) -> PyResult<Bound<'py, PyAny>> {
    let this = reading(filter)?;
    let model = this.shared.bank.model();
    let (values, sides) = of(model);
    arrays::array(filter.py(), values.clone(), &sides.map(|side| model.sizes[side]))
}

#[cold]
fn no_inputs(_u: &Bound<'_, PyAny>) -> PyErr {
    PyValueError::new_err("u was given, but the filter has no B that says what an input does")
}

fn is_matrix(shape: &[usize]) -> bool {
    shape.len() == 2 && shape.iter().all(|size| *size > 0)
}

fn square(shape: &[usize]) -> bool {
    shape.is_empty() || is_matrix(shape) && shape[0] == shape[1]
}

/// A number in place of a matrix with one element.
fn single(shape: &[usize], sides: [usize; 2]) -> bool {
    shape.is_empty() && sides == [1, 1]
}

fn side(F: &Record) -> usize {
    F.shape.first().copied().unwrap_or(1)
}
