//! Least squares: each sample from earlier samples, over all samples with enough earlier ones.

use nalgebra::{DMatrix, DVector};

use super::normal_equations::{Centre, NormalEquations};
use super::{Fit, FitError, NearFit, check};
use crate::math::segments::segments;
use crate::work;

/// Residual variances of orders 0..=order over the same n samples, and n.
pub fn variances(
    record: &[f64],
    order: usize,
    constant: bool,
) -> Result<(Vec<f64>, usize), FitError> {
    let centre = if constant { Centre::provisional(record) } else { Centre::default() };
    let (factor, n) = factor(record, order, constant, centre)?;
    Ok((factor.residual_sums().into_iter().map(|sum| sum / n as f64).collect(), n))
}

/// The model of one order.
pub fn fit(record: &[f64], order: usize, constant: bool) -> Result<Fit, FitError> {
    let centre = if constant { Centre::provisional(record) } else { Centre::default() };
    let (factor, n) = factor(record, order, constant, centre)?;
    let (first, coefficients) = (usize::from(constant), factor.coefficients());
    let fit = NearFit {
        phi: coefficients.as_slice()[first..].to_vec(),
        constant: if constant { coefficients[0] } else { 0.0 },
        sigma2: factor.residual_sums()[order] / n as f64,
        root: constant_last(factor.inverse_root(), constant),
        n,
        condition: factor.condition(),
    };
    Ok(fit.with_level(centre.level()))
}

fn factor(
    record: &[f64],
    order: usize,
    constant: bool,
    centre: Centre,
) -> Result<(Factor, usize), FitError> {
    let sums = NormalEquations::of(record, order, centre);
    check(record, order, sums.n(), constant, sums.energy())?;
    let factor = Factor::of_gram(sums.gram(constant), constant)
        .unwrap_or_else(|| Factor::of_upper(triangle(record, order, centre, constant), constant));
    match (factor.is_noiseless(), factor.dependent_lag()) {
        (true, _) => Err(FitError::Noiseless { order }),
        (_, Some(order)) => Err(FitError::Dependent { order }),
        _ => Ok((factor, sums.n())),
    }
}

/// Rows whose first belongs to the constant, if there is one; it is moved to the end, or zeros are
/// added there.
fn constant_last(rows: DMatrix<f64>, constant: bool) -> DMatrix<f64> {
    let (size, columns) = rows.shape();
    if !constant {
        return rows.insert_row(size, 0.0);
    }
    DMatrix::from_fn(size, columns, |i, j| rows[((i + 1) % size, j)])
}

/// Largest condition bound of the normal equations for products with enough precision. Relative
/// errors of a fit are about the condition times the rounding of a sum.
const MAX_CONDITION: f64 = 1e10;

/// Share of its column below which a pivot is rounding.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Upper triangle R with R'R = sums of products of `[1, y_(t-1), ..., y_(t-p), y_t]`.
///
/// The column of y_t is last and holds the contribution of each further lag: the sums of squared
/// residuals of all orders are sums over its tail.
#[derive(Debug, Clone)]
struct Factor {
    upper: DMatrix<f64>,
    constant: bool,
}

impl Factor {
    /// By Cholesky's method; `None` if the products have too few digits for it.
    fn of_gram(gram: DMatrix<f64>, constant: bool) -> Option<Self> {
        let upper = gram.cholesky()?.l().transpose();
        let factor = Self { upper, constant };
        (factor.condition_bound() <= MAX_CONDITION).then_some(factor)
    }

    /// From a triangle of the rows themselves.
    fn of_upper(upper: DMatrix<f64>, constant: bool) -> Self {
        Self { upper, constant }
    }

    /// The largest order p.
    fn order(&self) -> usize {
        self.size() - usize::from(self.constant)
    }

    /// Sums of squared residuals of orders 0..=p.
    fn residual_sums(&self) -> Vec<f64> {
        let column = self.upper.column(self.size());
        let mut sums = vec![0.0; self.order() + 1];
        let mut sum = 0.0;
        for order in (0..=self.order()).rev() {
            sum += column[order + usize::from(self.constant)].powi(2);
            sums[order] = sum;
        }
        sums
    }

    /// The longest lag whose samples are determined by shorter lags, if there is one.
    fn dependent_lag(&self) -> Option<usize> {
        let first = usize::from(self.constant);
        (first..self.size()).rev().find(|&j| self.is_rounding(j)).map(|j| j + 1 - first)
    }

    /// True if y_t is determined by earlier samples.
    fn is_noiseless(&self) -> bool {
        self.is_rounding(self.size())
    }

    fn is_rounding(&self, j: usize) -> bool {
        self.upper[(j, j)].abs() <= ROUNDING * self.upper.column(j).norm()
    }

    /// Coefficients of all columns except the last.
    fn coefficients(&self) -> DVector<f64> {
        let mut solution =
            self.upper.view((0, self.size()), (self.size(), 1)).column(0).into_owned();
        for i in (0..self.size()).rev() {
            for j in i + 1..self.size() {
                solution[i] -= self.upper[(i, j)] * solution[j];
            }
            solution[i] /= self.upper[(i, i)];
        }
        solution
    }

    /// A root of the inverse of X'X: the inverse is the root times its transpose.
    fn inverse_root(&self) -> DMatrix<f64> {
        inverse_of_upper(&self.columns(0, self.size()))
    }

    /// Condition number of X'X, without the mean and scaled to a unit diagonal.
    fn condition(&self) -> f64 {
        if self.order() == 0 {
            return 1.0;
        }
        let columns = self.columns(usize::from(self.constant), self.size());
        let values = of_unit_length(columns).singular_values();
        (values.max() / values.min()).powi(2)
    }

    /// Upper bound of the condition number of all columns' products, from traces.
    fn condition_bound(&self) -> f64 {
        let scaled = of_unit_length(self.upper.clone());
        scaled.norm_squared() * inverse_of_upper(&scaled).norm_squared()
    }

    /// The triangle of the columns from `start` to `end`.
    fn columns(&self, start: usize, end: usize) -> DMatrix<f64> {
        self.upper.view((start, start), (end - start, end - start)).into()
    }

    /// Number of columns before y_t.
    fn size(&self) -> usize {
        self.upper.ncols() - 1
    }
}

fn of_unit_length(mut columns: DMatrix<f64>) -> DMatrix<f64> {
    columns.column_iter_mut().for_each(|mut column| column /= column.norm());
    columns
}

fn inverse_of_upper(upper: &DMatrix<f64>) -> DMatrix<f64> {
    let size = upper.ncols();
    let mut inverse = DMatrix::zeros(size, size);
    for j in 0..size {
        inverse[(j, j)] = 1.0 / upper[(j, j)];
        for i in (0..j).rev() {
            let sum: f64 = (i + 1..=j).map(|k| upper[(i, k)] * inverse[(k, j)]).sum();
            inverse[(i, j)] = -sum / upper[(i, i)];
        }
    }
    inverse
}

/// Number of rows in a block, as a multiple of the columns; the triangle of earlier rows is added
/// to each block.
const DEPTH: usize = 16;

/// Triangle of the rows `[1, y_(t-1), ..., y_(t-order), y_t]`; the 1 only with a constant. It is
/// slower than from products, with twice as many digits.
fn triangle(record: &[f64], order: usize, centre: Centre, constant: bool) -> DMatrix<f64> {
    let size = order + 1 + usize::from(constant);
    let depth = DEPTH * size;
    let mut upper = DMatrix::zeros(size, size);
    for segment in segments(record) {
        let late = segment.len().saturating_sub(order);
        for start in (0..late).step_by(depth) {
            work::pause();
            let block = &segment[start..segment.len().min(start + depth + order)];
            upper = join_factors(&upper, block, order, centre, constant);
        }
    }
    upper
}

/// Triangle of the earlier rows' triangle and the rows of a block.
fn join_factors(
    upper: &DMatrix<f64>,
    block: &[f64],
    order: usize,
    centre: Centre,
    constant: bool,
) -> DMatrix<f64> {
    let (size, first) = (upper.ncols(), usize::from(constant));
    let count = block.len() - order;
    let mut rows = DMatrix::from_element(size + count, size, 1.0);
    rows.view_mut((0, 0), (size, size)).copy_from(upper);
    for lag in 0..=order {
        let column = if lag == 0 { size - 1 } else { lag - 1 + first };
        let values = block[order - lag..].iter().map(|z| centre.subtract_centre(*z));
        rows.view_mut((size, column), (count, 1))
            .iter_mut()
            .zip(values)
            .for_each(|(to, y)| *to = y);
    }
    rows.qr().unpack_r()
}
