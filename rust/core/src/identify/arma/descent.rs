//! Levenberg-Marquardt for sums of squares of few parameters.

use super::normal::Normal;

/// A sum of squares to be made small.
pub trait Problem {
    /// Normal equations at a point.
    fn normal(&self, point: &[f64]) -> Normal;

    /// How far from zero each coordinate may go.
    fn bounds(&self) -> &[f64];

    /// Number of residuals.
    fn count(&self) -> usize;
}

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// At a minimum, as far as it was to tell.
    Minimum,
    /// On a way that leads to a known place.
    Futile,
    /// Before it found a minimum.
    Unfinished,
}

/// Where a search came to.
#[derive(Debug, Clone)]
pub struct Descent {
    pub point: Vec<f64>,
    pub normal: Normal,
    pub end: End,
    /// How often the sum of squares was taken.
    pub evaluations: usize,
}

/// When to stop.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// Length of a Newton step in standard errors.
    pub step: f64,
    pub evaluations: usize,
}

/// Sums of squares that differ by less are equal: what rounding makes of a million terms.
const ROUNDING: f64 = 1e-13;
/// A coordinate moves at most so far in a step; none needs more where the model is good.
const STRIDE: f64 = 3.0;
const FIRST_DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-12;
const LARGEST_DAMPING: f64 = 1e8;

/// Walks down from `start`, as long as the way is not futile.
pub fn minimise(
    problem: &impl Problem,
    start: Vec<f64>,
    stop: Stop,
    is_futile: impl Fn(&Descent) -> bool,
) -> Descent {
    let normal = problem.normal(&start);
    let mut at = Descent { point: start, normal, end: End::Unfinished, evaluations: 1 };
    let mut damping = FIRST_DAMPING;
    while at.evaluations < stop.evaluations && damping < LARGEST_DAMPING {
        let frozen = frozen(&at, problem.bounds());
        if is_minimum(&at, &frozen, problem.count(), stop) {
            return Descent { end: End::Minimum, ..at };
        }
        if is_futile(&at) {
            return Descent { end: End::Futile, ..at };
        }
        damping = match next(&at, damping, &frozen, problem.bounds()) {
            Some(point) => advance(&mut at, problem, point, damping),
            None => worse(damping),
        };
    }
    at
}

/// Goes to `point` if that is no higher, and returns the damping of the next step.
fn advance(at: &mut Descent, problem: &impl Problem, point: Vec<f64>, damping: f64) -> f64 {
    let normal = problem.normal(&point);
    at.evaluations += 1;
    if normal.sum_of_squares <= at.normal.sum_of_squares * (1.0 + ROUNDING) {
        (at.point, at.normal) = (point, normal);
        better(damping)
    } else {
        worse(damping)
    }
}

fn better(damping: f64) -> f64 {
    if damping > LEAST_DAMPING { damping / 30.0 } else { 0.0 }
}

fn worse(damping: f64) -> f64 {
    (damping * 10.0).max(FIRST_DAMPING)
}

/// Coordinates on their bound from which the sum of squares falls only beyond it.
fn frozen(at: &Descent, bounds: &[f64]) -> Vec<bool> {
    let outward = |i: usize| at.normal.descent[i] * at.point[i] >= 0.0;
    (0..bounds.len()).map(|i| at.point[i].abs() >= bounds[i] && outward(i)).collect()
}

fn next(at: &Descent, damping: f64, frozen: &[bool], bounds: &[f64]) -> Option<Vec<f64>> {
    let step = at.normal.step(damping, frozen)?;
    let longest = (0..bounds.len()).filter(|i| bounds[*i].is_finite()).map(|i| step[i].abs());
    let share = (STRIDE / longest.fold(STRIDE, f64::max)).min(1.0);
    let moved = |(i, x): (usize, &f64)| (x + share * step[i]).clamp(-bounds[i], bounds[i]);
    Some(at.point.iter().enumerate().map(moved).collect())
}

fn is_minimum(at: &Descent, frozen: &[bool], count: usize, stop: Stop) -> bool {
    let variance = at.normal.sum_of_squares / count as f64;
    match at.normal.step(0.0, frozen) {
        Some(step) => {
            at.normal.length(&step) <= stop.step * stop.step * variance
                || step.iter().zip(&at.point).all(|(dx, x)| dx.abs() <= RELATIVE * x.abs())
        }
        None => false,
    }
}

/// Relative changes of all coordinates below which a search ends in any case.
const RELATIVE: f64 = 1e-10;
