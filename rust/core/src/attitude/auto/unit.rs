//! A gyro in degrees a second that is given in radians, or the other way round: gravity turns in the
//! sensor by 57 times less than it says, or more.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{DEGREE, square};
use crate::attitude::sample::{MAX_FORCE, MAX_RATE};
use crate::math::validity::{are_within, is_size};

/// Seconds over which turns are compared.
const COMPARISON_S: f64 = 10.0;
/// Times by which a unit may seem larger or smaller than one that is wrong.
const WRONG_UNIT_TOLERANCE: f64 = 2.0;
/// Square of the least correlation of what gravity does with what the gyro says, and the least sum of the
/// squares of its changes, (m/s²)².
const MIN_CORRELATION_SQUARED: f64 = 0.36;
const MIN_CHANGE_SQUARED: f64 = 20.0;
/// Least mean square of rates too large, (rad/s)².
const MIN_FAST_RATE_SQUARED: f64 = 100.0;
/// Square of the largest share of the force that points one way, where rates are too small: what only
/// speeds up turns gravity by less.
const MAX_ONE_WAY_SHARE_SQUARED: f64 = 0.64;
/// Times by which a right unit may seem another one, and the sum of squares, (m/s²)², that proves it: then
/// nobody looks again.
const RIGHT_UNIT_TOLERANCE: f64 = 2.0;
const PROOF_CHANGE_SQUARED: f64 = 100.0;

/// Changes of the force from tick to tick, and those that the gyro says.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UnitWatch {
    /// Rate and force of the tick before; no force before the first.
    rate: Vector3<f64>,
    force: Vector3<f64>,
    /// Faded sums of products: seen with itself, said with itself, both.
    seen: f64,
    said: f64,
    both: f64,
    /// Means of the rate's square, the force and its square.
    fast: f64,
    mean: Vector3<f64>,
    square: f64,
    right: bool,
}

impl Default for UnitWatch {
    fn default() -> Self {
        let zero = Vector3::zeros();
        let [seen, said, both, fast, square] = [0.0; 5];
        Self { rate: zero, force: zero, seen, said, both, fast, mean: zero, square, right: false }
    }
}

impl UnitWatch {
    /// Nothing is known of a while.
    pub fn interrupt(&mut self) {
        self.force = Vector3::zeros();
    }

    /// Takes the mean rate and force of a tick.
    pub fn observe(&mut self, rate: &Vector3<f64>, force: &Vector3<f64>, span: f64) {
        let (last_rate, last) = (self.rate, self.force);
        (self.rate, self.force) = (*rate, *force);
        if last == Vector3::zeros() {
            return;
        }
        let seen = force - last;
        let said = (force + last).cross(&(rate + last_rate)) * (0.25 * span);
        let share = (span / COMPARISON_S).min(1.0);
        let kept = 1.0 - share;
        self.seen = kept * self.seen + seen.norm_squared();
        self.said = kept * self.said + said.norm_squared();
        self.both = kept * self.both + seen.dot(&said);
        self.fast += share * (rate.norm_squared() - self.fast);
        self.mean += (force - self.mean) * share;
        self.square += share * (force.norm_squared() - self.square);
        let is_one = self.both > self.said / RIGHT_UNIT_TOLERANCE
            && self.both < self.said * RIGHT_UNIT_TOLERANCE;
        self.right = is_one && self.seen > PROOF_CHANGE_SQUARED && self.is_alike();
    }

    /// Whether the unit of the gyro was seen to be the one said.
    #[inline(always)]
    pub fn is_right(&self) -> bool {
        self.right
    }

    fn is_alike(&self) -> bool {
        self.both > 0.0 && square(self.both) > MIN_CORRELATION_SQUARED * self.seen * self.said
    }

    /// Whether the unit of the gyro is not the one said.
    pub fn is_wrong(&self) -> bool {
        if !self.is_alike() || self.seen < MIN_CHANGE_SQUARED {
            return false;
        }
        let unit = self.both / self.said;
        let is =
            |times: f64| unit > times / WRONG_UNIT_TOLERANCE && unit < times * WRONG_UNIT_TOLERANCE;
        is(DEGREE) && self.fast > MIN_FAST_RATE_SQUARED
            || is(1.0 / DEGREE)
                && self.mean.norm_squared() < MAX_ONE_WAY_SHARE_SQUARED * self.square
    }

    pub fn is_valid(&self) -> bool {
        let sizes = [(self.seen, 1e12), (self.said, 1e18), (self.both.abs(), 1e18)];
        sizes.iter().all(|(x, most)| is_size(*x, *most))
            && is_size(self.fast, 4.0 * MAX_RATE * MAX_RATE)
            && is_size(self.square, 4.0 * MAX_FORCE * MAX_FORCE)
            && are_within(&self.rate, 2.0 * MAX_RATE)
            && [self.force, self.mean].iter().all(|v| are_within(v, 2.0 * MAX_FORCE))
    }
}
