//! Whether a sensor rests, told from one channel of a gyroscope alone.
//!
//! Samples are put together to ticks of a quarter of a second. What ticks show at rest is learned:
//! how much the samples vary within one, and how far its level lies from averages of 1, 4 and 16 s.
//! A tick beyond what chance does once in a million ends the rest; one and a half seconds near the
//! level of the last rest begin the next.
//!
//! No gyroscope tells slow turning at one rate from a bias, and no sensor keeps its bias or its
//! noise for ever. So a level not known before is taken for rest if it stands still: after 10 s if
//! it is near, after 60 s if it is five deviations of the samples off. What was known before is kept
//! and returned to in one and a half seconds.

mod bounds;
mod candidate;
mod judge;
mod known;
mod run;
mod ticker;
mod times;

use serde::{Deserialize, Serialize};

use self::judge::Judge;
use self::ticker::{Seen, Ticker};
use self::times::Times;
use crate::error::Error;
use crate::filter::{Filter, SideBySide};
use crate::params::check_rate;
use crate::real::{Limits, Real};

/// Fewest samples that tell a mean and a variance without the farthest of them.
const LEAST: u32 = 4;

/// What changed at the end of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// A rest began at the level known.
    Rest,
    /// The rest is over: the tick that says so, and perhaps the one before, belong to motion.
    Motion,
    /// What was taken for rest was none, or its level holds no longer: what was learned of it is
    /// to be forgotten.
    Restart,
}

/// A quarter of a second, but four samples at least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick<T> {
    /// Samples that were not missing.
    pub count: u32,
    /// Their mean, if there are any.
    pub mean: T,
    /// Their deviation from it, zero for less than two.
    pub deviation: T,
    /// Whether it belongs to a rest. A tick of fewer than four samples tells nothing and does not.
    pub calm: bool,
    /// What changed with it.
    pub event: Option<Event>,
}

/// Tells rest from motion.
///
/// Decisions do not depend on the unit of the samples, nor on a constant added to them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RestDetector<T> {
    ticker: Ticker<T>,
    judge: Judge<T>,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> RestDetector<T> {
    /// A detector for `rate` samples a second.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the rate is not a positive number.
    pub fn new(rate: f64) -> Result<Self, Error> {
        check_rate(rate)?;
        let times = Times::new(rate);
        Ok(Self { ticker: Ticker::new(times.tick), judge: Judge::new(times) })
    }

    /// Takes one sample; answers the tick that it completes.
    #[inline(always)]
    pub fn observe(&mut self, z: T) -> Option<Tick<T>> {
        let seen = self.ticker.observe(z)?;
        Some(self.judged(&seen))
    }

    /// Whether the sensor rests, as far as the last tick tells.
    pub fn at_rest(&self) -> bool {
        self.judge.at_rest
    }

    /// Samples in a tick, missing ones included.
    pub fn tick_length(&self) -> u32 {
        self.judge.times.tick
    }

    /// Whether another detector is one for the same rate.
    pub fn is_like(&self, other: &Self) -> bool {
        self.judge.times == other.judge.times && self.ticker.length() == other.ticker.length()
    }

    fn judged(&mut self, seen: &Seen<T>) -> Tick<T> {
        let telling = seen.count >= LEAST;
        let event = if telling { self.judge.take(seen) } else { None };
        let calm = telling && self.at_rest();
        Tick { count: seen.count, mean: seen.mean, deviation: seen.deviation, calm, event }
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Filter<T> for RestDetector<T> {
    /// Answers one at rest, else zero.
    #[inline]
    fn update(&mut self, z: T) -> T {
        self.observe(z);
        if self.at_rest() { T::one() } else { T::zero() }
    }

    fn reset(&mut self) {
        let times = self.judge.times;
        *self = Self { ticker: Ticker::new(times.tick), judge: Judge::new(times) };
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> SideBySide<T> for RestDetector<T> {}
