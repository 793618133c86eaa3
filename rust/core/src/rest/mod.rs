//! Rest detection from one channel of a gyroscope.
//!
//! Samples form ticks of a quarter of a second. Two values are learned at rest: the variance of
//! samples within a tick, and the distance of a tick's mean from averages over 1, 4 and 16 s. A
//! tick ends the rest if chance explains its value only once in a million. The next rest begins
//! after 1.5 s near the level of the last rest.
//!
//! A gyroscope cannot distinguish a slow steady rotation from a bias, and a sensor's bias and noise
//! change. A new level therefore counts as rest if it stays constant for some time. This time is 10
//! s, plus about 11 s for each standard deviation of the samples between the old and the new level,
//! at most 60 s. The detector keeps the old level: a return to it takes 1.5 s. An accelerometer
//! detects most such rotations: [`MotionDetector`].

mod bounds;
mod candidate;
mod decision;
mod gate;
mod model;
mod motion;
pub(crate) mod quiet;
mod repeats;
#[cfg(feature = "std")]
pub(crate) mod side_by_side;
mod still;
mod sums;
mod ticker;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use self::decision::{Decision, Times};
pub use self::motion::MotionDetector;
pub use self::quiet::{QuietLimits, longest_quiet};
pub(crate) use self::ticker::Run;
use self::ticker::{TickSums, Ticker};
use crate::error::{Error, check_positive, check_rate};
use crate::math::{Limits, Real};
use crate::stream::checkpoint::Checkpoint;
use crate::stream::{Number, Stream};

/// Smallest number of samples for a mean and a variance without the farthest sample.
pub(crate) const MIN_SAMPLES: u32 = 4;

/// Change at the end of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// A rest began at the known level.
    Rest,
    /// The rest ended: this tick, and possibly the previous tick, belong to motion.
    Motion,
    /// The rest was false, or its level is outdated: everything learned from it must be forgotten.
    Restart,
}

/// A quarter of a second, at least four samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick<T> {
    /// Number of used samples, which are not missing, outliers or stuck. Fewer than four are added
    /// to the next tick.
    pub count: u32,
    /// Mean of the samples, if there are any.
    pub mean: T,
    /// Standard deviation of the samples, zero for fewer than two.
    pub deviation: T,
    /// True if the tick belongs to a rest; false for a tick without samples.
    pub calm: bool,
    /// Number of outliers.
    pub outliers: u32,
    /// Number of samples of a stuck sensor.
    pub stuck: u32,
    /// Change at the end of the tick.
    pub event: Option<Event>,
}

/// Limits of rest, in the samples' unit: a rest never exceeds them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct RestLimits {
    /// Largest standard deviation within a tick at rest. The means of six ticks may spread by at
    /// most 0.3 times this limit.
    pub rest: Option<f64>,
    /// Largest level at rest.
    pub bias: Option<f64>,
}

impl RestLimits {
    /// The limits, if they are positive numbers.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first limit that is not positive.
    pub fn validate(self) -> Result<Self, Error> {
        let check = |name, limit: Option<f64>| {
            limit.map_or(Ok(()), |limit| check_positive(name, "a positive number", limit))
        };
        check("rest_limit", self.rest)?;
        check("bias_limit", self.bias)?;
        Ok(self)
    }
}

/// Distinguishes rest from motion.
///
/// Decisions do not depend on the samples' unit or on a constant added to them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RestDetector<T> {
    rate: f64,
    limits: RestLimits,
    ticker: Ticker<T>,
    decision: Decision<T>,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> RestDetector<T> {
    /// A detector for `rate` samples per second.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the rate or a limit is not a positive number.
    pub fn new(rate: f64, limits: RestLimits) -> Result<Self, Error> {
        check_rate(rate)?;
        let (times, limits) = (Times::new(rate), limits.validate()?);
        let ticker = Ticker::new(rate, times.tick);
        Ok(Self { rate, limits, ticker, decision: Decision::new(times, limits) })
    }

    /// Processes one sample; returns the tick that it completes.
    #[inline(always)]
    pub fn observe(&mut self, z: T) -> Option<Tick<T>> {
        self.observe_while(z, false)
    }

    /// [`observe`](Self::observe) with a flag of motion, for example from a [`MotionDetector`]: a
    /// tick with `moving` at its end is never at rest.
    #[inline(always)]
    pub fn observe_while(&mut self, z: T, moving: bool) -> Option<Tick<T>> {
        let seen = self.ticker.observe(z)?;
        Some(self.decide(&seen, moving))
    }

    /// True if no sample has come since the last tick.
    pub(crate) fn begins(&self) -> bool {
        self.ticker.position == 0
    }

    /// True if the sensor is at rest in the last tick.
    pub fn at_rest(&self) -> bool {
        self.decision.at_rest
    }

    /// True if the assumed rest may be motion: no stronger motion was seen and it has lasted less
    /// than a minute. False if there is a limit of rest.
    pub fn is_provisional(&self) -> bool {
        self.decision.is_provisional()
    }

    /// Number of consecutive ticks, up to the last one, that may become the first rest.
    pub fn standing(&self) -> u32 {
        self.decision.standing()
    }

    /// True if the sensor repeats one sample for longer than can be chance.
    pub fn is_stuck(&self) -> bool {
        self.ticker.is_stuck()
    }

    /// A sample limited to the bounds of outliers, before it is processed; NaN for a presumed
    /// outlier.
    pub fn gate_sample(&self, z: T) -> T {
        self.ticker.gate_sample(z)
    }

    /// Relation of a sample, before it is processed, to the run of equal samples at the last
    /// sample.
    pub(crate) fn run_with(&self, z: T) -> Run {
        self.ticker.run_with(z)
    }

    /// Number of samples in the present tick that may be found to be outliers, or from a stuck
    /// sensor, at its end.
    pub(crate) fn pending(&self) -> u64 {
        u64::from(self.ticker.pending())
    }

    /// Smallest step of the samples to date, zero if there was none.
    #[cfg(feature = "std")]
    pub(crate) fn resolution(&self) -> T {
        self.ticker.resolution()
    }

    /// Limits of rest.
    pub fn limits(&self) -> RestLimits {
        self.limits
    }

    /// Number of samples in a tick, missing ones included.
    pub fn tick_length(&self) -> u32 {
        self.decision.times.tick
    }

    /// Samples per second.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// Ends a tick whose last sample was processed elsewhere.
    #[cfg(feature = "std")]
    pub(crate) fn finished(&mut self) -> Option<Tick<T>> {
        let seen = self.ticker.finished()?;
        Some(self.decide(&seen, false))
    }

    /// Number of samples that the present tick still needs.
    #[cfg(feature = "std")]
    pub(crate) fn left(&self) -> u32 {
        self.ticker.length - self.ticker.position
    }

    /// True if learning from the first second is over.
    #[cfg(feature = "std")]
    pub(crate) fn is_settled(&self) -> bool {
        self.ticker.is_settled()
    }

    /// Resets to the state before the first sample.
    pub fn restart(&mut self) {
        let times = self.decision.times;
        self.ticker = Ticker::new(self.rate, times.tick);
        self.decision = Decision::new(times, self.limits);
    }

    fn decide(&mut self, seen: &TickSums<T>, moving: bool) -> Tick<T> {
        let event = match (self.ticker.is_lost(), seen.count > 0) {
            (true, _) => {
                self.restart();
                Some(Event::Restart)
            }
            (false, true) => self.decision.take(seen, moving),
            (false, false) => None,
        };
        if let Some(variance) = self.decision.begun(event) {
            self.ticker.rest(variance);
        }
        let TickSums { count, mean, outliers, stuck, .. } = *seen;
        let deviation = if count > 0 { seen.deviation } else { T::zero() };
        let calm = count > 0 && self.at_rest();
        Tick { count, mean, deviation, calm, event, outliers, stuck }
    }
}

/// A stream with a flag of the body's motion, for example from a [`MotionDetector`].
pub trait MotionAware: Stream {
    /// Processes one sample. If `moving`, the body is known to move; else its motion is unknown. A
    /// stream that treats every sample as rest ignores the flag.
    #[inline]
    fn update_while(&mut self, input: Self::Input, moving: bool) -> Self::Output {
        let _ = moving;
        self.update(input)
    }
}

impl<T: Number> MotionAware for RestDetector<T> {
    #[inline]
    fn update_while(&mut self, z: T, moving: bool) -> bool {
        self.observe_while(z, moving);
        self.at_rest()
    }
}

impl<T: Number> Stream for RestDetector<T> {
    type Input = T;
    type Output = bool;

    /// Returns true if the sensor rests.
    #[inline]
    fn update(&mut self, z: T) -> bool {
        self.update_while(z, false)
    }

    fn reset(&mut self) {
        self.restart();
    }
}

impl<T> Checkpoint for RestDetector<T>
where
    T: Limits + Real<Element = T, SimdBool = bool> + Serialize + DeserializeOwned,
{
    const TAG: &'static str = "rest-detector";
    const VERSION: u16 = 4;

    fn is_valid(&self) -> bool {
        Self::new(self.rate, self.limits).is_ok_and(|fresh| {
            self.ticker.is_after(&fresh.ticker) && self.decision.is_after(&fresh.decision)
        })
    }

    fn is_like(&self, other: &Self) -> bool {
        (self.rate, self.limits) == (other.rate, other.limits)
    }
}
