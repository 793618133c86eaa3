//! Newton's method in a trust region, for sums of squares of few parameters.

use super::model::Step;
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
/// The first radius, in deviations of the residuals: a coefficient moves by that much.
const FIRST_RADIUS: f64 = 0.3;
/// Steps shorter than this part of it go nowhere.
const SHORTEST: f64 = 1e-12;

/// Walks down from `start`, as long as the way is not futile; that is asked at every place with
/// the depth of the minimum that seems to lie ahead.
pub fn minimise(
    problem: &impl Problem,
    start: Vec<f64>,
    stop: Stop,
    is_futile: impl Fn(&Descent, f64) -> bool,
) -> Descent {
    let normal = problem.normal(&start);
    let first = FIRST_RADIUS * normal.sum_of_squares.sqrt();
    let mut radius = first;
    let mut at = Descent { point: start, normal, end: End::Unfinished, evaluations: 1 };
    while at.evaluations < stop.evaluations && radius > SHORTEST * first {
        let model = at.normal.model(&frozen(&at, problem.bounds()));
        let variance = at.normal.sum_of_squares / problem.count() as f64;
        let depth = model.depth();
        if depth <= stop.step * stop.step * variance {
            return Descent { end: End::Minimum, ..at };
        }
        if is_futile(&at, depth) {
            return Descent { end: End::Futile, ..at };
        }
        radius = advance(&mut at, problem, &model.step(radius), radius);
    }
    at
}

impl Descent {
    /// The minimum that seems to lie ahead: from where a search ends, a step too short to be worth
    /// a pass.
    pub fn outlook(&self, problem: &impl Problem) -> Vec<f64> {
        let model = self.normal.model(&frozen(self, problem.bounds()));
        match self.end {
            End::Minimum => moved(&self.point, &model.step(f64::INFINITY), problem.bounds()),
            _ => self.point.clone(),
        }
    }
}

/// Goes the step if that leads no higher, and returns the radius of the next one.
fn advance(at: &mut Descent, problem: &impl Problem, step: &Step, radius: f64) -> f64 {
    let point = moved(&at.point, step, problem.bounds());
    let normal = problem.normal(&point);
    at.evaluations += 1;
    let rounding = ROUNDING * at.normal.sum_of_squares;
    let gained = at.normal.sum_of_squares - normal.sum_of_squares;
    let kept = if step.gain > rounding { gained / step.gain } else { 1.0 };
    if gained >= -rounding {
        (at.point, at.normal) = (point, normal);
    }
    match kept {
        kept if kept > 0.75 => radius.max(2.0 * step.length),
        kept if kept > 0.25 => radius,
        _ => 0.25 * step.length,
    }
}

/// Coordinates on their bound from which the sum of squares falls only beyond it.
fn frozen(at: &Descent, bounds: &[f64]) -> Vec<bool> {
    let outward = |i: usize| at.normal.descent[i] * at.point[i] >= 0.0;
    (0..bounds.len()).map(|i| at.point[i].abs() >= bounds[i] && outward(i)).collect()
}

fn moved(point: &[f64], step: &Step, bounds: &[f64]) -> Vec<f64> {
    let step = &step.step;
    let longest = (0..bounds.len()).filter(|i| bounds[*i].is_finite()).map(|i| step[i].abs());
    let share = (STRIDE / longest.fold(STRIDE, f64::max)).min(1.0);
    let moved = |(i, x): (usize, &f64)| (x + share * step[i]).clamp(-bounds[i], bounds[i]);
    point.iter().enumerate().map(moved).collect()
}
