//! Motion detected by an accelerometer: in the axes of a rotating body gravity changes.
//!
//! Unit, bias and noise are unknown, and gravity itself is the measure. Means of 1, 2, 4, …, 64
//! successive ticks are compared with the previous means. If gravity has turned, or the body
//! accelerates, they differ by more than the samples' noise explains. A rotation about the vertical
//! is not detected, and a slow rotation only after some time.

use serde::{Deserialize, Serialize};

use super::MIN_SAMPLES;
use super::decision::Times;
use crate::error::{Error, check_rate};
use crate::math::validity::{is_size, is_within};
use crate::stream::Stream;
use crate::stream::checkpoint::Checkpoint;

/// Number of scales: means of up to 64 ticks, sixteen seconds.
const SCALES: usize = 7;

/// Smallest difference of means in motion, as a share of gravity: a rotation by 0.4 degrees. Cheap
/// accelerometers at rest jump by a third of it.
const MIN_TURN_SHARE: f64 = 1.0 / 150.0;

/// Ratio of a squared difference to its variance that chance does not reach. The variance includes
/// all axes: a difference on one axis alone is five standard deviations.
const MIN_DIFFERENCE_RATIO: f64 = 25.0;

/// Largest number of independent samples in a tick: a sensor's filter correlates neighbours.
const MAX_INDEPENDENT_SAMPLES: u32 = 8;

/// Smallest ratio of the variance to the quiet ticks' variance at which a moved body still shakes.
const MIN_SHAKE_RATIO: f64 = 4.0;

/// Number of ticks by which a loud tick prolongs a motion.
const SHAKE_TICKS: u32 = 3;

/// Gain of the quiet ticks' variance per tick, downwards and upwards.
const VARIANCE_FALL_GAIN: f64 = 1.0 / 8.0;
const VARIANCE_RISE_GAIN: f64 = 1.0 / 240.0;

/// Largest component; its square is far from overflow.
const MAX_COMPONENT: f64 = 1e75;

/// Detects that a body moves, from its accelerometer alone. It cannot detect that the body is at
/// rest.
///
/// The samples may have any unit and any axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MotionDetector {
    rate: f64,
    length: u32,
    /// Largest number of ticks by which loud ticks prolong a motion: a new noise may be an
    /// engine's.
    patience: u32,
    position: u32,
    sums: Sums,
    scales: [Successive; SCALES],
    /// Number of ticks that still count as motion.
    left: u32,
    /// Number of ticks since gravity was last seen to turn.
    since: u32,
    /// Variance of a sample without motion.
    quiet: Option<f64>,
}

/// Sums over the samples of a tick, relative to the first sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Sums {
    count: u32,
    origin: [f64; 3],
    sum: [f64; 3],
    squares: f64,
}

/// Mean of some ticks, and its variance over all axes together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Mean {
    level: [f64; 3],
    variance: f64,
}

/// Means of a number of ticks, one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Successive {
    last: Option<Mean>,
    /// True if the last mean is the first half of a mean twice as long.
    halves: bool,
}

impl MotionDetector {
    /// A detector for `rate` samples per second.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the rate is not a positive number.
    pub fn new(rate: f64) -> Result<Self, Error> {
        check_rate(rate)?;
        let times = Times::new(rate);
        Ok(Self {
            rate,
            length: times.tick,
            patience: times.long,
            position: 0,
            sums: Sums::none(),
            scales: [Successive::NONE; SCALES],
            left: 0,
            since: times.long,
            quiet: None,
        })
    }

    /// True if the body moves in the last tick.
    pub fn is_moving(&self) -> bool {
        self.left > 0
    }

    /// Samples per second.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// Ends a tick; a tick with few samples continues in the next tick.
    fn end_tick(&mut self) {
        self.position = 0;
        self.left = self.left.saturating_sub(1);
        self.since = (self.since + 1).min(self.patience);
        if self.sums.count >= MIN_SAMPLES {
            let (mean, variance) = self.sums.mean_and_variance();
            self.sums = Sums::none();
            self.test(mean, variance);
        }
    }

    fn test(&mut self, mean: Mean, variance: f64) {
        if let Some(scale) = self.turned(mean) {
            // A motion that took long to detect may take as long until it is detected again.
            self.left = self.left.max((3 << scale) - 1);
            self.since = 0;
            self.scales = [Successive::NONE; SCALES];
        } else if self.is_moving() && self.shakes(variance) {
            self.left = self.left.max(SHAKE_TICKS);
        }
        if !self.is_moving() {
            let quiet = self.quiet.unwrap_or(variance);
            let share = if variance < quiet { VARIANCE_FALL_GAIN } else { VARIANCE_RISE_GAIN };
            self.quiet = Some(quiet + (variance - quiet) * share);
        }
    }

    /// Shortest scale at which gravity has turned.
    fn turned(&mut self, tick: Mean) -> Option<usize> {
        let mut mean = tick;
        for (scale, successive) in self.scales.iter_mut().enumerate() {
            let before = successive.last.replace(mean);
            if before.is_some_and(|before| mean.differs(&before)) {
                return Some(scale);
            }
            let first = before.filter(|_| successive.halves);
            successive.halves = !successive.halves;
            mean = first?.join(&mean);
        }
        None
    }

    /// True if a tick of a motion is louder than rest; false before the first rest.
    fn shakes(&self, variance: f64) -> bool {
        self.since < self.patience
            && self.quiet.is_some_and(|quiet| variance > MIN_SHAKE_RATIO * quiet)
    }
}

impl Sums {
    fn none() -> Self {
        Self { count: 0, origin: [0.0; 3], sum: [0.0; 3], squares: 0.0 }
    }

    fn add(&mut self, sample: [f64; 3]) {
        let sample = sample.map(|x| x.clamp(-MAX_COMPONENT, MAX_COMPONENT));
        if self.count == 0 {
            self.origin = sample;
        }
        self.count += 1;
        for i in 0..3 {
            let distance = sample[i] - self.origin[i];
            self.sum[i] += distance;
            self.squares += distance * distance;
        }
    }

    /// Mean of the samples, and variance of a sample.
    fn mean_and_variance(&self) -> (Mean, f64) {
        let n = f64::from(self.count);
        let above = self.sum.map(|x| x / n);
        let variance = ((self.squares - n * square(above)) / (n - 1.0)).max(0.0);
        let level = core::array::from_fn(|i| self.origin[i] + above[i]);
        let variance_of_mean = variance / f64::from(self.count.min(MAX_INDEPENDENT_SAMPLES));
        (Mean { level, variance: variance_of_mean }, variance)
    }
}

impl Mean {
    /// Mean of two equally long means.
    fn join(&self, next: &Self) -> Self {
        let level = core::array::from_fn(|i| 0.5 * (self.level[i] + next.level[i]));
        Self { level, variance: 0.25 * (self.variance + next.variance) }
    }

    /// True if gravity has turned, beyond what noise explains.
    fn differs(&self, before: &Self) -> bool {
        let change = square(core::array::from_fn(|i| self.level[i] - before.level[i]));
        let noise = MIN_DIFFERENCE_RATIO * (self.variance + before.variance);
        change > noise && change > MIN_TURN_SHARE * MIN_TURN_SHARE * square(self.level)
    }
}

impl Successive {
    const NONE: Self = Self { last: None, halves: false };
}

fn square(x: [f64; 3]) -> f64 {
    x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
}

impl Stream for MotionDetector {
    type Input = [f64; 3];
    type Output = bool;

    /// Processes a sample of all axes, missing if an axis is missing; returns true if the body
    /// moves.
    #[inline]
    fn update(&mut self, sample: [f64; 3]) -> bool {
        if sample.iter().all(|x| x.is_finite()) {
            self.sums.add(sample);
        }
        self.position += 1;
        if self.position >= self.length {
            self.end_tick();
        }
        self.is_moving()
    }

    fn reset(&mut self) {
        if let Ok(fresh) = Self::new(self.rate) {
            *self = fresh;
        }
    }
}

impl Checkpoint for MotionDetector {
    const TAG: &'static str = "motion-detector";
    const VERSION: u16 = 1;

    fn is_valid(&self) -> bool {
        Self::new(self.rate).is_ok_and(|fresh| {
            (self.length, self.patience) == (fresh.length, fresh.patience)
                && self.position < self.length
                && self.sums.is_valid(self.position)
                && self.scales.iter().all(Successive::is_valid)
                && self.left < 3 << (SCALES - 1)
                && self.since <= self.patience
                && self.quiet.is_none_or(is_variance)
        })
    }

    fn is_like(&self, other: &Self) -> bool {
        (self.rate, self.position) == (other.rate, other.position)
    }
}

impl Sums {
    /// True if samples can have led to this state, at most `position` of them in this tick.
    fn is_valid(&self, position: u32) -> bool {
        // Some samples may wait for the next tick.
        let most = 2.0 * MAX_COMPONENT * f64::from(self.count);
        self.count < position + MIN_SAMPLES
            && is_vector(self.origin, MAX_COMPONENT)
            && is_vector(self.sum, most)
            && is_size(self.squares, 6.0 * MAX_COMPONENT * most)
    }
}

impl Successive {
    fn is_valid(&self) -> bool {
        // Means are rounded.
        let is_mean =
            |mean: Mean| is_vector(mean.level, 3.0 * MAX_COMPONENT) && is_variance(mean.variance);
        self.last.is_none_or(is_mean) && (self.last.is_some() || !self.halves)
    }
}

fn is_vector(x: [f64; 3], most: f64) -> bool {
    x.iter().all(|x| is_within(*x, most))
}

/// True for a variance that samples within the bounds can have.
fn is_variance(x: f64) -> bool {
    is_size(x, 24.0 * MAX_COMPONENT * MAX_COMPONENT)
}
