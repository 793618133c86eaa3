//! Many gyros of one body as one gyro.
//!
//! The drift of each axis of each gyro is learned. At rest the weights follow from the noise. In
//! motion they follow from scale errors, which are assumed equal. A sensor that disagrees with the
//! other sensors is excluded until it has agreed again for some time. An array of one gyro gives
//! bit-identical results to its drift filter.
//!
//! The number of gyros is known only at run time. [`GyroArray`] therefore takes slices. It is not a
//! [`Stream`], because the input of a stream has a compiled size. For a known number of gyros it
//! becomes a stream in a few lines: see `tests/core/array.rs`.

mod centralised;
mod noise;
mod octaves;
mod params;
mod validity;
mod vote;

use serde::{Deserialize, Serialize};

use self::centralised::Centralised;
use self::noise::Noise;
pub use self::octaves::Covariance;
pub use self::params::{ArrayParams, Fusion, Weights};
use self::vote::Vote;
use crate::drift::{AutoFilter, DriftStream};
use crate::error::Error;
use crate::memory;
use crate::stream::Stream;

/// Largest sample in sums; its square, and sums of squares, are far from overflow.
const MAX_SAMPLE: f64 = 1e75;

/// Smallest sum of the weights relative to the sum of their sizes; some weights may be negative.
const MIN_WEIGHT_SUM: f64 = 0.25;

/// Gyros of one body, with `A` axes each, fused into one gyro.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GyroArray<const A: usize> {
    params: ArrayParams,
    /// Matrices from each sensor's samples to the axes of the body.
    body_rotations: Option<Vec<f64>>,
    /// Filters of all axes of the first sensor, then of the next.
    filters: Vec<AutoFilter<f64>>,
    centralised: Centralised,
    noise: Noise,
    vote: Vote,
    /// Number of samples in a tick, and in the present tick.
    length: u32,
    position: u32,
    samples: u64,
    /// Mask of rest, axis by axis.
    at_rest: Vec<bool>,
    weights: Vec<f64>,
    used: Vec<bool>,
    /// Quality of each sensor's last sample, and its rates in the axes of the body.
    seen: Vec<Seen>,
    rates: Vec<f64>,
    /// Mask of the sensor's own axes with a rate near the other sensors' rates.
    near: Vec<bool>,
    /// The rates in order of size, axis by axis.
    sorted: Vec<f64>,
}

/// Quality of a sensor's last sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Seen {
    Whole,
    Missing,
    Saturated,
    Stuck,
}

/// Health of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Health {
    /// The sensor is used.
    Good,
    /// Part of its last sample was missing.
    Missing,
    /// Part of its last sample was at the end of the range.
    Saturated,
    /// The sensor repeats one sample.
    Stuck,
    /// The sensor disagrees with the others, or has not yet agreed with them for long enough.
    Excluded,
    /// The sensor is one of two remaining sensors that disagree.
    Disputed,
}

impl Health {
    /// Name of the health.
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Missing => "missing",
            Self::Saturated => "saturated",
            Self::Stuck => "stuck",
            Self::Excluded => "excluded",
            Self::Disputed => "disputed",
        }
    }
}

impl<const A: usize> GyroArray<A> {
    /// An array before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of range, [`Error::Memory`] if there is no memory.
    pub fn new(params: ArrayParams) -> Result<Self, Error> {
        params.check(A)?;
        let n = params.sensors;
        let filter = AutoFilter::new(params.of_filter())?;
        let length = filter.tick_length();
        Ok(Self {
            filters: memory::filled(filter, n * A)?,
            centralised: Centralised::new(n, A)?,
            noise: Noise::new(n, A)?,
            vote: Vote::new(n, A)?,
            length,
            position: 0,
            samples: 0,
            at_rest: memory::filled(false, A)?,
            weights: memory::filled(0.0, n * A)?,
            used: memory::filled(false, n * A)?,
            seen: memory::filled(Seen::Whole, n)?,
            rates: memory::filled(f64::NAN, n * A)?,
            near: memory::filled(false, n * A)?,
            sorted: memory::filled(f64::INFINITY, n * A)?,
            body_rotations: params.body_rotations::<A>()?,
            params,
        })
    }

    /// Parameters of the array.
    pub fn params(&self) -> &ArrayParams {
        &self.params
    }

    /// Processes a sample of every sensor, axis by axis; writes the rate of the body to `rate`.
    #[inline]
    pub fn update(&mut self, z: &[f64], rate: &mut [f64]) {
        self.samples += 1;
        if self.params.fusion == Fusion::Centralised {
            return self.centralise(z, rate);
        }
        for sensor in 0..self.params.sensors {
            self.take(sensor, &z[sensor * A..][..A]);
        }
        if self.params.sensors == 1 {
            self.alone(rate);
        } else {
            self.fuse(rate);
        }
        self.noise.add(z, &self.near, 2 * self.position < self.length);
        self.position += 1;
        if self.position >= self.length {
            self.end_tick();
        }
    }

    /// Resets to the state before the first sample.
    pub fn reset(&mut self) {
        if let Ok(fresh) = Self::new(self.params.clone()) {
            *self = fresh;
        }
    }

    /// Restarts after the sensors were off: forgets the biases, keeps noise and exclusions.
    pub fn power_on(&mut self) {
        self.filters.iter_mut().for_each(|filter| {
            filter.power_on();
        });
        self.centralised.restart();
        self.noise.interrupt();
        self.vote.forget_tick();
        self.position = 0;
        self.at_rest.fill(false);
    }

    /// Processes one sensor by its filters, and rotates its rates into the axes of the body.
    #[inline(always)]
    fn take(&mut self, sensor: usize, z: &[f64]) {
        let filters = &mut self.filters[sensor * A..][..A];
        let (mut rates, mut seen) = ([0.0; A], Seen::Whole);
        for axis in 0..A {
            rates[axis] = filters[axis].update(z[axis]);
            if filters[axis].is_stuck() {
                seen = Seen::Stuck;
                if self.params.sensors > 1 {
                    rates[axis] = f64::NAN;
                }
            } else if !rates[axis].is_finite() && seen != Seen::Stuck {
                let saturated = z[axis].is_finite();
                seen = if saturated || seen == Seen::Saturated {
                    Seen::Saturated
                } else {
                    Seen::Missing
                };
            }
        }
        self.seen[sensor] = seen;
        for axis in 0..A {
            self.near[sensor * A + axis] = rates[axis].is_finite();
        }
        let turned = self.turned(sensor, &rates);
        self.rates[sensor * A..][..A].copy_from_slice(&turned);
    }

    /// Rates of a sensor in the axes of the body.
    #[inline(always)]
    fn turned(&self, sensor: usize, rates: &[f64; A]) -> [f64; A] {
        match self.turn(sensor) {
            Some(turn) => rotate(turn, rates),
            None => *rates,
        }
    }

    /// The rotation of a sensor's samples, row by row.
    #[inline(always)]
    fn turn(&self, sensor: usize) -> Option<&[f64]> {
        self.body_rotations
            .as_deref()
            .map(|body_rotations| &body_rotations[sensor * A * A..][..A * A])
    }

    fn alone(&mut self, rate: &mut [f64]) {
        rate.copy_from_slice(&self.rates);
        for axis in 0..A {
            self.used[axis] = self.rates[axis].is_finite();
            self.weights[axis] = f64::from(u8::from(self.used[axis]));
        }
    }

    #[inline(always)]
    fn fuse(&mut self, rate: &mut [f64]) {
        let (centre, counts) = self.median();
        let speed = self.vote.note_speed(&centre);
        self.vote.note_centre(&centre, &counts);
        self.test_sensors(&centre, &counts, speed);
        self.weigh(speed);
        for axis in 0..A {
            rate[axis] = self.mean(axis, centre[axis]);
        }
    }

    /// Median of the voting sensors' rates, and their number, axis by axis.
    #[inline(always)]
    fn median(&mut self) -> ([f64; A], [usize; A]) {
        let mut counts = [0; A];
        for sensor in 0..self.params.sensors {
            let mut row = [f64::INFINITY; A];
            for axis in 0..A {
                let index = sensor * A + axis;
                let counts_here =
                    self.vote.counts(sensor, index, axis) && self.rates[index].is_finite();
                self.used[index] = counts_here;
                row[axis] = if counts_here { self.rates[index] } else { f64::INFINITY };
                counts[axis] += usize::from(counts_here);
            }
            insert(&mut self.sorted[..(sensor + 1) * A], row);
        }
        let at = |index: usize, axis: usize| self.sorted[index * A + axis];
        let middle = |axis: usize| match counts[axis] {
            0 => f64::NAN,
            count => 0.5 * at((count - 1) / 2, axis) + 0.5 * at(count / 2, axis),
        };
        (core::array::from_fn(middle), counts)
    }

    /// Leaves out samples that are far from the median.
    #[inline(always)]
    fn test_sensors(&mut self, centre: &[f64; A], counts: &[usize; A], speed: f64) {
        for sensor in 0..self.params.sensors {
            for axis in 0..A {
                let index = sensor * A + axis;
                if counts[axis] > 1 {
                    let far = self.vote.is_far(index, self.rates[index], centre[axis], speed);
                    if far && counts[axis] > 2 {
                        self.used[index] = false;
                        self.near[sensor * A..][..A].fill(false);
                    }
                }
            }
        }
    }

    /// Writes the weight of each used sensor.
    #[inline(always)]
    fn weigh(&mut self, speed: f64) {
        let wrong = self.params.scale_error * speed;
        let motion: [f64; A] = core::array::from_fn(|axis| self.noise.motion(axis, wrong));
        for sensor in 0..self.params.sensors {
            for axis in 0..A {
                let index = sensor * A + axis;
                let weight = self.noise.weight(&self.params.weights, index, motion[axis]);
                self.weights[index] = if self.used[index] { weight } else { 0.0 };
            }
        }
    }

    /// Weighted mean of the used sensors.
    #[inline(always)]
    fn mean(&mut self, axis: usize, centre: f64) -> f64 {
        let (mut sum, mut size) = (0.0, 0.0);
        for weight in self.weights.iter().skip(axis).step_by(A) {
            (sum, size) = (sum + weight, size + weight.abs());
        }
        // If the remaining weights almost cancel, they no longer have a meaning.
        if sum <= MIN_WEIGHT_SUM * size {
            sum = self.count_alike(axis);
        }
        if sum <= 0.0 {
            return centre;
        }
        let mut rate = 0.0;
        for index in (axis..self.used.len()).step_by(A) {
            self.weights[index] /= sum;
            if self.used[index] {
                rate += self.weights[index] * self.rates[index];
            }
        }
        rate
    }

    /// Gives all used sensors the same weight; returns their number.
    #[cold]
    fn count_alike(&mut self, axis: usize) -> f64 {
        let mut count = 0.0;
        for index in (axis..self.used.len()).step_by(A) {
            self.weights[index] = f64::from(u8::from(self.used[index]));
            count += self.weights[index];
        }
        count
    }

    #[cold]
    fn end_tick(&mut self) {
        self.position = 0;
        let n = self.params.sensors;
        for axis in 0..A {
            let resting = |sensor: &usize| self.is_resting(*sensor, axis);
            let resting = (0..n).filter(|i| !self.vote.is_excluded(*i)).filter(resting).count();
            let tested = (0..n).filter(|i| !self.vote.is_excluded(*i)).count();
            self.at_rest[axis] = 2 * resting > tested;
        }
        for sensor in 0..n {
            let halves = self.noise.take_halves::<A>(sensor, self.length);
            let halves = halves.map(|means| self.turned(sensor, &means));
            for axis in 0..A {
                let calm = self.at_rest[axis]
                    && self.is_resting(sensor, axis)
                    && !self.vote.is_excluded(sensor);
                let means = if calm { halves.map(|half| half[axis]) } else { noise::NO_MEAN };
                let sigma = self.deviation(sensor, axis);
                self.noise.end_position(sensor * A + axis, means, calm);
                self.vote.know(sensor * A + axis, sigma);
            }
        }
        for axis in 0..A {
            self.noise.end_tick(axis, self.at_rest[axis]);
            self.vote.know_centre(axis, A);
        }
        if n > 1 {
            self.vote.end_tick(A, self.ticks(vote::READMISSION_S));
        }
    }

    /// Number of ticks in this number of seconds.
    fn ticks(&self, seconds: f64) -> u32 {
        (seconds * self.params.rate / f64::from(self.length)).round().clamp(1.0, 1e6) as u32
    }

    /// Axes of a sensor that contribute to an axis of the body.
    fn parts(&self, sensor: usize, axis: usize) -> impl Iterator<Item = (usize, f64)> {
        let turn = self.turn(sensor).map(|turn| core::array::from_fn(|k| turn[axis * A + k]));
        let entries: [f64; A] =
            turn.unwrap_or_else(|| core::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 }));
        entries.into_iter().enumerate().filter(|(_, x)| *x != 0.0)
    }

    fn is_resting(&self, sensor: usize, axis: usize) -> bool {
        self.parts(sensor, axis).all(|(k, _)| self.filters[sensor * A + k].drift().at_rest)
    }

    /// Standard deviation of a sensor's white noise on an axis of the body; NaN before it is known.
    fn deviation(&self, sensor: usize, axis: usize) -> f64 {
        let variance: f64 = self
            .parts(sensor, axis)
            .map(|(k, x)| x * x * self.filters[sensor * A + k].settled_noise().unwrap_or(f64::NAN))
            .sum();
        // A rate is never known better than a step of the output.
        let step =
            self.parts(sensor, axis).map(|(k, x)| x * self.filters[sensor * A + k].resolution());
        (variance + step.map(|x| x * x).sum::<f64>()).sqrt()
    }

    fn centralise(&mut self, z: &[f64], rate: &mut [f64]) {
        for sensor in 0..self.params.sensors {
            let own = core::array::from_fn(|axis| z[sensor * A + axis]);
            let turned = self.turned(sensor, &own);
            self.rates[sensor * A..][..A].copy_from_slice(&turned);
        }
        for axis in 0..A {
            let count = self.centralised.take(axis, A, &self.rates, self.params.limit);
            rate[axis] = self.centralised.rate(axis);
            for sensor in 0..self.params.sensors {
                let index = sensor * A + axis;
                self.used[index] = self.centralised.took(index);
                let part = if self.used[index] { 1.0 / f64::from(count) } else { 0.0 };
                self.weights[index] = part;
            }
        }
    }
}

/// State after the last sample.
impl<const A: usize> GyroArray<A> {
    /// Biases of all sensors in their own axes, sensor by sensor.
    pub fn biases(&self) -> impl Iterator<Item = f64> {
        self.filters.iter().map(|filter| filter.bias())
    }

    /// Standard deviations of these biases, for their means over the next ten seconds.
    pub fn bias_sigmas(&self) -> impl Iterator<Item = f64> {
        self.filters.iter().map(|filter| filter.bias_sigma())
    }

    /// Weight of each sensor, axis by axis of the body; zero if it was not used.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Mask of used samples, axis by axis of the body.
    pub fn used(&self) -> &[bool] {
        &self.used
    }

    /// Mask of sensors excluded because they disagree with the others.
    pub fn excluded(&self) -> impl Iterator<Item = bool> {
        (0..self.params.sensors).map(|sensor| self.vote.is_excluded(sensor))
    }

    /// True if sensors disagree without a majority.
    pub fn is_disputed(&self) -> bool {
        self.vote.is_disputed()
    }

    /// Mask of rest, axis by axis.
    pub fn at_rest(&self) -> &[bool] {
        &self.at_rest
    }

    /// Samples to date, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.samples
    }

    /// Health of each sensor.
    pub fn health(&self) -> impl Iterator<Item = Health> {
        (0..self.params.sensors).map(|sensor| match self.seen[sensor] {
            _ if self.vote.is_excluded(sensor) => Health::Excluded,
            Seen::Stuck => Health::Stuck,
            Seen::Saturated => Health::Saturated,
            Seen::Missing => Health::Missing,
            Seen::Whole if self.vote.is_disputed() => Health::Disputed,
            Seen::Whole => Health::Good,
        })
    }

    /// Allan covariances at rest on an axis of the body, octave by octave.
    pub fn covariances(&self, axis: usize) -> impl Iterator<Item = Covariance<'_>> {
        self.noise.covariances(axis)
    }

    /// Number of samples in a tick.
    pub fn tick_length(&self) -> u32 {
        self.length
    }
}

/// A sample in the axes of the body; a missing axis makes all axes missing to which it contributes.
#[inline(always)]
fn rotate<const A: usize>(turn: &[f64], from: &[f64; A]) -> [f64; A] {
    core::array::from_fn(|i| {
        let mut sum = 0.0;
        for k in 0..A {
            let entry = turn[i * A + k];
            sum += if entry == 0.0 { 0.0 } else { entry * from[k] };
        }
        if sum.is_finite() { sum } else { f64::NAN }
    })
}

/// Inserts a row into rows sorted axis by axis, by exchanges only: a branch on the order of two
/// numbers would be unpredictable.
#[inline(always)]
fn insert<const A: usize>(sorted: &mut [f64], mut row: [f64; A]) {
    let last = sorted.len() - A;
    for other in sorted[..last].chunks_exact_mut(A) {
        for (mine, theirs) in row.iter_mut().zip(other) {
            let (less, more) = if *mine < *theirs { (*mine, *theirs) } else { (*theirs, *mine) };
            (*theirs, *mine) = (less, more);
        }
    }
    sorted[last..].copy_from_slice(&row);
}
