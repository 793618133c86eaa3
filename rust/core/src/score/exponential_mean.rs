//! Exponential moving average that starts as the running mean.

use crate::error::Error;

/// Replaces every sample by the average to date, `y += max(1/k, gain) (z - y)` at the k-th present
/// sample. It is a running mean until the gain exceeds 1/k; with a gain of zero it always is.
///
/// At a missing sample the average is held; before the first present sample it is NaN.
///
/// # Errors
/// [`Error::Parameter`] if the gain is not between 0 and 1.
pub fn exponential_mean(samples: &mut [f64], gain: f64) -> Result<(), Error> {
    if !(0.0..=1.0).contains(&gain) {
        let expected = "a number from 0 to 1";
        return Err(Error::Parameter { name: "gain", expected, value: gain });
    }
    let (mut mean, mut count) = (f64::NAN, 0.0);
    for z in samples {
        if z.is_finite() {
            count += 1.0;
            mean = if count > 1.0 { towards(mean, *z, gain.max(1.0 / count)) } else { *z };
        }
        *z = mean;
    }
    Ok(())
}

fn towards(mean: f64, z: f64, gain: f64) -> f64 {
    // A difference of huge numbers overflows, and the bounds limit the result to the correct value.
    (mean + (gain * z - gain * mean)).clamp(mean.min(z), mean.max(z))
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::*;

    fn averaged(samples: &[f64], gain: f64) -> Vec<f64> {
        let mut averages = samples.to_vec();
        exponential_mean(&mut averages, gain).expect("the gain is valid");
        averages
    }

    #[test]
    fn the_running_mean_gives_way_to_the_gain() {
        // Powers of two: every step is exact.
        assert_eq!(averaged(&[8.0, 0.0, 4.0, 8.0], 0.5), [8.0, 4.0, 4.0, 6.0]);
        assert_eq!(averaged(&[8.0, 0.0, 4.0, 8.0], 0.0), [8.0, 4.0, 4.0, 5.0]);
    }

    #[test]
    fn missing_samples_hold_and_do_not_count() {
        let averages = averaged(&[f64::NAN, 8.0, f64::INFINITY, 0.0, f64::NAN], 0.0);
        assert!(averages[0].is_nan());
        assert_eq!(averages[1..], [8.0, 8.0, 4.0, 4.0]);
    }

    #[test]
    fn huge_samples_stay_finite() {
        let averages = averaged(&[f64::MAX, f64::MIN, f64::MAX], 0.9);
        assert!(averages.iter().all(|y| y.is_finite()));
    }

    #[test]
    fn a_gain_beyond_one_is_refused() {
        for gain in [-0.1, 1.1, f64::NAN] {
            assert!(exponential_mean(&mut [1.0], gain).is_err());
        }
    }
}
