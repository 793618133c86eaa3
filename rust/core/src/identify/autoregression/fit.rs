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

impl Fit {
    /// The fit of a record, from that of its distances from `level`.
    pub(super) fn about(mut self, level: f64) -> Self {
        let order = self.phi.len();
        self.constant += level * (1.0 - self.phi.iter().sum::<f64>());
        let mut change = DMatrix::identity(order + 1, order + 1);
        change.view_mut((order, 0), (1, order)).fill(-level);
        self.covariance = &change * self.covariance * change.transpose();
        self
    }
}
