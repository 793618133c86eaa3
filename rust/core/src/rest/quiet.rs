//! A quiet body: means of ticks of its gyro and its accelerometer are constant, for any samples.
//! This detects rest in physical units, live and in a record.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::math::validity::{are_within, is_size};

/// Number of ticks for the first direction of gravity, and gain of each tick in the last direction.
pub const FIRST_DIRECTION_TICKS: f64 = 5.0;
pub const LAST_DIRECTION_GAIN: f64 = 0.2;

/// Limits of ticks' means at rest, rad/s and m/s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuietLimits {
    /// Largest spread of the rate, as norm of the three axes. It limits the standard deviation, and
    /// half the distance of a tick from the mean.
    pub gyro: f64,
    /// Largest spread of the force, defined as for the rate.
    pub accel: f64,
    /// Largest change of gravity's direction, as a force. It detects a slow rotation about a level
    /// axis.
    pub turned: f64,
}

/// Ticks in a row with constant means, in the sensor's axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Quiet {
    pub ticks: f64,
    pub seconds: f64,
    pub gyro: Vector3<f64>,
    pub accel: Vector3<f64>,
    /// Sums of squared distances from the means.
    gyro_squares: f64,
    accel_squares: f64,
    /// Direction of gravity at the beginning and now.
    first: Vector3<f64>,
    last: Vector3<f64>,
}

impl Default for Quiet {
    fn default() -> Self {
        let zero = Vector3::zeros();
        Self {
            ticks: 0.0,
            seconds: 0.0,
            gyro: zero,
            accel: zero,
            gyro_squares: 0.0,
            accel_squares: 0.0,
            first: zero,
            last: zero,
        }
    }
}

impl Quiet {
    /// True if a tick's distance from the mean means another rest, or motion.
    #[inline(always)]
    pub fn is_left(&self, gyro: &Vector3<f64>, accel: &Vector3<f64>, limits: &QuietLimits) -> bool {
        let far = |one: &Vector3<f64>, mean: &Vector3<f64>, most: f64| {
            (one - mean).norm_squared() > 4.0 * most * most
        };
        far(gyro, &self.gyro, limits.gyro) || far(accel, &self.accel, limits.accel)
    }

    /// Adds a tick of this duration, s.
    #[inline(always)]
    pub fn add(&mut self, gyro: &Vector3<f64>, accel: &Vector3<f64>, span: f64) {
        self.ticks += 1.0;
        self.seconds += span;
        for (value, mean, squares) in [
            (gyro, &mut self.gyro, &mut self.gyro_squares),
            (accel, &mut self.accel, &mut self.accel_squares),
        ] {
            let before = value - *mean;
            *mean += before * (1.0 / self.ticks);
            *squares += before.dot(&(value - *mean)).max(0.0);
        }
        if self.ticks <= FIRST_DIRECTION_TICKS {
            (self.first, self.last) = (self.accel, self.accel);
        } else {
            self.last += (accel - self.last) * LAST_DIRECTION_GAIN;
        }
    }

    /// True if the ticks vary more, or gravity has turned further, than at rest.
    #[inline(always)]
    pub fn is_restless(&self, limits: &QuietLimits) -> bool {
        self.gyro_spread() > limits.gyro * limits.gyro
            || self.accel_spread() > limits.accel * limits.accel
            || (self.last - self.first).norm_squared() > limits.turned * limits.turned
    }

    /// Mean squares of the distances from the means, (rad/s)² and (m/s²)².
    pub fn gyro_spread(&self) -> f64 {
        self.gyro_squares / (self.ticks - 1.0).max(1.0)
    }

    pub fn accel_spread(&self) -> f64 {
        self.accel_squares / (self.ticks - 1.0).max(1.0)
    }

    /// True if ticks of rates and forces within these sizes can have led to this state.
    pub fn is_valid(&self, rates: f64, forces: f64) -> bool {
        is_size(self.ticks, 1e15)
            && is_size(self.seconds, 2.0 * self.ticks)
            && are_within(&self.gyro, rates)
            && [self.accel, self.first, self.last].iter().all(|v| are_within(v, forces))
            && is_size(self.gyro_squares, 1e15)
            && is_size(self.accel_squares, 1e15)
    }
}

/// Returns the longest quiet stretch of a record: its first tick and its end (exclusive). They are
/// equal if there is none.
///
/// `means` are mean rate and force in each tick, rad/s and m/s². A mean that is not finite is
/// missing and ends a stretch. A mean rate beyond `bias` is no rest.
pub fn longest_quiet(means: &[[f64; 6]], limits: &QuietLimits, bias: f64) -> (usize, usize) {
    let mut longest = (0, 0);
    let (mut quiet, mut first) = (Quiet::default(), 0);
    for (k, &[x, y, z, a, b, c]) in means.iter().enumerate() {
        let (gyro, accel) = (Vector3::new(x, y, z), Vector3::new(a, b, c));
        let known = gyro.iter().chain(accel.iter()).all(|x| x.is_finite());
        if known && quiet.is_left(&gyro, &accel, limits) {
            (quiet, first) = (Quiet::default(), k);
        }
        quiet.add(&gyro, &accel, 1.0);
        if !known || quiet.is_restless(limits) {
            (quiet, first) = (Quiet::default(), k + 1);
        } else if quiet.gyro.norm() <= bias && k + 1 - first > longest.1 - longest.0 {
            longest = (first, k + 1);
        }
    }
    longest
}

#[cfg(test)]
mod tests {
    use core::array::from_fn;

    use super::{QuietLimits, longest_quiet};

    const LIMITS: QuietLimits = QuietLimits { gyro: 0.01, accel: 0.1, turned: 0.1 };

    fn still(rate: f64) -> [f64; 6] {
        [rate, 0.0, 0.0, 0.0, 0.0, 9.81]
    }

    #[test]
    fn the_longest_of_two_levels_is_found_and_a_turn_is_none() {
        let means: [_; 66] = from_fn(|k| match k {
            0..7 => still(0.02),
            7..27 => still(0.1 * (k - 7) as f64),
            27..36 => still(0.03),
            // A level larger than any bias.
            _ => still(0.5),
        });
        assert_eq!(longest_quiet(&means[..36], &LIMITS, 0.2), (27, 36));
        assert_eq!(longest_quiet(&means, &LIMITS, 0.2), (27, 36));
    }

    #[test]
    fn what_is_missing_ends_it_and_gravity_may_not_turn() {
        let mut means = [still(0.0); 10];
        means[4][5] = f64::NAN;
        assert_eq!(longest_quiet(&means, &LIMITS, 0.2), (5, 10));
        let leaning: [_; 40] = from_fn(|k| [0.0, 0.0, 0.0, 0.01 * k as f64, 0.0, 9.81]);
        let (first, last) = longest_quiet(&leaning, &LIMITS, 0.2);
        assert!(last - first < 25, "{first} {last}");
        assert_eq!(longest_quiet(&[], &LIMITS, 0.2), (0, 0));
    }
}
