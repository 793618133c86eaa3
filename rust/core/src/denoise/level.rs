//! Choice of the number of levels.

use statrs::distribution::{ContinuousCDF, Normal};

use super::NORMAL_MEDIAN;
use super::median::median_size;

/// Rule for the last level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LevelRule {
    /// This level.
    Fixed(usize),
    /// The last level before the largest detail exceeds this share of the sum of all details (Wu &
    /// Ran 10).
    PeakToSum(f64),
    /// The last level before that share exceeds this multiple of its value in white noise with as
    /// many details. The share itself grows as the number of details decreases.
    PeakToSumOverNoise(f64),
    /// The last level with details like the noise of the first level.
    Noise,
}

/// Smallest number of details for a comparison with noise.
const MIN_DETAILS: usize = 64;

/// Relative standard error of a median size of n normal numbers, times √n.
const MEDIAN_ERROR: f64 = 1.17;

/// Largest chance deviation, in standard deviations.
const MAX_SIGMAS: f64 = 3.0;

/// Tolerance of the ratio of standard deviations and of the RMS, for any number of details.
const MAX_RATIO_ERROR: f64 = 0.05;
const MAX_RMS_EXCESS: f64 = 0.1;

impl LevelRule {
    /// True if a level after the first is thresholded. `sigma` and `first` are the standard
    /// deviation and number of details of the first level.
    pub(super) fn goes_on(&self, level: usize, details: &[f64], sigma: f64, first: usize) -> bool {
        match *self {
            Self::Fixed(last) => level <= last,
            Self::PeakToSum(cut) => peak_to_sum(details) <= cut,
            Self::PeakToSumOverNoise(cut) => {
                peak_to_sum(details) <= cut * peak_to_sum_of_noise(details.len())
            }
            Self::Noise => details.len() >= MIN_DETAILS && looks_like(details, sigma, first),
        }
    }
}

fn peak_to_sum(details: &[f64]) -> f64 {
    let peak = details.iter().fold(0.0, |peak: f64, d| peak.max(d.abs()));
    peak / sum(details, f64::abs)
}

/// Sum of `f` over all values, in four parallel sums that hide the time of an addition.
fn sum(values: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    let (fours, rest) = values.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for four in fours {
        for (sum, x) in sums.iter_mut().zip(four) {
            *sum += f(*x);
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(|x| f(*x)).sum::<f64>()
}

/// Peak-to-sum ratio of `n` independent normal numbers, approximately: Blom's plotting position of
/// the largest size over the mean size.
fn peak_to_sum_of_noise(n: usize) -> f64 {
    let n = n as f64;
    let within = (n - 0.375) / (n + 0.25);
    let peak = Normal::standard().inverse_cdf(1.0 - 0.5 * (1.0 - within));
    peak / (n * std::f64::consts::FRAC_2_PI.sqrt())
}

/// Compares median and root mean square: the first shows a full level, the second rare details.
fn looks_like(details: &[f64], sigma: f64, first: usize) -> bool {
    let n = details.len() as f64;
    let ratio = median_size(details) / NORMAL_MEDIAN / sigma;
    let chance = MAX_SIGMAS * MEDIAN_ERROR * (1.0 / n + 1.0 / first as f64).sqrt();
    let rms = (sum(details, |d| d * d) / n).sqrt();
    ratio.ln().abs() <= chance.max(MAX_RATIO_ERROR)
        && rms <= sigma * (1.0 + (MAX_SIGMAS / (2.0 * n).sqrt()).max(MAX_RMS_EXCESS))
}

#[cfg(test)]
mod tests {
    use super::{peak_to_sum, peak_to_sum_of_noise};

    #[test]
    fn a_peak_is_a_part_of_the_sum() {
        assert_eq!(peak_to_sum(&[1.0, -5.0, 0.0, 4.0]), 0.5);
        assert!(peak_to_sum(&[0.0; 3]).is_nan());
        // Two in 10⁴ normal numbers are beyond 3.9 standard deviations; their mean size is 0.8.
        let part = peak_to_sum_of_noise(10_000);
        assert!((part * 1e4 * 0.797_885 - 3.99).abs() < 0.05, "{part}");
    }
}
