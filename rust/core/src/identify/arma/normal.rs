//! Normal equations of a few parameters.

use nalgebra::{DMatrix, DVector};

use super::model::Model;

/// `JᵀJ`, `Σ r r″`, `-Jᵀr` and `rᵀr` of residuals `r` with derivatives `J` and `r″`.
#[derive(Debug, Clone)]
pub struct Normal {
    pub gram: DMatrix<f64>,
    pub bend: DMatrix<f64>,
    pub descent: DVector<f64>,
    pub sum_of_squares: f64,
}

impl Normal {
    /// A matrix alone, to be inverted.
    pub fn of_gram(gram: DMatrix<f64>) -> Self {
        let (descent, bend) = (DVector::zeros(gram.nrows()), gram.map(|_| 0.0));
        Self { gram, bend, descent, sum_of_squares: 0.0 }
    }

    /// The same in other coordinates, of whose change `slopes` are the derivatives.
    pub fn transformed(&self, slopes: &DMatrix<f64>) -> Self {
        Self {
            gram: slopes.tr_mul(&self.gram) * slopes,
            bend: slopes.tr_mul(&self.bend) * slopes,
            descent: slopes.tr_mul(&self.descent),
            sum_of_squares: self.sum_of_squares,
        }
    }

    /// The quadratic model in coordinates of unit curvature each; the `frozen` ones stay.
    pub fn model(&self, frozen: &[bool]) -> Model {
        let scale = scale(&self.gram);
        let free = |i: usize| if frozen[i] { 0.0 } else { scale[i] };
        let curvature = DMatrix::from_fn(frozen.len(), frozen.len(), |i, j| {
            let held = f64::from(u8::from(i == j && frozen[i]));
            (self.gram[(i, j)] + self.bend[(i, j)]) * free(i) * free(j) + held
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
