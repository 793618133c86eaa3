//! A fitted model in the units of the record.

use nalgebra::{DMatrix, DVector};

use super::conditional::Conditional;
use super::descent::{Descent, End, Problem, Stop, minimise};
use super::exact::Exact;
use super::hessian::curvature;
use super::lattice::lattice;
use super::normal::Normal;
use super::partial;
use super::series::Series;

/// Steps this small, in standard errors, let two searches agree to 1e-6 in well determined
/// coefficients.
const FINE: Stop = Stop { step: 1e-6, evaluations: 200 };

/// Steps of second differences, in standard errors: small beside the curvature's own changes,
/// large beside the rounding of a million terms.
const HESSIAN_STEP: f64 = 0.02;
/// The same at most, in free coordinates and deviations of the record.
const LARGEST_STEP: f64 = 0.05;

/// What is made small.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The sum of the squares of the conditional residuals.
    Conditional,
    /// Minus the exact Gaussian likelihood.
    Exact,
}

/// A model and how well the record determines it.
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
    /// Of `[φ, θ, c]`, row after row.
    pub covariance: Vec<f64>,
    /// Standard error of the mean `c / (1 - φ_1 - … - φ_p)`.
    pub mean_sigma: f64,
    /// Number of innovations summed.
    pub count: usize,
    /// Of the innovations.
    pub log_likelihood: f64,
    /// Condition number of the normal equations scaled to a unit diagonal.
    pub condition: f64,
    /// Whether the search came to a minimum.
    pub converged: bool,
    /// Whether a root of `φ`, and whether one of `θ`, lies on the unit circle.
    pub on_circle: (bool, bool),
    /// Passes over the record at the last order.
    pub evaluations: usize,
}

/// Coefficients of a scaled record, before they get back its units.
struct Scaled {
    /// `[φ, θ, c]`, without `c` where it was not estimated.
    coefficients: Vec<f64>,
    covariance: DMatrix<f64>,
    condition: f64,
    sigma2: f64,
    log_likelihood: f64,
    count: usize,
}

/// The model of orders (p, q), at most [`super::MAX_ORDER`], that fits a record best.
pub fn fit(series: &Series, p: usize, q: usize, has_constant: bool, method: Method) -> Estimate {
    let problem = Conditional::new(series, p, q, has_constant, p);
    let mut found = lattice(series, p, q, has_constant, p);
    let (start, evaluations) = found.swap_remove(found.len() - 1);
    let descent = minimise(&problem, start.point, FINE, |_, _| false);
    let evaluations = evaluations + descent.evaluations;
    let (scaled, descent) = match method {
        Method::Conditional => (conditional(&problem, &descent), descent),
        Method::Exact => exact(series, &problem.coefficients(&descent.point), p, q, has_constant),
    };
    let converged = descent.end == End::Minimum;
    with_units(series, scaled, p, q, converged, evaluations + descent.evaluations)
}

fn conditional(problem: &Conditional<'_>, descent: &Descent) -> Scaled {
    let coefficients = problem.coefficients(&descent.point);
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

fn exact(
    series: &Series,
    start: &[f64],
    p: usize,
    q: usize,
    has_constant: bool,
) -> (Scaled, Descent) {
    let problem = Exact::new(series, p, q, has_constant);
    let descent = minimise(&problem, exact_start(start, p, q), FINE, |_, _| false);
    let (phi, theta, mean) = problem.model(&descent.point);
    let covariance = exact_covariance(&problem, &descent);
    let room = 1.0 - phi.iter().sum::<f64>();
    let mut slopes = DMatrix::identity(covariance.nrows(), covariance.nrows());
    let mut coefficients = [phi, theta].concat();
    if has_constant {
        slopes.view_mut((p + q, 0), (1, p)).fill(-mean);
        slopes[(p + q, p + q)] = room;
        coefficients.push(mean * room);
    }
    let covariance = &slopes * covariance * slopes.transpose();
    let information = Normal::of_gram(covariance.clone()).inverse().0;
    let likelihood = problem.likelihood(&descent.point);
    let scaled = Scaled {
        coefficients,
        covariance,
        condition: Normal::of_gram(information).inverse().1,
        sigma2: likelihood.map_or(f64::NAN, |l| l.sigma2()),
        log_likelihood: likelihood.map_or(f64::NAN, |l| l.log_likelihood()),
        count: problem.count(),
    };
    (scaled, descent)
}

/// The point of conditional coefficients, brought into the region where a likelihood exists.
fn exact_start(coefficients: &[f64], p: usize, q: usize) -> Vec<f64> {
    let (phi, rest) = coefficients.split_at(p);
    let (theta, constant) = rest.split_at(q);
    let inside = |x: &[f64]| {
        let shrunk = || partial::to_free(&partial::shrunk(x));
        partial::to_free(x).or_else(shrunk).unwrap_or_default()
    };
    let minus_theta: Vec<f64> = theta.iter().map(|x| -x).collect();
    // The record's mean is zero, and near it that of any process that could have made it.
    [inside(phi), inside(&minus_theta), constant.iter().map(|_| 0.0).collect()].concat()
}

/// Covariance of `[φ, θ, mean]`: the inverse curvature of the log-likelihood, or where that has
/// none, at the edge of the region, that of its sum of squares.
fn exact_covariance(problem: &Exact<'_>, descent: &Descent) -> DMatrix<f64> {
    let sigma2 = descent.normal.sum_of_squares / problem.count() as f64;
    let rough = descent.normal.inverse().0 * sigma2;
    let step = |variance: f64| (HESSIAN_STEP * variance.sqrt()).min(LARGEST_STEP);
    let steps: Vec<f64> = rough.diagonal().iter().map(|variance| step(*variance)).collect();
    let value = |point: &[f64]| Some(problem.likelihood(point)?.log_likelihood());
    let sharp = curvature(value, &descent.point, &steps)
        .filter(|curvature| curvature.clone().cholesky().is_some())
        .map(|curvature| Normal::of_gram(curvature).inverse().0);
    let slopes = problem.slopes(&descent.point);
    &slopes * sharp.unwrap_or(rough) * slopes.transpose()
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
    let room = 1.0 - scaled.coefficients[..p].iter().sum::<f64>();
    let c = scaled.coefficients.get(p + q).copied().unwrap_or(0.0);
    let mut slopes = DMatrix::zeros(p + q + 1, scaled.coefficients.len());
    slopes.fill_diagonal(1.0);
    let mut mean_slope = DVector::zeros(scaled.coefficients.len());
    if has_constant {
        slopes.view_mut((p + q, 0), (1, p)).fill(-origin);
        slopes[(p + q, p + q)] = unit;
        mean_slope.rows_mut(0, p).fill(unit * c / (room * room));
        mean_slope[p + q] = unit / room;
    }
    let covariance = &slopes * &scaled.covariance * slopes.transpose();
    let minus_theta: Vec<f64> = scaled.coefficients[p..p + q].iter().map(|x| -x).collect();
    let phi = scaled.coefficients[..p].to_vec();
    Estimate {
        on_circle: (partial::on_circle(&phi), partial::on_circle(&minus_theta)),
        theta: scaled.coefficients[p..p + q].to_vec(),
        constant: if has_constant { origin * room + unit * c } else { 0.0 },
        sigma2: scaled.sigma2 * unit * unit,
        covariance: covariance.as_slice().to_vec(),
        mean_sigma: mean_slope.dot(&(&scaled.covariance * &mean_slope)).max(0.0).sqrt(),
        count: scaled.count,
        log_likelihood: scaled.log_likelihood - scaled.count as f64 * unit.ln(),
        condition: scaled.condition,
        converged,
        evaluations,
        phi,
    }
}
