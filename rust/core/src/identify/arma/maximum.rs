//! The greatest likelihood and its curvature.

use nalgebra::DMatrix;

use super::descent::{Descent, Problem, Stop, minimise};
use super::estimate::{FINE, Scaled};
use super::exact::Exact;
use super::hessian::curvature;
use super::normal::Normal;
use super::partial;
use super::series::Series;

/// Near enough for the curvature there to be that at the maximum.
const NEAR: Stop = Stop { step: 1e-3, evaluations: 100 };

/// Steps of second differences, in standard errors: small beside the curvature's own changes,
/// large beside the rounding of a million terms.
const HESSIAN_STEP: f64 = 0.02;
/// The same at most, in free coordinates and deviations of the record.
const LARGEST_STEP: f64 = 0.05;

/// The most likely stationary model near conditional coefficients, and the search for it.
pub fn maximum(
    series: &Series,
    start: &[f64],
    (p, q): (usize, usize),
    has_constant: bool,
) -> (Scaled, Descent) {
    let mut problem = Exact::new(series, p, q, has_constant);
    let near = minimise(&problem, inside(start, p, q), NEAR, |_, _| false);
    let bent = problem.bend(&near, information(&problem, &near));
    let found = minimise(&problem, near.point, FINE, |_, _| false);
    let free = Normal::of_gram(&found.normal.gram + bent).inverse().0
        * (found.normal.sum_of_squares / problem.count() as f64);
    let evaluations = near.evaluations + found.evaluations;
    let found = Descent { evaluations, ..found };
    (scaled(&problem, &found.outlook(&problem), &free, has_constant), found)
}

/// `[φ, θ, c]` from a point and the covariance of its coordinates.
fn scaled(problem: &Exact<'_>, point: &[f64], free: &DMatrix<f64>, has_constant: bool) -> Scaled {
    let (phi, theta, mean) = problem.model(point);
    let (p, end) = (phi.len(), phi.len() + theta.len());
    let room = 1.0 - phi.iter().sum::<f64>();
    let mut coefficients = [phi, theta].concat();
    let mut slopes = DMatrix::identity(point.len(), point.len());
    if has_constant {
        slopes.view_mut((end, 0), (1, p)).fill(-mean);
        slopes[(end, end)] = room;
        coefficients.push(mean * room);
    }
    let slopes = slopes * problem.slopes(point);
    let covariance = &slopes * free * slopes.transpose();
    let information = Normal::of_gram(covariance.clone()).inverse().0;
    let likelihood = problem.likelihood(point);
    Scaled {
        coefficients,
        covariance,
        condition: Normal::of_gram(information).inverse().1,
        sigma2: likelihood.map_or(f64::NAN, |likelihood| likelihood.sigma2()),
        log_likelihood: likelihood.map_or(f64::NAN, |likelihood| likelihood.log_likelihood()),
        count: problem.count(),
    }
}

/// The point of conditional coefficients, brought into the region where a likelihood exists.
fn inside(coefficients: &[f64], p: usize, q: usize) -> Vec<f64> {
    let (phi, rest) = coefficients.split_at(p);
    let (theta, constant) = rest.split_at(q);
    let free = |x: &[f64]| {
        let shrunk = || partial::to_free(&partial::shrunk(x));
        partial::to_free(x).or_else(shrunk).unwrap_or_default()
    };
    let minus_theta: Vec<f64> = theta.iter().map(|x| -x).collect();
    // The record's mean is zero, and near it that of any process that could have made it.
    [free(phi), free(&minus_theta), constant.iter().map(|_| 0.0).collect()].concat()
}

/// Curvature of the log-likelihood, if it has one in every direction: at the edge of the region
/// it has not.
fn information(problem: &Exact<'_>, near: &Descent) -> Option<DMatrix<f64>> {
    let sigma2 = near.normal.sum_of_squares / problem.count() as f64;
    let variances = near.normal.inverse().0.diagonal() * sigma2;
    let step = |variance: &f64| (HESSIAN_STEP * variance.sqrt()).min(LARGEST_STEP);
    let steps: Vec<f64> = variances.iter().map(step).collect();
    let value = |point: &[f64]| Some(problem.likelihood(point)?.log_likelihood());
    curvature(value, &near.point, &steps).filter(|found| found.clone().cholesky().is_some())
}
