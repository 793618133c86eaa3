//! What a person chooses for a filter, and what follows from it once the rate is known.

use serde::{Deserialize, Serialize};

use crate::allan::AllanKind;
use crate::error::Error;

/// Which noise covariances adapt: the three filters that Fu & Han compare are one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Method {
    /// G and R stay what the start-up window says.
    Kf,
    /// R follows the Allan variance with equal weights, G stays.
    Akf,
    /// R follows the Allan variance with fading memory, G the rank-one Sage-Husa recursion.
    Fading,
}

/// Parameters of a [`DriftFilter`](crate::DriftFilter).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Params {
    /// Samples a second.
    pub rate: f64,
    /// Which covariances adapt.
    pub method: Method,
    /// Memory b of the measurement noise in (0, 1], used by [`Method::Fading`].
    pub fading: f64,
    /// Which variance the measurement noise is taken from.
    pub noise: AllanKind,
    /// Seconds after the start-up during which the drift model is learned; `None`: always.
    pub adapt_for: Option<f64>,
    /// λ of the drift model's least squares in (0, 1].
    pub forgetting_factor: f64,
    /// Initial process noise G₀, and covariance P₀, in start-up variances.
    pub process_noise: f64,
    /// Samples that G₀ counts for besides those seen, in the weight 1/k of Sage-Husa.
    pub process_noise_memory: f64,
    /// Length of the start-up window in seconds.
    pub startup: f64,
    /// The noise's deviation in the unit of the samples, if it is known.
    pub scale: Option<f64>,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            rate: 100.0,
            method: Method::Fading,
            fading: 0.97,
            noise: AllanKind::Allan,
            adapt_for: Some(120.0),
            forgetting_factor: 1.0,
            process_noise: 0.1,
            process_noise_memory: 0.0,
            startup: 1.0,
            scale: None,
        }
    }
}

/// Fewest samples of a start-up window, whatever the rate.
const STARTUP_SAMPLES_MIN: f64 = 10.0;

impl Params {
    /// The parameters, if each is in its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first that is not.
    pub fn checked(self) -> Result<Self, Error> {
        check_rate(self.rate)?;
        check_fading(self.fading)?;
        check_forgetting_factor(self.forgetting_factor)?;
        if let Some(seconds) = self.adapt_for {
            check_not_negative("adapt_for", "zero or a positive number of seconds", seconds)?;
        }
        check_not_negative("process_noise", "zero or a positive number", self.process_noise)?;
        let memory = self.process_noise_memory;
        check_not_negative("process_noise_memory", "zero or a positive number", memory)?;
        check_positive("startup", "a positive number of seconds", self.startup)?;
        check_scale(self.scale)?;
        Ok(self)
    }

    pub(crate) fn startup_samples(&self) -> u64 {
        window(self.rate, self.startup)
    }

    pub(crate) fn adapt_samples(&self) -> u64 {
        self.adapt_for.map_or(u64::MAX, |seconds| rounded(seconds * self.rate))
    }

    pub(crate) fn adapts_measurement_noise(&self) -> bool {
        self.method != Method::Kf
    }

    pub(crate) fn adapts_process_noise(&self) -> bool {
        self.method == Method::Fading
    }

    /// The memory of the measurement noise: equal weights unless the method fades.
    pub(crate) fn memory(&self) -> f64 {
        if self.method == Method::Fading { self.fading } else { 1.0 }
    }
}

/// Samples of a start-up window.
fn window(rate: f64, startup: f64) -> u64 {
    rounded((startup * rate).max(STARTUP_SAMPLES_MIN))
}

/// [`window`] of parameters that are in their range.
pub(crate) fn checked_window(rate: f64, startup: f64) -> Result<u64, Error> {
    check_positive("rate", "a positive number of samples a second", rate)?;
    check_positive("startup", "a positive number of seconds", startup)?;
    Ok(window(rate, startup))
}

/// Nearest whole number; `as` saturates.
fn rounded(x: f64) -> u64 {
    (x + 0.5) as u64
}

fn check_positive(name: &'static str, expected: &'static str, value: f64) -> Result<(), Error> {
    require(value > 0.0 && value.is_finite(), name, expected, value)
}

fn check_not_negative(name: &'static str, expected: &'static str, value: f64) -> Result<(), Error> {
    require(value >= 0.0 && value.is_finite(), name, expected, value)
}

pub(crate) fn check_rate(value: f64) -> Result<(), Error> {
    check_positive("rate", "a positive number of samples a second", value)
}

pub(crate) fn check_fading(value: f64) -> Result<(), Error> {
    require(value > 0.0 && value <= 1.0, "fading", "above 0 and at most 1", value)
}

pub(crate) fn check_forgetting_factor(value: f64) -> Result<(), Error> {
    require(value > 0.0 && value <= 1.0, "forgetting_factor", "above 0 and at most 1", value)
}

pub(crate) fn check_scale(value: Option<f64>) -> Result<(), Error> {
    value.map_or(Ok(()), |scale| check_positive("scale", "a positive number", scale))
}

fn require(
    holds: bool,
    name: &'static str,
    expected: &'static str,
    value: f64,
) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(Error::Parameter { name, expected, value }) }
}
