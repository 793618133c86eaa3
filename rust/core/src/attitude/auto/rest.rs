//! Rest of a body, by gyro and accelerometer.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::strapdown::Sums;

/// How far samples of a resting gyro, rad/s, and accelerometer, m/s², lie from their mean.
const GYRO: f64 = 2.0 * DEGREE;
const ACCEL: f64 = 0.5;
const DEGREE: f64 = core::f64::consts::PI / 180.0;
/// Seconds of the means.
const MEAN: f64 = 0.5;
/// Seconds after which what looks like rest is one, near the bias known and far from it.
const NEAR: f64 = 1.5;
const FAR: f64 = 10.0;

/// What a tick is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    Motion,
    Rest,
    /// A rest at a level that is far from the bias: what was learned of it is wrong.
    FarRest,
}

/// Means of the last half second, and since when they hold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rest {
    gyro: Vector3<f64>,
    accel: Vector3<f64>,
    /// The accelerometer's mean when it began.
    first_accel: Vector3<f64>,
    /// Seconds within the limits; negative before the first tick.
    since: f64,
}

impl Default for Rest {
    fn default() -> Self {
        let zero = Vector3::zeros();
        Self { gyro: zero, accel: zero, first_accel: zero, since: -1.0 }
    }
}

impl Rest {
    /// Mean rate, rad/s.
    pub fn level(&self) -> &Vector3<f64> {
        &self.gyro
    }

    /// Takes a tick; without a known rate or a force it tells nothing, and is no rest.
    pub fn observe(&mut self, sums: &Sums, bias: &Vector3<f64>) -> State {
        if sums.unknown > 0.0 || sums.forces == 0.0 {
            self.since = self.since.min(0.0);
            return State::Motion;
        }
        let (gyro, accel) = (sums.gyro * (1.0 / sums.samples), sums.accel * (1.0 / sums.forces));
        if self.since < 0.0 {
            (self.gyro, self.accel, self.first_accel, self.since) = (gyro, accel, accel, 0.0);
        }
        let (of_gyro, of_accel) = sums.spread(&self.gyro, &self.accel);
        let weight = (sums.elapsed / MEAN).min(1.0);
        self.gyro += (gyro - self.gyro) * weight;
        self.accel += (accel - self.accel) * weight;
        // A turn about no vertical axis shows in gravity, however slow it is.
        let moved = (self.accel - self.first_accel).norm_squared();
        if of_gyro > GYRO * GYRO || of_accel.max(moved) > ACCEL * ACCEL {
            (self.since, self.first_accel) = (0.0, self.accel);
            return State::Motion;
        }
        self.since += sums.elapsed;
        match (self.gyro - bias).norm_squared() > GYRO * GYRO {
            false if self.since >= NEAR => State::Rest,
            true if self.since >= FAR => State::FarRest,
            _ => State::Motion,
        }
    }

    pub fn is_sound(&self) -> bool {
        let finite = |v: &Vector3<f64>| v.iter().all(|x| x.abs() <= 2e3);
        finite(&self.gyro)
            && finite(&self.accel)
            && finite(&self.first_accel)
            && (-1.0..1e18).contains(&self.since)
    }
}
