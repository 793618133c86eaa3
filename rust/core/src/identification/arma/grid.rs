//! Fits of all orders up to (P, Q), each from the optima of lower orders.

use nalgebra::{Cholesky, DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};

use super::columns::{BLOCK, against};
use super::conditional::Conditional;
use super::descent::{Descent, End, Problem, Stop, minimise};
use super::series::Series;
use super::spectrum::{Guide, Spectrum};
use crate::identification::autoregression::Reflections;
use crate::math::parallel;
use crate::work;

/// Precise to 1e-4 in a criterion on the scale of `N ln σ²`; for an order above the record's, to
/// some tenths.
const COARSE_STOP: Stop = Stop { step: 1e-2, evaluations: 100, patience: 12 };

/// A second search gets no more passes than this.
const SECOND_STOP: Stop = Stop { step: 1e-2, evaluations: 25, patience: 6 };

/// For searches on the spectrum, where a pass takes almost no time.
const GUIDED_STOP: Stop = Stop { step: 1e-2, evaluations: 300, patience: 24 };

/// For searches that begin at the end of a search on the spectrum.
const NEAR_STOP: Stop = Stop { step: 1e-2, evaluations: 25, patience: 4 };

/// Smallest difference of two ends, in variances of a residual, that the spectrum can distinguish.
const MIN_END_DIFFERENCE: f64 = 1.0;

/// Distance of two searches, in standard errors, within which they have the same end.
const SAME_END_SIGMAS: f64 = 0.1;

/// The fit of one order in a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// `[φ, θ, c]` of the record, without `c` if it was not estimated.
    pub coefficients: Vec<f64>,
    /// Sum of the squared residuals over their number, in the square of the record's unit.
    pub sigma2: f64,
    /// True if the search reached its end.
    pub converged: bool,
    /// Passes over the record, for all searches at this order.
    pub evaluations: usize,
}

/// Fits of all orders up to (p, q), row by row of one p, on the same residuals.
///
/// No order has a larger sum of squares than the orders that it contains.
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
    best_fits(series, p, q, has_constant, p).into_iter().enumerate().map(cell).collect()
}

/// Best fit at every order, and number of passes for it.
pub fn best_fits(
    series: &Series,
    p: usize,
    q: usize,
    has_constant: bool,
    skip: usize,
) -> Vec<(Descent, usize)> {
    let (regression, spectrum) = (Regression::new(series, p, q), Spectrum::new(series));
    let mut found: Vec<Option<(Descent, usize)>> = vec![None; (p + 1) * (q + 1)];
    for diagonal in 0..=p + q {
        let orders: Vec<_> =
            (diagonal.saturating_sub(q)..=p.min(diagonal)).map(|i| (i, diagonal - i)).collect();
        let fit = |(i, j): (usize, usize)| {
            let problem = Conditional::new(series, i, j, has_constant, skip);
            let lower = |less_p: usize, less_q: usize| {
                let (p, j) = (i.checked_sub(less_p)?, j.checked_sub(less_q)?);
                found[p * (q + 1) + j].as_ref().map(|(at, _)| Lower { p, q: j, at })
            };
            let below: Vec<_> = lower(1, 0).into_iter().chain(lower(0, 1)).collect();
            let guide = spectrum.as_ref().map(|spectrum| Guide { spectrum, problem: &problem });
            let slow = lower(1, 1).and_then(|lower| with_slow_noise(&problem, guide, lower));
            let starts = starts(&problem, &regression, has_constant, slow, &below);
            let best = match guide {
                Some(guide) => search_guided(&guide, starts, &below),
                None => best(&problem, starts, COARSE_STOP, SECOND_STOP),
            };
            (i * (q + 1) + j, best)
        };
        for (index, fitted) in parallel::map(orders, true, fit) {
            found[index] = Some(fitted);
        }
    }
    found.into_iter().flatten().collect()
}

/// Searches from every start, but ends searches that lead to the same minimum.
fn best(
    problem: &Conditional<'_>,
    starts: Vec<Vec<f64>>,
    stop: Stop,
    second: Stop,
) -> (Descent, usize) {
    let mut starts = starts.into_iter();
    let first = starts.next().unwrap_or_else(|| vec![0.0; problem.bounds().len()]);
    let mut best = minimise(problem, first, stop, |_, _| false);
    let mut evaluations = best.evaluations;
    for start in starts {
        let found = minimise(problem, start, second, |at, decrease| {
            is_futile(at, decrease, &best, problem.count())
        });
        evaluations += found.evaluations;
        if found.normal.sum_of_squares < best.normal.sum_of_squares {
            best = found;
        }
    }
    (best, evaluations)
}

/// Searches on the spectrum from every start, then on the record from the ends.
fn search_guided(
    guide: &Guide<'_>,
    starts: Vec<Vec<f64>>,
    below: &[Lower<'_>],
) -> (Descent, usize) {
    let (problem, count) = (guide.problem, guide.count());
    let mut ends: Vec<Descent> = Vec::new();
    for start in starts {
        let found = minimise(guide, start, GUIDED_STOP, |_, _| false);
        if !ends.iter().any(|end| is_futile(&found, 0.0, end, count)) {
            ends.push(found);
        }
    }
    ends.sort_by(|a, b| a.normal.sum_of_squares.total_cmp(&b.normal.sum_of_squares));
    let lowest = ends.first().map_or(f64::INFINITY, |end| end.normal.sum_of_squares);
    let near = lowest * (1.0 + MIN_END_DIFFERENCE / count as f64);
    let points = ends.into_iter().take_while(|end| end.normal.sum_of_squares <= near);
    let points = points.map(|end| end.point);
    let (mut best, mut evaluations) = best(problem, points.collect(), NEAR_STOP, NEAR_STOP);
    for lower in below {
        if best.normal.sum_of_squares > lower.at.normal.sum_of_squares {
            let found = minimise(problem, grow(problem, *lower), NEAR_STOP, |_, _| false);
            evaluations += found.evaluations;
            if found.normal.sum_of_squares < best.normal.sum_of_squares {
                best = found;
            }
        }
    }
    (best, evaluations)
}

/// True if a search with the predicted `decrease` will not end below `best`, or will end at the
/// same place.
fn is_futile(at: &Descent, decrease: f64, best: &Descent, count: usize) -> bool {
    let between = DVector::from_iterator(
        at.point.len(),
        at.point.iter().zip(&best.point).map(|(here, there)| here - there),
    );
    let variance = best.normal.sum_of_squares / count as f64;
    let above = at.normal.sum_of_squares - best.normal.sum_of_squares;
    above >= 0.0
        && (above > 2.0 * decrease
            || best.normal.length(&between) <= SAME_END_SIGMAS * SAME_END_SIGMAS * variance)
}

/// The best model of a lower order.
#[derive(Debug, Clone, Copy)]
struct Lower<'a> {
    p: usize,
    q: usize,
    at: &'a Descent,
}

/// Starting points at an order; the first is searched to its end. They are the model with both
/// orders one less, with slow noise added; the models with one order one less; and the model of
/// Hannan and Rissanen.
fn starts(
    problem: &Conditional<'_>,
    regression: &Regression,
    has_constant: bool,
    slow: Option<Vec<f64>>,
    below: &[Lower<'_>],
) -> Vec<Vec<f64>> {
    let regressed = regression.coefficients(problem.p, problem.q, has_constant);
    let regressed = regressed.map(|coefficients| problem.point(&coefficients));
    let grown = below.iter().map(|lower| grow(problem, *lower));
    slow.into_iter().chain(grown).chain(regressed).collect()
}

/// The lower model with new coefficients of zero.
fn grow(problem: &Conditional<'_>, Lower { p, q, at }: Lower<'_>) -> Vec<f64> {
    let mut point = at.point.clone();
    (q..problem.q).for_each(|_| point.insert(p + q, 0.0));
    (p..problem.p).for_each(|_| point.insert(p, 0.0));
    point
}

/// The lower model times a slow pair that nearly cancels. Gyros have a faint drift under much
/// noise, which no short autoregression finds. The best is selected from several time scales, with
/// more and with less slow noise than the model has.
fn with_slow_noise(
    problem: &Conditional<'_>,
    guide: Option<Guide<'_>>,
    Lower { p, q, at }: Lower<'_>,
) -> Option<Vec<f64>> {
    let lower = problem.of_order(p, q).coefficients(&at.point);
    let scales = std::iter::successors(Some(8.0), |scale| Some(4.0 * scale));
    let scales = scales.take_while(|scale| 8.0 * scale < problem.count() as f64);
    let pairs = scales.flat_map(|scale| [(8.0 * scale, scale), (scale, 8.0 * scale)]);
    let points: Vec<_> = pairs
        .map(|(ar, ma)| {
            problem.point(&multiply_factors(&lower, p, q, 1.0 - 1.0 / ar, 1.0 - 1.0 / ma))
        })
        .collect();
    let sums = match guide {
        Some(guide) => points.iter().map(|point| guide.sum_of_squares(point)).collect(),
        None => problem.sums_of_squares(&points),
    };
    let valued = sums.into_iter().zip(points);
    valued.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, point)| point)
}

/// `[φ, θ, c]` of `φ(B)(1 - ar B)` and `θ(B)(1 - ma B)`, with the same mean.
fn multiply_factors(lower: &[f64], p: usize, q: usize, ar: f64, ma: f64) -> Vec<f64> {
    let (phi, rest) = lower.split_at(p);
    let (theta, constant) = rest.split_at(q);
    let mut coefficients = with_root(phi, -1.0, ar);
    coefficients.extend(with_root(theta, 1.0, ma));
    coefficients.extend(constant.iter().map(|c| c * (1.0 - ar)));
    coefficients
}

/// The polynomial `first + Σ coefficient_i B^i` times `1 - root B`, without its first coefficient.
fn with_root(coefficients: &[f64], first: f64, root: f64) -> Vec<f64> {
    let shifted = std::iter::once(first).chain(coefficients.iter().copied());
    let same = coefficients.iter().copied().chain(std::iter::once(0.0));
    same.zip(shifted).map(|(own, before)| own - root * before).collect()
}

/// Order of the long autoregression.
const LONG_ORDER: usize = 20;

/// Hannan and Rissanen's regression on past samples and on residuals of a long autoregression:
/// products of all regressors, up to the highest orders.
#[derive(Debug, Clone)]
struct Regression {
    /// Products of past samples, past residuals, one, and the sample itself.
    products: DMatrix<f64>,
    p: usize,
    q: usize,
}

impl Regression {
    /// Regression for orders up to (p, q).
    fn new(series: &Series, p: usize, q: usize) -> Self {
        let arch = Arch::new();
        let phi = long_autoregression(&arch.dispatch(Autocovariances(series)));
        let residuals = arch.dispatch(LongResiduals { series, phi: &phi });
        let products = arch.dispatch(Products { series, residuals: &residuals, p, q });
        Self { products, p, q }
    }

    /// `[φ, θ]` and the constant, if the model has one.
    fn coefficients(&self, p: usize, q: usize, has_constant: bool) -> Option<Vec<f64>> {
        let one = self.p + self.q;
        let mut chosen: Vec<usize> = (0..p).chain(self.p..self.p + q).collect();
        chosen.extend(has_constant.then_some(one));
        let gram = DMatrix::from_fn(chosen.len(), chosen.len(), |i, j| {
            self.products[(chosen[i], chosen[j])]
        });
        let right = DVector::from_fn(chosen.len(), |i, _| self.products[(chosen[i], one + 1)]);
        Some(Cholesky::new(gram)?.solve(&right).as_slice().to_vec())
    }
}

struct Autocovariances<'a>(&'a Series);

impl WithSimd for Autocovariances<'_> {
    type Output = [f64; LONG_ORDER + 1];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut total = [0.0; LONG_ORDER + 1];
        for segment in &self.0.segments {
            let y = &self.0.values[segment.clone()];
            for start in (0..y.len()).step_by(BLOCK) {
                work::pause();
                let end = y.len().min(start + BLOCK);
                for lag in 0..=LONG_ORDER.min(end - 1) {
                    let later = &y[start.max(lag)..end];
                    let mut sum = [0.0];
                    against(simd, later, &[&y[start.max(lag) - lag..][..later.len()]], &mut sum);
                    total[lag] += sum[0];
                }
            }
        }
        total
    }
}

/// The Yule-Walker solution, with higher orders only if they improve it.
fn long_autoregression(autocovariances: &[f64; LONG_ORDER + 1]) -> Vec<f64> {
    let mut models = Reflections::new(autocovariances[0]);
    for _ in 0..LONG_ORDER {
        let r = models.levinson(autocovariances);
        if r.is_nan() || r.abs() >= 1.0 {
            break;
        }
        models.extend(r);
    }
    models.last().to_vec()
}

/// Residuals of the long autoregression, zero near the start of a segment.
struct LongResiduals<'a> {
    series: &'a Series,
    phi: &'a [f64],
}

impl WithSimd for LongResiduals<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<f64> {
        let mut residuals = work::collect(self.series.values.iter().copied());
        for segment in &self.series.segments {
            let y = &self.series.values[segment.clone()];
            let out = &mut residuals[segment.clone()];
            let skip = self.phi.len().min(y.len());
            out[..skip].fill(0.0);
            for start in (skip..y.len()).step_by(BLOCK) {
                work::pause();
                let block = &mut out[start..y.len().min(start + BLOCK)];
                for (i, phi) in self.phi.iter().enumerate() {
                    block.iter_mut().zip(&y[start - 1 - i..]).for_each(|(e, y)| *e -= phi * y);
                }
            }
        }
        residuals
    }
}

struct Products<'a> {
    series: &'a Series,
    residuals: &'a [f64],
    p: usize,
    q: usize,
}

impl WithSimd for Products<'_> {
    type Output = DMatrix<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> DMatrix<f64> {
        let size = self.p + self.q + 2;
        let mut total = DMatrix::zeros(size, size);
        let mut row = vec![0.0; size];
        let skip = self.p.max(self.q);
        for segment in &self.series.segments {
            for start in (segment.start + skip..segment.end).step_by(BLOCK) {
                work::pause();
                let n = BLOCK.min(segment.end - start);
                let columns = self.columns(start, n);
                for (i, column) in columns.iter().enumerate() {
                    against(simd, column, &columns, &mut row);
                    (0..size).for_each(|j| total[(i, j)] += row[j]);
                }
            }
        }
        total
    }
}

impl Products<'_> {
    #[inline(always)]
    fn columns(&self, start: usize, n: usize) -> Vec<&[f64]> {
        let samples = (1..=self.p).map(|i| &self.series.values[start - i..][..n]);
        let residuals = (1..=self.q).map(|j| &self.residuals[start - j..][..n]);
        let ends = [&ONES[..n], &self.series.values[start..][..n]];
        samples.chain(residuals).chain(ends).collect()
    }
}

static ONES: [f64; BLOCK] = [1.0; BLOCK];
