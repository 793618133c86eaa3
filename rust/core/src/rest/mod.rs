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
mod known;
mod run;
mod ticker;
mod times;

use serde::{Deserialize, Serialize};

use self::bounds::LOUD;
use self::candidate::Candidate;
use self::known::Known;
use self::run::Run;
use self::ticker::{Seen, Ticker};
use self::times::Times;
use crate::error::Error;
use crate::filter::Filter;
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
    times: Times,
    ticker: Ticker<T>,
    at_rest: bool,
    /// The rest that the start was taken for was none.
    deceived: bool,
    known: Option<Known<T>>,
    /// What was known before the last change of level or noise.
    home: Option<Known<T>>,
    candidate: Candidate<T>,
    /// Ticks near the level known.
    back: Run<T>,
    /// Ticks near the level of home.
    home_again: Run<T>,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> RestDetector<T> {
    /// A detector for `rate` samples a second.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the rate is not a positive number.
    pub fn new(rate: f64) -> Result<Self, Error> {
        check_rate(rate)?;
        let length = ((rate * 0.25 + 0.5) as u32).max(LEAST);
        Ok(Self::fresh(Times::new(rate, length), length))
    }

    fn fresh(times: Times, length: u32) -> Self {
        Self {
            times,
            ticker: Ticker::new(length),
            at_rest: false,
            deceived: false,
            known: None,
            home: None,
            candidate: Candidate::none(),
            back: Run::none(),
            home_again: Run::none(),
        }
    }

    /// Takes one sample; answers the tick that it completes.
    #[inline(always)]
    pub fn observe(&mut self, z: T) -> Option<Tick<T>> {
        let seen = self.ticker.observe(z)?;
        Some(self.judged(&seen))
    }

    /// Whether the sensor rests, as far as the last tick tells.
    pub fn at_rest(&self) -> bool {
        self.at_rest
    }

    /// Samples in a tick, missing ones included.
    pub fn tick_length(&self) -> u32 {
        self.ticker.length()
    }

    /// Whether another detector is one for the same rate.
    pub fn is_like(&self, other: &Self) -> bool {
        self.times == other.times && self.tick_length() == other.tick_length()
    }

    fn judged(&mut self, seen: &Seen<T>) -> Tick<T> {
        let telling = seen.count >= LEAST;
        let event = if telling { self.judge(seen) } else { None };
        Tick { count: seen.count, mean: seen.mean, calm: telling && self.at_rest, event }
    }

    fn judge(&mut self, seen: &Seen<T>) -> Option<Event> {
        match self.known {
            None => self.begin(seen),
            Some(known) if self.at_rest => self.rest(known, seen),
            Some(known) => self.motion(known, seen),
        }
    }

    /// Before anything is known.
    fn begin(&mut self, seen: &Seen<T>) -> Option<Event> {
        let length = self.ticker.length();
        self.candidate.take(seen, length);
        let Times { dwell, short, .. } = self.times;
        let (needed, trust) = if self.deceived { (short, short) } else { (dwell, 0) };
        if self.candidate.ticks < needed {
            return None;
        }
        self.known = Some(Known::new(&self.candidate, length, trust));
        self.at_rest = true;
        Some(Event::Rest)
    }

    fn rest(&mut self, mut known: Known<T>, seen: &Seen<T>) -> Option<Event> {
        if let Some(event) = self.go_home(&known, seen) {
            return Some(event);
        }
        if known.holds(seen) {
            self.known = Some(known);
            return None;
        }
        self.at_rest = false;
        self.candidate = Candidate::of(seen);
        self.back = Run::none();
        if known.trust < self.times.short {
            self.known = None;
            self.deceived = true;
            return Some(Event::Restart);
        }
        known.leave(self.times.short);
        self.known = Some(known);
        Some(Event::Motion)
    }

    fn motion(&mut self, known: Known<T>, seen: &Seen<T>) -> Option<Event> {
        self.candidate.take(seen, self.ticker.length());
        self.back.take(known.is_near(seen), seen.level);
        if self.back.has_arrived(self.times.dwell, &known, seen.step) {
            self.resume(known, self.back);
            return Some(Event::Rest);
        }
        self.go_home(&known, seen).or_else(|| self.adopt(&known, seen))
    }

    /// Returns to what was known before, if the sensor has done so.
    fn go_home(&mut self, known: &Known<T>, seen: &Seen<T>) -> Option<Event> {
        let home = self.home?;
        self.home_again.take(home.is_near(seen), seen.level);
        let louder = known.noise.variance > T::of(LOUD) * home.noise.variance;
        let arrived = self.home_again.has_arrived(self.times.dwell, &home, seen.step);
        if !arrived || (self.at_rest && !louder) {
            return None;
        }
        self.home = None;
        self.resume(home, self.home_again);
        Some(match home.is_level(known.slow_level(), seen.step) {
            true => Event::Rest,
            false => Event::Restart,
        })
    }

    fn resume(&mut self, mut known: Known<T>, run: Run<T>) {
        known.resume(run.level, run.ticks);
        self.known = Some(known);
        self.at_rest = true;
        self.home_again = Run::none();
    }

    /// Takes what has stood still for long enough for rest.
    fn adopt(&mut self, known: &Known<T>, seen: &Seen<T>) -> Option<Event> {
        if T::of(f64::from(self.candidate.ticks)) < self.needed(known, seen.step) {
            return None;
        }
        let length = self.ticker.length();
        let mut adopted = Known::new(&self.candidate, length, self.times.short);
        let ratio = T::of(LOUD);
        let (new, old) = (self.candidate.variance, known.noise.variance);
        if new <= old * ratio && new * ratio >= old {
            adopted.noise = known.noise;
        }
        if known.trust >= self.times.long {
            self.home = Some(*known);
        }
        self.known = Some(adopted);
        self.at_rest = true;
        self.home_again = Run::none();
        Some(match known.is_level(self.candidate.level, seen.step) {
            true => Event::Rest,
            false => Event::Restart,
        })
    }

    /// Ticks that a candidate needs: the farther it is and the louder, the longer.
    fn needed(&self, known: &Known<T>, step: T) -> T {
        let Times { dwell, short, long } = self.times;
        let candidate = &self.candidate;
        let level_stands = known.is_level(candidate.level, step)
            && known.is_as_steady(candidate.level_variance(), step);
        if level_stands {
            return T::of(2.0 * f64::from(dwell));
        }
        let long = T::of(f64::from(long));
        let deviation = known.noise.variance.simd_sqrt();
        if deviation == T::zero() {
            return long;
        }
        let louder = (candidate.variance.simd_sqrt() / deviation).simd_sqrt();
        let times = known.distance(candidate.level) / deviation + louder.at_least(T::one());
        (T::of(f64::from(short)) * times).at_most(long)
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Filter<T> for RestDetector<T> {
    /// Answers one at rest, else zero.
    #[inline]
    fn update(&mut self, z: T) -> T {
        self.observe(z);
        if self.at_rest { T::one() } else { T::zero() }
    }

    fn reset(&mut self) {
        *self = Self::fresh(self.times, self.ticker.length());
    }
}
