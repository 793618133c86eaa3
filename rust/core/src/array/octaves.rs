//! Allan covariances of parallel sensors, octave by octave, while means of ticks arrive.

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::memory;

/// Number of averaging times: 1, 2, 4, …, 4096 ticks, up to 17 minutes.
pub(super) const OCTAVES: usize = 13;

/// Differences of successive means of 2^k ticks; each mean is made of successive ticks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Octaves {
    pub(super) sensors: usize,
    pub(super) all: Vec<Octave>,
    /// Mean that is passed to the next octave.
    pub(super) mean: Vec<f64>,
}

/// One averaging time; NaN without a mean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Octave {
    pub(super) last: Vec<f64>,
    /// First half of a mean of the next octave, if it is present.
    pub(super) half: Vec<f64>,
    pub(super) has_half: bool,
    /// Products of differences, on and above the diagonal, and their numbers.
    pub(super) products: Vec<f64>,
    pub(super) counts: Vec<u32>,
}

/// Allan covariances of all sensors at one averaging time.
#[derive(Debug, Clone, Copy)]
pub struct Covariance<'a> {
    /// Number of ticks in the averaging time.
    pub ticks: u32,
    sensors: usize,
    octave: &'a Octave,
}

impl Octaves {
    pub(super) fn new(sensors: usize) -> Result<Self, Error> {
        let mut all = memory::room(OCTAVES)?;
        for _ in 0..OCTAVES {
            all.push(Octave {
                last: memory::filled(f64::NAN, sensors)?,
                half: memory::filled(f64::NAN, sensors)?,
                has_half: false,
                products: memory::filled(0.0, sensors * sensors)?,
                counts: memory::filled(0, sensors * sensors)?,
            });
        }
        Ok(Self { sensors, all, mean: memory::filled(f64::NAN, sensors)? })
    }

    /// Processes the means of the sensors' next tick, NaN for a sensor without a mean.
    pub(super) fn take(&mut self, mean: impl Iterator<Item = f64>) {
        self.mean.iter_mut().zip(mean).for_each(|(to, from)| *to = from);
        for octave in &mut self.all {
            octave.differ(&self.mean);
            octave.last.copy_from_slice(&self.mean);
            octave.has_half = !octave.has_half;
            if octave.has_half {
                octave.half.copy_from_slice(&self.mean);
                return;
            }
            for (mean, half) in self.mean.iter_mut().zip(&octave.half) {
                *mean = 0.5 * *mean + 0.5 * half;
            }
        }
    }

    /// The next tick does not follow the last one.
    pub(super) fn interrupt(&mut self) {
        for octave in &mut self.all {
            octave.last.fill(f64::NAN);
            octave.has_half = false;
        }
    }

    /// Allan variance of a sensor at an octave, and its number of differences.
    pub(super) fn variance(&self, sensor: usize, octave: usize) -> (f64, u32) {
        let (index, octave) = (sensor * (self.sensors + 1), &self.all[octave]);
        let count = octave.counts[index];
        (octave.products[index] / f64::from(count.max(1)), count)
    }

    pub(super) fn covariances(&self) -> impl Iterator<Item = Covariance<'_>> {
        let of = |(k, octave)| Covariance { ticks: 1_u32 << k, sensors: self.sensors, octave };
        self.all.iter().enumerate().map(of)
    }
}

impl Octave {
    fn differ(&mut self, mean: &[f64]) {
        let n = mean.len();
        for i in 0..n {
            let of_one = mean[i] - self.last[i];
            if of_one.is_nan() {
                continue;
            }
            for j in i..n {
                let of_other = mean[j] - self.last[j];
                if !of_other.is_nan() {
                    self.products[i * n + j] += 0.5 * of_one * of_other;
                    self.counts[i * n + j] = self.counts[i * n + j].saturating_add(1);
                }
            }
        }
    }
}

impl Covariance<'_> {
    /// Covariance of two sensors, NaN without differences.
    pub fn of(&self, one: usize, other: usize) -> f64 {
        let index = self.index(one, other);
        self.octave.products[index] / f64::from(self.octave.counts[index])
    }

    /// Number of differences in the covariance.
    pub fn count(&self, one: usize, other: usize) -> u32 {
        self.octave.counts[self.index(one, other)]
    }

    fn index(&self, one: usize, other: usize) -> usize {
        one.min(other) * self.sensors + one.max(other)
    }
}
