//! Rest of a body, from gyro, accelerometer and, if present, magnetometer.
//!
//! A rest gives the most precise bias of the gyro, and a false rest ruins the heading. The modules
//! have these tasks:
//!
//! - [`limits`]: the usual rest.
//! - [`quiet`]: a rest of seconds, even with motors running.
//! - [`calm`]: separates rest from a smooth road or a table.
//! - [`field_observer`]: detects a rotation that only the field shows.
//!
//! This module combines them, and decides on a rest at a rate far from the bias.

mod calm;
mod field_observer;
mod limits;
mod quiet;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use self::calm::Calm;
use self::field_observer::FieldObserver;
use self::limits::Limits;
use self::quiet::Candidate;
pub use self::quiet::RATE_NOISE;
use super::strapdown::Sums;
use super::{DEGREE, square};
use crate::attitude::sample::MAX_RATE;
use crate::math::validity::{are_within, is_size};

/// Largest distance of a rest's level from the bias, rad/s, in addition to three standard
/// deviations of the bias. Once a rest was used, these count at most as much as this value.
const MAX_BIAS_CHANGE_RAD_S: f64 = 0.15 * DEGREE;
const BIAS_SIGMAS_SQUARED: f64 = 9.0;
const MAX_USED_BIAS_CHANGE_RAD_S: f64 = 0.3 * DEGREE;
/// Time for which a level far from the bias must be steady, s, before any rest was used and after;
/// and its tolerance, rad/s.
const FAR_REST_S: [f64; 2] = [10.0, 30.0];
const MAX_STEADY_RATE_RAD_S: f64 = 0.5 * DEGREE;
/// Largest drift of a bias known from a rest, rad/s, if three standard deviations are not more. A
/// level with a larger difference is a rotation, until gravity or a field proves that it is not.
const MAX_BIAS_DRIFT_RAD_S: f64 = 0.9 * DEGREE;
/// Time of rest after which a different bias has jumped, instead of an earlier error, s.
const MIN_SUPPORT_S: f64 = 10.0;
/// Time of a rest that refutes an earlier one: smallest time, s; multiple of the earlier support;
/// and time of a steady level, s.
const REFUTING_REST_S: [f64; 3] = [2.0, 2.0, 9.9];
const REFUTING_STEADINESS: f64 = 1.5;
/// Ratio of a rate to the largest bias above which it is a rotation.
const MAX_BIAS_RATIO: f64 = 3.0;

/// Tick of a rest detector, in the sensor's axes.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    pub span: f64,
    pub gyro: Vector3<f64>,
    pub accel: Vector3<f64>,
    /// Mean square of the rate about its mean, (rad/s)².
    pub vibration: f64,
}

impl Seen {
    /// The tick, `None` if a rate or all forces are unknown.
    fn of(sums: &Sums) -> Option<Self> {
        if sums.unknown > 0.0 || sums.forces == 0.0 {
            return None;
        }
        let gyro = sums.gyro * (1.0 / sums.samples);
        let vibration = (sums.gyro_squared / sums.samples - gyro.norm_squared()).max(0.0);
        Some(Self { span: sums.elapsed, gyro, accel: sums.accel * (1.0 / sums.forces), vibration })
    }
}

/// State of the sensor before a tick.
#[derive(Debug, Clone, Copy)]
pub struct Known {
    /// The bias, rad/s, largest variance of its axes, and its largest size.
    pub bias: Vector3<f64>,
    pub variance: f64,
    pub most: f64,
    /// True if the body certainly accelerates.
    pub pushed: bool,
}

/// Class of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum State {
    Motion,
    /// A rest, with its bias and variance if it measures the bias.
    Rest(Option<(Vector3<f64>, f64)>),
    /// A rest that refutes earlier rests, with its level and variance: the earlier bias was wrong.
    Refuted(Vector3<f64>, f64),
    /// The rest that gave the bias was a rotation.
    Denied,
    /// A rest at a level far from the bias: the bias has jumped.
    Jumped(Vector3<f64>),
    /// A rest at a rate too large for a bias, or a rotation about this direction; the two cannot be
    /// distinguished.
    Unclear(Vector3<f64>),
}

/// State of the rest detector.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Rest {
    limits: Limits,
    candidate: Candidate,
    calm: Calm,
    field_observer: FieldObserver,
    /// The level at which it became steady, rad/s, and time since then, s.
    anchor: Vector3<f64>,
    steady: f64,
    /// True if a rest was used; time of quiet rest behind the bias, s; and squared spread of the
    /// last rest.
    used: bool,
    support: f64,
    spread: f64,
    /// True if a field has refuted the first rest.
    denied: bool,
    /// Time of the rest in use, s.
    lasted: f64,
}

impl Rest {
    /// Time for which the body has rested without a break, s.
    pub fn lasted(&self) -> f64 {
        self.lasted
    }

    /// True if the last ticks may be a rest at any level.
    pub fn is_quiet(&self) -> bool {
        self.candidate.lasts()
    }

    /// True if any rest has measured the bias, or a rest was a rotation.
    pub fn has_evidence(&self) -> bool {
        self.tells() || self.support > 0.0
    }

    /// True if rests determine the bias better than motion: one was used, or one was a rotation.
    pub fn tells(&self) -> bool {
        self.used || self.denied
    }

    /// Notes a gap without samples.
    pub fn interrupt(&mut self) {
        (self.limits, self.candidate) = (Limits::default(), Candidate::default());
        self.field_observer.begin();
        (self.steady, self.lasted) = (0.0, 0.0);
    }

    /// Processes a tick, and the mean field in it in the sensor's axes.
    #[inline(always)]
    pub fn observe(&mut self, sums: &Sums, field: Option<&Vector3<f64>>, known: &Known) -> State {
        self.calm.age(sums.elapsed);
        self.field_observer.age(sums.elapsed);
        let state = match Seen::of(sums) {
            Some(seen) if self.follow(sums, &seen, field) => {
                self.deny();
                State::Denied
            }
            Some(seen) => self.decide(&seen, known),
            None => {
                self.limits.end();
                self.restart_candidate();
                State::Motion
            }
        };
        let moves = matches!(state, State::Motion | State::Denied | State::Unclear(_));
        self.lasted = if moves { 0.0 } else { self.lasted + sums.elapsed };
        state
    }

    /// Returns true if the field shows that the only rest to date is a rotation.
    #[inline(always)]
    fn follow(&mut self, sums: &Sums, seen: &Seen, field: Option<&Vector3<f64>>) -> bool {
        self.limits.observe(sums, seen);
        if self.candidate.observe(seen) {
            self.field_observer.begin();
        }
        self.steady += seen.span;
        if (self.limits.level() - self.anchor).norm_squared()
            > MAX_STEADY_RATE_RAD_S * MAX_STEADY_RATE_RAD_S
        {
            (self.anchor, self.steady) = (*self.limits.level(), 0.0);
        }
        let Some(field) = field else { return false };
        let [moved, away] = self.field_observer.observe(field, seen.span);
        if away {
            self.steady = 0.0;
        }
        let only = !self.candidate.is_new() && self.support <= 2.0 * self.candidate.seconds;
        let denied = moved
            && only
            && self.support < MIN_SUPPORT_S
            && self.field_observer.follows_rotation(&self.candidate.gyro, self.candidate.seconds);
        if moved {
            self.restart_candidate();
        }
        denied
    }

    /// Forgets everything learned from the first rest, which was a rotation.
    fn deny(&mut self) {
        (self.calm, self.denied) = (Calm::default(), true);
        self.field_observer.forget();
        (self.used, self.support, self.spread) = (false, 0.0, 0.0);
    }

    #[inline(always)]
    fn decide(&mut self, seen: &Seen, known: &Known) -> State {
        let Known { bias, variance, most, pushed } = known;
        let bound = match (self.used, self.denied) {
            (true, _) => MAX_USED_BIAS_CHANGE_RAD_S * MAX_USED_BIAS_CHANGE_RAD_S,
            (false, false) => f64::INFINITY,
            (false, true) => 0.0,
        };
        let bound = MAX_BIAS_CHANGE_RAD_S * MAX_BIAS_CHANGE_RAD_S
            + (BIAS_SIGMAS_SQUARED * variance).min(bound);
        let calm = self.is_calm(seen, bias, bound);
        if *pushed {
            return State::Motion;
        }
        if calm && self.candidate.lasts() {
            // A level beyond any bias is no rest, however uncertain the bias is.
            let known = self.used || bias.norm() > *most;
            let near = known && (self.candidate.gyro - bias).norm_squared() <= bound;
            let may_be = near || self.candidate.gyro.norm() <= *most;
            let state = match may_be {
                true => self.quietly(seen, bias, bound),
                false => self.beyond(seen, *most),
            };
            if let Some(state) = state {
                return state;
            }
        }
        self.usual(seen, bias, bound, (*variance, *most), calm)
    }

    /// True if the tick is as calm as this sensor's rests.
    fn is_calm(&mut self, seen: &Seen, bias: &Vector3<f64>, bound: f64) -> bool {
        let level = self.limits.level();
        if (level - bias).norm_squared()
            <= bound.min(limits::MAX_GYRO_RAD_S * limits::MAX_GYRO_RAD_S)
        {
            // A level is steady only while it is far from the bias.
            (self.anchor, self.steady) = (*level, 0.0);
        }
        let left = self.calm.is_left(&self.candidate, level, seen.span);
        if self.calm.is_gone() {
            self.restart_candidate();
        }
        !left && self.calm.holds(&self.candidate, seen)
    }

    fn restart_candidate(&mut self) {
        self.candidate = Candidate::default();
        self.field_observer.begin();
    }

    /// Class of a candidate, if it is a rest.
    fn quietly(&mut self, seen: &Seen, bias: &Vector3<f64>, bound: f64) -> Option<State> {
        let off = (self.candidate.gyro - bias).norm();
        let first = !self.used
            && (!self.denied || self.field_observer.refutes_turn(off, self.candidate.seconds));
        if off * off <= bound || first {
            return Some(self.quiet(seen));
        }
        if self.is_refuted(off) {
            return Some(self.refute(seen));
        }
        if self.candidate.refutes_lean(bias) {
            self.candidate.is_known();
            self.used = true;
            return Some(State::Jumped(self.candidate.gyro));
        }
        None
    }

    /// Class of a candidate with a rate above any bias. Constant gravity proves that it does not
    /// rotate about a level axis; a constant field proves that it does not rotate about the
    /// vertical.
    fn beyond(&mut self, seen: &Seen, most: f64) -> Option<State> {
        let rest = &self.candidate;
        if !rest.is_long() || rest.gyro.norm() > MAX_BIAS_RATIO * most {
            return None;
        }
        let about_up = rest.gyro.dot(&rest.up()).abs();
        let stays = match about_up > most {
            true => self.field_observer.refutes_turn(about_up, rest.seconds),
            false => rest.refutes_level_turn(),
        };
        if stays {
            return Some(self.refute(seen));
        }
        (!self.used).then(|| State::Unclear(rest.up()))
    }

    /// A quiet rest near the bias, or the first.
    fn quiet(&mut self, seen: &Seen) -> State {
        let rest = &mut self.candidate;
        self.support += if rest.is_new() { rest.seconds } else { seen.span };
        self.used |= rest.seconds >= REFUTING_STEADINESS * (1.0 - 1e-9);
        self.spread = rest.gyro_spread();
        self.calm.learn(rest);
        self.field_observer.learn();
        State::Rest(rest.measure(seen))
    }

    /// True if this rest proves that the known bias came from a false rest.
    fn is_refuted(&self, off: f64) -> bool {
        let rest = &self.candidate;
        let seconds = rest.seconds * (1.0 + 1e-9);
        let long =
            REFUTING_REST_S[0].max((REFUTING_REST_S[1] * self.support).min(REFUTING_REST_S[2]));
        let steadier = seconds >= REFUTING_STEADINESS && rest.gyro_spread() < 0.25 * self.spread;
        (self.support < MIN_SUPPORT_S && (seconds >= long || steadier))
            || (seconds >= REFUTING_REST_S[0]
                && self.field_observer.refutes_turn(off, rest.seconds))
    }

    fn refute(&mut self, seen: &Seen) -> State {
        let rest = &mut self.candidate;
        rest.is_known();
        (self.used, self.support, self.spread) = (true, rest.seconds, rest.gyro_spread());
        self.calm.learn(rest);
        self.field_observer.learn();
        State::Refuted(rest.gyro, seen.noise() / rest.seconds)
    }

    /// A rest by the limits of the samples, while no calmer rest is known; far from the bias only
    /// if it is steady for long.
    #[inline(always)]
    fn usual(
        &mut self,
        seen: &Seen,
        bias: &Vector3<f64>,
        bound: f64,
        (variance, most): (f64, f64),
        calm: bool,
    ) -> State {
        let (level, since) = (*self.limits.level(), self.limits.since());
        let bound = bound.min(limits::MAX_GYRO_RAD_S * limits::MAX_GYRO_RAD_S);
        if (level - bias).norm_squared() <= bound {
            if since < limits::MIN_REST_S * (1.0 - 1e-9) || self.calm.is_known() {
                return State::Motion;
            }
            self.used = true;
            return State::Rest(Some((seen.gyro, seen.noise() / seen.span)));
        }
        let long = FAR_REST_S[usize::from(self.used)];
        if !calm || since.min(self.steady) < long * (1.0 - 1e-9) || level.norm() > most {
            return State::Motion;
        }
        let drifts = square(MAX_BIAS_DRIFT_RAD_S).max(BIAS_SIGMAS_SQUARED * variance);
        if self.used && (level - bias).norm_squared() > drifts {
            return State::Motion;
        }
        self.used = true;
        State::Jumped(level)
    }

    pub fn is_valid(&self) -> bool {
        self.limits.is_valid()
            && self.candidate.is_valid()
            && self.calm.is_valid()
            && self.field_observer.is_valid()
            && are_within(&self.anchor, 2.0 * MAX_RATE)
            && [self.steady, self.support, self.lasted].iter().all(|x| is_size(*x, 1e18))
            && is_size(self.spread, 1.0)
    }
}
