//! Gate of an aid: a disturbed, frozen or jumping sensor does not change the filter.
//!
//! A reading is tested alone and together with earlier readings: many small innovations with one
//! sign are as improbable as a large innovation. After a disturbance readings must agree with the
//! filter for some time before a reading is used. If they disagree by a constant amount instead,
//! the sensor's own constant has changed.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::adaptive_noise::AdaptiveNoise;
use super::covariance::Innovation;
use super::innovation_gate::MAX_INNOVATION;
use crate::math::validity::{are_within, is_count, is_within};

/// Gain of the mean of normalised innovations; its largest value, 4.4 standard deviations; and the
/// largest innovation in the mean.
const MEAN_GAIN: f64 = 0.05;
const MAX_MEAN: f64 = 0.7;
const MAX_NORMALISED: f64 = 5.0;
/// Number of rejected readings in a row that is a disturbance.
const MIN_DISTURBANCE: u32 = 2;
/// Largest difference of two agreeing readings, in standard deviations.
const MAX_AGREEMENT_SIGMAS: f64 = 3.0;
/// Time after which a bit-identical value means a frozen sensor, s.
const MAX_EQUAL_S: f64 = 2.0;

/// Times of agreement, s: with the filter, until a reading is used after a disturbance; and between
/// readings, until the sensor's constant has changed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Patience {
    pub agreement: f64,
    pub change: f64,
}

/// Gate of one sensor with readings of one axis or three axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct AidGate {
    pub noise: AdaptiveNoise,
    /// Time of the last reading, s; NaN before the first.
    pub time: f64,
    /// Innovations of the last reading; NaN before the first, and for missing axes.
    pub new: [Innovation; 3],
    /// Numbers of readings used, rejected and refused.
    pub counts: [u64; 3],
    /// Fading mean of the normalised innovations.
    mean: Vector3<f64>,
    /// Number of readings rejected in a row.
    rejected: u32,
    pub disturbed: bool,
    /// Time since which readings agree with the filter after a disturbance, s; NaN if they
    /// disagree.
    agrees_since: f64,
    /// First of the rejected innovations that agree with each other, and its time, s; NaN if there
    /// is none.
    first: Vector3<f64>,
    first_time: f64,
    /// Last value, and time since which it is constant, s; NaN before the first.
    value: Vector3<f64>,
    equal_since: f64,
}

/// Decision on a reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AidDecision {
    Take,
    Reject,
    /// The constant of the sensor has changed.
    Change,
}

impl AidGate {
    pub fn new() -> Self {
        Self {
            noise: AdaptiveNoise::new(),
            time: f64::NAN,
            new: [Innovation::NONE; 3],
            counts: [0; 3],
            mean: Vector3::zeros(),
            rejected: 0,
            disturbed: false,
            agrees_since: f64::NAN,
            first: Vector3::zeros(),
            first_time: f64::NAN,
            value: Vector3::zeros(),
            equal_since: f64::NAN,
        }
    }

    /// Restarts the gate; learned noise and counts stay.
    pub fn restart(&mut self) {
        let Self { noise, time, counts, value, equal_since, .. } = *self;
        let noise = noise.restarted();
        *self = Self { noise, time, counts, value, equal_since, ..Self::new() };
    }

    /// Stores the raw value of a reading; returns true if the sensor seems frozen.
    pub fn is_frozen(&mut self, time: f64, value: &Vector3<f64>, moving: bool) -> bool {
        if self.equal_since.is_nan() || *value != self.value {
            (self.value, self.equal_since) = (*value, time);
        }
        moving && time - self.equal_since > MAX_EQUAL_S
    }

    /// Normalised innovation squared of the last reading; NaN before the first.
    pub fn nis(&self, axes: usize) -> f64 {
        self.new.iter().take(axes).map(Innovation::nis).sum()
    }

    /// Decides by the innovations of a reading, by `error` and by `variance`. `error` is the
    /// difference in axes in which a constant error of the sensor is constant. `variance` is the
    /// noise of `error`.
    pub fn decide(
        &mut self,
        time: f64,
        passes: bool,
        error: &Vector3<f64>,
        variance: f64,
        patience: &Patience,
    ) -> AidDecision {
        if passes && !self.leans() {
            return self.agree(time, patience);
        }
        self.agrees_since = f64::NAN;
        self.rejected = self.rejected.saturating_add(1);
        self.disturbed |= self.rejected >= MIN_DISTURBANCE;
        let apart = (error - self.first).norm_squared();
        let limit = 2.0 * MAX_AGREEMENT_SIGMAS * MAX_AGREEMENT_SIGMAS * variance;
        if self.first_time.is_nan() || apart > limit {
            (self.first, self.first_time) = (*error, time);
        } else if time - self.first_time >= patience.change {
            self.calm();
            return AidDecision::Change;
        }
        AidDecision::Reject
    }

    fn agree(&mut self, time: f64, patience: &Patience) -> AidDecision {
        (self.rejected, self.first_time) = (0, f64::NAN);
        if self.disturbed {
            if self.agrees_since.is_nan() {
                self.agrees_since = time;
            }
            if time - self.agrees_since < patience.agreement {
                return AidDecision::Reject;
            }
            self.calm();
        }
        AidDecision::Take
    }

    /// Notes a frozen or broken sensor, which agrees with nothing.
    pub fn freeze(&mut self) {
        self.disturbed = true;
        (self.agrees_since, self.first_time) = (f64::NAN, f64::NAN);
    }

    fn calm(&mut self) {
        self.mean = Vector3::zeros();
        (self.rejected, self.disturbed) = (0, false);
        (self.agrees_since, self.first_time) = (f64::NAN, f64::NAN);
    }

    /// Adds the innovations of a reading to their mean.
    pub fn average(&mut self, axes: usize) {
        for i in 0..axes {
            let Innovation { value, variance } = self.new[i];
            let normalised = (value / variance.sqrt()).clamp(-MAX_NORMALISED, MAX_NORMALISED);
            self.mean[i] += MEAN_GAIN * (normalised - self.mean[i]);
        }
    }

    /// True if the innovations are biased to one side.
    fn leans(&self) -> bool {
        self.mean.amax() > MAX_MEAN
    }

    pub fn is_valid(&self) -> bool {
        let times = [self.time, self.agrees_since, self.first_time, self.equal_since];
        self.noise.is_valid()
            && self.new.iter().all(Innovation::is_valid)
            && self.counts.into_iter().all(is_count)
            && are_within(&self.mean, MAX_NORMALISED)
            && times.into_iter().all(|time| time.is_nan() || is_within(time, 4e9))
            && are_within(&self.first, 2.0 * MAX_INNOVATION)
            && are_within(&self.value, MAX_INNOVATION)
    }
}
