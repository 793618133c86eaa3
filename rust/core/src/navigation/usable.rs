//! Verdict on each output: usable while its standard deviation is below a limit.

use super::covariance::{Errors, PHI, R, V};
use crate::error::{Error, require};

/// Outputs with a verdict, in the order of their bits.
pub const OUTPUTS: [&str; 5] = ["position", "height", "velocity", "attitude", "heading"];

/// Square of the share of the limit below which a lost output is usable again.
const RETURN_SHARE_SQUARED: f64 = 0.49;

/// Largest standard deviation of each output: horizontal position and height, m, velocity, m/s,
/// roll and pitch, and heading, rad.
pub type Limits = [f64; OUTPUTS.len()];

/// Limits of an unspecified vehicle.
pub const LIMITS: Limits = [10.0, 10.0, 1.0, 0.05, 0.17];
/// Limits of a vehicle on wheels.
pub const WHEELED_LIMITS: Limits = [5.0, 5.0, 0.5, 0.05, 0.1];

/// Bits of the usable outputs, from the previous bits and the variances of the errors.
#[inline(always)]
pub(crate) fn judge(before: u8, variances: &Errors, limits: &Limits) -> u8 {
    let v = variances;
    let sizes =
        [v[R] + v[R + 1], v[R + 2], v[V] + v[V + 1] + v[V + 2], v[PHI] + v[PHI + 1], v[PHI + 2]];
    let mut usable = 0;
    for (k, (size, limit)) in sizes.into_iter().zip(limits).enumerate() {
        let share = if before >> k & 1 == 1 { 1.0 } else { RETURN_SHARE_SQUARED };
        usable |= u8::from(size <= share * limit * limit) << k;
    }
    usable
}

/// # Errors
/// [`Error::Parameter`] if a limit is not positive.
pub(crate) fn validate(limits: &Limits) -> Result<(), Error> {
    for limit in limits {
        require(*limit > 0.0, "limits", "positive numbers", *limit)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{LIMITS, judge};
    use crate::navigation::covariance::STATES;

    #[test]
    fn an_output_returns_below_seven_tenths_of_its_limit() {
        let mut usable = 0;
        for (part, expected) in [(0.9, 0), (0.69, 31), (0.99, 31), (1.01, 0), (0.71, 0), (0.5, 31)]
        {
            let mut variances = [0.0; STATES];
            for (first, count, limit) in [(0, 2, 0), (2, 1, 1), (3, 3, 2), (6, 2, 3), (8, 1, 4)] {
                let size = (part * LIMITS[limit]).powi(2) / f64::from(count);
                variances[first..first + count as usize].fill(size);
            }
            usable = judge(usable, &variances, &LIMITS);
            assert_eq!(usable, expected, "{part}");
        }
    }
}
