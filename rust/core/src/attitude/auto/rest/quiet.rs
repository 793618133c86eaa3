//! A rest of seconds, with motors running perhaps: means of ticks stand still, whatever the samples do.

use core::ops::Deref;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{DEGREE, Seen};
use crate::attitude::sample::{MAX_FORCE, MAX_RATE};
use crate::math::validity::{are_within, is_size};
use crate::rest::quiet::{Quiet, QuietLimits};

/// Largest spread of ticks' means at rest, over the three axes: rad/s and m/s².
pub const MAX_GYRO_SPREAD_RAD_S: f64 = 0.5 * DEGREE;
pub const MAX_ACCEL_SPREAD_M_S2: f64 = 0.15;
/// Largest rotation of gravity at rest, m/s²: a slow rotation about a level axis.
const MAX_GRAVITY_TURN_M_S2: f64 = 0.12;
const LIMITS: QuietLimits = QuietLimits {
    gyro: MAX_GYRO_SPREAD_RAD_S,
    accel: MAX_ACCEL_SPREAD_M_S2,
    turned: MAX_GRAVITY_TURN_M_S2,
};
/// Seconds by which the last direction of gravity is behind, how many times further a turn would have
/// rotated it, and the least share of a jump that is about level axes.
const DIRECTION_DELAY_S: f64 = 0.8;
const MIN_TURN_RATIO: f64 = 3.0;
const MIN_LEVEL_SHARE: f64 = 0.2;
/// Density of the mean of a tick, rad/s √s, of a gyro that nothing shakes, and its share of what
/// shakes it: a gyro rectifies vibration.
pub const RATE_NOISE: f64 = 0.04 * DEGREE;
const RECTIFIED_SHARE: f64 = 0.05;
/// Slowest rotation that is distinguished from a rest of one second, rad/s.
const SLOW_TURN_RAD_S: f64 = 0.1 * DEGREE;
/// Seconds after which its mean is measured; each tick after the last.
const MEASURED_AFTER_S: [f64; 3] = [0.5, 1.0, 2.0];

/// Ticks in a row that may be rest, and what of them was measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    quiet: Quiet,
    /// Sum of the weights of the ticks, s³/rad², and the mean rate by them.
    weight: f64,
    weighted: Vector3<f64>,
    /// Number of its means that are measured.
    measured: u8,
}

impl Default for Candidate {
    fn default() -> Self {
        let (quiet, weighted) = (Quiet::default(), Vector3::zeros());
        Self { quiet, weight: 0.0, weighted, measured: 0 }
    }
}

impl Deref for Candidate {
    type Target = Quiet;

    fn deref(&self) -> &Quiet {
        &self.quiet
    }
}

impl Candidate {
    /// Takes a tick; returns whether it is the first, or none is left.
    #[inline(always)]
    pub fn observe(&mut self, seen: &Seen) -> bool {
        if self.quiet.is_left(&seen.gyro, &seen.accel, &LIMITS) {
            *self = Self::default();
        }
        self.add(seen);
        if self.quiet.is_restless(&LIMITS) {
            *self = Self::default();
        }
        self.ticks <= 1.0
    }

    #[inline(always)]
    fn add(&mut self, seen: &Seen) {
        self.quiet.add(&seen.gyro, &seen.accel, seen.span);
        let weight = seen.span / seen.noise();
        self.weight += weight;
        if self.weight > 0.0 {
            self.weighted += (seen.gyro - self.weighted) * (weight / self.weight);
        }
    }

    /// True if it has lasted for long enough to be one.
    pub fn lasts(&self) -> bool {
        self.seconds >= MEASURED_AFTER_S[0] * (1.0 - 1e-9)
    }

    /// True if nothing of it was measured.
    pub fn is_new(&self) -> bool {
        self.measured == 0
    }

    /// The bias that it measures after this tick, and the variance: its means after half a second,
    /// one and two, in which a slow rotation shows sixteen times less from one to the next, and
    /// then every tick.
    pub fn measure(&mut self, seen: &Seen) -> Option<(Vector3<f64>, f64)> {
        let due =
            MEASURED_AFTER_S.iter().filter(|time| self.seconds >= **time * (1.0 - 1e-9)).count()
                as u8;
        if due > self.measured {
            self.measured = due;
            let slow = SLOW_TURN_RAD_S / (self.seconds * self.seconds);
            return Some((self.weighted, 1.0 / self.weight + slow * slow));
        }
        (due == MEASURED_AFTER_S.len() as u8).then(|| (seen.gyro, seen.noise() / seen.span))
    }

    /// True if its level is not the bias, but no turn either: about a level axis that would have
    /// rotated gravity. A jump of the bias shows about all axes.
    pub fn refutes_lean(&self, bias: &Vector3<f64>) -> bool {
        let off = self.gyro - bias;
        let leans = self.level_part(&off);
        self.is_long() && leans > MIN_LEVEL_SHARE * off.norm() && self.would_rotate_gravity(leans)
    }

    /// True if gravity proves the part of its level about level axes to be no turn.
    pub fn refutes_level_turn(&self) -> bool {
        self.would_rotate_gravity(self.level_part(&self.gyro))
    }

    /// True if it has lasted until a turn would show.
    pub fn is_long(&self) -> bool {
        self.seconds >= MEASURED_AFTER_S[2] * (1.0 - 1e-9)
    }

    /// Up in the axes of the sensor.
    pub fn up(&self) -> Vector3<f64> {
        self.accel * (1.0 / self.accel.norm().max(MAX_GRAVITY_TURN_M_S2))
    }

    fn level_part(&self, rate: &Vector3<f64>) -> f64 {
        let up = self.up();
        (rate - up * rate.dot(&up)).norm()
    }

    /// True if a turn at this rate about a level axis would have rotated gravity.
    fn would_rotate_gravity(&self, rate: f64) -> bool {
        rate * (self.seconds - DIRECTION_DELAY_S) * self.accel.norm()
            > MIN_TURN_RATIO * MAX_GRAVITY_TURN_M_S2
    }

    /// All of its means count as measured.
    pub fn is_known(&mut self) {
        self.measured = MEASURED_AFTER_S.len() as u8;
    }

    pub fn is_valid(&self) -> bool {
        self.quiet.is_valid(2.0 * MAX_RATE, 2.0 * MAX_FORCE)
            && are_within(&self.weighted, 2.0 * MAX_RATE)
            && is_size(self.weight, 1e24)
            && usize::from(self.measured) <= MEASURED_AFTER_S.len()
    }
}

impl Seen {
    /// Density of the noise of the mean rate, (rad/s)² s: a shaken gyro's is larger.
    pub fn noise(&self) -> f64 {
        RATE_NOISE * RATE_NOISE + RECTIFIED_SHARE * RECTIFIED_SHARE * self.vibration
    }
}
