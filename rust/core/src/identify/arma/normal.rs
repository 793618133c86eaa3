//! Normal equations of a few parameters.

use nalgebra::{Cholesky, DMatrix, DVector};

/// `JᵀJ`, `-Jᵀr` and `rᵀr` of residuals `r` with derivatives `J`.
#[derive(Debug, Clone)]
pub struct Normal {
    pub gram: DMatrix<f64>,
    pub descent: DVector<f64>,
    pub sum_of_squares: f64,
}

impl Normal {
    /// A matrix alone, to be inverted.
    pub fn of_gram(gram: DMatrix<f64>) -> Self {
        Self { descent: DVector::zeros(gram.nrows()), gram, sum_of_squares: 0.0 }
    }

    /// The same in other coordinates, of whose change `slopes` are the derivatives.
    pub fn transformed(&self, slopes: &DMatrix<f64>) -> Self {
        Self {
            gram: slopes.tr_mul(&self.gram) * slopes,
            descent: slopes.tr_mul(&self.descent),
            sum_of_squares: self.sum_of_squares,
        }
    }

    /// Step to the minimum of the quadratic model with its diagonal raised by `damping`; the
    /// `frozen` coordinates stay.
    pub fn step(&self, damping: f64, frozen: &[bool]) -> Option<DVector<f64>> {
        let (mut gram, mut descent) = (self.gram.clone(), self.descent.clone());
        let scale = scale(&gram);
        for i in (0..frozen.len()).filter(|i| frozen[*i]) {
            gram.row_mut(i).fill(0.0);
            gram.column_mut(i).fill(0.0);
            descent[i] = 0.0;
        }
        gram =
            DMatrix::from_fn(gram.nrows(), gram.ncols(), |i, j| gram[(i, j)] * scale[i] * scale[j]);
        (0..gram.nrows()).for_each(|i| gram[(i, i)] += damping + f64::from(u8::from(frozen[i])));
        let solved = Cholesky::new(gram)?.solve(&descent.component_mul(&scale));
        Some(solved.component_mul(&scale)).filter(|step| step.iter().all(|x| x.is_finite()))
    }

    /// `stepᵀ JᵀJ step`.
    pub fn length(&self, step: &DVector<f64>) -> f64 {
        step.dot(&(&self.gram * step))
    }

    /// Inverse of `JᵀJ`, and its condition number once scaled to a unit diagonal. What rounding
    /// leaves undetermined is finite, and huge.
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

/// What brings the diagonal to one; a column of zeros is left as it is.
fn scale(gram: &DMatrix<f64>) -> DVector<f64> {
    gram.diagonal().map(|square| if square > 0.0 { square.sqrt().recip() } else { 1.0 })
}
