//! A rest of seconds, with motors running perhaps: means of ticks stand still, whatever the samples do.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{DEGREE, Seen};
use crate::attitude::sample::{FORCE_MAX, RATE_MAX};
use crate::math::sound::{are_within, is_size};

/// How far means of ticks vary at rest, over the three axes: rad/s and m/s².
pub const GYRO: f64 = 0.5 * DEGREE;
pub const ACCEL: f64 = 0.15;
/// How far gravity may turn in it, m/s²: a slow turn about a level axis.
const TURNED: f64 = 0.12;
/// Seconds by which the last direction of gravity is behind, how many times further a turn would have
/// carried it, and the least share of a jump that is about level axes.
const BEHIND: f64 = 0.8;
const SURELY: f64 = 3.0;
const SHARE: f64 = 0.2;
/// Ticks of the first direction of gravity, and share of each tick in the last.
pub const SETTLED: f64 = 5.0;
pub const RECENT: f64 = 0.2;
/// Density of the mean of a tick, rad/s √s, of a gyro that nothing shakes, and its share of what
/// shakes it: a gyro rectifies vibration.
pub const NOISE: f64 = 0.04 * DEGREE;
const RECTIFIED: f64 = 0.05;
/// What a turn may pass for a rest that lasts a second, rad/s.
const SLOW: f64 = 0.1 * DEGREE;
/// Seconds after which its mean is measured; each tick after the last.
const MEASURED: [f64; 3] = [0.5, 1.0, 2.0];

/// Ticks in a row that may be rest, in the axes of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    pub ticks: f64,
    pub seconds: f64,
    pub gyro: Vector3<f64>,
    pub accel: Vector3<f64>,
    /// Sums of squared distances from the means.
    gyro_squares: f64,
    accel_squares: f64,
    /// Direction of gravity at its begin and now.
    first: Vector3<f64>,
    last: Vector3<f64>,
    /// Sum of the weights of the ticks, s³/rad², and the mean rate by them.
    weight: f64,
    weighted: Vector3<f64>,
    /// How many of its means are measured.
    measured: u8,
}

impl Default for Candidate {
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
            weight: 0.0,
            weighted: zero,
            measured: 0,
        }
    }
}

impl Candidate {
    /// Takes a tick; returns whether it is the first, or none is left.
    #[inline(always)]
    pub fn observe(&mut self, seen: &Seen) -> bool {
        let far = |one: &Vector3<f64>, mean: &Vector3<f64>, most: f64| {
            (one - mean).norm_squared() > 4.0 * most * most
        };
        if far(&seen.gyro, &self.gyro, GYRO) || far(&seen.accel, &self.accel, ACCEL) {
            *self = Self::default();
        }
        self.add(seen);
        let turned = (self.last - self.first).norm_squared();
        if self.gyro_spread() > GYRO * GYRO
            || self.accel_spread() > ACCEL * ACCEL
            || turned > TURNED * TURNED
        {
            *self = Self::default();
        }
        self.ticks <= 1.0
    }

    #[inline(always)]
    fn add(&mut self, seen: &Seen) {
        self.ticks += 1.0;
        self.seconds += seen.span;
        for (value, mean, squares) in [
            (&seen.gyro, &mut self.gyro, &mut self.gyro_squares),
            (&seen.accel, &mut self.accel, &mut self.accel_squares),
        ] {
            let before = value - *mean;
            *mean += before * (1.0 / self.ticks);
            *squares += before.dot(&(value - *mean)).max(0.0);
        }
        if self.ticks <= SETTLED {
            (self.first, self.last) = (self.accel, self.accel);
        } else {
            self.last += (seen.accel - self.last) * RECENT;
        }
        let weight = seen.span / seen.noise();
        self.weight += weight;
        if self.weight > 0.0 {
            self.weighted += (seen.gyro - self.weighted) * (weight / self.weight);
        }
    }

    /// Mean squares of the distances from the means, (rad/s)² and (m/s²)².
    pub fn gyro_spread(&self) -> f64 {
        self.gyro_squares / (self.ticks - 1.0).max(1.0)
    }

    pub fn accel_spread(&self) -> f64 {
        self.accel_squares / (self.ticks - 1.0).max(1.0)
    }

    /// Whether it has lasted for long enough to be one.
    pub fn lasts(&self) -> bool {
        self.seconds >= MEASURED[0] * (1.0 - 1e-9)
    }

    /// Whether nothing of it was measured.
    pub fn is_new(&self) -> bool {
        self.measured == 0
    }

    /// What it says of the bias after this tick, and the variance: its means after half a second,
    /// one and two, in which a slow turn shows sixteen times less from one to the next, and then
    /// every tick.
    pub fn measure(&mut self, seen: &Seen) -> Option<(Vector3<f64>, f64)> {
        let due =
            MEASURED.iter().filter(|time| self.seconds >= **time * (1.0 - 1e-9)).count() as u8;
        if due > self.measured {
            self.measured = due;
            let slow = SLOW / (self.seconds * self.seconds);
            return Some((self.weighted, 1.0 / self.weight + slow * slow));
        }
        (due == MEASURED.len() as u8).then(|| (seen.gyro, seen.noise() / seen.span))
    }

    /// Whether its level is not the bias, but no turn either: about a level axis that would have
    /// carried gravity along. A jump of the bias shows about all axes.
    pub fn refutes_lean(&self, bias: &Vector3<f64>) -> bool {
        let (off, up) = (self.gyro - bias, self.accel * (1.0 / self.accel.norm().max(TURNED)));
        let leans = (off - up * off.dot(&up)).norm();
        let carried = leans * (self.seconds - BEHIND) * self.accel.norm();
        self.seconds >= MEASURED[2] * (1.0 - 1e-9)
            && leans > SHARE * off.norm()
            && carried > SURELY * TURNED
    }

    /// All of its means count as measured.
    pub fn is_known(&mut self) {
        self.measured = MEASURED.len() as u8;
    }

    pub fn is_sound(&self) -> bool {
        let (rates, forces) = (2.0 * RATE_MAX, 2.0 * FORCE_MAX);
        is_size(self.ticks, 1e15)
            && is_size(self.seconds, 2.0 * self.ticks)
            && [self.gyro, self.weighted].iter().all(|v| are_within(v, rates))
            && [self.accel, self.first, self.last].iter().all(|v| are_within(v, forces))
            && is_size(self.gyro_squares, 1e15)
            && is_size(self.accel_squares, 1e15)
            && is_size(self.weight, 1e24)
            && usize::from(self.measured) <= MEASURED.len()
    }
}

impl Seen {
    /// Density of the noise of the mean rate, (rad/s)² s: a shaken gyro's is larger.
    pub fn noise(&self) -> f64 {
        NOISE * NOISE + RECTIFIED * RECTIFIED * self.vibration
    }
}
