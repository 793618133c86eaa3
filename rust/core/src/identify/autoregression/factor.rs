//! The triangular factor of the normal equations, from which all else follows.

use nalgebra::{DMatrix, DVector};

/// Bound on the condition of the normal equations up to which their products are precise enough:
/// relative errors of a fit are about the condition times the rounding of a sum.
const LARGEST_CONDITION: f64 = 1e10;

/// A pivot below this part of its column is rounding.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Upper triangle R with R'R = sums of products of `[1, y_(t-1), ..., y_(t-p), y_t]`.
///
/// With y_t last, its column holds what each further lag explains: the sums of squared residuals
/// of all orders are sums over its tail.
#[derive(Debug, Clone)]
pub struct Factor {
    upper: DMatrix<f64>,
    constant: bool,
}

impl Factor {
    /// By Cholesky's method; `None` where the products hold too few digits for it.
    pub fn of_gram(gram: DMatrix<f64>, constant: bool) -> Option<Self> {
        let upper = gram.cholesky()?.l().transpose();
        let factor = Self { upper, constant };
        (factor.condition_bound() <= LARGEST_CONDITION).then_some(factor)
    }

    /// From a triangle made of the rows themselves.
    pub fn of_upper(upper: DMatrix<f64>, constant: bool) -> Self {
        Self { upper, constant }
    }

    /// The largest order p.
    pub fn order(&self) -> usize {
        self.size() - usize::from(self.constant)
    }

    /// Sums of squared residuals of orders 0..=p.
    pub fn residual_sums(&self) -> Vec<f64> {
        let column = self.upper.column(self.size());
        let mut sums = vec![0.0; self.order() + 1];
        let mut sum = 0.0;
        for order in (0..=self.order()).rev() {
            sum += column[order + usize::from(self.constant)].powi(2);
            sums[order] = sum;
        }
        sums
    }

    /// The longest lag whose samples follow from those of shorter ones, if there is one.
    pub fn dependent_lag(&self) -> Option<usize> {
        let first = usize::from(self.constant);
        (first..self.size()).rev().find(|&j| self.is_rounding(j)).map(|j| j + 1 - first)
    }

    /// Whether y_t follows from the samples before it.
    pub fn is_noiseless(&self) -> bool {
        self.is_rounding(self.size())
    }

    fn is_rounding(&self, j: usize) -> bool {
        self.upper[(j, j)].abs() <= ROUNDING * self.upper.column(j).norm()
    }

    /// Coefficients of all columns but the last.
    pub fn coefficients(&self) -> DVector<f64> {
        let mut answer = self.upper.view((0, self.size()), (self.size(), 1)).column(0).into_owned();
        for i in (0..self.size()).rev() {
            for j in i + 1..self.size() {
                answer[i] -= self.upper[(i, j)] * answer[j];
            }
            answer[i] /= self.upper[(i, i)];
        }
        answer
    }

    /// A root of the inverse of X'X, its transpose on the right.
    pub fn inverse_root(&self) -> DMatrix<f64> {
        inverse_of_upper(&self.columns(0, self.size()))
    }

    /// Condition number of X'X, the mean taken off and scaled to a unit diagonal.
    pub fn condition(&self) -> f64 {
        if self.order() == 0 {
            return 1.0;
        }
        let columns = self.columns(usize::from(self.constant), self.size());
        let values = of_unit_length(columns).singular_values();
        (values.max() / values.min()).powi(2)
    }

    /// At least the condition number of all columns' products: that of traces.
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
