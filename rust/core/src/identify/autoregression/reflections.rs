//! Autoregressions of every order from their reflection coefficients.

use nalgebra::DMatrix;

use super::fit::Fit;

/// Models of orders 0, 1, ... of which each is the one before it, extended.
#[derive(Debug, Clone)]
pub struct Reflections {
    /// Coefficients of each order.
    phi: Vec<Vec<f64>>,
    /// Variance of the residuals of each order.
    variances: Vec<f64>,
}

impl Reflections {
    /// Order 0: residuals are the samples, of this variance.
    pub fn new(variance: f64) -> Self {
        Self { phi: vec![Vec::new()], variances: vec![variance] }
    }

    /// Appends the next order, whose last coefficient is given.
    pub fn extend(&mut self, last: f64) {
        let phi = self.last();
        let mut next: Vec<f64> =
            phi.iter().zip(phi.iter().rev()).map(|(a, mirrored)| a - last * mirrored).collect();
        next.push(last);
        self.variances.push(self.last_variance() * (1.0 - last * last));
        self.phi.push(next);
    }

    /// Coefficients of the highest order.
    pub fn last(&self) -> &[f64] {
        self.phi.last().map_or(&[], Vec::as_slice)
    }

    /// Variance of the highest order.
    pub fn last_variance(&self) -> f64 {
        self.variances.last().copied().unwrap_or(0.0)
    }

    /// Variance of order 0.
    pub fn first_variance(&self) -> f64 {
        self.variances[0]
    }

    /// Variances of all orders.
    pub fn variances(self) -> Vec<f64> {
        self.variances
    }

    /// The highest order as a fit to `n` samples of mean 0; the constant's variance if it has one.
    pub fn fit(&self, n: usize, constant: bool) -> Fit {
        let (phi, sigma2) = (self.last().to_vec(), self.last_variance());
        let order = phi.len();
        let precision = self.precision();
        let condition = condition(&precision);
        let mut covariance = DMatrix::zeros(order + 1, order + 1);
        covariance.view_mut((0, 0), (order, order)).copy_from(&(precision * (sigma2 / n as f64)));
        covariance[(order, order)] = if constant { sigma2 / n as f64 } else { 0.0 };
        Fit { phi, constant: 0.0, sigma2, covariance, n, condition }
    }

    /// Inverse of the covariance of as many neighbouring samples as the highest order: residuals of
    /// orders 0, 1, ... are uncorrelated.
    fn precision(&self) -> DMatrix<f64> {
        let order = self.last().len();
        let mut residuals = DMatrix::zeros(order, order);
        for k in 0..order {
            let weight = self.variances[k].sqrt().recip();
            residuals[(k, k)] = weight;
            self.phi[k]
                .iter()
                .enumerate()
                .for_each(|(i, phi)| residuals[(k, k - 1 - i)] = -phi * weight);
        }
        residuals.transpose() * residuals
    }
}

/// Of a matrix whose inverse has equal elements on its diagonal.
fn condition(precision: &DMatrix<f64>) -> f64 {
    if precision.is_empty() {
        return 1.0;
    }
    let values = precision.symmetric_eigenvalues();
    values.max() / values.min()
}
