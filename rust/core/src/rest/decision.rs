//! Decision between rest and motion, tick by tick.

use serde::{Deserialize, Serialize};

use super::bounds::{MIN_MOTION_RATIO, is_quieter};
use super::candidate::{Candidate, Run};
use super::model::RestModel;
use super::still::Still;
use super::ticker::TickSums;
use super::{Event, MIN_SAMPLES, RestLimits};
use crate::math::{Limits, Real};

/// Largest distance of a candidate's level from the previous rest's level, in standard deviations,
/// at which the two may be equal.
const SAME_LEVEL_SIGMAS: f64 = 3.0;

/// Number of doubts after which the time for a rest no longer doubles.
const MAX_DOUBTS: u32 = 8;

/// Samples in a tick, and times in ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Times {
    pub tick: u32,
    /// Ticks near the known level until rest begins.
    pub dwell: u32,
    /// Ticks until a rest is proven, and until a rest at an unknown level begins.
    pub short: u32,
    /// Ticks until a rest begins at any distance of its level.
    pub long: u32,
}

impl Times {
    pub(super) fn new(rate: f64) -> Self {
        let tick = ((rate * 0.25 + 0.5) as u32).max(MIN_SAMPLES);
        let ticks = |seconds: f64| (seconds * rate / f64::from(tick) + 0.5) as u32;
        // At low rates ticks are long, and a few ticks contain little information.
        let [dwell, short, long] = [ticks(1.5).max(6), ticks(10.0).max(10), ticks(60.0).max(30)];
        Self { tick, dwell, short, long }
    }
}

/// Distinguishes rest from motion, tick by tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Decision<T> {
    pub times: Times,
    pub at_rest: bool,
    /// True if the assumed rest at the start was false.
    false_start: bool,
    known: Option<RestModel<T>>,
    /// Model before the last change of level or noise.
    earlier: Option<RestModel<T>>,
    candidate: Candidate<T>,
    /// Ticks near the known level.
    back: Run<T>,
    /// Ticks near the level of `earlier`.
    near_earlier: Run<T>,
    still: Still<T>,
    /// Number of rests in a row that ended before they were proven, if limits let them begin at
    /// once.
    doubts: u32,
    /// True if the model certainly belongs to rest: stronger motion has been seen, or the rest has
    /// lasted for a minute.
    proven: bool,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Decision<T> {
    pub(super) fn new(times: Times, limits: RestLimits) -> Self {
        Self {
            times,
            still: Still::new(limits),
            doubts: 0,
            proven: limits.rest.is_some(),
            at_rest: false,
            false_start: false,
            known: None,
            earlier: None,
            candidate: Candidate::none(),
            back: Run::none(),
            near_earlier: Run::none(),
        }
    }

    /// Processes a tick and returns the change. If the body is known to be `moving`, the tick is no
    /// rest.
    pub(super) fn take(&mut self, seen: &TickSums<T>, moving: bool) -> Option<Event> {
        let possible = self.still.take(seen);
        match self.known {
            None => self.begin(possible && !moving, seen),
            Some(known) if self.at_rest => self.rest(known, possible && !moving, seen),
            Some(known) => self.motion(known, possible, moving, seen),
        }
    }

    /// Number of ticks in a row that may become the first rest.
    pub(super) fn standing(&self) -> u32 {
        if self.known.is_some() { 0 } else { self.candidate.ticks }
    }

    /// True if the assumed rest may be motion, because no stronger motion has been seen.
    pub(super) fn is_provisional(&self) -> bool {
        !self.proven
    }

    /// Variance of the samples of a rest that begins with this tick.
    pub(super) fn begun(&self, event: Option<Event>) -> Option<T> {
        let begins = matches!(event, Some(Event::Rest | Event::Restart)) && self.at_rest;
        self.known.filter(|_| begins).map(|known| known.noise.variance)
    }

    /// Processes a tick before anything is known.
    fn begin(&mut self, possible: bool, seen: &TickSums<T>) -> Option<Event> {
        if !possible {
            self.candidate = Candidate::none();
            return Some(Event::Restart);
        }
        self.candidate.take(seen);
        let Times { dwell, short, .. } = self.times;
        let doubted = self.false_start && !self.still.is_limited();
        let needed = match self.still.is_limited() {
            true => self.needed_within_limits(seen.step),
            false if doubted => short,
            false => dwell,
        };
        if self.candidate.ticks < needed || !self.still.lasts() {
            return None;
        }
        let trust = if doubted { short } else { 0 };
        self.known = Some(RestModel::new(&self.candidate, self.times.tick, trust));
        self.at_rest = true;
        Some(Event::Rest)
    }

    fn rest(
        &mut self,
        mut known: RestModel<T>,
        possible: bool,
        seen: &TickSums<T>,
    ) -> Option<Event> {
        if let Some(event) = self.return_to_earlier(&known, seen) {
            return Some(event);
        }
        if possible && known.holds(seen) {
            self.proven |= known.trust >= self.times.long;
            self.known = Some(known);
            return self.doubt(&known, seen);
        }
        self.at_rest = false;
        self.candidate = if possible { Candidate::of(seen) } else { Candidate::none() };
        self.back = Run::none();
        if known.trust < self.times.short {
            if !self.still.is_limited() {
                self.known = None;
                self.false_start = true;
                return Some(Event::Restart);
            }
            self.doubts = self.doubts.saturating_add(1);
        }
        self.proven |= is_quieter(known.noise.variance, seen.variance, seen.step);
        known.leave(self.times.short);
        self.known = Some(known);
        Some(Event::Motion)
    }

    /// Accepts a quieter level as rest after a rest that was never proven.
    fn doubt(&mut self, known: &RestModel<T>, seen: &TickSums<T>) -> Option<Event> {
        if self.proven {
            return None;
        }
        self.candidate.take(seen);
        let lasts = self.candidate.ticks >= self.times.dwell;
        let quiet = is_quieter(self.candidate.variance, known.noise.variance, seen.step);
        (lasts && quiet).then(|| self.replace())
    }

    /// Accepts the candidate as rest, and treats the earlier rest as motion.
    fn replace(&mut self) -> Event {
        let trust = self.times.short;
        self.known = Some(RestModel::new(&self.candidate, self.times.tick, trust));
        (self.earlier, self.near_earlier) = (None, Run::none());
        (self.at_rest, self.proven) = (true, true);
        Event::Restart
    }

    fn motion(
        &mut self,
        known: RestModel<T>,
        possible: bool,
        moving: bool,
        seen: &TickSums<T>,
    ) -> Option<Event> {
        self.proven |= is_quieter(known.noise.variance, seen.variance, seen.step);
        if !possible {
            self.candidate = Candidate::none();
            (self.back, self.near_earlier) = (Run::none(), Run::none());
            return None;
        }
        self.back.take(known.is_near(seen), seen.level);
        if moving {
            // A return to the known level is no evidence here: it may be the end of the motion.
            (self.candidate, self.near_earlier) = (Candidate::none(), Run::none());
            return None;
        }
        self.candidate.take(seen);
        if !self.still.lasts() {
            return None;
        }
        if self.back.has_arrived(self.times.dwell, &known, seen.step) {
            self.resume(known, self.back);
            return Some(Event::Rest);
        }
        self.return_to_earlier(&known, seen).or_else(|| self.accept_candidate(&known, seen))
    }

    /// Returns to the earlier model, if the sensor has returned to its level.
    fn return_to_earlier(&mut self, known: &RestModel<T>, seen: &TickSums<T>) -> Option<Event> {
        let earlier = self.earlier?;
        self.near_earlier.take(earlier.is_near(seen), seen.level);
        let louder = known.noise.variance > T::of(MIN_MOTION_RATIO) * earlier.noise.variance;
        let arrived = self.near_earlier.has_arrived(self.times.dwell, &earlier, seen.step);
        if !arrived || (self.at_rest && !louder) {
            return None;
        }
        self.earlier = None;
        self.resume(earlier, self.near_earlier);
        Some(match earlier.is_level(known.slow_level(), seen.step) {
            true => Event::Rest,
            false => Event::Restart,
        })
    }

    fn resume(&mut self, mut known: RestModel<T>, run: Run<T>) {
        known.resume(run.level, run.ticks);
        self.known = Some(known);
        self.at_rest = true;
        self.near_earlier = Run::none();
    }

    /// Accepts a candidate as rest if it has lasted long enough.
    fn accept_candidate(&mut self, known: &RestModel<T>, seen: &TickSums<T>) -> Option<Event> {
        if T::of(f64::from(self.candidate.ticks)) < self.needed(known, seen.step) {
            return None;
        }
        let weak = self.still.is_limited() && known.trust < self.times.short;
        let trust = if weak { 0 } else { self.times.short };
        let mut accepted = RestModel::new(&self.candidate, self.times.tick, trust);
        let ratio = T::of(MIN_MOTION_RATIO);
        let (new, old) = (self.candidate.variance, known.noise.variance);
        if new <= old * ratio && new * ratio >= old {
            accepted.noise = known.noise;
        }
        if is_quieter(new, old, seen.step) {
            self.proven = true;
        } else if known.trust >= self.times.long {
            self.earlier = Some(*known);
        }
        self.known = Some(accepted);
        self.at_rest = true;
        self.near_earlier = Run::none();
        // The level of a louder candidate is less certain.
        let unsure = T::of(SAME_LEVEL_SIGMAS) * self.candidate.level_deviation();
        let distance = (known.distance(self.candidate.level) - unsure).at_least(T::zero());
        Some(match known.is_near_level(distance, seen.step) {
            true => Event::Rest,
            false => Event::Restart,
        })
    }

    /// Number of ticks for a rest without further evidence: a rotation stands still for a moment
    /// when it reverses.
    fn needed_within_limits(&self, step: T) -> u32 {
        let Times { dwell, short, .. } = self.times;
        let first = dwell + dwell / 2;
        match self.candidate.is_even(step) {
            true => (first << self.doubts.min(MAX_DOUBTS)).min(short),
            false => short,
        }
    }

    /// Number of ticks that a candidate needs; it grows with the candidate's distance and noise.
    fn needed(&self, known: &RestModel<T>, step: T) -> T {
        let Times { dwell, short, long, .. } = self.times;
        let candidate = &self.candidate;
        let level_stands = known.is_level(candidate.level, step)
            && known.is_as_steady(candidate.level_variance(), step);
        // Motion is never quieter than rest.
        let (new, old) = (candidate.variance, known.noise.variance);
        if level_stands || is_quieter(new, old, step) {
            return T::of(2.0 * f64::from(dwell));
        }
        if self.still.is_limited() && known.trust < short && !is_quieter(old, new, step) {
            return T::of(f64::from(self.needed_within_limits(step)));
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

impl<T: Limits + Real<Element = T, SimdBool = bool>> Decision<T> {
    /// True if ticks can have changed `fresh` to this state.
    pub(super) fn is_after(&self, fresh: &Self) -> bool {
        let is_valid = |model: &RestModel<T>| model.is_valid();
        self.times == fresh.times
            && (self.known.is_some() || !self.at_rest && self.earlier.is_none())
            && self.known.iter().chain(&self.earlier).all(is_valid)
            && self.candidate.is_valid()
            && self.back.is_valid()
            && self.near_earlier.is_valid()
            && self.still.is_after(&fresh.still)
            && (self.proven || !fresh.proven)
    }
}
