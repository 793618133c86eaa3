//! Noise of an array's sensors at rest, and the weights that follow.

use serde::{Deserialize, Serialize};

use super::MAX_SAMPLE;
use super::octaves::{Covariance, Octaves};
use super::params::Weights;
use crate::error::Error;
use crate::memory;

/// Octaves of one and of four seconds.
const ONE_SECOND_OCTAVE: usize = 2;
const FOUR_SECOND_OCTAVE: usize = 4;

/// Differences below which a variance tells nothing.
const MIN_DIFFERENCES: u32 = 8;

/// Variances over those of the others, as far as they count.
const MIN_VARIANCE_RATIO: f64 = 1e-2;
const MAX_VARIANCE_RATIO: f64 = 1e4;

/// Allan variances of all sensors, of half a tick, of one and of four seconds, learned from ticks at
/// rest that are followed by another, and the weights that follow from them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Noise {
    pub(super) axes: usize,
    /// Sensor by sensor, in its own axes.
    pub(super) sums: Vec<Sums>,
    /// The same in the axes of the body.
    pub(super) ticks: Vec<Halves>,
    pub(super) halves: Vec<Variance>,
    /// Axis by axis.
    pub(super) octaves: Vec<Octaves>,
    /// Variance over that of the others; of white noise alone; of the array's at one second.
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

/// Means of the halves of ticks at rest; NaN for none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Halves {
    /// Of a tick that waits for the next one.
    pub(super) waiting: [f64; 2],
    /// Of one that has been followed by another.
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

    /// Adds the samples of all sensors, of those axes that are near the others'.
    #[inline(always)]
    pub(super) fn add(&mut self, z: &[f64], near: &[bool], first_half: bool) {
        let half = usize::from(!first_half);
        for ((sums, z), near) in self.sums.iter_mut().zip(z).zip(near) {
            sums.sums[half] += if *near { z.clamp(-MAX_SAMPLE, MAX_SAMPLE) } else { 0.0 };
            sums.counts[half] += u32::from(*near);
        }
    }

    /// The cost of a rate in weight, where a part of it is wrong.
    #[inline(always)]
    pub(super) fn motion(&self, axis: usize, wrong: f64) -> f64 {
        let ratio = wrong.min(MAX_SAMPLE) * (wrong.min(MAX_SAMPLE) / self.second[axis]);
        // Unknown, or against no noise at all: equal weights.
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

    /// Means of the halves of a sensor's tick in its own axes, NaN for half a tick of which less than
    /// half is there; the next tick begins.
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

    /// Ends the tick of a sensor on an axis of the body, which was calm or not.
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

    /// Ends the tick of an axis, on which the body rests or not.
    pub(super) fn end_tick(&mut self, axis: usize, at_rest: bool) {
        if !at_rest {
            return self.octaves[axis].interrupt();
        }
        let followed = self.ticks.iter().skip(axis).step_by(self.axes);
        self.octaves[axis]
            .take(followed.map(|tick| 0.5 * tick.followed[0] + 0.5 * tick.followed[1]));
        self.weigh(axis);
    }

    /// No tick follows another.
    pub(super) fn interrupt(&mut self) {
        self.octaves.iter_mut().for_each(Octaves::interrupt);
        self.ticks.fill(Halves { waiting: NO_MEAN, followed: NO_MEAN });
        self.sums.fill(Sums::default());
    }

    pub(super) fn covariances(&self, axis: usize) -> impl Iterator<Item = Covariance<'_>> {
        self.octaves[axis].covariances()
    }

    /// Variance of a sensor at one of the three averaging times, and of how many differences it is.
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

    /// Mean of the sensors' variances at one averaging time, NaN as long as there is none.
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
