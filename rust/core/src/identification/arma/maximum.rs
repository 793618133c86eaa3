//! The model of maximum exact likelihood, and the covariance of its coefficients.

use nalgebra::{DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};

use super::columns::{BLOCK, against};
use super::descent::{Descent, Normal, Problem, Stop, minimise};
use super::likelihood::{Kalman, Likelihood, likelihood};
use super::series::{Series, phi_of_one};
use super::{FINE_STOP, MAX_ORDER, Scaled, partial};

/// One iteration: a search with the curvature at its first point.
const ROUND_STOP: Stop = Stop { evaluations: 30, ..FINE_STOP };
/// Largest move in an iteration, in standard errors, after which the curvature stays the same.
const SHORT_MOVE: f64 = 0.01;
const ROUNDS: usize = 5;

/// Steps of second differences, in standard errors. They are small relative to changes of the
/// curvature, and large relative to the rounding of a million terms.
const HESSIAN_STEP: f64 = 0.02;
/// Largest such step, in free coordinates and standard deviations of the record.
const MAX_HESSIAN_STEP: f64 = 0.05;

/// Factor by which a point is shrunk per iteration, and largest number of iterations: to a
/// hundredth of 8.
const SHRINK_FACTOR: f64 = 0.9;
const MAX_SHRINKS: usize = 64;

/// Searches the most likely stationary model near conditional coefficients.
pub fn maximum(
    series: &Series,
    start: &[f64],
    (p, q): (usize, usize),
    has_constant: bool,
) -> (Scaled, Descent) {
    let mut problem = Exact::new(series, p, q, has_constant);
    let mut evaluations = 0;
    let mut start = shrunk_until_likely(&problem, inside(start, p, q));
    for round in 1.. {
        let normal = problem.normal(&start);
        let curvature = problem.set_curvature(&normal, information(&problem, &start, &normal));
        let curved = Normal::of_gram(&normal.gram + curvature);
        let found = minimise(&problem, start.clone(), ROUND_STOP, |_, _| false);
        evaluations += found.evaluations + 1;
        let moved = DVector::from_fn(start.len(), |i, _| found.point[i] - start[i]);
        let variance = normal.sum_of_squares / problem.count() as f64;
        if round == ROUNDS || curved.length(&moved) <= SHORT_MOVE * SHORT_MOVE * variance {
            let free = curved.inverse().0 * variance;
            let scaled = scale(&problem, &last_point(&problem, &found), &free, has_constant);
            return (scaled, Descent { evaluations, ..found });
        }
        start = found.point;
    }
    unreachable!("the last round returns")
}

/// Minimum that the search predicts, or its last point if there is no likelihood at the minimum.
fn last_point(problem: &Exact<'_>, found: &Descent) -> Vec<f64> {
    let predicted = found.predicted_minimum(problem);
    if is_likely(problem, &predicted) { predicted } else { found.point.clone() }
}

/// The point, shrunk towards zero until it is stationary and has a likelihood.
fn shrunk_until_likely(problem: &Exact<'_>, mut point: Vec<f64>) -> Vec<f64> {
    let mut count = 0;
    let may_start = |point: &[f64]| problem.is_stationary(point) && is_likely(problem, point);
    while !may_start(&point) && count < MAX_SHRINKS {
        point.iter_mut().for_each(|x| *x *= SHRINK_FACTOR);
        count += 1;
    }
    point
}

fn is_likely(problem: &Exact<'_>, point: &[f64]) -> bool {
    problem.likelihood(point).is_some_and(|found| found.log_likelihood().is_finite())
}

/// `[φ, θ, c]` from a point and the covariance of its coordinates.
fn scale(problem: &Exact<'_>, point: &[f64], free: &DMatrix<f64>, has_constant: bool) -> Scaled {
    let (phi, theta, mean) = problem.model(point);
    let (p, end) = (phi.len(), phi.len() + theta.len());
    let phi_of_one = phi_of_one(&phi);
    let mut coefficients = [phi, theta].concat();
    let mut slopes = DMatrix::identity(point.len(), point.len());
    if has_constant {
        slopes.view_mut((end, 0), (1, p)).fill(-mean);
        slopes[(end, end)] = phi_of_one;
        coefficients.push(mean * phi_of_one);
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

/// The point of conditional coefficients, moved into the region with a likelihood.
fn inside(coefficients: &[f64], p: usize, q: usize) -> Vec<f64> {
    let (phi, rest) = coefficients.split_at(p);
    let (theta, constant) = rest.split_at(q);
    let free = |x: &[f64]| -> Vec<f64> {
        partial::to_nearest_free(x)
            .into_iter()
            .map(|x| x.clamp(-MAX_COORDINATE, MAX_COORDINATE))
            .collect()
    };
    // The mean of the record is zero, and the mean of any process that could have made it is near
    // zero.
    [free(phi), free(&partial::negated(theta)), constant.iter().map(|_| 0.0).collect()].concat()
}

/// Curvature of the log-likelihood, if it is positive in every direction. It is not far from a
/// maximum and at the edge of the region.
fn information(problem: &Exact<'_>, point: &[f64], normal: &Normal) -> Option<DMatrix<f64>> {
    let sigma2 = normal.sum_of_squares / problem.count() as f64;
    let variances = normal.inverse().0.diagonal() * sigma2;
    let step = |variance: &f64| (HESSIAN_STEP * variance.sqrt()).min(MAX_HESSIAN_STEP);
    let steps: Vec<f64> = variances.iter().map(step).collect();
    let value = |point: &[f64]| Some(problem.likelihood(point)?.log_likelihood());
    negative_hessian(value, point, &steps).filter(|found| found.clone().cholesky().is_some())
}

/// Half the width of a difference, in free coordinates and in standard deviations of the record.
/// Its error is of the order of the width squared; this and rounding are near 1e-10.
const WIDTH: f64 = 1e-5;

/// Bound of the search: partial autocorrelations of 1 - 2e-7. Beyond it, rounding destroys the
/// variance of the stationary state.
const MAX_COORDINATE: f64 = 8.0;

/// The exact likelihood of ARMA(p, q) about a mean as a sum of squares (Ansley 1979).
///
/// The innovations' variance is eliminated. The likelihood is then largest where the sum of the
/// squared standardised innovations times `Π F^{1/n}` is smallest. A point has the free coordinates
/// of `φ` and of `θ`, and the mean.
#[derive(Debug, Clone)]
struct Exact<'a> {
    series: &'a Series,
    p: usize,
    q: usize,
    bounds: Vec<f64>,
    curvature: DMatrix<f64>,
}

impl<'a> Exact<'a> {
    fn new(series: &'a Series, p: usize, q: usize, has_constant: bool) -> Self {
        let mut bounds = vec![MAX_COORDINATE; p + q];
        bounds.extend(has_constant.then_some(f64::INFINITY));
        let curvature = DMatrix::zeros(bounds.len(), bounds.len());
        Self { series, p, q, bounds, curvature }
    }

    /// Sets and returns the curvature of the likelihood that is missing in the normal equations
    /// near a point.
    fn set_curvature(&mut self, at: &Normal, information: Option<DMatrix<f64>>) -> &DMatrix<f64> {
        let sigma2 = at.sum_of_squares / self.count() as f64;
        self.curvature = match information {
            Some(information) => information * sigma2 - &at.gram,
            None => DMatrix::zeros(at.gram.nrows(), at.gram.ncols()),
        };
        &self.curvature
    }

    /// `φ`, `θ` and the mean at a point.
    fn model(&self, point: &[f64]) -> (Vec<f64>, Vec<f64>, f64) {
        let (phi, rest) = point.split_at(self.p);
        let (theta, mean) = rest.split_at(self.q);
        let theta = partial::negated(&partial::from_free(theta));
        (partial::from_free(phi), theta, mean.first().copied().unwrap_or(0.0))
    }

    fn likelihood(&self, point: &[f64]) -> Option<Likelihood> {
        let (phi, theta, mean) = self.model(point);
        likelihood(&self.series.values, &phi, &theta, mean)
    }

    /// Derivatives of `[φ, θ, mean]` by the coordinates of the point.
    fn slopes(&self, point: &[f64]) -> DMatrix<f64> {
        let (p, q) = (self.p, self.q);
        let mut slopes = DMatrix::identity(point.len(), point.len());
        slopes.view_mut((0, 0), (p, p)).copy_from(&partial::jacobian(&point[..p]));
        slopes.view_mut((p, p), (q, q)).copy_from(&-partial::jacobian(&point[p..p + q]));
        slopes
    }

    /// `φ`, `θ` and the mean at a point and on its two sides in every coordinate.
    fn models(&self, point: &[f64]) -> impl Iterator<Item = (Vec<f64>, Vec<f64>, f64)> {
        let moved = (0..point.len()).flat_map(|i| [WIDTH, -WIDTH].map(|step| (i, step)));
        std::iter::once((0, 0.0)).chain(moved).map(|(i, step)| {
            let mut point = point.to_vec();
            if let Some(x) = point.get_mut(i) {
                *x += step;
            }
            self.model(&point)
        })
    }

    /// True if the model is stationary to rounding, at a point and on its two sides.
    fn is_stationary(&self, point: &[f64]) -> bool {
        self.models(point).all(|(phi, _, _)| partial::partials(&phi).is_some())
    }

    /// Infinite if a model is not stationary: no search goes there.
    fn normal_of_size<const R: usize>(&self, point: &[f64]) -> Normal {
        let filters = self.models(point).map(|(phi, theta, mean)| {
            let filter = Kalman::<R>::new(&phi, &theta)?;
            Some((filter, mean))
        });
        let Some(mut filters) = filters.collect::<Option<Vec<_>>>() else {
            let gram = DMatrix::zeros(point.len(), point.len());
            return Normal { sum_of_squares: f64::INFINITY, ..Normal::of_gram(gram) };
        };
        let values = &self.series.values;
        let products = Arch::new().dispatch(Differences { values, filters: &mut filters });
        let logs: Vec<f64> = filters.iter().map(|(filter, _)| filter.log_determinant).collect();
        assemble(&products, &logs, self.count() as f64)
    }
}

impl Problem for Exact<'_> {
    fn normal(&self, point: &[f64]) -> Normal {
        let normal = match self.p.max(self.q + 1) {
            1 => self.normal_of_size::<1>(point),
            2 => self.normal_of_size::<2>(point),
            3 => self.normal_of_size::<3>(point),
            4 => self.normal_of_size::<4>(point),
            _ => self.normal_of_size::<{ MAX_ORDER + 1 }>(point),
        };
        Normal { curvature: self.curvature.clone(), ..normal }
    }

    fn bounds(&self) -> &[f64] {
        &self.bounds
    }

    fn count(&self) -> usize {
        self.series.present
    }
}

/// Products of the standardised innovations and of their differences by every coordinate.
struct Differences<'a, const R: usize> {
    values: &'a [f64],
    filters: &'a mut [(Kalman<R>, f64)],
}

impl<const R: usize> WithSimd for Differences<'_, R> {
    type Output = DMatrix<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> DMatrix<f64> {
        let m = self.filters.len() / 2;
        let mut lines = vec![[0.0; BLOCK]; 2 * m + 1];
        let mut total = DMatrix::zeros(m + 1, m + 1);
        let mut row = vec![0.0; m + 1];
        for y in self.values.chunks(BLOCK) {
            for ((filter, mean), line) in self.filters.iter_mut().zip(&mut lines) {
                line.iter_mut().zip(y).for_each(|(w, y)| *w = filter.update(y - *mean));
            }
            for i in 0..m {
                difference(&mut lines[2 * i + 1..]);
            }
            let columns: Vec<&[f64]> =
                (0..=m).map(|i| &lines[(2 * i + 1) % (2 * m + 1)][..y.len()]).collect();
            for i in 0..=m {
                against(simd, columns[i], &columns, &mut row);
                (0..=m).for_each(|j| total[(i, j)] += row[j]);
            }
        }
        total
    }
}

/// Converts values above and below a point into the derivative there.
#[inline(always)]
fn difference(lines: &mut [[f64; BLOCK]]) {
    if let [above, below, ..] = lines {
        above.iter_mut().zip(below).for_each(|(a, b)| *a = (*a - *b) / (2.0 * WIDTH));
    }
}

/// Normal equations of `w Π F^{1/2n}` from the products of `w` and its derivatives; the last
/// products are of `w` itself.
fn assemble(products: &DMatrix<f64>, logs: &[f64], count: f64) -> Normal {
    let m = products.nrows() - 1;
    let square = (logs[0] / count).exp();
    let log_slope = |i: usize| (logs[2 * i + 1] - logs[2 * i + 2]) / (4.0 * WIDTH * count);
    let sum = products[(m, m)];
    let first = |i: usize| products[(i, m)] + log_slope(i) * sum;
    let gram = DMatrix::from_fn(m, m, |i, j| {
        square * (products[(i, j)] + log_slope(j) * products[(i, m)] + log_slope(i) * first(j))
    });
    Normal {
        curvature: DMatrix::zeros(m, m),
        gram,
        descent: DVector::from_fn(m, |i, _| -square * first(i)),
        sum_of_squares: square * sum,
    }
}

/// Minus the second differences of `value` about a point, at `steps` in every coordinate.
fn negative_hessian(
    value: impl Fn(&[f64]) -> Option<f64>,
    point: &[f64],
    steps: &[f64],
) -> Option<DMatrix<f64>> {
    let at = |moves: &[(usize, f64)]| {
        let mut point = point.to_vec();
        moves.iter().for_each(|(i, sign)| point[*i] += sign * steps[*i]);
        value(&point)
    };
    let middle = at(&[])?;
    let mut curvature = DMatrix::zeros(point.len(), point.len());
    for i in 0..point.len() {
        let straight = at(&[(i, 1.0)])? - 2.0 * middle + at(&[(i, -1.0)])?;
        curvature[(i, i)] = -straight / (steps[i] * steps[i]);
        for j in 0..i {
            let along = at(&[(i, 1.0), (j, 1.0)])? + at(&[(i, -1.0), (j, -1.0)])?;
            let across = at(&[(i, 1.0), (j, -1.0)])? + at(&[(i, -1.0), (j, 1.0)])?;
            curvature[(i, j)] = (across - along) / (4.0 * steps[i] * steps[j]);
            curvature[(j, i)] = curvature[(i, j)];
        }
    }
    Some(curvature)
}

#[cfg(test)]
mod tests {
    use super::negative_hessian;

    #[test]
    fn a_parabola_has_its_own_hessian() {
        let value = |x: &[f64]| Some(-3.0 * x[0] * x[0] + x[0] * x[1] - 2.0 * x[1] * x[1]);
        let found = negative_hessian(value, &[1.0, -0.5], &[0.25, 0.5]).expect("it has values");
        // Sums of few powers of two: exact.
        assert_eq!(found.as_slice(), [6.0, -1.0, -1.0, 4.0]);
    }
}
