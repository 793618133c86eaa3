//! Gate of an aid: a disturbed, frozen or jumping sensor does not move the filter.
//!
//! A reading is judged alone and together with those before it: many small innovations of one sign
//! are as improbable as one that is large. After a disturbance readings must agree with the filter
//! for a while before one is used. If they disagree by a constant amount instead, the sensor's own
//! constant has changed, not the filter.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::adaptive_noise::AdaptiveNoise;
use super::covariance::Innovation;
use super::innovation_gate::MAX_INNOVATION;
use crate::math::validity::{are_within, is_count, is_within};

/// Gain of the mean of normalised innovations, the largest mean, 4.4 of its standard deviations, and
/// the largest innovation that it takes.
const MEAN_GAIN: f64 = 0.05;
const MAX_MEAN: f64 = 0.7;
const MAX_NORMALISED: f64 = 5.0;
/// Rejected readings in a row that are a disturbance.
const MIN_DISTURBANCE: u32 = 2;
/// Standard deviations of a difference by which readings agree with each other.
const MAX_AGREEMENT_SIGMAS: f64 = 3.0;
/// Seconds after which a value that has not changed by a bit is that of a frozen sensor.
const MAX_EQUAL_S: f64 = 2.0;

/// Seconds of agreement: with the filter, until a reading is used after a disturbance, and of
/// readings with each other, until the sensor's constant is another one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Patience {
    pub agreement: f64,
    pub change: f64,
}

/// Gate of one sensor, whose readings have one axis or three.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct AidGate {
    pub noise: AdaptiveNoise,
    /// Time of the last reading, s; NaN before the first.
    pub time: f64,
    /// Innovations of the last one; NaN before the first, and where it has fewer axes.
    pub new: [Innovation; 3],
    /// Readings used, rejected and refused.
    pub counts: [u64; 3],
    /// Fading mean of the normalised innovations.
    mean: Vector3<f64>,
    /// Readings rejected in a row.
    rejected: u32,
    pub disturbed: bool,
    /// Since when readings agree with the filter after a disturbance, s; NaN: they do not.
    agrees_since: f64,
    /// First of the rejected innovations that agree with each other, and its time, s; NaN: none.
    first: Vector3<f64>,
    first_time: f64,
    /// The last value, and since when it is the same, s; NaN before the first.
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

    /// Restart the gate; what was learned of the sensor, and its counts stay.
    pub fn restart(&mut self) {
        let Self { noise, time, counts, value, equal_since, .. } = *self;
        let noise = noise.restarted();
        *self = Self { noise, time, counts, value, equal_since, ..Self::new() };
    }

    /// Takes the value of a reading as it was given; returns true if the sensor seems frozen.
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

    /// Decides by the innovations of a reading and `error`, what it differs by in axes in which a
    /// constant error of the sensor stays constant. `variance` is that of its noise.
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

    /// A sensor that is frozen or broken agrees with nothing.
    pub fn freeze(&mut self) {
        self.disturbed = true;
        (self.agrees_since, self.first_time) = (f64::NAN, f64::NAN);
    }

    fn calm(&mut self) {
        self.mean = Vector3::zeros();
        (self.rejected, self.disturbed) = (0, false);
        (self.agrees_since, self.first_time) = (f64::NAN, f64::NAN);
    }

    /// Takes the innovations of a reading into their mean.
    pub fn average(&mut self, axes: usize) {
        for i in 0..axes {
            let Innovation { value, variance } = self.new[i];
            let normalised = (value / variance.sqrt()).clamp(-MAX_NORMALISED, MAX_NORMALISED);
            self.mean[i] += MEAN_GAIN * (normalised - self.mean[i]);
        }
    }

    /// True if the innovations lean to one side.
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
