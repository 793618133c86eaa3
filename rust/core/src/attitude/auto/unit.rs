//! A gyro in degrees a second that is given in radians, or the other way round: gravity turns in the
//! sensor by 57 times less than it says, or more.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{DEGREE, square};
use crate::attitude::sample::{FORCE_MAX, RATE_MAX};
use crate::math::sound::{are_within, is_size};

/// Seconds over which turns are compared.
const MEMORY: f64 = 10.0;
/// Times by which a unit may seem larger or smaller than one that is wrong.
const NEAR: f64 = 2.0;
/// Square of the least correlation of what gravity does with what the gyro says, and the least sum of the
/// squares of its changes, (m/s²)².
const ALIKE: f64 = 0.36;
const SEEN: f64 = 20.0;
/// Least mean square of rates too large, (rad/s)².
const FAST: f64 = 100.0;
/// Square of the largest share of the force that points one way, where rates are too small: what only
/// speeds up turns gravity by less.
const ONE_WAY: f64 = 0.64;
/// Times by which a right unit may seem another one, and the sum of squares, (m/s²)², that proves it: then
/// nobody looks again.
const RIGHT: f64 = 2.0;
const PROVEN: f64 = 100.0;

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
        let share = (span / MEMORY).min(1.0);
        let kept = 1.0 - share;
        self.seen = kept * self.seen + seen.norm_squared();
        self.said = kept * self.said + said.norm_squared();
        self.both = kept * self.both + seen.dot(&said);
        self.fast += share * (rate.norm_squared() - self.fast);
        self.mean += (force - self.mean) * share;
        self.square += share * (force.norm_squared() - self.square);
        let is_one = self.both > self.said / RIGHT && self.both < self.said * RIGHT;
        self.right = is_one && self.seen > PROVEN && self.is_alike();
    }

    /// Whether the unit of the gyro was seen to be the one said.
    #[inline(always)]
    pub fn is_right(&self) -> bool {
        self.right
    }

    fn is_alike(&self) -> bool {
        self.both > 0.0 && square(self.both) > ALIKE * self.seen * self.said
    }

    /// Whether the unit of the gyro is not the one said.
    pub fn is_wrong(&self) -> bool {
        if !self.is_alike() || self.seen < SEEN {
            return false;
        }
        let unit = self.both / self.said;
        let is = |times: f64| unit > times / NEAR && unit < times * NEAR;
        is(DEGREE) && self.fast > FAST
            || is(1.0 / DEGREE) && self.mean.norm_squared() < ONE_WAY * self.square
    }

    pub fn is_sound(&self) -> bool {
        let sizes = [(self.seen, 1e12), (self.said, 1e18), (self.both.abs(), 1e18)];
        sizes.iter().all(|(x, most)| is_size(*x, *most))
            && is_size(self.fast, 4.0 * RATE_MAX * RATE_MAX)
            && is_size(self.square, 4.0 * FORCE_MAX * FORCE_MAX)
            && are_within(&self.rate, 2.0 * RATE_MAX)
            && [self.force, self.mean].iter().all(|v| are_within(v, 2.0 * FORCE_MAX))
    }
}
