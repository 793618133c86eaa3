//! Which fixes are believed, and how much: a gate that a filter which is wrong can leave, and the
//! noise of the receiver as its innovations show it.
//!
//! The Allan variance of the innovations over one fix is that of the measurement, as long as the
//! inertial sensors take the motion out (Fu & Han, equations 17 and 26 to 31).

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::covariance::Innovation;
use super::params::Adapt;
use crate::math::Real;

/// Rejected fixes in a row after which the filter, not the receiver, is wrong.
const REJECTED_MAX: u32 = 10;
/// Seconds across which differences of innovations say nothing; fixes come once a second, about.
const APART: f64 = 1.5;
/// Memory of the Allan variance, and differences from which on it counts.
const FADING: f64 = 0.03;
const LEARNED: u32 = 10;
/// After so many seconds, and so many times the usual, without a fix there is no gate for a while:
/// how far a filter has drifted it knows only as well as its noise model, and the first fixes tell.
const OUTAGE: f64 = 2.0;
const OUTAGE_TIMES: f64 = 3.0;
const AMNESTY: f64 = 1.0;
/// Part of its change that the usual time between fixes takes over.
const USUAL: f64 = 0.1;
/// Part of the noise told below which it never goes.
const FREE_MIN: f64 = 1e-4;

/// One kind of measurement: positions, or velocities.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Judge {
    /// Allan variance of the innovations an axis, and differences it was learned from.
    pub spread: Vector3<f64>,
    pub count: u32,
    /// The last innovation, and its time; NaN before the first.
    last: Vector3<f64>,
    last_time: f64,
    /// Usual seconds between fixes, zero before it is known.
    usual: f64,
    /// Fixes rejected in a row.
    rejected: u32,
    /// Until when all are taken; NaN before the first.
    open_until: f64,
    /// What was new of the last one; NaN before the first.
    pub new: [Innovation; 3],
}

/// What becomes of a fix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Judgement {
    Take,
    /// The filter is wrong: widen, then take.
    Widen,
    Reject,
}

impl Judge {
    pub fn new() -> Self {
        Self {
            spread: Vector3::zeros(),
            count: 0,
            last: Vector3::zeros(),
            last_time: f64::NAN,
            usual: 0.0,
            rejected: 0,
            open_until: f64::NAN,
            new: [Innovation::NONE; 3],
        }
    }

    /// The filter begins anew; what was learned of the receiver stays.
    pub fn restart(&mut self) {
        let Self { spread, count, usual, .. } = *self;
        *self = Self { spread, count, usual, ..Self::new() };
    }

    /// Learns from an innovation, whether it will be taken or not.
    pub fn learn(&mut self, time: f64, innovation: &Vector3<f64>) {
        let difference = innovation - self.last;
        let apart = time - self.last_time;
        if apart > OUTAGE.max(OUTAGE_TIMES * self.usual) {
            self.open_until = time + AMNESTY;
        }
        // NaN before the first.
        if apart > 0.0 {
            let part = if self.usual > 0.0 { USUAL } else { 1.0 };
            self.usual += part * (apart.min(USUAL_MAX) - self.usual);
        }
        if apart <= APART {
            self.count = self.count.saturating_add(1);
            let w = FADING.max(1.0 / f64::from(self.count));
            for i in 0..3 {
                let half = 0.5 * difference[i] * difference[i];
                let a = self.spread[i];
                let new = if self.count > 1 { half.min(4.0 * a) } else { half };
                self.spread[i] = (1.0 - w) * a + w * new.min(SPREAD_MAX);
            }
        }
        (self.last, self.last_time) = (*innovation, time);
    }

    /// Variance of an axis, told to be `told`.
    pub fn noise(&self, axis: usize, told: f64, adapt: Adapt) -> f64 {
        match adapt {
            _ if self.count < LEARNED => told,
            Adapt::Fixed => told,
            Adapt::Inflate => told.max(self.spread[axis]),
            Adapt::Free => self.spread[axis].max(FREE_MIN * told),
        }
    }

    /// Standard deviations that the innovations show; NaN before they do.
    pub fn learned(&self) -> [f64; 3] {
        let known = self.count >= LEARNED;
        [0, 1, 2].map(|i| if known { self.spread[i].simd_sqrt() } else { f64::NAN })
    }

    /// Normalised innovation squared of the last one, 3 on average; NaN before the first.
    pub fn nis(&self) -> f64 {
        self.new.iter().map(Innovation::nis).sum()
    }

    /// Judges a fix by its normalised innovation squared.
    pub fn judge(&mut self, time: f64, new: [Innovation; 3], gate: f64) -> Judgement {
        self.new = new;
        if self.nis() <= gate || time < self.open_until {
            self.rejected = 0;
            return Judgement::Take;
        }
        self.rejected += 1;
        if self.rejected <= REJECTED_MAX {
            return Judgement::Reject;
        }
        self.rejected = 0;
        Judgement::Widen
    }

    pub fn is_sound(&self) -> bool {
        let time = |t: f64| t.is_nan() || t.is_finite();
        self.spread.iter().all(|a| (0.0..=SPREAD_MAX).contains(a))
            && self.last.iter().all(|e| e.abs() <= INNOVATION_MAX)
            && (0.0..=USUAL_MAX).contains(&self.usual)
            && self.rejected <= REJECTED_MAX
            && [self.last_time, self.open_until].into_iter().all(time)
            && self.new.iter().all(Innovation::is_sound)
    }
}

impl Innovation {
    fn is_sound(&self) -> bool {
        let Self { value, variance } = *self;
        let there = value.is_finite() && variance > 0.0 && variance.is_finite();
        there || (value.is_nan() && variance.is_nan())
    }
}

/// Largest innovation: farther than anything on Earth.
pub(crate) const INNOVATION_MAX: f64 = 1e8;
const USUAL_MAX: f64 = 60.0;
const SPREAD_MAX: f64 = INNOVATION_MAX * INNOVATION_MAX;
