//! Gate and weight of fixes: a gate that a wrong filter can leave.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::adaptive_noise::AdaptiveNoise;
use super::covariance::Innovation;
use crate::math::Real;

/// Number of rejected fixes in a row after which the filter is wrong, not the receiver.
const MAX_REJECTED: u32 = 10;
/// Smallest outage without a gate: a time, s, and a multiple of the usual interval. After it only
/// the noise model gives the filter's drift. A position is used if the next position agrees with
/// it. Velocities without positions are all used for a while.
const MIN_OUTAGE_S: f64 = 2.0;
const MIN_OUTAGE_RATIO: f64 = 5.0;
const OPEN_GATE_S: f64 = 1.0;
/// Limits for two agreeing positions: standard deviations, metres, and a share of the first
/// difference, scaled by the time since, relative to the outage. A drift grows at most with the
/// square of time.
const MAX_AGREEMENT_SIGMAS: f64 = 3.0;
const MAX_AGREEMENT_M: f64 = 0.5;
const MAX_AGREEMENT_DRIFT: f64 = 4.5;
/// Gain of the mean interval between fixes.
const INTERVAL_GAIN: f64 = 0.1;

/// One kind of measurement: positions, or velocities.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct InnovationGate {
    pub noise: AdaptiveNoise,
    /// Usual interval between fixes, s, zero before it is known.
    usual: f64,
    /// Number of fixes rejected in a row.
    rejected: u32,
    /// Time until which all fixes are used, s; NaN before the first.
    open_until: f64,
    /// The position after an outage that waits for an agreeing position.
    first: Option<First>,
    /// Innovations of the last fix; NaN before the first.
    pub new: [Innovation; 3],
}

/// A position after an outage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct First {
    innovation: Vector3<f64>,
    time: f64,
    /// Time since the last position before the outage, s.
    outage: f64,
}

/// Relation of a position to an outage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Return {
    /// There was no outage.
    None,
    /// The first position after an outage, or a position that disagrees with it; the next position
    /// decides.
    First,
    /// It agrees with the previous position; the duration of the outage is in seconds.
    Agrees(f64),
}

/// Decision on a fix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GateDecision {
    Take,
    /// The filter is wrong: its covariance is widened before the correction.
    Widen,
    Reject,
}

impl InnovationGate {
    pub fn new() -> Self {
        Self {
            noise: AdaptiveNoise::new(),
            usual: 0.0,
            rejected: 0,
            open_until: f64::NAN,
            first: None,
            new: [Innovation::NONE; 3],
        }
    }

    /// Restarts the gate; learned properties of the receiver stay.
    pub fn restart(&mut self) {
        let Self { noise, usual, .. } = *self;
        *self = Self { noise: noise.restarted(), usual, ..Self::new() };
    }

    /// Learns from an innovation, accepted or not. Returns the duration of an outage that it ends,
    /// s.
    pub fn learn(&mut self, time: f64, innovation: &Vector3<f64>) -> Option<f64> {
        let apart = self.noise.learn(time, innovation);
        let ended = apart > MIN_OUTAGE_S.max(MIN_OUTAGE_RATIO * self.usual);
        if ended {
            self.open_until = time + OPEN_GATE_S;
        }
        // Without a usual interval no outage can be detected.
        let outage = (ended && self.usual > 0.0).then_some(apart);
        // False for NaN, before the first fix.
        if apart > 0.0 {
            let part = if self.usual > 0.0 { INTERVAL_GAIN } else { 1.0 };
            self.usual += part * (apart.min(MAX_INTERVAL_S) - self.usual);
        }
        outage
    }

    /// True if a position waits for an agreeing position.
    #[inline(always)]
    pub fn waits(&self) -> bool {
        self.first.is_some()
    }

    /// Classifies a position at or after the end of an outage. `noise` are its variances, `walk`
    /// the variances of the velocity.
    pub fn classify_return(
        &mut self,
        time: f64,
        outage: Option<f64>,
        innovation: &Vector3<f64>,
        noise: &[f64; 3],
        walk: &[f64; 3],
    ) -> Return {
        let now = |outage: f64| Some(First { innovation: *innovation, time, outage });
        let Some(first) = self.first.filter(|_| outage.is_none()) else {
            let Some(seconds) = outage else { return Return::None };
            let before = self.first.map_or(0.0, |first| first.outage);
            self.first = now((seconds + before).min(MAX_OUTAGE_S));
            return Return::First;
        };
        let dt = time - first.time;
        let agrees = (0..3).all(|i| {
            let drift = MAX_AGREEMENT_DRIFT * first.innovation[i].abs() * dt / first.outage;
            let sigma = (2.0 * noise[i] + walk[i] * dt * dt).simd_sqrt();
            let apart = (innovation[i] - first.innovation[i]).abs();
            apart <= MAX_AGREEMENT_SIGMAS * sigma + MAX_AGREEMENT_M + drift
        });
        if agrees || self.rejected >= MAX_REJECTED {
            (self.first, self.rejected) = (None, 0);
            return Return::Agrees(first.outage);
        }
        self.rejected += 1;
        self.first = now((first.outage + dt).min(MAX_OUTAGE_S));
        Return::First
    }

    /// Normalised innovation squared of the last fix, 3 on average; NaN before the first.
    pub fn nis(&self) -> f64 {
        self.new.iter().map(Innovation::nis).sum()
    }

    /// Tests a fix by its normalised innovation squared.
    pub fn test(&mut self, time: f64, new: [Innovation; 3], gate: f64) -> GateDecision {
        self.new = new;
        if self.nis() <= gate || time < self.open_until {
            self.rejected = 0;
            return GateDecision::Take;
        }
        self.rejected += 1;
        if self.rejected <= MAX_REJECTED {
            return GateDecision::Reject;
        }
        self.rejected = 0;
        GateDecision::Widen
    }

    pub fn is_valid(&self) -> bool {
        let time = |t: f64| t.is_nan() || t.is_finite();
        self.noise.is_valid()
            && (0.0..=MAX_INTERVAL_S).contains(&self.usual)
            && self.rejected <= MAX_REJECTED
            && time(self.open_until)
            && self.first.is_none_or(|first| first.is_valid())
            && self.new.iter().all(Innovation::is_valid)
    }
}

impl First {
    fn is_valid(&self) -> bool {
        self.innovation.iter().all(|e| e.abs() <= MAX_INNOVATION)
            && self.time.is_finite()
            && (MIN_OUTAGE_S..=MAX_OUTAGE_S).contains(&self.outage)
    }
}

impl Innovation {
    pub(crate) fn is_valid(&self) -> bool {
        let Self { value, variance } = *self;
        let there = value.is_finite() && variance > 0.0 && variance.is_finite();
        there || (value.is_nan() && variance.is_nan())
    }
}

/// Largest innovation, m: larger than any distance on Earth.
pub(crate) const MAX_INNOVATION: f64 = 1e8;
const MAX_INTERVAL_S: f64 = 60.0;
/// Longest outage that is counted, s.
const MAX_OUTAGE_S: f64 = 1e9;
