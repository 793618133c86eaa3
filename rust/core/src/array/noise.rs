//! Noise of an array's sensors at rest, and the weights that follow.

use serde::{Deserialize, Serialize};

use super::MAX_SAMPLE;
use super::octaves::{Covariance, Octaves};
use super::params::Weights;
use crate::error::Error;
use crate::memory;

/// Octaves of one second and of four seconds.
const ONE_SECOND_OCTAVE: usize = 2;
const FOUR_SECOND_OCTAVE: usize = 4;

/// Smallest number of differences for a variance.
const MIN_DIFFERENCES: u32 = 8;

/// Limits of the variance ratio between sensors.
const MIN_VARIANCE_RATIO: f64 = 1e-2;
const MAX_VARIANCE_RATIO: f64 = 1e4;

/// Allan variances of all sensors at half a tick, one second and four seconds, and the weights that
/// follow. They are learned from ticks at rest that another tick follows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Noise {
    pub(super) axes: usize,
    /// Sums of each sensor in its own axes.
    pub(super) sums: Vec<Sums>,
    /// Half-tick means of each sensor in the axes of the body.
    pub(super) ticks: Vec<Halves>,
    pub(super) halves: Vec<Variance>,
    /// Octaves, axis by axis.
    pub(super) octaves: Vec<Octaves>,
    /// Ratio of the variance to the other sensors' variance; of white noise alone; and of the
    /// array's variance at one second.
    pub(super) ratios: Vec<f64>,
    pub(super) white: Vec<f64>,
    pub(super) second: Vec<f64>,
}

/// Sums over the halves of a tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Sums {
    pub(super) sums: [f64; 2],
    pub(super) counts: [u32; 2],
}

/// Means of the halves of ticks at rest; NaN if missing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Halves {
    /// Means of a tick that waits for the next tick.
    pub(super) waiting: [f64; 2],
    /// Means of a tick that another tick has followed.
    pub(super) followed: [f64; 2],
}

/// Mean of squared differences.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Variance {
    pub(super) sum: f64,
    pub(super) count: u32,
}

/// No mean.
pub(super) const NO_MEAN: [f64; 2] = [f64::NAN; 2];

impl Noise {
    pub(super) fn new(sensors: usize, axes: usize) -> Result<Self, Error> {
        let mut octaves = memory::room(axes)?;
        for _ in 0..axes {
            octaves.push(Octaves::new(sensors)?);
        }
        let tick = Halves { waiting: NO_MEAN, followed: NO_MEAN };
        Ok(Self {
            axes,
            sums: memory::filled(Sums::default(), sensors * axes)?,
            ticks: memory::filled(tick, sensors * axes)?,
            halves: memory::filled(Variance { sum: 0.0, count: 0 }, sensors * axes)?,
            octaves,
            ratios: memory::filled(1.0, sensors * axes)?,
            white: memory::filled(1.0, sensors * axes)?,
            second: memory::filled(f64::NAN, axes)?,
        })
    }

    /// Adds the samples of all sensors, for the axes near the other sensors.
    #[inline(always)]
    pub(super) fn add(&mut self, z: &[f64], near: &[bool], first_half: bool) {
        let half = usize::from(!first_half);
        for ((sums, z), near) in self.sums.iter_mut().zip(z).zip(near) {
            sums.sums[half] += if *near { z.clamp(-MAX_SAMPLE, MAX_SAMPLE) } else { 0.0 };
            sums.counts[half] += u32::from(*near);
        }
    }

    /// Variance of a rate for its weight, if a share of the rate is wrong.
    #[inline(always)]
    pub(super) fn motion(&self, axis: usize, wrong: f64) -> f64 {
        let ratio = wrong.min(MAX_SAMPLE) * (wrong.min(MAX_SAMPLE) / self.second[axis]);
        // Unknown variance, or no noise: equal weights.
        if ratio.is_nan() { 0.0 } else { ratio.min(1e12) }
    }

    #[inline(always)]
    pub(super) fn weight(&self, kind: &Weights, index: usize, motion: f64) -> f64 {
        match kind {
            Weights::Auto => 1.0 / (self.ratios[index] + motion),
            Weights::Mean => 1.0,
            Weights::White => 1.0 / self.white[index],
            Weights::Given(weights) => weights[index],
        }
    }

    /// Means of the halves of a sensor's tick in its own axes, and beginning of the next tick. A
    /// half is NaN if less than half of its samples are present.
    pub(super) fn take_halves<const A: usize>(
        &mut self,
        sensor: usize,
        length: u32,
    ) -> [[f64; A]; 2] {
        let mut means = [[f64::NAN; A]; 2];
        for (axis, sums) in self.sums[sensor * A..][..A].iter_mut().enumerate() {
            for half in 0..2 {
                if 4 * sums.counts[half] > length {
                    means[half][axis] = sums.sums[half] / f64::from(sums.counts[half]);
                }
            }
            *sums = Sums::default();
        }
        means
    }

    /// Ends the tick of a sensor on an axis of the body; `calm` is true at rest.
    pub(super) fn end_position(&mut self, index: usize, means: [f64; 2], calm: bool) {
        let tick = &mut self.ticks[index];
        tick.followed = if calm { tick.waiting } else { NO_MEAN };
        let whole = means.iter().all(|mean| !mean.is_nan());
        tick.waiting = if whole { means } else { NO_MEAN };
        let [first, second] = tick.followed;
        if !first.is_nan() {
            let variance = &mut self.halves[index];
            variance.sum += 0.5 * (second - first) * (second - first);
            variance.count = variance.count.saturating_add(1);
        }
    }

    /// Ends the tick of an axis; `at_rest` is true if the body rests on it.
    pub(super) fn end_tick(&mut self, axis: usize, at_rest: bool) {
        if !at_rest {
            return self.octaves[axis].interrupt();
        }
        let followed = self.ticks.iter().skip(axis).step_by(self.axes);
        self.octaves[axis]
            .take(followed.map(|tick| 0.5 * tick.followed[0] + 0.5 * tick.followed[1]));
        self.weigh(axis);
    }

    /// Notes that the next tick does not follow the last tick.
    pub(super) fn interrupt(&mut self) {
        self.octaves.iter_mut().for_each(Octaves::interrupt);
        self.ticks.fill(Halves { waiting: NO_MEAN, followed: NO_MEAN });
        self.sums.fill(Sums::default());
    }

    pub(super) fn covariances(&self, axis: usize) -> impl Iterator<Item = Covariance<'_>> {
        self.octaves[axis].covariances()
    }

    /// Variance of a sensor at one of the three averaging times, and its number of differences.
    fn variance(&self, sensor: usize, axis: usize, time: usize) -> (f64, u32) {
        if time > 0 {
            return self.octaves[axis]
                .variance(sensor, [ONE_SECOND_OCTAVE, FOUR_SECOND_OCTAVE][time - 1]);
        }
        let half = self.halves[sensor * self.axes + axis];
        (half.sum / f64::from(half.count.max(1)), half.count)
    }

    fn weigh(&mut self, axis: usize) {
        let sensors = self.octaves[axis].sensors;
        let means: [f64; 3] = core::array::from_fn(|time| self.mean(axis, time));
        self.second[axis] = means[1];
        for sensor in 0..sensors {
            let (mut sum, mut count) = (0.0, 0);
            for (time, mean) in means.iter().enumerate() {
                let (variance, differences) = self.variance(sensor, axis, time);
                let ratio = variance / mean;
                if differences >= MIN_DIFFERENCES && ratio.is_finite() {
                    let ratio = ratio.clamp(MIN_VARIANCE_RATIO, MAX_VARIANCE_RATIO);
                    (sum, count) = (sum + ratio, count + 1);
                    if time == 0 {
                        self.white[sensor * self.axes + axis] = ratio;
                    }
                }
            }
            let ratio = if count > 0 { sum / f64::from(count) } else { 1.0 };
            self.ratios[sensor * self.axes + axis] = ratio;
        }
    }

    /// Mean of the sensors' variances at one averaging time, NaN without any.
    fn mean(&self, axis: usize, time: usize) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for sensor in 0..self.octaves[axis].sensors {
            let (variance, differences) = self.variance(sensor, axis, time);
            if differences >= MIN_DIFFERENCES {
                (sum, count) = (sum + variance, count + 1);
            }
        }
        sum / f64::from(count)
    }
}
