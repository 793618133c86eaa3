//! The greatest likelihood and its curvature.

use nalgebra::{DMatrix, DVector};

use super::descent::{Descent, Problem, Stop, minimise};
use super::estimate::{FINE, Scaled};
use super::exact::{EDGE, Exact};
use super::hessian::curvature;
use super::normal::Normal;
use super::partial;
use super::series::Series;

/// One search with the curvature of its first point.
const LEG: Stop = Stop { evaluations: 30, ..FINE };
/// Where a leg is shorter, in standard errors, the curvature at its ends is the same.
const SHORT: f64 = 0.01;
const LEGS: usize = 5;

/// Steps of second differences, in standard errors: small beside the curvature's own changes,
/// large beside the rounding of a million terms.
const HESSIAN_STEP: f64 = 0.02;
/// The same at most, in free coordinates and deviations of the record.
const LARGEST_STEP: f64 = 0.05;

/// How much a point is drawn towards zero at a time, and how often: to a hundredth of 8 at last.
const DRAW: f64 = 0.9;
const MOST_DRAWS: usize = 64;

/// The most likely stationary model near conditional coefficients, and the search for it.
pub fn maximum(
    series: &Series,
    start: &[f64],
    (p, q): (usize, usize),
    has_constant: bool,
) -> (Scaled, Descent) {
    let mut problem = Exact::new(series, p, q, has_constant);
    let mut evaluations = 0;
    let mut start = settled(&problem, inside(start, p, q));
    for legs in 1.. {
        let normal = problem.normal(&start);
        let bend = problem.bend(&normal, information(&problem, &start, &normal));
        let curved = Normal::of_gram(&normal.gram + bend);
        let found = minimise(&problem, start.clone(), LEG, |_, _| false);
        evaluations += found.evaluations + 1;
        let leg = DVector::from_fn(start.len(), |i, _| found.point[i] - start[i]);
        let variance = normal.sum_of_squares / problem.count() as f64;
        if legs == LEGS || curved.length(&leg) <= SHORT * SHORT * variance {
            let free = curved.inverse().0 * variance;
            let scaled = scaled(&problem, &end(&problem, &found), &free, has_constant);
            return (scaled, Descent { evaluations, ..found });
        }
        start = found.point;
    }
    unreachable!("the last leg returns")
}

/// Where the search seems to end, or where it stands if there is no likelihood there.
fn end(problem: &Exact<'_>, found: &Descent) -> Vec<f64> {
    let ahead = found.outlook(problem);
    if is_likely(problem, &ahead) { ahead } else { found.point.clone() }
}

/// The point drawn towards zero until its stationary state can be told from rounding.
fn settled(problem: &Exact<'_>, mut point: Vec<f64>) -> Vec<f64> {
    let mut draws = 0;
    while !is_likely(problem, &point) && draws < MOST_DRAWS {
        point.iter_mut().for_each(|x| *x *= DRAW);
        draws += 1;
    }
    point
}

fn is_likely(problem: &Exact<'_>, point: &[f64]) -> bool {
    problem.likelihood(point).is_some_and(|found| found.log_likelihood().is_finite())
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
        let free = partial::to_free(x).or_else(shrunk).unwrap_or_default();
        free.into_iter().map(|x| x.clamp(-EDGE, EDGE)).collect::<Vec<_>>()
    };
    let minus_theta: Vec<f64> = theta.iter().map(|x| -x).collect();
    // The record's mean is zero, and near it that of any process that could have made it.
    [free(phi), free(&minus_theta), constant.iter().map(|_| 0.0).collect()].concat()
}

/// Curvature of the log-likelihood, if it has one in every direction: far from a maximum and at
/// the edge of the region it has not.
fn information(problem: &Exact<'_>, point: &[f64], normal: &Normal) -> Option<DMatrix<f64>> {
    let sigma2 = normal.sum_of_squares / problem.count() as f64;
    let variances = normal.inverse().0.diagonal() * sigma2;
    let step = |variance: &f64| (HESSIAN_STEP * variance.sqrt()).min(LARGEST_STEP);
    let steps: Vec<f64> = variances.iter().map(step).collect();
    let value = |point: &[f64]| Some(problem.likelihood(point)?.log_likelihood());
    curvature(value, point, &steps).filter(|found| found.clone().cholesky().is_some())
}
