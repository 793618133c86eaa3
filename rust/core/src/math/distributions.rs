//! Chi-squared and normal distributions, for confidence bounds and tests.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use libm::erfc;
use statrs::distribution::{ChiSquared, Continuous, ContinuousCDF};

/// Quantile of chi-squared at a probability in (0, 1). Degrees of freedom need not be whole; the
/// result is NaN if they are not positive and finite.
pub fn chi_squared_quantile(probability: f64, freedom: f64) -> f64 {
    chi_squared(freedom).map_or(f64::NAN, |distribution| {
        let rough = distribution.inverse_cdf(probability);
        (0..STEPS).fold(rough, |x, _| refined(&distribution, probability, x))
    })
}

/// Number of steps that reduce an absolute error of 1e-10 to rounding.
const STEPS: usize = 3;

/// Newton's step for the logarithm of a quantile. The logarithm of the probability is nearly a
/// straight line in it if the two are small.
fn refined(distribution: &ChiSquared, probability: f64, x: f64) -> f64 {
    let below = distribution.cdf(x);
    let step = (probability / below).ln() * below / (x * distribution.pdf(x));
    if step.is_finite() { x * step.exp() } else { x }
}

/// Probability that chi-squared exceeds a value; its relative error is small even far in the tail.
/// `None` for NaN, and for degrees of freedom that are not positive and finite.
pub fn chi_squared_survival(value: f64, freedom: f64) -> Option<f64> {
    let distribution = chi_squared(freedom).filter(|_| !value.is_nan())?;
    Some(distribution.sf(value))
}

fn chi_squared(freedom: f64) -> Option<ChiSquared> {
    ChiSquared::new(freedom).ok().filter(|_| freedom.is_finite())
}

/// Argument below which the tail's series is exact to rounding.
const TAIL: f64 = -20.0;

/// Logarithm of the cumulative standard normal distribution, accurate even far in its lower tail.
pub fn log_normal_cdf(x: f64) -> f64 {
    let half_erfc = |x: f64| 0.5 * erfc(x * FRAC_1_SQRT_2);
    if x < TAIL {
        let u = 1.0 / (x * x);
        let series = u * (-1.0 + u * (3.0 + u * (-15.0 + u * (105.0 - 945.0 * u))));
        -0.5 * x * x - (-x).ln() - 0.5 * (2.0 * PI).ln() + series.ln_1p()
    } else if x < 0.0 {
        half_erfc(-x).ln()
    } else {
        (-half_erfc(x)).ln_1p()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chi_squared_of_two_degrees_is_exponential() {
        for probability in [1e-12_f64, 0.025, 0.5, 0.975] {
            let expected = -2.0 * (-probability).ln_1p();
            let found = chi_squared_quantile(probability, 2.0);
            assert!((found / expected - 1.0).abs() < 1e-13, "{found} {expected}");
        }
        let found = chi_squared_survival(1400.0, 2.0).expect("two degrees of freedom");
        assert!((found.ln() + 700.0).abs() < 1e-11, "{found}");
    }

    #[test]
    fn no_degrees_of_freedom_no_distribution() {
        for freedom in [0.0, -1.0, f64::INFINITY, f64::NAN] {
            assert!(chi_squared_quantile(0.5, freedom).is_nan());
            assert!(chi_squared_survival(1.0, freedom).is_none());
        }
        assert!(chi_squared_survival(f64::NAN, 1.0).is_none());
    }

    #[test]
    fn the_normal_tail_joins_its_series() {
        let (near, far) = (log_normal_cdf(TAIL), log_normal_cdf(TAIL * (1.0 + 1e-15)));
        assert!((near / far - 1.0).abs() < 1e-12, "{near} {far}");
        assert_eq!(log_normal_cdf(0.0), 0.5_f64.ln());
    }
}
