//! Deviations of the Allan family for Python.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use zerorate_core::allan::{Curve, Kind, Record, curves};
use zerorate_core::stream::on_pool;
use zerorate_core::work::Current;

use crate::common::arrays;
use crate::common::errors::about;
use crate::common::streaming::positive;
use crate::common::work::interruptible;

type Arrays<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);

/// Return deviations of the Allan family of rate records, at averaging factors in samples.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,) or (n, k)
///     Rates of one axis or of k axes. Rates that are not finite or masked are missing. A term that
///     needs a missing rate is left out.
/// factors : sequence of int
///     Averaging times m in samples, at least 1.
/// kind : str, default "oadev"
///     "adev", "oadev", "mdev", "tdev", "hdev", "ohdev", "totdev", "mtotdev", "ttotdev", "htotdev",
///     "theo1" or "pdev". No kind is corrected for bias. "theo1" has the averaging time 0.75 m and
///     needs an even m of at least 10. "tdev" and "ttotdev" are in the unit of ``z`` times samples.
/// bridge : int, default 0
///     Longest gap, in samples, that is first filled by linear interpolation.
/// threads : int, optional
///     Number of threads. With 1 the calling thread does the work; a larger number creates a pool
///     of threads. The default is the process's pool, with as many threads as the machine has. The
///     result does not depend on it, bit for bit.
///
/// Returns
/// -------
/// deviation : ndarray, float64, shape (t,) or (t, k)
///     Deviations in the unit of ``z``, one row per factor; NaN without a term.
/// terms : ndarray, int64, shape (t,) or (t, k)
///     Number of terms; each overlapping term is counted.
/// exponent : ndarray, int64, shape (t,) or (t, k)
///     Exponent α of the rate's noise S(f) ~ f^α at this averaging time. It is between -4 and 2 for
///     Hadamard kinds, and between -2 and 2 for the other kinds. If it cannot be identified, the
///     exponent of the previous factor is used, for the first factor 0.
///
/// Raises
/// ------
/// ValueError
///     The kind is unknown, a factor is below 1, or ``z`` has a wrong shape.
/// TypeError
///     ``z`` does not hold real numbers.
///
/// Notes
/// -----
/// W. J. Riley, NIST Special Publication 1065, section 5; "pdev": Vernotte et al., IEEE Trans. UFFC
/// 63(4), 2016; exponent: Riley and Greenhall, 18th EFTF, 2004.
///
/// Examples
/// --------
/// >>> from zerorate import _native
/// >>> deviation, terms, _ = _native.allan_deviations([1.0, 2.0, 0.0], [1, 2])
/// >>> deviation.round(3).tolist(), terms.tolist()
/// ([1.118, nan], [2, 0])
#[pyfunction]
#[pyo3(signature = (z, factors, kind="oadev", bridge=0, threads=None))]
pub fn allan_deviations<'py>(
    z: &Bound<'py, PyAny>,
    factors: &Bound<'py, PyAny>,
    kind: &str,
    bridge: i128,
    threads: Option<i128>,
) -> PyResult<Arrays<'py>> {
    let kind = named(kind)?;
    let factors = read(factors)?;
    let bridge = usize::try_from(bridge)
        .map_err(|_| about("bridge", format!("bridge must not be negative, got {bridge}")))?;
    let threads = threads.map(|n| positive("threads", n.min(i128::from(u16::MAX)))).transpose()?;
    let columns = arrays::columns(z)?;
    let shape: Vec<usize> = std::iter::once(factors.len()).chain(columns.axes).collect();
    let samples = columns.values.iter().map(Vec::len).sum();
    let curves = interruptible(z.py(), samples, || {
        on_threads(threads, |parallel| {
            let records = Record::of_columns(columns.values, bridge, parallel);
            curves(&records, kind, &factors, parallel)
        })
    })??;
    tabulate(z.py(), &curves, &shape)
}

/// Return the largest averaging factor with a term in a record of n samples; 0 if none has a term.
///
/// Raises
/// ------
/// ValueError
///     The kind is unknown, or n is negative.
#[pyfunction]
pub fn longest_factor(kind: &str, n: i128) -> PyResult<usize> {
    let samples = usize::try_from(n)
        .map_err(|_| PyValueError::new_err(format!("n must be a number of samples, got {n}")))?;
    Ok(named(kind)?.longest(samples))
}

/// Averaging factors of an array, read at once, since the array may be as long as a record.
fn read(factors: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
    let factor = |m| positive("a factor", m);
    match factors.cast::<PyArray1<i64>>() {
        Ok(array) => array.try_readonly()?.as_array().iter().map(|m| factor((*m).into())).collect(),
        Err(_) => factors.extract::<Vec<i128>>()?.into_iter().map(factor).collect(),
    }
}

fn named(kind: &str) -> PyResult<Kind> {
    Kind::from_name(kind).ok_or_else(|| {
        let names = Kind::NAMES.map(|(_, name)| format!("'{name}'")).join(", ");
        PyValueError::new_err(format!("kind must be one of {names}, got '{kind}'"))
    })
}

/// Runs `work` on the process's pool, on a new pool, or, for one thread, on the calling thread.
fn on_threads<R: Send>(threads: Option<usize>, work: impl FnOnce(bool) -> R + Send) -> PyResult<R> {
    match threads {
        None => Ok(on_pool(|| work(true))),
        Some(1) => Ok(work(false)),
        Some(n) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().map_err(|error| {
                PyRuntimeError::new_err(format!("{n} threads could not be started: {error}"))
            })?;
            let current = Current::here();
            Ok(pool.install(|| current.run(|| work(true))))
        }
    }
}

/// Arrays with one row per factor and one column per axis.
fn tabulate<'py>(py: Python<'py>, curves: &[Curve], shape: &[usize]) -> PyResult<Arrays<'py>> {
    let rows = || (0..shape[0]).flat_map(|t| curves.iter().map(move |curve| (curve, t)));
    let deviations =
        rows().map(|(curve, t)| curve.estimates[t].map_or(f64::NAN, |estimate| estimate.deviation));
    let terms =
        rows().map(|(curve, t)| curve.estimates[t].map_or(0, |estimate| estimate.terms as i64));
    let exponents = rows().map(|(curve, t)| i64::from(curve.exponents[t]));
    Ok((
        arrays::array(py, deviations.collect(), shape)?,
        arrays::array(py, terms.collect(), shape)?,
        arrays::array(py, exponents.collect(), shape)?,
    ))
}
