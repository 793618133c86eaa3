//! Autoregressions of every order from their reflection coefficients.

use nalgebra::DMatrix;

use super::fit::NearFit;

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

    /// The highest order as a fit to `n` samples of mean 0, that was taken off for a constant.
    pub fn fit(&self, n: usize, constant: bool) -> NearFit {
        let (phi, sigma2) = (self.last().to_vec(), self.last_variance());
        let (order, precision_root) = (phi.len(), self.precision_root());
        let scale = (n as f64).sqrt().recip();
        let mut root = (&precision_root * scale).insert_row(order, 0.0).insert_column(order, 0.0);
        root[(order, order)] = if constant { scale } else { 0.0 };
        NearFit { phi, constant: 0.0, sigma2, root, n, condition: condition(&precision_root) }
    }

    /// A root, its transpose on the right, of the inverse of the covariance of as many neighbouring
    /// samples as the highest order: residuals of orders 0, 1, ... are uncorrelated.
    fn precision_root(&self) -> DMatrix<f64> {
        let order = self.last().len();
        let mut root = DMatrix::zeros(order, order);
        for k in 0..order {
            let weight = self.variances[k].sqrt().recip();
            root[(k, k)] = weight;
            self.phi[k]
                .iter()
                .enumerate()
                .for_each(|(i, phi)| root[(k - 1 - i, k)] = -phi * weight);
        }
        root
    }
}

/// Condition number of a matrix whose inverse has this root, and equal elements on its diagonal.
fn condition(root: &DMatrix<f64>) -> f64 {
    if root.is_empty() {
        return 1.0;
    }
    let values = root.singular_values();
    (values.max() / values.min()).powi(2)
}
