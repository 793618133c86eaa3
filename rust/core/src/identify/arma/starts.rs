//! Where the searches begin.

use super::conditional::Conditional;
use super::descent::{Descent, Problem};
use super::regression::Regression;

/// A model of a lower order that is as good as it gets.
#[derive(Debug, Clone, Copy)]
pub struct Lower<'a> {
    pub p: usize,
    pub q: usize,
    pub at: &'a Descent,
}

/// Starting points at an order, the first for a search to its end: the model of both orders one
/// less with slow noise added, those of one order less, and Hannan and Rissanen's.
pub fn starts(
    problem: &Conditional<'_>,
    regression: &Regression,
    has_constant: bool,
    diagonal: Option<Lower<'_>>,
    below: &[Lower<'_>],
) -> Vec<Vec<f64>> {
    let regressed = regression.coefficients(problem.p, problem.q, has_constant);
    let regressed = regressed.map(|coefficients| problem.point(&coefficients));
    let slow = diagonal.and_then(|lower| with_slow_noise(problem, lower));
    let grown = below.iter().map(|lower| grown(problem, *lower));
    slow.into_iter().chain(grown).chain(regressed).collect()
}

/// The lower model, its new coefficients zero.
fn grown(problem: &Conditional<'_>, Lower { p, q, at }: Lower<'_>) -> Vec<f64> {
    let mut point = at.point.clone();
    (q..problem.q).for_each(|_| point.insert(p + q, 0.0));
    (p..problem.p).for_each(|_| point.insert(p, 0.0));
    point
}

/// The lower model times a slow pair that nearly cancels: gyros have a faint drift under much
/// noise, which no short autoregression finds. Of a ladder of time scales, with more slow noise
/// than the model has and with less, the best.
fn with_slow_noise(problem: &Conditional<'_>, Lower { p, q, at }: Lower<'_>) -> Option<Vec<f64>> {
    let lower = problem.of_order(p, q).coefficients(&at.point);
    let scales = std::iter::successors(Some(8.0), |scale| Some(4.0 * scale));
    let scales = scales.take_while(|scale| 8.0 * scale < problem.count() as f64);
    let pairs = scales.flat_map(|scale| [(8.0 * scale, scale), (scale, 8.0 * scale)]);
    let points = pairs
        .map(|(ar, ma)| problem.point(&multiplied(&lower, p, q, 1.0 - 1.0 / ar, 1.0 - 1.0 / ma)));
    let valued = points.map(|point| (problem.normal(&point).sum_of_squares, point));
    valued.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, point)| point)
}

/// `[φ, θ, c]` of `φ(B)(1 - ar B)` and `θ(B)(1 - ma B)`, of the same mean.
fn multiplied(lower: &[f64], p: usize, q: usize, ar: f64, ma: f64) -> Vec<f64> {
    let (phi, rest) = lower.split_at(p);
    let (theta, constant) = rest.split_at(q);
    let mut coefficients = longer(phi, -1.0, ar);
    coefficients.extend(longer(theta, 1.0, ma));
    coefficients.extend(constant.iter().map(|c| c * (1.0 - ar)));
    coefficients
}

/// The polynomial `first + Σ coefficient_i B^i` times `1 - root B`, without its first.
fn longer(coefficients: &[f64], first: f64, root: f64) -> Vec<f64> {
    let shifted = std::iter::once(first).chain(coefficients.iter().copied());
    let same = coefficients.iter().copied().chain(std::iter::once(0.0));
    same.zip(shifted).map(|(own, before)| own - root * before).collect()
}
