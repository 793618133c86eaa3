//! Invariants of the filter's state; bytes that violate them are refused.

use nalgebra::{Matrix3, Vector3};

use super::covariance::{BAROMETER, COMPASS, CONSTANTS, ConstantsCovariance, Covariance, STATES};
use super::earth::{MAX_HEIGHT, MAX_LATITUDE};
use super::filter::{FixCounts, MAX_SAMPLE, MAX_SIZES, NavigationFilter, Sensors, Sums};
use super::innovation_gate::MAX_INNOVATION;
use super::motion::Motion;
use super::odometer::{MAX_CONSTANT, MAX_SPEED, Odometer, Rolled};
use super::params::{MAX_BIAS, MAX_LEVER};
use super::usable::OUTPUTS;
use crate::checkpoint::Checkpoint;
use crate::math::Symmetric;
use crate::math::validity::{are_within, is_count, is_size, is_whole, is_within};

impl Checkpoint for NavigationFilter {
    const TAG: &'static str = "navigation";
    const VERSION: u16 = 7;

    fn is_valid(&self) -> bool {
        let chosen = self.params.validate().is_ok() && self.start.validate().is_ok();
        let sigma = |x: &f64| if self.navigating { is_size(*x, 1e8) } else { x.is_nan() };
        chosen
            && self.motion.is_valid()
            && are_within(&self.gyro_bias, MAX_BIAS)
            && are_within(&self.accel_bias, MAX_BIAS)
            && self.covariance.is_valid()
            && self.covariance.considers_antenna()
                == (self.params.consider_antenna && self.params.has_antenna_sigma())
            && self.sigma.iter().all(sigma)
            && self.gates.iter().all(|gate| gate.is_valid())
            && self.sensors.is_valid()
            && self.sums.is_valid()
            && self.before.is_none_or(|before| before.is_valid())
            && (!self.navigating || (self.heading_known && self.sensors.time.is_finite()))
            && is_size(self.alone, MAX_TIME)
            && is_size(self.wheels, MAX_TIME)
            && self.odometer.is_valid()
            && are_within(&self.antenna, MAX_LEVER)
            && (self.last_used.is_nan() || is_within(self.last_used, self.sensors.time))
            && is_count(self.sensors.samples)
            && self.fixes.is_valid()
            && self.aids.is_valid()
            && (!self.aids.has_started() || (self.heading_known && !self.navigating))
            && usize::from(self.usable) < 1 << OUTPUTS.len()
            && (self.navigating || self.usable == 0)
    }
}

impl FixCounts {
    fn is_valid(&self) -> bool {
        let [at, by] = self.last_move;
        let counts = [self.used, self.rejected, self.refused, self.moved];
        let moved = is_within(at, MAX_TIME) && is_size(by, 2.0 * MAX_INNOVATION);
        counts.into_iter().chain(self.rejected_of).all(is_count)
            && if self.moved > 0 { moved } else { at.is_nan() && by.is_nan() }
    }
}

const MAX_TIME: f64 = 4e9;
/// Longest time between two steps of the covariance, s: a step and a sample.
const MAX_STEP: f64 = 2.5;

impl Motion {
    fn is_valid(&self) -> bool {
        let square = self.attitude.transpose() * self.attitude - Matrix3::identity();
        // The norm is invariant under rotation.
        is_size(square.norm_squared(), 1e-6)
            && self.attitude.determinant() > 0.0
            && are_within(&self.velocity, 2e5)
            && are_within(&self.acceleration, 1e9)
            && is_within(self.latitude, MAX_LATITUDE + 0.1)
            && is_within(self.longitude, 10.0)
            && is_within(self.height, 2.0 * MAX_HEIGHT)
            && self.local_earth.is_valid()
    }
}

impl Covariance {
    /// True if the matrix is symmetric and semidefinite. A matrix that is valid only pair by pair
    /// may give a negative variance at the next measurement.
    pub(super) fn is_valid(&self) -> bool {
        let symmetric = |i: usize| (0..=i).all(|j| is_same(self.at(i, j), self.at(j, i)));
        let upper = Symmetric::<f64, STATES>::from_upper(|i, j| self.at(i, j));
        (0..STATES).all(|i| symmetric(i) && self.at(i, STATES) == 0.0)
            && upper.is_covariance(10.0 * MAX_SIZES[0])
            && self.1.is_none_or(|extra| self.goes_with(&extra))
    }

    fn goes_with(&self, extra: &ConstantsCovariance) -> bool {
        let of = |i: usize, j: usize| match (i < STATES, j < STATES) {
            (true, true) => self.at(i, j),
            (true, false) => extra.cross[j - STATES][i],
            (false, true) => extra.cross[i - STATES][j],
            (false, false) => extra.own[i - STATES][j - STATES],
        };
        let symmetric = |i: usize| (0..i).all(|j| is_same(extra.own[i][j], extra.own[j][i]));
        let whole = Symmetric::<f64, { STATES + CONSTANTS }>::from_upper(of);
        whole.is_covariance(10.0 * MAX_SIZES[0])
            && (0..CONSTANTS).all(|k| symmetric(k) && extra.cross[k][STATES] == 0.0)
            && extra.found == [0.0; CONSTANTS]
            && (extra.aided || !(extra.has(BAROMETER) || extra.has(COMPASS)))
    }
}

/// True if the two numbers are bit-identical: zeros of different sign differ.
fn is_same(one: f64, other: f64) -> bool {
    one.to_bits() == other.to_bits()
}

impl Odometer {
    fn is_valid(&self) -> bool {
        let Rolled { count, speed, variance, velocity, rate } = self.sums;
        self.constants.iter().all(|x| is_within(*x, MAX_CONSTANT))
            && self.slips.is_none_or(|since| is_within(since, MAX_TIME))
            && is_whole(count, 1e12)
            && is_within(speed, MAX_SPEED * count)
            && is_size(variance, MAX_SPEED * MAX_SPEED * count)
            && are_within(&velocity, 2e9 * count)
            && are_within(&rate, 2.0 * MAX_SAMPLE * count)
    }
}

impl Sensors {
    fn is_valid(&self) -> bool {
        let rates = are_within(&self.gyro, MAX_SAMPLE) && are_within(&self.accel, MAX_SAMPLE);
        let time =
            if self.samples > 0 { is_within(self.time, MAX_TIME) } else { self.time.is_nan() };
        rates && time && is_size(self.gyro_age, MAX_TIME) && is_size(self.accel_age, MAX_TIME)
    }
}

impl Sums {
    fn is_valid(&self) -> bool {
        let n = self.samples;
        let rates = Vector3::from_element(2.0 * MAX_SAMPLE * n);
        is_size(self.seconds, MAX_STEP)
            && is_whole(n, 1e12)
            && is_size(self.rest_samples, n)
            && (n > 0.0) == (self.seconds > 0.0)
            && are_within(&self.attitude, 2.0 * n)
            && are_within(&self.velocity, 4e5 * n)
            && are_within(&self.gyro, rates.x)
            && self.vibration.iter().all(|x| is_size(*x, 4.0 * MAX_SAMPLE * MAX_SAMPLE * n))
            && self.unknown.iter().all(|x| is_size(*x, self.seconds * 1.001))
    }
}

#[cfg(test)]
mod tests {
    use super::super::covariance::{Covariance, STATES};
    use super::super::filter::Sums;
    use super::super::motion::{Motion, rotation};
    use super::super::odometer::{Odometer, Rolled};
    use nalgebra::{Matrix3, Vector3};

    #[test]
    fn no_turn_hides_or_shows_a_stretch() {
        for (stretch, valid) in [(4e-4, true), (6e-4, false)] {
            let stretched = Matrix3::from_diagonal(&Vector3::new(1.0 + stretch, 1.0, 1.0));
            for angle in [0.0, 0.4, 0.8, 2.0] {
                let turn = rotation(&Vector3::new(0.3 * angle, -angle, 0.5 * angle));
                for attitude in [turn * stretched, stretched * turn] {
                    assert_eq!(Motion::new(attitude, 0.8, 3.1, 100.0).is_valid(), valid);
                }
            }
        }
    }

    #[test]
    fn pairs_that_do_not_fit_together_are_no_covariance() {
        let mut p = Covariance::of(&[1.0; STATES]);
        for (i, j) in [(3, 6), (6, 8), (3, 8)] {
            (p.0[i][j], p.0[j][i]) = (0.9, 0.9);
        }
        assert!(p.is_valid());
        p.0[3][8] = -0.9;
        assert!(!p.is_valid());
        p.0[8][3] = -0.9;
        assert!(!p.is_valid());
    }

    #[test]
    fn zeros_of_two_signs_are_not_symmetric() {
        let mut p = Covariance::of(&[1.0; STATES]);
        p.0[3][8] = -0.0;
        assert!(!p.is_valid());
        p.0[8][3] = -0.0;
        assert!(p.is_valid());
    }

    #[test]
    fn a_count_that_is_no_whole_number_counts_nothing() {
        for (count, valid) in [(0.0, true), (1.0, true), (0.5, false), (5e-315, false)] {
            let sums = Rolled { count, ..Rolled::default() };
            assert_eq!(Odometer { sums, ..Odometer::default() }.is_valid(), valid, "{count}");
            let seconds = if count > 0.0 { 0.01 } else { 0.0 };
            assert_eq!(
                Sums { samples: count, seconds, ..Sums::new() }.is_valid(),
                valid,
                "{count}"
            );
        }
    }
}
