//! Where the searches begin.

use super::conditional::Conditional;
use super::descent::{Descent, Problem};
use super::regression::Regression;

/// Starting points at an order: Hannan and Rissanen's, and the optima of the orders below.
pub fn starts(
    problem: &Conditional<'_>,
    regression: &Regression,
    has_constant: bool,
    below: &[(usize, usize, &Descent)],
) -> Vec<Vec<f64>> {
    let (p, q) = (problem.p, problem.q);
    let regressed = regression.coefficients(p, q, has_constant);
    let regressed = regressed.map(|coefficients| problem.point(&coefficients));
    let grown = below.iter().map(|(lower_p, lower_q, descent)| {
        let mut point = descent.point.clone();
        (*lower_q..q).for_each(|_| point.insert(lower_p + lower_q, 0.0));
        (*lower_p..p).for_each(|_| point.insert(*lower_p, 0.0));
        point
    });
    let drifts = ((p, q) == (1, 1)).then(|| drift(problem, has_constant));
    grown.chain(regressed).chain(drifts.flatten()).collect()
}

/// White noise on a slow drift, a nearly cancelling ARMA(1, 1) that no short autoregression
/// finds: the best of a ladder of time scales.
fn drift(problem: &Conditional<'_>, has_constant: bool) -> Option<Vec<f64>> {
    let scales = std::iter::successors(Some(8.0), |scale| Some(4.0 * scale));
    let scales = scales.take_while(|scale| 8.0 * scale < problem.count() as f64);
    let points = scales.map(|scale| {
        let mut coefficients = vec![1.0 - 0.125 / scale, 1.0 / scale - 1.0];
        coefficients.extend(has_constant.then_some(0.0));
        problem.point(&coefficients)
    });
    let valued = points.map(|point| (problem.normal(&point).sum_of_squares, point));
    valued.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, point)| point)
}
