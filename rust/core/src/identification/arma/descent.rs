//! Newton's method in a trust region, for sums of squares of few parameters.

use nalgebra::{DMatrix, DVector};

/// A sum of squares to be minimised.
pub trait Problem {
    /// Normal equations at a point.
    fn normal(&self, point: &[f64]) -> Normal;

    /// Largest absolute value of each coordinate.
    fn bounds(&self) -> &[f64];

    /// Number of residuals.
    fn count(&self) -> usize;
}

/// End of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// At a minimum, to rounding.
    Minimum,
    /// Given up: it leads to a known minimum.
    Abandoned,
    /// Stopped before it found a minimum.
    Unfinished,
}

/// Result of a search.
#[derive(Debug, Clone)]
pub struct Descent {
    pub point: Vec<f64>,
    pub normal: Normal,
    pub end: End,
    /// Number of evaluations of the sum of squares.
    pub evaluations: usize,
}

/// Conditions for a stop.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// Length of a Newton step, in standard errors, at which the search ends.
    pub step: f64,
    pub evaluations: usize,
    /// Number of passes in which a search must decrease by [`MIN_DECREASE`]. If roots cancel each
    /// other, the sum of squares has a valley without an end.
    pub patience: usize,
}

/// Smallest useful decrease in variances of a residual: below it no criterion of order
/// distinguishes models.
const MIN_DECREASE: f64 = 1e-2;

/// Relative difference below which sums of squares are equal: rounding of a million terms.
const ROUNDING: f64 = 1e-12;
/// Largest move of a coordinate in a step; good models need no larger move.
const MAX_MOVE: f64 = 3.0;
/// Initial radius, in standard deviations of the residuals: the resulting move of a coefficient.
const INITIAL_RADIUS: f64 = 0.3;
/// Smallest step as a share of the radius.
const MIN_STEP: f64 = 1e-12;

/// Descends from `start`. The search ends early if `is_futile` is true for a point and the decrease
/// that the model predicts there.
pub fn minimise(
    problem: &impl Problem,
    start: Vec<f64>,
    stop: Stop,
    is_futile: impl Fn(&Descent, f64) -> bool,
) -> Descent {
    let normal = problem.normal(&start);
    let first = INITIAL_RADIUS * normal.sum_of_squares.sqrt();
    let mut radius = first;
    let mut at = Descent { point: start, normal, end: End::Unfinished, evaluations: 1 };
    let (mut since, mut height) = (at.evaluations, at.normal.sum_of_squares);
    while at.evaluations < stop.evaluations && radius > MIN_STEP * first {
        if at.evaluations - since >= stop.patience {
            let variance = height / problem.count() as f64;
            if height - at.normal.sum_of_squares < MIN_DECREASE * variance {
                break;
            }
            (since, height) = (at.evaluations, at.normal.sum_of_squares);
        }
        let model = at.normal.model(&find_frozen(&at, problem.bounds()));
        let variance = at.normal.sum_of_squares / problem.count() as f64;
        let decrease = model.largest_decrease();
        if decrease <= stop.step * stop.step * variance {
            return Descent { end: End::Minimum, ..at };
        }
        if is_futile(&at, decrease) {
            return Descent { end: End::Abandoned, ..at };
        }
        radius = advance(&mut at, problem, &model.step(radius), radius);
    }
    // Along a direction with little effect, rounding may keep a search from its end.
    let decrease = at.normal.model(&find_frozen(&at, problem.bounds())).largest_decrease();
    let is_level = decrease <= ROUNDING * at.normal.sum_of_squares;
    Descent { end: if is_level { End::Minimum } else { End::Unfinished }, ..at }
}

impl Descent {
    /// Minimum predicted by the model at the end of a search: the step is too short for another
    /// pass.
    pub fn predicted_minimum(&self, problem: &impl Problem) -> Vec<f64> {
        let model = self.normal.model(&find_frozen(self, problem.bounds()));
        match self.end {
            End::Minimum => move_point(&self.point, &model.step(f64::INFINITY), problem.bounds()),
            _ => self.point.clone(),
        }
    }
}

/// Makes the step if the sum does not increase, and returns the radius of the next step.
fn advance(at: &mut Descent, problem: &impl Problem, step: &Step, radius: f64) -> f64 {
    let point = move_point(&at.point, step, problem.bounds());
    let normal = problem.normal(&point);
    at.evaluations += 1;
    let rounding = ROUNDING * at.normal.sum_of_squares;
    let decrease = at.normal.sum_of_squares - normal.sum_of_squares;
    let kept = if step.decrease > rounding { decrease / step.decrease } else { 1.0 };
    if decrease >= -rounding {
        (at.point, at.normal) = (point, normal);
    }
    match kept {
        kept if kept > 0.75 => radius.max(2.0 * step.length),
        kept if kept > 0.25 => radius,
        _ => 0.25 * step.length,
    }
}

/// Coordinates on their bound for which the sum of squares decreases only beyond it.
fn find_frozen(at: &Descent, bounds: &[f64]) -> Vec<bool> {
    let outward = |i: usize| at.normal.descent[i] * at.point[i] >= 0.0;
    (0..bounds.len()).map(|i| at.point[i].abs() >= bounds[i] && outward(i)).collect()
}

fn move_point(point: &[f64], step: &Step, bounds: &[f64]) -> Vec<f64> {
    let step = &step.step;
    let longest = (0..bounds.len()).filter(|i| bounds[*i].is_finite()).map(|i| step[i].abs());
    let share = (MAX_MOVE / longest.fold(MAX_MOVE, f64::max)).min(1.0);
    let moved = |(i, x): (usize, &f64)| (x + share * step[i]).clamp(-bounds[i], bounds[i]);
    point.iter().enumerate().map(moved).collect()
}

/// `JᵀJ`, `Σ r r″`, `-Jᵀr` and `rᵀr` of residuals `r` with derivatives `J` and `r″`.
#[derive(Debug, Clone)]
pub struct Normal {
    pub gram: DMatrix<f64>,
    pub curvature: DMatrix<f64>,
    pub descent: DVector<f64>,
    pub sum_of_squares: f64,
}

impl Normal {
    /// Only a matrix, for its inverse.
    pub fn of_gram(gram: DMatrix<f64>) -> Self {
        let (descent, curvature) = (DVector::zeros(gram.nrows()), gram.map(|_| 0.0));
        Self { gram, curvature, descent, sum_of_squares: 0.0 }
    }

    /// The normal equations in other coordinates; `slopes` are the derivatives of the change.
    pub fn transform(&self, slopes: &DMatrix<f64>) -> Self {
        Self {
            gram: slopes.tr_mul(&self.gram) * slopes,
            curvature: slopes.tr_mul(&self.curvature) * slopes,
            descent: slopes.tr_mul(&self.descent),
            sum_of_squares: self.sum_of_squares,
        }
    }

    /// The quadratic model in coordinates of unit curvature; the `frozen` coordinates are constant.
    pub fn model(&self, frozen: &[bool]) -> Model {
        let scale = scale(&self.gram);
        let free = |i: usize| if frozen[i] { 0.0 } else { scale[i] };
        let curvature = DMatrix::from_fn(frozen.len(), frozen.len(), |i, j| {
            let held = f64::from(u8::from(i == j && frozen[i]));
            (self.gram[(i, j)] + self.curvature[(i, j)]) * free(i) * free(j) + held
        });
        let descent = DVector::from_fn(frozen.len(), |i, _| self.descent[i] * free(i));
        if frozen.is_empty() {
            return Model { curvatures: descent.clone(), axes: curvature, descent, scale };
        }
        let eigen = curvature.symmetric_eigen();
        let descent = eigen.eigenvectors.tr_mul(&descent);
        Model { curvatures: eigen.eigenvalues, axes: eigen.eigenvectors, descent, scale }
    }

    /// `stepᵀ JᵀJ step`.
    pub fn length(&self, step: &DVector<f64>) -> f64 {
        step.dot(&(&self.gram * step))
    }

    /// Inverse of `JᵀJ`, and its condition number after scaling to a unit diagonal. Values that
    /// rounding leaves undetermined are finite and very large.
    pub fn inverse(&self) -> (DMatrix<f64>, f64) {
        let n = self.gram.nrows();
        if n == 0 {
            return (DMatrix::zeros(0, 0), 1.0);
        }
        let scale = scale(&self.gram);
        let scaled = DMatrix::from_fn(n, n, |i, j| self.gram[(i, j)] * scale[i] * scale[j]);
        let eigen = scaled.symmetric_eigen();
        let largest = eigen.eigenvalues.max().max(f64::MIN_POSITIVE);
        let values = eigen.eigenvalues.map(|value| value.max(largest * f64::EPSILON));
        let spread = DMatrix::from_diagonal(&values.map(f64::recip));
        let inverse = &eigen.eigenvectors * spread * eigen.eigenvectors.transpose();
        let inverse = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        (inverse, largest / values.min())
    }
}

/// Scale for a unit diagonal; a column of zeros is unchanged.
fn scale(gram: &DMatrix<f64>) -> DVector<f64> {
    gram.diagonal().map(|square| if square > 0.0 { square.sqrt().recip() } else { 1.0 })
}

/// `-2 descentᵀ s + Σ curvature s²` along the axes of the curvature, and its minimum within a trust
/// region (Moré and Sorensen 1983).
#[derive(Debug, Clone)]
pub struct Model {
    pub curvatures: DVector<f64>,
    pub axes: DMatrix<f64>,
    /// Slopes along the axes.
    pub descent: DVector<f64>,
    /// Units of the scaled coordinates.
    pub scale: DVector<f64>,
}

/// A step and its prediction by the model.
#[derive(Debug, Clone)]
pub struct Step {
    pub step: DVector<f64>,
    /// Length in scaled coordinates.
    pub length: f64,
    /// Decrease of the model over the step.
    pub decrease: f64,
}

/// Curvatures below this share of the largest are rounding.
const MIN_CURVATURE: f64 = 1e-14;

impl Model {
    /// Decrease of the model at its minimum, infinite without a minimum.
    pub fn largest_decrease(&self) -> f64 {
        if self.is_convex() { self.at(0.0).decrease } else { f64::INFINITY }
    }

    /// The minimum of the model within `radius`.
    pub fn step(&self, radius: f64) -> Step {
        if self.is_convex() {
            let newton = self.at(0.0);
            if newton.length <= radius {
                return newton;
            }
        }
        let lowest = self.curvatures.iter().copied().fold(0.0, |low: f64, x| low.max(-x));
        // With this damping no component makes the step longer than the radius.
        let (mut low, mut high) =
            (lowest, lowest + self.descent.norm() / radius + f64::MIN_POSITIVE);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match self.at(middle).length > radius {
                true => low = middle,
                false => high = middle,
            }
        }
        self.at(high)
    }

    fn is_convex(&self) -> bool {
        let largest = self.curvatures.iter().copied().fold(0.0, f64::max);
        self.curvatures.iter().all(|x| *x > MIN_CURVATURE * largest)
    }

    fn at(&self, damping: f64) -> Step {
        let along = self.descent.zip_map(&self.curvatures, |descent, curvature| {
            if descent == 0.0 { 0.0 } else { descent / (curvature + damping) }
        });
        let bent = along.component_mul(&along).dot(&self.curvatures);
        let decrease = 2.0 * along.dot(&self.descent) - bent;
        let step = (&self.axes * &along).component_mul(&self.scale);
        Step { length: along.norm(), decrease, step }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(curvatures: [f64; 2]) -> Model {
        Model {
            curvatures: DVector::from_row_slice(&curvatures),
            axes: DMatrix::identity(2, 2),
            descent: DVector::from_row_slice(&[1.0, 1.0]),
            scale: DVector::from_row_slice(&[1.0, 2.0]),
        }
    }

    #[test]
    fn newton_where_it_fits_else_the_edge() {
        let newton = model([1.0, 0.5]).step(10.0);
        // Powers of two: exact.
        assert_eq!(newton.step.as_slice(), [1.0, 4.0]);
        assert_eq!(newton.decrease, model([1.0, 0.5]).largest_decrease());
        for curvatures in [[1.0, 0.5], [1.0, -0.5], [0.0, 1.0]] {
            let edge = model(curvatures).step(0.25);
            // Sixty halvings.
            assert!((edge.length - 0.25).abs() < 1e-12, "{edge:?}");
            assert!(edge.decrease > 0.0);
        }
        assert_eq!(model([1.0, -0.5]).largest_decrease(), f64::INFINITY);
    }
}
