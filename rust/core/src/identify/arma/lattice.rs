//! All orders up to (P, Q), each from the optima of the orders below it.

use nalgebra::DVector;

use super::conditional::Conditional;
use super::descent::{Descent, End, Problem, Stop, minimise};
use super::regression::Regression;
use super::series::Series;
use super::starts::{Lower, starts};

/// Good to 1e-4 in a criterion on the scale of `N ln σ²`.
const COARSE: Stop = Stop { step: 1e-2, evaluations: 100 };

/// A second search is worth no more passes than this.
const SECOND: Stop = Stop { step: 1e-2, evaluations: 25 };

/// Two searches that come so near, in standard errors, end at the same place.
const SAME: f64 = 0.1;

/// What a grid says of one order.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// `[φ, θ, c]` of the record, without `c` where it was not estimated.
    pub coefficients: Vec<f64>,
    /// Sum of the squared residuals over their number, in the square of the record's unit.
    pub sigma2: f64,
    /// Whether the search came to its end.
    pub converged: bool,
    /// Passes over the record, of all searches at this order.
    pub evaluations: usize,
}

/// Fits of all orders up to (p, q), row after row of one p, on the same residuals.
///
/// No order fits worse than one that it contains.
pub fn grid(series: &Series, p: usize, q: usize, has_constant: bool) -> Vec<Cell> {
    let count = series.residuals(p) as f64;
    let cell = |(k, (descent, evaluations)): (usize, (Descent, usize))| {
        let (i, j) = (k / (q + 1), k % (q + 1));
        let problem = Conditional::new(series, i, j, has_constant, p);
        Cell {
            coefficients: series.with_units(problem.coefficients(&descent.point), i, i + j),
            sigma2: descent.normal.sum_of_squares / count * series.unit * series.unit,
            converged: descent.end == End::Minimum,
            evaluations,
        }
    };
    lattice(series, p, q, has_constant, p).into_iter().enumerate().map(cell).collect()
}

/// The best found at every order, and the passes that it took.
pub fn lattice(
    series: &Series,
    p: usize,
    q: usize,
    has_constant: bool,
    skip: usize,
) -> Vec<(Descent, usize)> {
    let regression = Regression::new(series, p, q);
    let mut found: Vec<Option<(Descent, usize)>> = vec![None; (p + 1) * (q + 1)];
    for diagonal in 0..=p + q {
        let orders: Vec<_> =
            (diagonal.saturating_sub(q)..=p.min(diagonal)).map(|i| (i, diagonal - i)).collect();
        let fit = |(i, j): &(usize, usize)| {
            let problem = Conditional::new(series, *i, *j, has_constant, skip);
            let lower = |less_p: usize, less_q: usize| {
                let (p, j) = (i.checked_sub(less_p)?, j.checked_sub(less_q)?);
                found[p * (q + 1) + j].as_ref().map(|(at, _)| Lower { p, q: j, at })
            };
            let below: Vec<_> = lower(1, 0).into_iter().chain(lower(0, 1)).collect();
            best(&problem, starts(&problem, &regression, has_constant, lower(1, 1), &below))
        };
        for ((i, j), fitted) in orders.iter().zip(each(&orders, fit)) {
            found[i * (q + 1) + j] = Some(fitted);
        }
    }
    found.into_iter().flatten().collect()
}

#[cfg(feature = "parallel")]
fn each<R: Send>(
    orders: &[(usize, usize)],
    fit: impl Fn(&(usize, usize)) -> R + Sync + Send,
) -> Vec<R> {
    use rayon::prelude::*;
    orders.par_iter().map(fit).collect()
}

#[cfg(not(feature = "parallel"))]
fn each<R>(orders: &[(usize, usize)], fit: impl Fn(&(usize, usize)) -> R) -> Vec<R> {
    orders.iter().map(fit).collect()
}

/// Searches from every start, but goes no way twice.
fn best(problem: &Conditional<'_>, starts: Vec<Vec<f64>>) -> (Descent, usize) {
    let mut starts = starts.into_iter();
    let first = starts.next().unwrap_or_else(|| vec![0.0; problem.bounds().len()]);
    let mut best = minimise(problem, first, COARSE, |_, _| false);
    let mut evaluations = best.evaluations;
    for start in starts {
        let found = minimise(problem, start, SECOND, |at, depth| {
            is_idle(at, depth, &best, problem.count())
        });
        evaluations += found.evaluations;
        if found.normal.sum_of_squares < best.normal.sum_of_squares {
            best = found;
        }
    }
    (best, evaluations)
}

/// Whether a search, at a place whose minimum seems to lie lower by `depth`, will not end lower
/// than `best`, or not elsewhere.
fn is_idle(at: &Descent, depth: f64, best: &Descent, count: usize) -> bool {
    let between = DVector::from_iterator(
        at.point.len(),
        at.point.iter().zip(&best.point).map(|(here, there)| here - there),
    );
    let variance = best.normal.sum_of_squares / count as f64;
    let above = at.normal.sum_of_squares - best.normal.sum_of_squares;
    above >= 0.0 && (above > 2.0 * depth || best.normal.length(&between) <= SAME * SAME * variance)
}
