//! ARMA(p, q) models by conditional least squares and by the exact Gaussian likelihood.
//!
//! `z_k = φ_1 z_{k-1} + … + φ_p z_{k-p} + a_k + θ_1 a_{k-1} + … + θ_q a_{k-q} + c`. Searches use
//! the inverse hyperbolic tangents of partial autocorrelations. In these coordinates every point is
//! an invertible model and, for the likelihood, a stationary model.

mod columns;
mod conditional;
mod descent;
mod grid;
mod likelihood;
mod maximum;
mod partial;
mod series;
mod spectrum;

use nalgebra::{DMatrix, DVector};

use conditional::Conditional;
use descent::{Descent, End, Problem, Stop, minimise};
use grid::best_fits;
use maximum::maximum;
use series::phi_of_one;

pub use grid::{Cell, grid};
pub use likelihood::{Likelihood, likelihood};
pub use series::Series;

/// Highest order of a polynomial.
pub const MAX_ORDER: usize = 8;

/// Step in standard errors at which two searches agree to 1e-6 in well determined coefficients.
const FINE_STOP: Stop = Stop { step: 1e-6, evaluations: 60, patience: usize::MAX };

/// Objective of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The sum of the squares of the conditional residuals.
    Conditional,
    /// Minus the exact Gaussian likelihood.
    Exact,
}

/// A model and its statistics.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// Autoregressive coefficients.
    pub phi: Vec<f64>,
    /// Moving-average coefficients.
    pub theta: Vec<f64>,
    /// The constant, zero if it was not estimated.
    pub constant: f64,
    /// Sum of the squared innovations over their number.
    pub sigma2: f64,
    /// Covariance of `[φ, θ, c]`, row after row.
    pub covariance: Vec<f64>,
    /// Standard error of the mean `c / (1 - φ_1 - … - φ_p)`.
    pub mean_sigma: f64,
    /// Number of innovations summed.
    pub count: usize,
    /// Log-likelihood of the innovations.
    pub log_likelihood: f64,
    /// Condition number of the normal equations scaled to a unit diagonal.
    pub condition: f64,
    /// True if the search reached a minimum.
    pub converged: bool,
    /// True if a root of `φ` lies on the unit circle, and true if a root of `θ` does.
    pub on_circle: (bool, bool),
    /// Passes over the record at the last order.
    pub evaluations: usize,
    /// Mean and standard deviation of the record; the mean is zero if it was assumed to be zero.
    pub moments: (f64, f64),
}

/// Coefficients of a scaled record, before they are converted to its units.
#[derive(Debug)]
struct Scaled {
    /// `[φ, θ, c]`, without `c` if it was not estimated.
    coefficients: Vec<f64>,
    covariance: DMatrix<f64>,
    condition: f64,
    sigma2: f64,
    log_likelihood: f64,
    count: usize,
}

/// The model of orders (p, q), at most [`MAX_ORDER`], that fits a record best. With a stated
/// `[φ, θ, c]` the search begins only there.
pub fn fit(
    series: &Series,
    p: usize,
    q: usize,
    has_constant: bool,
    method: Method,
    start: Option<Vec<f64>>,
) -> Estimate {
    let problem = Conditional::new(series, p, q, has_constant, p);
    let (start, evaluations) = match start {
        Some(start) => (problem.point(&series.without_units(start, p, p + q)), 0),
        None => search(series, p, q, has_constant),
    };
    let descent = minimise(&problem, start, FINE_STOP, |_, _| false);
    let evaluations = evaluations + descent.evaluations;
    let (scaled, descent) = match method {
        Method::Conditional => (conditional(&problem, &descent), descent),
        Method::Exact => {
            maximum(series, &problem.coefficients(&descent.point), (p, q), has_constant)
        }
    };
    let converged = descent.end == End::Minimum;
    with_units(series, scaled, p, q, converged, evaluations + descent.evaluations)
}

/// Best point from starts at all lower orders, and number of passes of the last search.
fn search(series: &Series, p: usize, q: usize, has_constant: bool) -> (Vec<f64>, usize) {
    let mut found = best_fits(series, p, q, has_constant, p);
    let (descent, evaluations) = found.swap_remove(found.len() - 1);
    (descent.point, evaluations)
}

fn conditional(problem: &Conditional<'_>, descent: &Descent) -> Scaled {
    let coefficients = problem.coefficients(&descent.predicted_minimum(problem));
    let normal = problem.natural(&coefficients);
    let (inverse, condition) = normal.inverse();
    let n = problem.count() as f64;
    let sigma2 = normal.sum_of_squares / n;
    Scaled {
        coefficients,
        covariance: inverse * sigma2,
        condition,
        sigma2,
        log_likelihood: -0.5 * n * ((std::f64::consts::TAU * sigma2).ln() + 1.0),
        count: problem.count(),
    }
}

fn with_units(
    series: &Series,
    scaled: Scaled,
    p: usize,
    q: usize,
    converged: bool,
    evaluations: usize,
) -> Estimate {
    let (origin, unit) = (series.origin, series.unit);
    let has_constant = scaled.coefficients.len() > p + q;
    let phi_of_one = phi_of_one(&scaled.coefficients[..p]);
    let c = scaled.coefficients.get(p + q).copied().unwrap_or(0.0);
    let mut slopes = DMatrix::zeros(p + q + 1, scaled.coefficients.len());
    slopes.fill_diagonal(1.0);
    let mut mean_slope = DVector::zeros(scaled.coefficients.len());
    if has_constant {
        slopes.view_mut((p + q, 0), (1, p)).fill(-origin);
        slopes[(p + q, p + q)] = unit;
        mean_slope.rows_mut(0, p).fill(unit * c / (phi_of_one * phi_of_one));
        mean_slope[p + q] = unit / phi_of_one;
    }
    let covariance = &slopes * &scaled.covariance * slopes.transpose();
    let phi = scaled.coefficients[..p].to_vec();
    let theta = scaled.coefficients[p..p + q].to_vec();
    Estimate {
        on_circle: (partial::on_circle(&phi), partial::on_circle(&partial::negated(&theta))),
        constant: if has_constant { origin * phi_of_one + unit * c } else { 0.0 },
        sigma2: scaled.sigma2 * unit * unit,
        covariance: covariance.as_slice().to_vec(),
        mean_sigma: mean_slope.dot(&(&scaled.covariance * &mean_slope)).max(0.0).sqrt(),
        count: scaled.count,
        log_likelihood: scaled.log_likelihood - scaled.count as f64 * unit.ln(),
        condition: scaled.condition,
        converged,
        evaluations,
        moments: (origin, unit),
        phi,
        theta,
    }
}
