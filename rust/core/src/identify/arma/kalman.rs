//! Innovations of a stationary ARMA process by the Kalman filter of its Harvey form.

use super::partial;

type Matrix<const R: usize> = [[f64; R]; R];

/// Once the covariance is that of the steady state to this, it is no longer carried along.
const STEADY: f64 = 1e-14;

/// State `x_k = T x_{k-1} + b a_k`, `y_k` its first element, at unit innovation variance;
/// `R >= max(p, q + 1)`.
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
    /// In the stationary state, if the process has one.
    pub fn new(phi: &[f64], theta: &[f64]) -> Option<Self> {
        partial::partials(phi)?;
        let b = |i: usize| if i == 0 { 1.0 } else { theta.get(i - 1).copied().unwrap_or(0.0) };
        let (phi, b) =
            (std::array::from_fn(|i| phi.get(i).copied().unwrap_or(0.0)), std::array::from_fn(b));
        let covariance = stationary(&phi, &b);
        Some(Self { phi, b, x: [0.0; R], covariance, is_steady: false, log_determinant: 0.0 })
    }

    /// Innovation over its deviation, zero where the sample is missing.
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
        self.covariance = self.predicted(|i, j| first[i] * first[j] / variance);
        self.is_steady = self.has_settled();
        self.log_determinant += variance.ln();
        innovation / variance.sqrt()
    }

    /// `T (x + correction)`, whose first element is known to be `y`.
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
        self.covariance = self.predicted(|_, _| 0.0);
        self.is_steady = false;
    }

    /// `T (P - known) Tᵀ + b bᵀ`.
    fn predicted(&self, known: impl Fn(usize, usize) -> f64) -> Matrix<R> {
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
            (self.covariance[i][j] - steady).abs() <= STEADY * (1.0 + steady.abs())
        };
        (0..R).all(|i| (i..R).all(|j| near(i, j)))
    }
}

/// Solution of `P = T P Tᵀ + b bᵀ` by doubling: sums of squares only, which lose nothing to
/// cancellation near a unit root.
fn stationary<const R: usize>(phi: &[f64; R], b: &[f64; R]) -> Matrix<R> {
    let mut covariance: Matrix<R> = std::array::from_fn(|i| b.map(|b_j| b[i] * b_j));
    let mut power: Matrix<R> = std::array::from_fn(|i| {
        std::array::from_fn(|j| if j == 0 { phi[i] } else { f64::from(u8::from(j == i + 1)) })
    });
    // Any stationary process that a search may meet has forgotten its start after 2^60 samples.
    for _ in 0..60 {
        let added = times(&times(&power, &covariance), &transposed(&power));
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

fn transposed<const R: usize>(a: &Matrix<R>) -> Matrix<R> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}
