//! A fitted autoregression.

use nalgebra::DMatrix;

/// z_k = sum_i phi_i z_(k-i) + a_k + constant, as a record determines it.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Coefficients.
    pub phi: Vec<f64>,
    /// 0 if none was fitted.
    pub constant: f64,
    /// Variance of a.
    pub sigma2: f64,
    /// Of the estimates of phi and, last, the constant; zero for one that was not fitted.
    pub covariance: DMatrix<f64>,
    /// Number of residuals.
    pub n: usize,
    /// Condition number of the normal equations, the mean taken off, scaled to a unit diagonal.
    pub condition: f64,
}

/// The fit of a record's distances from a level.
pub(super) struct NearFit {
    pub phi: Vec<f64>,
    pub constant: f64,
    pub sigma2: f64,
    /// Times its transpose and sigma2, the covariance of phi and, last, the constant.
    pub root: DMatrix<f64>,
    pub n: usize,
    pub condition: f64,
}

impl NearFit {
    /// The fit of the record itself.
    pub fn with_level(self, level: f64) -> Fit {
        let Self { phi, sigma2, mut root, n, condition, .. } = self;
        let constant = self.constant + level * (1.0 - phi.iter().sum::<f64>());
        // The root has the digits that a difference of variances would lose.
        let with_phi = root.rows(0, phi.len()).row_sum() * level;
        root.row_mut(phi.len()).zip_apply(&with_phi, |own, share| *own -= share);
        let covariance = &root * root.transpose() * sigma2;
        Fit { phi, constant, sigma2, covariance, n, condition }
    }
}
