//! Exclusion of sensors that disagree with the others, and their return.

use serde::{Deserialize, Serialize};

use core::f64::consts::FRAC_PI_2;

use super::MAX_SAMPLE;
use crate::error::Error;
use crate::memory;

/// Distance of an outlier, in standard deviations and as a share of the rate.
const MAX_SAMPLE_SIGMAS: f64 = 6.0;
const MAX_SAMPLE_RATE_SHARE: f64 = 0.5;

/// Distance for means over a tick, in standard deviations and as a share of the rate: working
/// sensors differ by at most a fiftieth of the rate.
const MAX_TICK_SIGMAS: f64 = 9.0;
const MAX_TICK_RATE_SHARE: f64 = 0.1;

/// Factor on the usual difference between sensors in the same tick. It covers effects on all
/// sensors: samples that are not synchronous in motion, and biases that change with the pose.
const MAX_TYPICAL_RATIO: f64 = 5.0;

/// Smallest number of samples for a test of a tick.
const MIN_TICK_SAMPLES: u32 = 4;

/// Largest number of axes of a gyro.
const MAX_AXES: usize = 3;

/// Time of agreement after which a sensor is used again, s.
pub(super) const READMISSION_S: f64 = 10.0;

/// Share of the rate at which a fault was seen, above which agreement counts.
const MIN_RATE_SHARE: f64 = 0.3;

/// Differences from the median, per sample and summed over a tick.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Vote {
    /// Sums of each sensor, axis by axis.
    pub(super) sums: Vec<Sums>,
    /// Standard deviation of a sample, NaN before it is known.
    pub(super) sigmas: Vec<f64>,
    /// For each axis: sum of the squared medians; number of voters; and a flag that a voter knows
    /// its noise and bias.
    pub(super) squares: Vec<f64>,
    pub(super) voters: Vec<u32>,
    pub(super) known: Vec<bool>,
    /// Sum of the squared speed, and number of samples in the tick.
    pub(super) speeds: f64,
    pub(super) samples: u32,
    pub(super) standings: Vec<Standing>,
    pub(super) disputed: bool,
    pub(super) sorted: Vec<f64>,
}

/// Differences of a sensor from the median on one axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Sums {
    pub(super) count: u32,
    /// Number of outliers, which are not in the sums.
    pub(super) far: u32,
    pub(super) difference: f64,
    /// Sum of the products with the median: it shows a wrong scale, sign or axis even if the motion
    /// alternates.
    pub(super) product: f64,
    /// Largest contributions of one sample to the two sums: one spike is no fault of the sensor.
    pub(super) largest: [f64; 2],
}

/// Agreement of a sensor with the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Standing {
    pub(super) excluded: bool,
    /// Rate at which the sensor last disagreed.
    pub(super) exposed: f64,
    /// Number of ticks since, with agreement at a rate that would have shown the fault.
    pub(super) agreed: u32,
}

impl Vote {
    pub(super) fn new(sensors: usize, axes: usize) -> Result<Self, Error> {
        Ok(Self {
            sums: memory::filled(Sums::default(), sensors * axes)?,
            sigmas: memory::filled(f64::NAN, sensors * axes)?,
            squares: memory::filled(0.0, axes)?,
            voters: memory::filled(0, axes)?,
            known: memory::filled(false, axes)?,
            speeds: 0.0,
            samples: 0,
            standings: memory::filled(
                Standing { excluded: false, exposed: 0.0, agreed: 0 },
                sensors,
            )?,
            disputed: false,
            sorted: memory::filled(0.0, sensors)?,
        })
    }

    pub(super) fn is_excluded(&self, sensor: usize) -> bool {
        self.standings[sensor].excluded
    }

    pub(super) fn is_disputed(&self) -> bool {
        self.disputed
    }

    /// True if a sensor votes. A sensor with an unknown bias does not, if another sensor's bias is
    /// known.
    #[inline(always)]
    pub(super) fn counts(&self, sensor: usize, index: usize, axis: usize) -> bool {
        !self.standings[sensor].excluded && (!self.known[axis] || !self.sigmas[index].is_nan())
    }

    /// Angular speed of the body, from the medians of all axes.
    #[inline(always)]
    pub(super) fn note_speed(&mut self, centre: &[f64]) -> f64 {
        let bounded = |x: &f64| if x.is_nan() { 0.0 } else { x.clamp(-MAX_SAMPLE, MAX_SAMPLE) };
        let square: f64 = centre.iter().map(bounded).map(|x| x * x).sum();
        self.speeds += square;
        self.samples += 1;
        square.sqrt()
    }

    /// Adds the median, and its number of sensors.
    #[inline(always)]
    pub(super) fn note_centre(&mut self, centre: &[f64], counts: &[usize]) {
        for (axis, (centre, count)) in centre.iter().zip(counts).enumerate() {
            self.voters[axis] = self.voters[axis].max(*count as u32);
            if *count > 1 {
                let centre = centre.clamp(-MAX_SAMPLE, MAX_SAMPLE);
                self.squares[axis] += centre * centre;
            }
        }
    }

    /// Adds the distance of a rate from the median; returns true for an outlier.
    #[inline(always)]
    pub(super) fn is_far(&mut self, index: usize, rate: f64, centre: f64, speed: f64) -> bool {
        if rate.is_nan() {
            return false;
        }
        let difference = (rate - centre).clamp(-MAX_SAMPLE, MAX_SAMPLE);
        let far = difference.abs()
            > MAX_SAMPLE_SIGMAS * self.sigmas[index] + MAX_SAMPLE_RATE_SHARE * speed;
        let sums = &mut self.sums[index];
        sums.count += 1;
        sums.far += u32::from(far);
        // An excluded sample gives no information on the other sensors.
        let near = if far { 0.0 } else { difference };
        let product = near * centre.clamp(-MAX_SAMPLE, MAX_SAMPLE);
        sums.difference += near;
        sums.product += product;
        if near.abs() > sums.largest[0].abs() {
            sums.largest = [near, product];
        }
        far
    }

    /// Sets the standard deviation of a sensor's samples on an axis, NaN if it or the bias is
    /// unknown.
    pub(super) fn know(&mut self, index: usize, sigma: f64) {
        if self.sigmas[index].is_nan() {
            // Until now the rate included the bias.
            self.sums[index] = Sums::default();
        }
        // The comparison is false for NaN.
        self.sigmas[index] = if sigma > MAX_SAMPLE { MAX_SAMPLE } else { sigma };
    }

    /// Adds the noise of the median, once the sensors' own noise is known. It is the noise of a
    /// median of normal distributions, from their density there.
    pub(super) fn know_centre(&mut self, axis: usize, axes: usize) {
        let (mut density, mut count) = (0.0, 0);
        for (sensor, standing) in self.standings.iter().enumerate() {
            let sigma = self.sigmas[sensor * axes + axis];
            if !standing.excluded && !sigma.is_nan() {
                (density, count) = (density + 1.0 / sigma.max(f64::MIN_POSITIVE), count + 1);
            }
        }
        self.known[axis] = count > 0;
        if count == 0 {
            return;
        }
        let centre = (FRAC_PI_2 * f64::from(count)).sqrt() / density;
        for sigma in self.sigmas.iter_mut().skip(axis).step_by(axes) {
            // NaN stays NaN.
            *sigma = sigma.hypot(centre);
        }
    }

    /// Ends a tick: excludes sensors, and readmits them after `back` ticks of agreement.
    pub(super) fn end_tick(&mut self, axes: usize, back: u32) {
        let speed = (self.speeds / f64::from(self.samples.max(1))).sqrt();
        let n = self.standings.len();
        let mut typical = [[0.0; 2]; MAX_AXES];
        for (axis, typical) in typical.iter_mut().enumerate().take(axes) {
            *typical = [0, 1].map(|kind| self.typical(axis, axes, kind));
        }
        let wrong = |vote: &Self, sensor| {
            (0..axes).any(|axis| vote.disagrees(sensor * axes + axis, axis, speed, typical[axis]))
        };
        let tested = self.standings.iter().filter(|one| !one.excluded).count();
        let accused = (0..n).filter(|i| !self.is_excluded(*i) && wrong(self, *i)).count();
        // With two sensors, or if half of all disagree, it is unknown which sensors are wrong.
        self.disputed = accused > 0 && 2 * accused >= tested;
        for sensor in 0..n {
            let (wrong, present) = (wrong(self, sensor), self.was_tested(sensor, axes));
            let standing = &mut self.standings[sensor];
            match (standing.excluded, wrong) {
                (false, true) if !self.disputed => {
                    *standing = Standing { excluded: true, exposed: speed, agreed: 0 };
                }
                (true, true) => *standing = Standing { excluded: true, exposed: speed, agreed: 0 },
                (true, false) if present && speed >= MIN_RATE_SHARE * standing.exposed => {
                    standing.agreed += 1;
                    standing.excluded = standing.agreed < back;
                }
                _ => {}
            }
        }
        for axis in 0..axes {
            let known = self.sigmas.iter().skip(axis).step_by(axes).enumerate();
            let known = known.filter(|(i, sigma)| !self.standings[*i].excluded && !sigma.is_nan());
            self.known[axis] = known.count() > 0;
        }
        self.forget_tick();
    }

    pub(super) fn forget_tick(&mut self) {
        self.sums.fill(Sums::default());
        self.squares.fill(0.0);
        self.voters.fill(0);
        (self.speeds, self.samples) = (0.0, 0);
    }

    /// True if a sensor was compared on every axis on which a comparison was possible.
    fn was_tested(&self, sensor: usize, axes: usize) -> bool {
        (0..axes).all(|axis| {
            let index = sensor * axes + axis;
            self.sums[index].count >= MIN_TICK_SAMPLES && !self.sigmas[index].is_nan()
        })
    }

    /// Median distance of the sensors from the median rate in this tick: of the mean, and along the
    /// motion. Zero for two sensors, whose distances are equal.
    fn typical(&mut self, axis: usize, axes: usize, kind: usize) -> f64 {
        let mut count = 0;
        for sensor in 0..self.standings.len() {
            let sums = self.sums[sensor * axes + axis];
            if !self.standings[sensor].excluded && sums.count >= MIN_TICK_SAMPLES {
                self.sorted[count] = sums.off(self.squares[axis])[kind];
                count += 1;
            }
        }
        if count < 3 {
            return 0.0;
        }
        let sorted = &mut self.sorted[..count];
        sorted.sort_unstable_by(f64::total_cmp);
        sorted[(count - 1) / 2]
    }

    fn disagrees(&self, index: usize, axis: usize, speed: f64, typical: [f64; 2]) -> bool {
        let (sums, sigma) = (self.sums[index], self.sigmas[index]);
        if sums.count < MIN_TICK_SAMPLES || sigma.is_nan() || self.voters[axis] < 2 {
            return false;
        }
        let n = f64::from(sums.count);
        // Each of two sensors differs from their median by half their difference.
        let part = if self.voters[axis] == 2 { 0.5 } else { 1.0 };
        let [mean, along] = sums.off(self.squares[axis]);
        let root = n.sqrt();
        2 * sums.far > sums.count
            || mean
                > part
                    * (MAX_TICK_SIGMAS * sigma / root + MAX_TICK_RATE_SHARE * speed)
                        .max(MAX_TYPICAL_RATIO * typical[0])
            || along
                > part
                    * (MAX_TICK_SIGMAS * sigma + MAX_TICK_RATE_SHARE * root * speed)
                        .max(MAX_TYPICAL_RATIO * typical[1])
    }
}

impl Sums {
    /// Differences from the median without the largest contribution: of the mean, and along the
    /// motion.
    fn off(&self, squares: f64) -> [f64; 2] {
        let product = self.product - self.largest[1];
        let along = if squares > 0.0 { product / squares.sqrt() } else { 0.0 };
        let near = (self.count - self.far).saturating_sub(1).max(1);
        [(self.difference - self.largest[0]).abs() / f64::from(near), along.abs()]
    }
}
