//! A rest of seconds, possibly with motors running: means of ticks are constant, samples may vary.

use core::ops::Deref;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{DEGREE, Seen};
use crate::attitude::sample::{MAX_FORCE, MAX_RATE};
use crate::math::validity::{are_within, is_size};
use crate::rest::quiet::{Quiet, QuietLimits};

/// Largest spread of ticks' means at rest over the three axes, rad/s and m/s².
pub const MAX_GYRO_SPREAD_RAD_S: f64 = 0.5 * DEGREE;
pub const MAX_ACCEL_SPREAD_M_S2: f64 = 0.15;
/// Largest rotation of gravity at rest, m/s²: a slow rotation about a level axis.
const MAX_GRAVITY_TURN_M_S2: f64 = 0.12;
const LIMITS: QuietLimits = QuietLimits {
    gyro: MAX_GYRO_SPREAD_RAD_S,
    accel: MAX_ACCEL_SPREAD_M_S2,
    turned: MAX_GRAVITY_TURN_M_S2,
};
/// Delay of the last direction of gravity, s; ratio to the limit by which a rotation would have
/// turned gravity; and smallest share of a jump about level axes.
const DIRECTION_DELAY_S: f64 = 0.8;
const MIN_TURN_RATIO: f64 = 3.0;
const MIN_LEVEL_SHARE: f64 = 0.2;
/// Noise density of a tick's mean for a gyro without vibration, rad/s √s, and its share of the
/// vibration: a gyro rectifies vibration.
pub const RATE_NOISE: f64 = 0.04 * DEGREE;
const RECTIFIED_SHARE: f64 = 0.05;
/// Slowest rotation that is distinguished from a rest of one second, rad/s.
const SLOW_TURN_RAD_S: f64 = 0.1 * DEGREE;
/// Times after which the mean is measured, s; after the last, at each tick.
const MEASURED_AFTER_S: [f64; 3] = [0.5, 1.0, 2.0];

/// Ticks in a row that may be rest, and their measurements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    quiet: Quiet,
    /// Sum of the weights of the ticks, s³/rad², and weighted mean rate.
    weight: f64,
    weighted: Vector3<f64>,
    /// Number of measured means.
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
    /// Processes a tick; returns whether it is the first, or none is left.
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

    /// True if it has lasted long enough for a rest.
    pub fn lasts(&self) -> bool {
        self.seconds >= MEASURED_AFTER_S[0] * (1.0 - 1e-9)
    }

    /// True if no mean was measured.
    pub fn is_new(&self) -> bool {
        self.measured == 0
    }

    /// The measured bias after this tick, and its variance. Means are measured after half a second,
    /// one and two seconds; a slow rotation decreases sixteen times from one to the next.
    /// Afterwards every tick is measured.
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

    /// True if its level is neither the bias nor a rotation: a rotation about a level axis would
    /// have turned gravity. A jump of the bias appears about all axes.
    pub fn refutes_lean(&self, bias: &Vector3<f64>) -> bool {
        let off = self.gyro - bias;
        let leans = self.level_part(&off);
        self.is_long() && leans > MIN_LEVEL_SHARE * off.norm() && self.would_rotate_gravity(leans)
    }

    /// True if gravity proves that the level's part about level axes is no rotation.
    pub fn refutes_level_turn(&self) -> bool {
        self.would_rotate_gravity(self.level_part(&self.gyro))
    }

    /// True if it has lasted until a rotation would be detected.
    pub fn is_long(&self) -> bool {
        self.seconds >= MEASURED_AFTER_S[2] * (1.0 - 1e-9)
    }

    /// Unit vector up, in the sensor's axes.
    pub fn up(&self) -> Vector3<f64> {
        self.accel * (1.0 / self.accel.norm().max(MAX_GRAVITY_TURN_M_S2))
    }

    fn level_part(&self, rate: &Vector3<f64>) -> f64 {
        let up = self.up();
        (rate - up * rate.dot(&up)).norm()
    }

    /// True if a rotation at this rate about a level axis would have turned gravity.
    fn would_rotate_gravity(&self, rate: f64) -> bool {
        rate * (self.seconds - DIRECTION_DELAY_S) * self.accel.norm()
            > MIN_TURN_RATIO * MAX_GRAVITY_TURN_M_S2
    }

    /// Marks all means as measured.
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
    /// Density of the mean rate's noise, (rad/s)² s; it is larger for a shaken gyro.
    pub fn noise(&self) -> f64 {
        RATE_NOISE * RATE_NOISE + RECTIFIED_SHARE * RECTIFIED_SHARE * self.vibration
    }
}
