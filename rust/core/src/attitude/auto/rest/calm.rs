//! A smooth road, a robot, a rate table: what is calm by any limit, but less so than this sensor at
//! rest.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::quiet::{Candidate, MAX_ACCEL_SPREAD_M_S2, MAX_GYRO_SPREAD_RAD_S};
use super::{DEGREE, Seen};
use crate::math::validity::is_size;
use crate::rest::quiet::FIRST_DIRECTION_TICKS;

/// Largest ratio of a rest's noise to the calmest rest's, and of a single tick's distance from its
/// mean: squared.
const MAX_NOISE_RATIO: f64 = 9.0;
const MAX_TICK_RATIO: f64 = 16.0;
/// The same, squared, of the mean of half a second, which the mean of a long candidate hides; ticks of
/// the candidate from which on it counts, and seconds in a row after which it is another's.
const MAX_LEVEL_RATIO: f64 = 1.5;
const MIN_LEVEL_TICKS: f64 = 10.0;
const MAX_STRAY_S: f64 = 3.0;
/// Seconds in which the floor doubles: a place may be less calm.
const FLOOR_DOUBLING_S: f64 = 300.0;
/// Least floors, rad/s and m/s².
const MIN_GYRO_RAD_S: f64 = 0.005 * DEGREE;
const MIN_ACCEL_M_S2: f64 = 0.003;
/// Seconds of rest from which on a floor is learned.
const MIN_LEARNING_S: f64 = 2.0;

/// Spread of the ticks' means in the calmest rest to date, squared; zero before the first.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Calm {
    gyro: f64,
    accel: f64,
    /// Seconds in a row for which the level has been off the candidate's mean.
    strayed: f64,
}

impl Calm {
    /// True if a floor is known.
    pub fn is_known(&self) -> bool {
        self.gyro > 0.0
    }

    /// So many seconds passed.
    pub fn age(&mut self, span: f64) {
        let grown = 1.0 + 2.0 * core::f64::consts::LN_2 / FLOOR_DOUBLING_S * span;
        self.gyro = (self.gyro * grown).min(MAX_GYRO_SPREAD_RAD_S * MAX_GYRO_SPREAD_RAD_S);
        self.accel = (self.accel * grown).min(MAX_ACCEL_SPREAD_M_S2 * MAX_ACCEL_SPREAD_M_S2);
    }

    /// True if what may be a rest is as calm as rests of this sensor are.
    pub fn holds(&self, rest: &Candidate, seen: &Seen) -> bool {
        !self.is_known()
            || rest.ticks >= FIRST_DIRECTION_TICKS
                && rest.gyro_spread() <= MAX_NOISE_RATIO * self.gyro
                && rest.accel_spread() <= MAX_NOISE_RATIO * self.accel
                && (seen.gyro - rest.gyro).norm_squared() <= MAX_TICK_RATIO * self.gyro
    }

    /// True if the level of half a second has left the mean of what may be a rest.
    pub fn is_left(&mut self, rest: &Candidate, level: &Vector3<f64>, span: f64) -> bool {
        let off = self.is_known()
            && rest.ticks >= MIN_LEVEL_TICKS
            && (level - rest.gyro).norm_squared() > MAX_LEVEL_RATIO * self.gyro;
        self.strayed = if off { self.strayed + span } else { 0.0 };
        off
    }

    /// True if it has for so long that the next rest starts again: sooner, a smooth drive had many
    /// short candidates, of which one would be calm by chance.
    pub fn is_gone(&self) -> bool {
        self.strayed > MAX_STRAY_S * (1.0 + 1e-9)
    }

    /// Takes a rest.
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
