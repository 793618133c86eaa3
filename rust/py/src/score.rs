//! Measures of a replay for Python, and the average as a baseline for filters.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use zerorate_core::memory;
use zerorate_core::score::{AxisScores, Score, Totals};

use crate::common::arrays;
use crate::common::errors::NativeError;
use crate::common::streaming::exclusive;

/// Measures of k axes of a replay, for the raw samples and each estimate of their drift.
///
/// Blocks have one row per axis. The measures do not depend on the blocks' size.
///
/// Parameters
/// ----------
/// axes, estimates : int
///     Number of axes, and of estimates.
/// horizons : sequence of int
///     Horizons of the coasting errors, in samples.
/// delay : int, optional
///     Number of samples that measures at rest leave out before each motion. With None they use all
///     samples.
#[pyclass(module = "zerorate._native")]
#[derive(Debug)]
pub struct ReplayScores {
    axes: Vec<AxisScores>,
    estimates: usize,
    horizons: usize,
    leaves_out_motion: bool,
}

#[pymethods]
impl ReplayScores {
    #[new]
    #[pyo3(signature = (axes, estimates, horizons, delay=None))]
    fn new(
        axes: usize,
        estimates: usize,
        horizons: Vec<usize>,
        delay: Option<usize>,
    ) -> PyResult<Self> {
        if let Some(zero) = horizons.iter().find(|horizon| **horizon == 0) {
            return Err(PyValueError::new_err(format!("a horizon must be at least 1, got {zero}")));
        }
        let mut all = memory::room(axes).map_err(NativeError::from)?;
        for _ in 0..axes {
            let axis = AxisScores::new(estimates, &horizons, delay.unwrap_or(0));
            all.push(axis.map_err(NativeError::from)?);
        }
        let leaves_out_motion = delay.is_some();
        Ok(Self { axes: all, estimates, horizons: horizons.len(), leaves_out_motion })
    }

    /// Process a block: samples (k, n), the estimates of each method, and optional arrays.
    ///
    /// ``at_rest`` is True where the filter learned, ``truth`` is the true drift. The interpreter
    /// lock is released.
    #[pyo3(signature = (raw, estimates, at_rest=None, truth=None))]
    fn take(
        slf: &Bound<'_, Self>,
        raw: PyReadonlyArray2<'_, f64>,
        estimates: Vec<PyReadonlyArray2<'_, f64>>,
        at_rest: Option<PyReadonlyArray2<'_, bool>>,
        truth: Option<PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let shape = [this.axes.len(), raw.shape()[1]];
        arrays::check("raw", raw.shape(), &shape)?;
        arrays::check("estimates", &[estimates.len()], &[this.estimates])?;
        for estimate in &estimates {
            arrays::check("an estimate", estimate.shape(), &shape)?;
        }
        let raw = raw.as_array();
        let raw = arrays::rows("raw", &raw)?;
        let views: Vec<_> = estimates.iter().map(|estimate| estimate.as_array()).collect();
        let estimates: PyResult<Vec<_>> =
            views.iter().map(|view| arrays::rows("an estimate", view)).collect();
        let estimates = estimates?;
        let at_rest = at_rest.as_ref().map(|flags| flags.as_array());
        let truth = truth.as_ref().map(|truth| truth.as_array());
        let at_rest = at_rest.as_ref().map(|flags| arrays::rows("at_rest", flags)).transpose()?;
        let truth = truth.as_ref().map(|truth| arrays::rows("truth", truth)).transpose()?;
        let (leaves_out_motion, axes) = (this.leaves_out_motion, &mut this.axes);
        slf.py().detach(|| {
            for (i, axis) in axes.iter_mut().enumerate() {
                let series: Vec<&[f64]> = estimates.iter().map(|estimate| estimate[i]).collect();
                let flags = at_rest.as_ref().map(|flags| flags[i]);
                axis.count_rest(flags.unwrap_or_default());
                let rest = flags.filter(|_| leaves_out_motion);
                axis.take(raw[i], rest, &series, truth.as_ref().map(|truth| truth[i]));
            }
        });
        Ok(())
    }

    /// End the record and return arrays by name, with the raw samples first.
    ///
    /// `mean`, `deviation` and `error` are (k, m + 1). `coasting` is (k, m + 1, horizons), unit
    /// times samples. `missing`, `present` and `at_rest` are counts of all samples. `least` and
    /// `most` are (k,).
    fn finish<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let py = slf.py();
        let mut this = exclusive(slf)?;
        let scores: Vec<Score> = this.axes.iter_mut().flat_map(AxisScores::finish).collect();
        let totals: Vec<Totals> = this.axes.iter().map(AxisScores::totals).collect();
        let (k, series) = (this.axes.len(), this.estimates + 1);
        let found = PyDict::new(py);
        for (name, of) in NUMBERS {
            let values: Vec<f64> = scores.iter().map(of).collect();
            found.set_item(name, arrays::array(py, values, &[k, series])?)?;
        }
        let coasting: Vec<f64> = scores.into_iter().flat_map(|score| score.coasting).collect();
        found.set_item("coasting", arrays::array(py, coasting, &[k, series, this.horizons])?)?;
        for (name, of) in COUNTS {
            let values: Vec<i64> = totals.iter().map(|totals| of(totals) as i64).collect();
            found.set_item(name, values.into_pyarray(py))?;
        }
        for (i, name) in ["least", "most"].into_iter().enumerate() {
            let values: Vec<f64> = totals.iter().map(|totals| totals.range[i]).collect();
            found.set_item(name, values.into_pyarray(py))?;
        }
        Ok(found)
    }
}

type Named<T, V> = (&'static str, fn(&T) -> V);

const NUMBERS: [Named<Score, f64>; 3] = [
    ("mean", |score| score.mean),
    ("deviation", |score| score.deviation),
    ("error", |score| score.error),
];

const COUNTS: [Named<Totals, u64>; 3] = [
    ("missing", |totals| totals.missing),
    ("present", |totals| totals.present),
    ("at_rest", |totals| totals.at_rest),
];

/// Return the exponential moving average of one axis; it starts as the running mean.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,)
///     Samples; the average is held if a sample is not finite.
/// gain : float
///     Gain from 0, the running mean, to 1, the samples themselves.
///
/// Returns
/// -------
/// ndarray, float64, shape (n,)
///     Average; NaN before the first sample that is present.
///
/// Raises
/// ------
/// ValueError
///     The gain is out of range, or `z` has a wrong shape.
#[pyfunction]
pub fn exponential_mean<'py>(
    z: &Bound<'py, PyAny>,
    gain: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let mut values = arrays::record(z)?;
    z.py()
        .detach(|| zerorate_core::exponential_mean(&mut values, gain))
        .map_err(NativeError::from)?;
    Ok(values.into_pyarray(z.py()))
}
