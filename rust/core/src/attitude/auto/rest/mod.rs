//! Rest of a body, by gyro, accelerometer and, where there is one, magnetometer.
//!
//! A rest shows the bias of the gyro, and nothing else does so well; a false one ruins the heading.
//! So each part of this folder is for a body that seems to rest or does not: [`limits`] for the usual
//! rest, [`quiet`] for one of seconds and with motors running, [`calm`] for what a road or a table
//! makes of either, [`field_observer`] for a turn that only a field shows. Here they are put together, and
//! it is decided what becomes of a rest at a rate that is far from the bias.

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

/// Largest distance of a rest's level from the bias, rad/s: always, in addition to three standard
/// deviations of the bias, which do not count for more than this once a rest was used.
const MAX_BIAS_CHANGE_RAD_S: f64 = 0.15 * DEGREE;
const BIAS_SIGMAS_SQUARED: f64 = 9.0;
const MAX_USED_BIAS_CHANGE_RAD_S: f64 = 0.3 * DEGREE;
/// Seconds that a level far from the bias has to be steady, before any rest was used and after,
/// within how many rad/s.
const FAR_REST_S: [f64; 2] = [10.0, 30.0];
const MAX_STEADY_RATE_RAD_S: f64 = 0.5 * DEGREE;
/// By how much a bias that a rest has shown drifts, rad/s, if three deviations of it are no more: a level
/// that differs by more is that of a turn, until gravity or a field proves that it is none.
const MAX_BIAS_DRIFT_RAD_S: f64 = 0.9 * DEGREE;
/// Seconds of rest from which on a bias is one that jumped, not one that never was.
const MIN_SUPPORT_S: f64 = 10.0;
/// Seconds of a rest that prove an earlier one wrong: by its length, at the least and in times of
/// the support, and by its steadiness.
const REFUTING_REST_S: [f64; 3] = [2.0, 2.0, 9.9];
const REFUTING_STEADINESS: f64 = 1.5;
/// Ratio of a rate to the largest bias above which it is a rotation.
const MAX_BIAS_RATIO: f64 = 3.0;

/// Tick of a rest detector, in the axes of the sensor.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    pub span: f64,
    pub gyro: Vector3<f64>,
    pub accel: Vector3<f64>,
    /// Mean square of the rate about its mean, (rad/s)².
    pub vibration: f64,
}

impl Seen {
    /// None where a rate or all forces are unknown.
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
    /// The bias, rad/s, the largest variance of its axes, and its largest size.
    pub bias: Vector3<f64>,
    pub variance: f64,
    pub most: f64,
    /// True if the body surely speeds up.
    pub pushed: bool,
}

/// Class of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum State {
    Motion,
    /// With what it says of the bias and the variance of that, if it says anything.
    Rest(Option<(Vector3<f64>, f64)>),
    /// A rest that proves those before wrong, with its level and the variance of that: the bias was
    /// never what they said.
    Refuted(Vector3<f64>, f64),
    /// The rest that the bias rests on was a turn.
    Denied,
    /// A rest at a level that is far from the bias, which has jumped.
    Jumped(Vector3<f64>),
    /// A rest at a rate that is too large for a bias, or a turn about this direction: none can tell.
    Unclear(Vector3<f64>),
}

/// State of the rest detector.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Rest {
    limits: Limits,
    candidate: Candidate,
    calm: Calm,
    field_observer: FieldObserver,
    /// The level when it began to be steady, rad/s, and seconds since then.
    anchor: Vector3<f64>,
    steady: f64,
    /// True if a rest was used, seconds of quiet rest that the bias rests on, and the spread of the
    /// last, squared.
    used: bool,
    support: f64,
    spread: f64,
    /// True if a field has shown that the first rest was none.
    denied: bool,
    /// Seconds of the rest in use.
    lasted: f64,
}

impl Rest {
    /// Seconds for which the body has rested without a break.
    pub fn lasted(&self) -> f64 {
        self.lasted
    }

    /// True if the last ticks may be a rest, at whatever level.
    pub fn is_quiet(&self) -> bool {
        self.candidate.lasts()
    }

    /// True if any rest, however short, has said something of the bias, or one was a turn.
    pub fn has_evidence(&self) -> bool {
        self.tells() || self.support > 0.0
    }

    /// True if rests tell more of the bias than motion does: one was used, or one was a turn.
    pub fn tells(&self) -> bool {
        self.used || self.denied
    }

    /// Nothing is known of a while.
    pub fn interrupt(&mut self) {
        (self.limits, self.candidate) = (Limits::default(), Candidate::default());
        self.field_observer.begin();
        (self.steady, self.lasted) = (0.0, 0.0);
    }

    /// Takes a tick, and the mean field in it in the axes of the sensor.
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

    /// The first rest was a turn: what it has taught is forgotten.
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
            // Of a bias that is none it is no rest, however unsure that is.
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

    /// True if the tick is as calm as rests of this sensor are.
    fn is_calm(&mut self, seen: &Seen, bias: &Vector3<f64>, bound: f64) -> bool {
        let level = self.limits.level();
        if (level - bias).norm_squared()
            <= bound.min(limits::MAX_GYRO_RAD_S * limits::MAX_GYRO_RAD_S)
        {
            // A level is steady for as long as it is far.
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

    /// The class of a candidate that may be a rest, if it is one.
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

    /// The class of a candidate whose rate is larger than any bias should be. Gravity that stays
    /// proves that it does not turn about a level axis, a field that stays that it does not about
    /// the vertical.
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

    /// True if this one proves that the bias known was that of no rest.
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

    /// A rest by the limits of samples: as long as no calmer one is known, and far from the bias
    /// where it is steady for long.
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
