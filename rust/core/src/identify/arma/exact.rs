//! The exact likelihood as a sum of squares (Ansley 1979).
//!
//! With the innovations' variance concentrated out, the likelihood is greatest where the sum of
//! the squares of the standardised innovations times `Π F^{1/n}` is least.

use nalgebra::{DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};

use super::MAX_ORDER;
use super::descent::Problem;
use super::gaussian::{Likelihood, likelihood};
use super::kalman::Kalman;
use super::normal::Normal;
use super::partial;
use super::products::against;
use super::recursion::BLOCK;
use super::series::Series;

/// Half the width of a difference, in free coordinates and in deviations of the record: its
/// error, of the order of the width squared, and that of rounding are both near 1e-10.
const WIDTH: f64 = 1e-5;

/// How far a search goes: partial autocorrelations of 1 - 2e-7. Beyond, the variance of the
/// stationary state is lost in rounding.
pub const EDGE: f64 = 8.0;

/// ARMA(p, q) about a mean; a point is the free coordinates of `φ` and of `θ`, and the mean.
#[derive(Debug, Clone)]
pub struct Exact<'a> {
    series: &'a Series,
    p: usize,
    q: usize,
    bounds: Vec<f64>,
    bend: DMatrix<f64>,
}

impl<'a> Exact<'a> {
    pub fn new(series: &'a Series, p: usize, q: usize, has_constant: bool) -> Self {
        let mut bounds = vec![EDGE; p + q];
        bounds.extend(has_constant.then_some(f64::INFINITY));
        let bend = DMatrix::zeros(bounds.len(), bounds.len());
        Self { series, p, q, bounds, bend }
    }

    /// Gives the normal equations near a point what theirs there lack of the likelihood's
    /// curvature, and returns it.
    pub fn bend(&mut self, at: &Normal, information: Option<DMatrix<f64>>) -> &DMatrix<f64> {
        let sigma2 = at.sum_of_squares / self.count() as f64;
        self.bend = match information {
            Some(information) => information * sigma2 - &at.gram,
            None => DMatrix::zeros(at.gram.nrows(), at.gram.ncols()),
        };
        &self.bend
    }

    /// `φ`, `θ` and the mean at a point.
    pub fn model(&self, point: &[f64]) -> (Vec<f64>, Vec<f64>, f64) {
        let (phi, rest) = point.split_at(self.p);
        let (theta, mean) = rest.split_at(self.q);
        let theta = partial::from_free(theta).into_iter().map(|x| -x).collect();
        (partial::from_free(phi), theta, mean.first().copied().unwrap_or(0.0))
    }

    pub fn likelihood(&self, point: &[f64]) -> Option<Likelihood> {
        let (phi, theta, mean) = self.model(point);
        likelihood(&self.series.values, &phi, &theta, mean)
    }

    /// Derivatives of `[φ, θ, mean]` by the coordinates of the point.
    pub fn slopes(&self, point: &[f64]) -> DMatrix<f64> {
        let (p, q) = (self.p, self.q);
        let mut slopes = DMatrix::identity(point.len(), point.len());
        slopes.view_mut((0, 0), (p, p)).copy_from(&partial::jacobian(&point[..p]));
        slopes.view_mut((p, p), (q, q)).copy_from(&-partial::jacobian(&point[p..p + q]));
        slopes
    }

    /// The filter at a point and those on both sides of it in every coordinate.
    fn bundle<const R: usize>(&self, point: &[f64]) -> Vec<(Kalman<R>, f64)> {
        let moved = (0..point.len()).flat_map(|i| [WIDTH, -WIDTH].map(|step| (i, step)));
        std::iter::once((0, 0.0))
            .chain(moved)
            .filter_map(|(i, step)| {
                let mut point = point.to_vec();
                if let Some(x) = point.get_mut(i) {
                    *x += step;
                }
                let (phi, theta, mean) = self.model(&point);
                Some((Kalman::new(&phi, &theta)?, mean))
            })
            .collect()
    }

    fn normal_of_size<const R: usize>(&self, point: &[f64]) -> Normal {
        let mut filters = self.bundle::<R>(point);
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
        Normal { bend: self.bend.clone(), ..normal }
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

/// Turns values above and below a point into the derivative there.
#[inline(always)]
fn difference(lines: &mut [[f64; BLOCK]]) {
    if let [above, below, ..] = lines {
        above.iter_mut().zip(below).for_each(|(a, b)| *a = (*a - *b) / (2.0 * WIDTH));
    }
}

/// Normal equations of `w Π F^{1/2n}` from the products of `w` and its derivatives, the last of
/// which are those of `w` itself.
fn assemble(products: &DMatrix<f64>, logs: &[f64], count: f64) -> Normal {
    let m = products.nrows() - 1;
    let square = (logs[0] / count).exp();
    let pull = |i: usize| (logs[2 * i + 1] - logs[2 * i + 2]) / (4.0 * WIDTH * count);
    let sum = products[(m, m)];
    let first = |i: usize| products[(i, m)] + pull(i) * sum;
    let gram = DMatrix::from_fn(m, m, |i, j| {
        square * (products[(i, j)] + pull(j) * products[(i, m)] + pull(i) * first(j))
    });
    Normal {
        bend: DMatrix::zeros(m, m),
        gram,
        descent: DVector::from_fn(m, |i, _| -square * first(i)),
        sum_of_squares: square * sum,
    }
}
