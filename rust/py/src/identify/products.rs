//! Lagged products for Python.

use pyo3::prelude::*;
use zerorate_core::identify;

use crate::common::arrays;
use crate::common::streaming::positive;

/// Sums of products of samples so many apart, of which none reaches across a missing one.
///
/// Parameters
/// ----------
/// z : array_like, shape (n,)
///     Less its mean; those not finite are missing.
/// lags : int
///     The greatest lag, at least 1.
///
/// Returns
/// -------
/// sums : ndarray, float64, shape (lags + 1,)
///     Of z_k z_(k+l).
/// pairs : ndarray, int64, shape (lags + 1,)
///     How many products were summed.
///
/// Raises
/// ------
/// ValueError
///     ``lags`` below 1, or ``z`` of another shape.
#[pyfunction]
pub fn lagged_products<'py>(
    z: &Bound<'py, PyAny>,
    lags: i128,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let lags = positive("lags", lags)?;
    let record = arrays::batch(z, None)?.values;
    let products = z.py().detach(|| identify::lagged_products(&record, lags));
    let pairs: Vec<i64> = products.pairs.into_iter().map(|count| count as i64).collect();
    Ok((
        arrays::array(z.py(), products.sums, &[lags + 1])?,
        arrays::array(z.py(), pairs, &[lags + 1])?,
    ))
}
