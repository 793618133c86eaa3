//! What a tick says about rest, and what is known of it.

use serde::{Deserialize, Serialize};

use super::Event;
use super::bounds::LOUD;
use super::candidate::Candidate;
use super::known::Known;
use super::run::Run;
use super::ticker::Seen;
use super::times::Times;
use crate::real::{Limits, Real};

/// Tells rest from motion, tick by tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Judge<T> {
    pub times: Times,
    pub at_rest: bool,
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

impl<T: Limits + Real<Element = T, SimdBool = bool>> Judge<T> {
    pub(super) fn new(times: Times) -> Self {
        Self {
            times,
            at_rest: false,
            deceived: false,
            known: None,
            home: None,
            candidate: Candidate::none(),
            back: Run::none(),
            home_again: Run::none(),
        }
    }

    /// Judges a tick; answers what changed.
    pub(super) fn take(&mut self, seen: &Seen<T>) -> Option<Event> {
        match self.known {
            None => self.begin(seen),
            Some(known) if self.at_rest => self.rest(known, seen),
            Some(known) => self.motion(known, seen),
        }
    }

    /// Before anything is known.
    fn begin(&mut self, seen: &Seen<T>) -> Option<Event> {
        self.candidate.take(seen, self.times.tick);
        let Times { dwell, short, .. } = self.times;
        let (needed, trust) = if self.deceived { (short, short) } else { (dwell, 0) };
        if self.candidate.ticks < needed {
            return None;
        }
        self.known = Some(Known::new(&self.candidate, self.times.tick, trust));
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
        self.candidate.take(seen, self.times.tick);
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
        let mut adopted = Known::new(&self.candidate, self.times.tick, self.times.short);
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
        let Times { dwell, short, long, .. } = self.times;
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
