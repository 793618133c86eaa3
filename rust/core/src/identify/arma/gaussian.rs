//! The exact Gaussian likelihood at given coefficients.

use super::MAX_ORDER;
use super::kalman::Kalman;

/// Samples whose squares are summed by themselves, so that a million sum up precisely.
const BLOCK: usize = 512;

/// What the likelihood of a record is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likelihood {
    /// Of the innovations over their deviations at unit variance.
    pub sum_of_squares: f64,
    /// Sum of the logarithms of these variances.
    pub log_determinant: f64,
    /// Number of samples present.
    pub count: usize,
}

impl Likelihood {
    /// Variance of the innovations that makes the record most likely.
    pub fn sigma2(&self) -> f64 {
        self.sum_of_squares / self.count as f64
    }

    /// Logarithm of the likelihood at that variance.
    pub fn log_likelihood(&self) -> f64 {
        let n = self.count as f64;
        -0.5 * (n * ((std::f64::consts::TAU * self.sigma2()).ln() + 1.0) + self.log_determinant)
    }
}

/// Likelihood of samples, of which those not finite are missing, under a stationary process.
pub fn likelihood(z: &[f64], phi: &[f64], theta: &[f64], mean: f64) -> Option<Likelihood> {
    match phi.len().max(theta.len() + 1) {
        1 => of_size::<1>(z, phi, theta, mean),
        2 => of_size::<2>(z, phi, theta, mean),
        3 => of_size::<3>(z, phi, theta, mean),
        4 => of_size::<4>(z, phi, theta, mean),
        _ => of_size::<{ MAX_ORDER + 1 }>(z, phi, theta, mean),
    }
}

fn of_size<const R: usize>(z: &[f64], phi: &[f64], theta: &[f64], mean: f64) -> Option<Likelihood> {
    let mut kalman = Kalman::<R>::new(phi, theta)?;
    let mut square = |z: &f64| {
        let w = kalman.update(z - mean);
        w * w
    };
    let blocks = z.chunks(BLOCK).map(|block| block.iter().map(&mut square).sum::<f64>());
    let sum_of_squares = blocks.sum();
    let count = z.iter().filter(|z| z.is_finite()).count();
    Some(Likelihood { sum_of_squares, log_determinant: kalman.log_determinant, count })
}
