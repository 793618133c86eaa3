//! Outliers by running medians for Python.

use pyo3::prelude::*;
use zerorate_core::identify::Hampel;

use crate::common::arrays;
use crate::common::streaming::positive;

/// A record with its outliers replaced by the median of a running window.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,)
///     Those not finite are missing.
/// width : int
///     Samples of a window, at least 1.
/// threshold : float
///     Deviations, 1.4826 times the median distance from the median, that are too far.
/// least_deviation : float
///     In the unit of ``z``.
///
/// Returns
/// -------
/// cleaned : ndarray, float64, shape (n,)
/// places : ndarray, int64, shape (m,)
///     Which samples were replaced.
///
/// Raises
/// ------
/// ValueError
///     A width below 1, or ``z`` of another shape.
#[pyfunction]
pub fn without_outliers<'py>(
    z: &Bound<'py, PyAny>,
    width: i128,
    threshold: f64,
    least_deviation: f64,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let hampel = Hampel { width: positive("width", width)?, threshold, least_deviation };
    let mut record = arrays::batch(z, None)?;
    let places = z.py().detach(|| hampel.clean(&mut record.values));
    let places: Vec<i64> = places.into_iter().map(|k| k as i64).collect();
    let count = places.len();
    Ok((
        arrays::array(z.py(), record.values, &record.shape)?,
        arrays::array(z.py(), places, &[count])?,
    ))
}
