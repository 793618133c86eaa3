//! Detection of a wrong gyro unit: degrees per second stated as radians, or the reverse. Gravity
//! and the magnetic field then turn in the sensor 57 times slower or faster than the gyro.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{DEGREE, square};
use crate::attitude::GRAVITY;
use crate::attitude::sample::{MAX_FORCE, MAX_RATE};
use crate::math::validity::{are_within, is_size};

/// Time over which rotations are compared, s.
const COMPARISON_S: f64 = 10.0;
/// Largest factor by which a unit may differ from a wrong unit.
const WRONG_UNIT_TOLERANCE: f64 = 2.0;
/// Smallest squared correlation of gravity's rotation with the gyro, and smallest sum of its
/// squared changes, (m/s²)².
const MIN_CORRELATION_SQUARED: f64 = 0.36;
const MIN_CHANGE_SQUARED: f64 = 20.0;
/// Smallest squared correlation of the field, scaled to the size of gravity: only rotation and iron
/// change it.
const MIN_FIELD_CORRELATION_SQUARED: f64 = 0.25;
const MIN_FIELD_CHANGE_SQUARED: f64 = 0.5;
/// Smallest variation of the field's direction, as a share of its mean square, if rates are too
/// small; and smallest sum of the changes predicted by rates that are too large, (m/s²)².
const MIN_FIELD_SPREAD: f64 = 0.02;
const MIN_SAID_SQUARED: f64 = 100.0;
/// Smallest mean square of rates that are too large, (rad/s)².
const MIN_FAST_RATE_SQUARED: f64 = 100.0;
/// Largest squared share of the force in one direction, if rates are too small: acceleration alone
/// turns gravity less.
const MAX_ONE_WAY_SHARE_SQUARED: f64 = 0.64;
/// Smallest ratio of predicted to observed squared changes, for rates that are too large, about
/// their mean. A body that circles steadily has a constant force and rate. Its force exceeds
/// gravity by this squared ratio, unless it turns slower than this, (rad/s)².
const MIN_EXCESS_SQUARED: f64 = 20.0;
const MAX_FORCE_RATIO_SQUARED: f64 = 1.08;
const MIN_SPIN_RATE_SQUARED: f64 = 400.0;
/// Largest factor by which a right unit may differ, and sum of squares, (m/s²)², that proves it: no
/// further test is made.
const RIGHT_UNIT_TOLERANCE: f64 = 2.0;
const PROOF_CHANGE_SQUARED: f64 = 100.0;

/// Changes of a vector between ticks, and the changes predicted by the gyro: faded sums of
/// products.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Turns {
    /// Sums of products: observed with observed, predicted with predicted, and observed with
    /// predicted.
    seen: f64,
    said: f64,
    both: f64,
}

impl Turns {
    #[inline(always)]
    fn observe(&mut self, seen: &Vector3<f64>, said: &Vector3<f64>, kept: f64) {
        self.seen = kept * self.seen + seen.norm_squared();
        self.said = kept * self.said + said.norm_squared();
        self.both = kept * self.both + seen.dot(said);
    }

    fn are_alike(&self, correlation_squared: f64) -> bool {
        self.both > 0.0 && square(self.both) > correlation_squared * self.seen * self.said
    }

    /// True if the observed changes are this multiple of the predicted changes.
    fn is(&self, times: f64, tolerance: f64) -> bool {
        self.both > self.said * (times / tolerance) && self.both < self.said * (times * tolerance)
    }

    fn prove(&self) -> bool {
        self.is(1.0, RIGHT_UNIT_TOLERANCE)
            && self.seen > PROOF_CHANGE_SQUARED
            && self.are_alike(MIN_CORRELATION_SQUARED)
    }

    fn is_valid(&self) -> bool {
        let sizes = [(self.seen, 1e12), (self.said, 1e18), (self.both.abs(), 1e18)];
        sizes.iter().all(|(x, most)| is_size(*x, *most))
    }
}

/// Rotation of gravity and field in the sensor, compared with the gyro's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UnitWatch {
    /// Rate, force and field of the previous tick; no force and no field before the first.
    rate: Vector3<f64>,
    force: Vector3<f64>,
    field: Vector3<f64>,
    of_force: Turns,
    of_field: Turns,
    /// Sum of squares of the rates about their mean.
    varied: f64,
    /// Means of rate, force and field, of the squares of rate and force, and their weight.
    mean_rate: Vector3<f64>,
    mean: Vector3<f64>,
    mean_field: Vector3<f64>,
    fast: f64,
    square: f64,
    weight: f64,
    right: bool,
}

impl Default for UnitWatch {
    fn default() -> Self {
        let (zero, turns) = (Vector3::zeros(), Turns::default());
        Self {
            rate: zero,
            force: zero,
            field: zero,
            of_force: turns,
            of_field: turns,
            varied: 0.0,
            mean_rate: zero,
            mean: zero,
            mean_field: zero,
            fast: 0.0,
            square: 0.0,
            weight: 0.0,
            right: false,
        }
    }
}

impl UnitWatch {
    /// Notes a gap without samples.
    pub fn interrupt(&mut self) {
        (self.force, self.field) = (Vector3::zeros(), Vector3::zeros());
    }

    /// Processes the mean rate and force of a tick, and the direction of its field if it has
    /// changed.
    pub fn observe(
        &mut self,
        rate: &Vector3<f64>,
        force: &Vector3<f64>,
        field: Option<&Vector3<f64>>,
        span: f64,
    ) {
        let (last_rate, last) = (self.rate, self.force);
        (self.rate, self.force) = (*rate, *force);
        let field = field.map_or(Vector3::zeros(), |direction| direction * GRAVITY);
        let last_field = core::mem::replace(&mut self.field, field);
        if last == Vector3::zeros() {
            return;
        }
        let share = (span / COMPARISON_S).min(1.0);
        let kept = 1.0 - share;
        self.weight += share * (1.0 - self.weight);
        let (middle, mean) = ((force + last) * 0.5, (rate + last_rate) * (0.5 * span));
        self.of_force.observe(&(force - last), &middle.cross(&mean), kept);
        self.mean_rate += (rate - self.mean_rate) * share;
        let varied = mean - self.mean_rate * (span / self.weight);
        self.varied = kept * self.varied + middle.cross(&varied).norm_squared();
        self.fast += share * (rate.norm_squared() - self.fast);
        self.mean += (force - self.mean) * share;
        self.square += share * (force.norm_squared() - self.square);
        if field != Vector3::zeros() && last_field != Vector3::zeros() {
            let said = ((field + last_field) * 0.5).cross(&mean);
            self.of_field.observe(&(field - last_field), &said, kept);
            self.mean_field += (field - self.mean_field) * share;
        }
        // A field proves nothing: its mean over a tick is taken in a frame that the gyro turns.
        self.right = self.of_force.prove();
    }

    /// True if the unit of the gyro has been confirmed.
    #[inline(always)]
    pub fn is_right(&self) -> bool {
        self.right
    }

    /// True if the unit of the gyro is wrong.
    pub fn is_wrong(&self) -> bool {
        self.is_wrong_by_force() || self.is_wrong_by_field() || self.is_too_large()
    }

    fn is_wrong_by_force(&self) -> bool {
        let turns = &self.of_force;
        if !turns.are_alike(MIN_CORRELATION_SQUARED) || turns.seen < MIN_CHANGE_SQUARED {
            return false;
        }
        turns.is(DEGREE, WRONG_UNIT_TOLERANCE) && self.fast > MIN_FAST_RATE_SQUARED
            || turns.is(1.0 / DEGREE, WRONG_UNIT_TOLERANCE)
                && self.mean.norm_squared() < MAX_ONE_WAY_SHARE_SQUARED * self.square
    }

    fn is_wrong_by_field(&self) -> bool {
        let turns = &self.of_field;
        if !turns.are_alike(MIN_FIELD_CORRELATION_SQUARED) || turns.seen < MIN_FIELD_CHANGE_SQUARED
        {
            return false;
        }
        let one_way = square(GRAVITY * self.weight) * (1.0 - MIN_FIELD_SPREAD);
        turns.is(DEGREE, WRONG_UNIT_TOLERANCE) && turns.said > MIN_SAID_SQUARED
            || turns.is(1.0 / DEGREE, WRONG_UNIT_TOLERANCE)
                && self.mean_field.norm_squared() < one_way
    }

    /// True if the force is constant although rates change more than any body allows.
    fn is_too_large(&self) -> bool {
        let most = square(GRAVITY) * MAX_FORCE_RATIO_SQUARED * self.weight;
        self.varied > MIN_SAID_SQUARED.max(MIN_EXCESS_SQUARED * self.of_force.seen)
            && (self.fast > MIN_SPIN_RATE_SQUARED || self.square < most)
    }

    pub fn is_valid(&self) -> bool {
        let fields = [self.field, self.mean_field];
        self.of_force.is_valid()
            && self.of_field.is_valid()
            && is_size(self.varied, 1e18)
            && is_size(self.fast, 4.0 * MAX_RATE * MAX_RATE)
            && is_size(self.square, 4.0 * MAX_FORCE * MAX_FORCE)
            && is_size(self.weight, 1.0)
            && [self.rate, self.mean_rate].iter().all(|v| are_within(v, 2.0 * MAX_RATE))
            && [self.force, self.mean].iter().all(|v| are_within(v, 2.0 * MAX_FORCE))
            && fields.iter().all(|v| are_within(v, 2.0 * GRAVITY))
    }
}
