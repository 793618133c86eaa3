//! The exact Gaussian likelihood of a record, by the Kalman filter of an ARMA process.

use super::MAX_ORDER;
use super::partial;
use crate::work;

/// Number of samples whose squares are summed separately: a million are then summed precisely.
const BLOCK: usize = 512;

/// Parts of a record's likelihood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likelihood {
    /// Sum of the squared innovations over their variances, at unit innovation variance.
    pub sum_of_squares: f64,
    /// Sum of the logarithms of these variances.
    pub log_determinant: f64,
    /// Number of samples present.
    pub count: usize,
}

impl Likelihood {
    /// Most likely variance of the innovations.
    pub fn sigma2(&self) -> f64 {
        self.sum_of_squares / self.count as f64
    }

    /// Logarithm of the likelihood at this variance.
    pub fn log_likelihood(&self) -> f64 {
        let n = self.count as f64;
        -0.5 * (n * ((std::f64::consts::TAU * self.sigma2()).ln() + 1.0) + self.log_determinant)
    }
}

/// Likelihood of samples under a stationary process; samples that are not finite are missing.
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
    let blocks = z.chunks(BLOCK).map(|block| {
        work::pause();
        block.iter().map(&mut square).sum::<f64>()
    });
    let sum_of_squares = blocks.sum();
    let count = z.iter().filter(|z| z.is_finite()).count();
    Some(Likelihood { sum_of_squares, log_determinant: kalman.log_determinant, count })
}

type Matrix<const R: usize> = [[f64; R]; R];

/// Tolerance within which the covariance has reached its steady state and is no longer propagated.
const STEADY_TOLERANCE: f64 = 1e-14;

/// Innovations by the filter of the process in Harvey's form, at unit innovation variance: state
/// `x_k = T x_{k-1} + b a_k`, with `y_k` as its first element and `R >= max(p, q + 1)`.
#[derive(Debug, Clone)]
pub struct Kalman<const R: usize> {
    phi: [f64; R],
    b: [f64; R],
    x: [f64; R],
    covariance: Matrix<R>,
    is_steady: bool,
    /// Sum of the logarithms of the innovations' variances.
    pub log_determinant: f64,
}

impl<const R: usize> Kalman<R> {
    /// The stationary state, if the process has one.
    pub fn new(phi: &[f64], theta: &[f64]) -> Option<Self> {
        partial::partials(phi)?;
        let b = |i: usize| if i == 0 { 1.0 } else { theta.get(i - 1).copied().unwrap_or(0.0) };
        let (phi, b) =
            (std::array::from_fn(|i| phi.get(i).copied().unwrap_or(0.0)), std::array::from_fn(b));
        let covariance = stationary(&phi, &b);
        Some(Self { phi, b, x: [0.0; R], covariance, is_steady: false, log_determinant: 0.0 })
    }

    /// Innovation over its standard deviation, zero if the sample is missing.
    #[inline]
    pub fn update(&mut self, y: f64) -> f64 {
        if !y.is_finite() {
            self.skip();
            return 0.0;
        }
        let innovation = y - self.x[0];
        if self.is_steady {
            let b = self.b;
            self.advance(y, |i| b[i] * innovation);
            return innovation;
        }
        let variance = self.covariance[0][0];
        let first = self.covariance[0];
        self.advance(y, |i| first[i] / variance * innovation);
        self.covariance = self.predict(|i, j| first[i] * first[j] / variance);
        self.is_steady = self.has_settled();
        self.log_determinant += variance.ln();
        innovation / variance.sqrt()
    }

    /// `T (x + correction)`; its first element is known to be `y`.
    #[inline]
    fn advance(&mut self, y: f64, correction: impl Fn(usize) -> f64) {
        for i in 0..R {
            let next = if i + 1 < R { self.x[i + 1] + correction(i + 1) } else { 0.0 };
            self.x[i] = self.phi[i] * y + next;
        }
    }

    fn skip(&mut self) {
        let expected = self.x[0];
        self.advance(expected, |_| 0.0);
        self.covariance = self.predict(|_, _| 0.0);
        self.is_steady = false;
    }

    /// `T (P - known) Tᵀ + b bᵀ`.
    fn predict(&self, known: impl Fn(usize, usize) -> f64) -> Matrix<R> {
        let left = |i: usize, j: usize| match i < R && j < R {
            true => self.covariance[i][j] - known(i, j),
            false => 0.0,
        };
        let (phi, b) = (&self.phi, &self.b);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                left(i + 1, j + 1)
                    + phi[i] * left(0, j + 1)
                    + phi[j] * left(i + 1, 0)
                    + phi[i] * phi[j] * left(0, 0)
                    + b[i] * b[j]
            })
        })
    }

    fn has_settled(&self) -> bool {
        let near = |i: usize, j: usize| {
            let steady = self.b[i] * self.b[j];
            (self.covariance[i][j] - steady).abs() <= STEADY_TOLERANCE * (1.0 + steady.abs())
        };
        (0..R).all(|i| (i..R).all(|j| near(i, j)))
    }
}

/// Solution of `P = T P Tᵀ + b bᵀ` by doubling: sums of squares only, which lose no digits near a
/// unit root.
fn stationary<const R: usize>(phi: &[f64; R], b: &[f64; R]) -> Matrix<R> {
    let mut covariance: Matrix<R> = std::array::from_fn(|i| b.map(|b_j| b[i] * b_j));
    let mut power: Matrix<R> = std::array::from_fn(|i| {
        std::array::from_fn(|j| if j == 0 { phi[i] } else { f64::from(u8::from(j == i + 1)) })
    });
    // Any stationary process in a search has forgotten its start after 2^60 samples.
    for _ in 0..60 {
        let added = times(&times(&power, &covariance), &transpose(&power));
        let grows = |i: usize| added[i][i] > f64::EPSILON * 0.1 * covariance[i][i];
        let goes_on = (0..R).any(grows);
        for i in 0..R {
            (0..R).for_each(|j| covariance[i][j] += added[i][j]);
        }
        if !goes_on {
            break;
        }
        power = times(&power, &power);
    }
    covariance
}

fn times<const R: usize>(a: &Matrix<R>, b: &Matrix<R>) -> Matrix<R> {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..R).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transpose<const R: usize>(a: &Matrix<R>) -> Matrix<R> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}
