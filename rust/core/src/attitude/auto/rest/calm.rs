//! Calmness of a rest: a smooth road, a robot or a rate table is calm by any limit, but less calm
//! than this sensor at rest.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::quiet::{Candidate, MAX_ACCEL_SPREAD_M_S2, MAX_GYRO_SPREAD_RAD_S};
use super::{DEGREE, Seen};
use crate::math::validity::is_size;
use crate::rest::quiet::FIRST_DIRECTION_TICKS;

/// Largest ratio of a rest's noise to the calmest rest's noise, and of a single tick's distance
/// from its mean, squared.
const MAX_NOISE_RATIO: f64 = 9.0;
const MAX_TICK_RATIO: f64 = 16.0;
/// Largest squared ratio for the mean of half a second, which a long candidate's mean would hide;
/// number of the candidate's ticks from which it is used; and time in a row, s, after which it
/// belongs to another rest.
const MAX_LEVEL_RATIO: f64 = 1.5;
const MIN_LEVEL_TICKS: f64 = 10.0;
const MAX_STRAY_S: f64 = 3.0;
/// Time in which the floor doubles, s: a place may be less calm.
const FLOOR_DOUBLING_S: f64 = 300.0;
/// Smallest floors, rad/s and m/s².
const MIN_GYRO_RAD_S: f64 = 0.005 * DEGREE;
const MIN_ACCEL_M_S2: f64 = 0.003;
/// Time of rest after which a floor is learned, s.
const MIN_LEARNING_S: f64 = 2.0;

/// Squared spread of the ticks' means in the calmest rest to date; zero before the first.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Calm {
    gyro: f64,
    accel: f64,
    /// Time in a row for which the level has been off the candidate's mean, s.
    strayed: f64,
}

impl Calm {
    /// True if a floor is known.
    pub fn is_known(&self) -> bool {
        self.gyro > 0.0
    }

    /// Lets this time pass, s.
    pub fn age(&mut self, span: f64) {
        let grown = 1.0 + 2.0 * core::f64::consts::LN_2 / FLOOR_DOUBLING_S * span;
        self.gyro = (self.gyro * grown).min(MAX_GYRO_SPREAD_RAD_S * MAX_GYRO_SPREAD_RAD_S);
        self.accel = (self.accel * grown).min(MAX_ACCEL_SPREAD_M_S2 * MAX_ACCEL_SPREAD_M_S2);
    }

    /// True if a candidate is as calm as this sensor's rests.
    pub fn holds(&self, rest: &Candidate, seen: &Seen) -> bool {
        !self.is_known()
            || rest.ticks >= FIRST_DIRECTION_TICKS
                && rest.gyro_spread() <= MAX_NOISE_RATIO * self.gyro
                && rest.accel_spread() <= MAX_NOISE_RATIO * self.accel
                && (seen.gyro - rest.gyro).norm_squared() <= MAX_TICK_RATIO * self.gyro
    }

    /// True if the level of half a second has left the candidate's mean.
    pub fn is_left(&mut self, rest: &Candidate, level: &Vector3<f64>, span: f64) -> bool {
        let off = self.is_known()
            && rest.ticks >= MIN_LEVEL_TICKS
            && (level - rest.gyro).norm_squared() > MAX_LEVEL_RATIO * self.gyro;
        self.strayed = if off { self.strayed + span } else { 0.0 };
        off
    }

    /// True if it has left for so long that the next candidate begins. An earlier restart would
    /// give a smooth drive many short candidates, and one of them would be calm by chance.
    pub fn is_gone(&self) -> bool {
        self.strayed > MAX_STRAY_S * (1.0 + 1e-9)
    }

    /// Learns from a rest.
    pub fn learn(&mut self, rest: &Candidate) {
        if rest.seconds < MIN_LEARNING_S * (1.0 - 1e-9) {
            return;
        }
        let (gyro, accel) = (rest.gyro_spread(), rest.accel_spread());
        let least = |known: f64, seen: f64| if known > 0.0 { known.min(seen) } else { seen };
        self.gyro = least(self.gyro, gyro.max(MIN_GYRO_RAD_S * MIN_GYRO_RAD_S));
        self.accel = least(self.accel, accel.max(MIN_ACCEL_M_S2 * MIN_ACCEL_M_S2));
    }

    pub fn is_valid(&self) -> bool {
        (0.0..=MAX_GYRO_SPREAD_RAD_S * MAX_GYRO_SPREAD_RAD_S).contains(&self.gyro)
            && (0.0..=MAX_ACCEL_SPREAD_M_S2 * MAX_ACCEL_SPREAD_M_S2).contains(&self.accel)
            && is_size(self.strayed, 1e18)
    }
}
