//! Distributions that bounds and tests need.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use libm::erfc;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use statrs::distribution::{ChiSquared, Continuous, ContinuousCDF};

use crate::common::arrays;

/// Quantiles of the chi-squared distribution.
///
/// Parameters
/// ----------
/// probability : float
///     In (0, 1).
/// edf : array_like, shape (t,)
///     Degrees of freedom, not necessarily whole; NaN where there are none.
///
/// Returns
/// -------
/// ndarray, float64, shape (t,)
///     NaN where the degrees of freedom are not positive and finite.
///
/// Raises
/// ------
/// ValueError
///     If the probability is not in (0, 1) or `edf` of another shape.
#[pyfunction]
pub fn chi_squared_quantile<'py>(
    probability: f64,
    edf: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    if !(probability > 0.0 && probability < 1.0) {
        return Err(PyValueError::new_err(format!(
            "probability must lie between 0 and 1, got {probability}"
        )));
    }
    let freedoms = arrays::batch(edf, None)?;
    let values = freedoms.values.iter().map(|freedom| quantile(probability, *freedom)).collect();
    arrays::array(edf.py(), values, &freedoms.shape)
}

/// Probability of exceeding a value of chi-squared, to a small relative error far into the tail.
///
/// Parameters
/// ----------
/// value : float
/// freedom : float
///     Degrees of freedom, positive and finite.
///
/// Raises
/// ------
/// ValueError
///     Degrees of freedom that are not positive and finite, or a value that is NaN.
#[pyfunction]
pub fn chi_squared_survival(value: f64, freedom: f64) -> PyResult<f64> {
    let known = ChiSquared::new(freedom).ok().filter(|_| freedom.is_finite() && !value.is_nan());
    let distribution = known.ok_or_else(|| {
        let needed = "chi-squared needs a number and positive finite degrees of freedom";
        PyValueError::new_err(format!("{needed}, got {value} and {freedom}"))
    })?;
    Ok(distribution.sf(value))
}

/// Logarithm of the cumulative standard normal distribution, also far into its tail.
///
/// Parameters
/// ----------
/// x : array_like, shape (n,)
///     In standard deviations.
///
/// Returns
/// -------
/// ndarray, float64, shape (n,)
///
/// Raises
/// ------
/// ValueError
///     ``x`` of another shape.
#[pyfunction]
pub fn log_normal_cdf<'py>(x: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let mut samples = arrays::batch(x, None)?;
    x.py().detach(|| samples.values.iter_mut().for_each(|x| *x = log_phi(*x)));
    arrays::array(x.py(), samples.values, &samples.shape)
}

/// From here down the tail's series is exact to rounding.
const TAIL: f64 = -20.0;

fn log_phi(x: f64) -> f64 {
    let half_erfc = |x: f64| 0.5 * erfc(x * FRAC_1_SQRT_2);
    if x < TAIL {
        let u = 1.0 / (x * x);
        let series = u * (-1.0 + u * (3.0 + u * (-15.0 + u * (105.0 - 945.0 * u))));
        -0.5 * x * x - (-x).ln() - 0.5 * (2.0 * PI).ln() + series.ln_1p()
    } else if x < 0.0 {
        half_erfc(-x).ln()
    } else {
        (-half_erfc(x)).ln_1p()
    }
}

fn quantile(probability: f64, freedom: f64) -> f64 {
    match ChiSquared::new(freedom) {
        Ok(distribution) if freedom.is_finite() => {
            let rough = distribution.inverse_cdf(probability);
            (0..STEPS).fold(rough, |x, _| refined(&distribution, probability, x))
        }
        _ => f64::NAN,
    }
}

/// Steps that bring an absolute error of 1e-10 down to rounding.
const STEPS: usize = 3;

/// Newton's step for the logarithm of a quantile, of which that of the probability is nearly a
/// straight line where both are small.
fn refined(distribution: &ChiSquared, probability: f64, x: f64) -> f64 {
    let below = distribution.cdf(x);
    let step = (probability / below).ln() * below / (x * distribution.pdf(x));
    if step.is_finite() { x * step.exp() } else { x }
}
