//! Sum of the squares of the conditional residuals.

use std::ops::SubAssign;

use nalgebra::{DMatrix, DVector};
use pulp::Arch;

use super::columns::Sums;
use super::descent::Problem;
use super::normal::Normal;
use super::partial::{self, EDGE};
use super::series::Series;
use super::sweep::Sweep;

/// ARMA(p, q) on one record; a point is `φ`, the free coordinates of `θ`, and the constant.
#[derive(Debug, Clone)]
pub struct Conditional<'a> {
    series: &'a Series,
    pub p: usize,
    pub q: usize,
    has_constant: bool,
    skip: usize,
    bounds: Vec<f64>,
    arch: Arch,
}

impl<'a> Conditional<'a> {
    /// Every stretch gives up its first `skip` samples, at least `p`.
    pub fn new(series: &'a Series, p: usize, q: usize, has_constant: bool, skip: usize) -> Self {
        let mut bounds = vec![f64::INFINITY; p + q + usize::from(has_constant)];
        bounds[p..p + q].fill(EDGE);
        Self { series, p, q, has_constant, skip, bounds, arch: Arch::new() }
    }

    /// The same residuals of another order.
    pub fn of_order(&self, p: usize, q: usize) -> Self {
        Self::new(self.series, p, q, self.has_constant, self.skip)
    }

    /// `[φ, θ, c]` at a point.
    pub fn coefficients(&self, point: &[f64]) -> Vec<f64> {
        let theta = partial::from_free(&point[self.p..self.p + self.q]).into_iter().map(|x| -x);
        let mut coefficients = point.to_vec();
        coefficients[self.p..].iter_mut().zip(theta).for_each(|(to, from)| *to = from);
        coefficients
    }

    /// The point of `[φ, θ, c]`, `θ` brought inside the unit circle if it is not there.
    pub fn point(&self, coefficients: &[f64]) -> Vec<f64> {
        let minus_theta: Vec<f64> =
            coefficients[self.p..self.p + self.q].iter().map(|x| -x).collect();
        let free = partial::to_free(&minus_theta)
            .or_else(|| partial::to_free(&partial::shrunk(&minus_theta)));
        let mut point = coefficients.to_vec();
        point[self.p..].iter_mut().zip(free.unwrap_or_default()).for_each(|(to, x)| *to = x);
        point
    }

    /// Normal equations in `[φ, θ, c]`.
    pub fn natural(&self, coefficients: &[f64]) -> Normal {
        let sums = match self.q {
            0 => self.sums::<0>(coefficients),
            1 => self.sums::<1>(coefficients),
            2 => self.sums::<2>(coefficients),
            3 => self.sums::<3>(coefficients),
            _ => self.sums::<{ super::MAX_ORDER }>(coefficients),
        };
        let (m, products) = (coefficients.len(), &sums.products);
        Normal {
            gram: DMatrix::from_fn(m, m, |i, j| products[i.max(j)][i.min(j)]),
            bend: DMatrix::from_fn(m, m, |i, j| self.bend(&sums, i.max(j), i.min(j))),
            descent: DVector::from_fn(m, |i, _| products[m][i]),
            sum_of_squares: products[m][m],
        }
    }

    /// Sum of the residuals times their second derivatives by coefficients `i >= j`.
    fn bend(&self, sums: &Sums, i: usize, j: usize) -> f64 {
        let (p, end) = (self.p, self.p + self.q);
        match (i, j) {
            _ if i < p || i >= end => 0.0,
            _ if j < p => sums.phi_bends[(i - p + 1) + (j + 1)],
            _ => 2.0 * sums.theta_bends[(i - p + 1) + (j - p + 1)],
        }
    }

    fn sums<const Q: usize>(&self, coefficients: &[f64]) -> Sums {
        let (phi, rest) = coefficients.split_at(self.p);
        let (theta, constant) = rest.split_at(self.q);
        self.arch.dispatch(Sweep::<Q> {
            series: self.series,
            phi,
            theta,
            constant: constant.first().copied().unwrap_or(0.0),
            has_constant: self.has_constant,
            skip: self.skip,
        })
    }
}

impl Problem for Conditional<'_> {
    fn normal(&self, point: &[f64]) -> Normal {
        let (corner, size) = ((self.p, self.p), (self.q, self.q));
        let free = &point[self.p..self.p + self.q];
        let mut slopes = DMatrix::identity(point.len(), point.len());
        slopes.view_mut(corner, size).copy_from(&-partial::jacobian(free));
        let natural = self.natural(&self.coefficients(point));
        let pull = -natural.descent.rows(self.p, self.q);
        let mut normal = natural.transformed(&slopes);
        normal.bend.view_mut(corner, size).sub_assign(&partial::bend(free, &pull));
        normal
    }

    fn bounds(&self) -> &[f64] {
        &self.bounds
    }

    fn count(&self) -> usize {
        self.series.residuals(self.skip)
    }
}
