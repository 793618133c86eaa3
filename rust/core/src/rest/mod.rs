//! Rest detection from one channel of a gyroscope alone.
//!
//! Samples are put together to ticks of a quarter of a second. What ticks show at rest is learned:
//! how much the samples vary within one, and how far its level lies from averages of 1, 4 and 16 s.
//! A tick beyond what chance does once in a million ends the rest; one and a half seconds near the
//! level of the last rest begin the next.
//!
//! No gyroscope tells slow turning at one rate from a bias, and no sensor keeps its bias or its
//! noise for ever. So a new level counts as rest if it stays constant: after 10 s,
//! and about 11 s for each deviation of the samples that it lies off, 60 s at most. What was known
//! before is kept and returned to in one and a half seconds. Of many such turns an accelerometer knows
//! better: [`MotionDetector`].

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

/// Fewest samples that tell a mean and a variance without the farthest of them.
pub(crate) const MIN_SAMPLES: u32 = 4;

/// Change at the end of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// A rest began at the level known.
    Rest,
    /// The rest is over: the tick that says so, and perhaps the one before, belong to motion.
    Motion,
    /// The rest was false, or its level holds no longer: all learned from it is to be forgotten.
    Restart,
}

/// A quarter of a second, but four samples at least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick<T> {
    /// Samples that count: neither missing nor outliers nor a stuck sensor's. Fewer than four are
    /// counted with those of the next tick.
    pub count: u32,
    /// Their mean, if there are any.
    pub mean: T,
    /// Their deviation from it, zero for less than two.
    pub deviation: T,
    /// True if it belongs to a rest. A tick without samples tells nothing and does not.
    pub calm: bool,
    /// Number of outliers.
    pub outliers: u32,
    /// Samples that a stuck sensor gave.
    pub stuck: u32,
    /// Change with it.
    pub event: Option<Event>,
}

/// Limits of rest, in the unit of the samples: nothing beyond is ever learned as rest.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct RestLimits {
    /// Deviation within a tick that no sensor of this kind has at rest; its ticks' means spread over
    /// 1.5 s by three tenths of it at most.
    pub rest: Option<f64>,
    /// Level that no sensor of this kind has at rest.
    pub bias: Option<f64>,
}

impl RestLimits {
    /// The limits, if they are positive numbers.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first that is not.
    pub fn validate(self) -> Result<Self, Error> {
        let check = |name, limit: Option<f64>| {
            limit.map_or(Ok(()), |limit| check_positive(name, "a positive number", limit))
        };
        check("rest_limit", self.rest)?;
        check("bias_limit", self.bias)?;
        Ok(self)
    }
}

/// Tells rest from motion.
///
/// Decisions do not depend on the unit of the samples, nor on a constant added to them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RestDetector<T> {
    rate: f64,
    limits: RestLimits,
    ticker: Ticker<T>,
    decision: Decision<T>,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> RestDetector<T> {
    /// A detector for `rate` samples a second.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the rate or a limit is not a positive number.
    pub fn new(rate: f64, limits: RestLimits) -> Result<Self, Error> {
        check_rate(rate)?;
        let (times, limits) = (Times::new(rate), limits.validate()?);
        let ticker = Ticker::new(rate, times.tick);
        Ok(Self { rate, limits, ticker, decision: Decision::new(times, limits) })
    }

    /// Takes one sample; returns the tick that it completes.
    #[inline(always)]
    pub fn observe(&mut self, z: T) -> Option<Tick<T>> {
        self.observe_while(z, false)
    }

    /// The same where something else may know of motion, such as a [`MotionDetector`]: a tick at
    /// whose end the body is `moving` is never one of rest.
    #[inline(always)]
    pub fn observe_while(&mut self, z: T, moving: bool) -> Option<Tick<T>> {
        let seen = self.ticker.observe(z)?;
        Some(self.decide(&seen, moving))
    }

    /// True if no sample has come since the last tick.
    pub(crate) fn begins(&self) -> bool {
        self.ticker.position == 0
    }

    /// True if the sensor rests, as far as the last tick tells.
    pub fn at_rest(&self) -> bool {
        self.decision.at_rest
    }

    /// True if the assumed rest may also be motion: nothing louder has been seen to date, and
    /// it has not yet lasted for a minute. Never if there is a limit of what rest can be.
    pub fn is_provisional(&self) -> bool {
        self.decision.is_provisional()
    }

    /// Ticks in a row, up to the last one, that may become the first rest.
    pub fn standing(&self) -> u32 {
        self.decision.standing()
    }

    /// True if the sensor has given the same sample for longer than chance does.
    pub fn is_stuck(&self) -> bool {
        self.ticker.is_stuck()
    }

    /// A sample before it is taken, with the bounds that outliers have; NaN for one that is an
    /// outlier as far as is known before its tick is complete.
    pub fn gate_sample(&self, z: T) -> T {
        self.ticker.gate_sample(z)
    }

    /// The relation of a sample, before it is taken, to the run of equal ones that the last one
    /// belongs to.
    pub(crate) fn run_with(&self, z: T) -> Run {
        self.ticker.run_with(z)
    }

    /// Samples of the tick under way of which its end may say that they are outliers, or of a stuck
    /// sensor.
    pub(crate) fn pending(&self) -> u64 {
        u64::from(self.ticker.pending())
    }

    /// Smallest step of the samples to date, zero if there was none.
    #[cfg(feature = "std")]
    pub(crate) fn resolution(&self) -> T {
        self.ticker.resolution()
    }

    /// The limits of rest.
    pub fn limits(&self) -> RestLimits {
        self.limits
    }

    /// Samples in a tick, missing ones included.
    pub fn tick_length(&self) -> u32 {
        self.decision.times.tick
    }

    /// Samples a second.
    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// The tick of which others have taken the last sample.
    #[cfg(feature = "std")]
    pub(crate) fn finished(&mut self) -> Option<Tick<T>> {
        let seen = self.ticker.finished()?;
        Some(self.decide(&seen, false))
    }

    /// Samples that are still to come of the tick under way.
    #[cfg(feature = "std")]
    pub(crate) fn left(&self) -> u32 {
        self.ticker.length - self.ticker.position
    }

    /// True if nothing of the first second is to be learned any more.
    #[cfg(feature = "std")]
    pub(crate) fn is_settled(&self) -> bool {
        self.ticker.is_settled()
    }

    /// Back to before the first sample.
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

/// A stream that takes a flag of the body's motion, such as that of a [`MotionDetector`].
pub trait MotionAware: Stream {
    /// Takes one sample of a body that is known to be `moving`, or of which nothing is known. A
    /// stream that takes every sample for rest does so here too.
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
