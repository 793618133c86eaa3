//! Parameters of a drift filter, and values that follow from them and the rate.

use serde::{Deserialize, Serialize};

use crate::allan::AllanKind;
use crate::error::{
    Error, check_fading, check_forgetting_factor, check_not_negative, check_positive, check_rate,
    check_scale,
};
use crate::math::{Limits, Real};

/// Adaptation of the noise covariances, which differs between the three filters of Fu & Han.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Method {
    /// G and R keep their values from the start-up window.
    Kf,
    /// R follows the Allan variance with equal weights; G is constant.
    Akf,
    /// R follows the Allan variance with fading weights; G follows the rank-one Sage-Husa
    /// recursion.
    Fading,
}

/// Input of a filter, treatment of motion, and output.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Behaviour {
    /// Saturation level: a sample of this size or more counts as missing.
    pub limit: Option<f64>,
    /// Outliers count as missing.
    pub reject_outliers: bool,
    /// Samples in motion count as missing. What was learned in the first two ticks of a motion is
    /// undone.
    pub hold_in_motion: bool,
    /// The output is the sample minus the drift, instead of the drift.
    pub compensated: bool,
}

/// Behaviour of a filter that removes the bias of a moving sensor.
impl Default for Behaviour {
    fn default() -> Self {
        Self { hold_in_motion: true, compensated: true, ..Self::PUBLISHED }
    }
}

impl Behaviour {
    /// Behaviour of the published filters: every sample is used, the output is the estimate.
    pub const PUBLISHED: Self =
        Self { limit: None, reject_outliers: false, hold_in_motion: false, compensated: false };

    /// The behaviour, if its limit is a positive number.
    ///
    /// # Errors
    /// [`Error::Parameter`] if it is not positive.
    pub fn validate(self) -> Result<Self, Error> {
        self.limit.map_or(Ok(()), |limit| check_positive("limit", "a positive number", limit))?;
        Ok(self)
    }

    /// True if a sample is saturated.
    #[inline(always)]
    pub(crate) fn saturates<T: Limits + Real<Element = T, SimdBool = bool>>(self, z: T) -> bool {
        self.limit.is_some_and(|limit| z.simd_abs() >= T::of(limit) && z.finite())
    }

    /// Output for a sample with known drift, NaN if the sample is missing.
    #[inline(always)]
    pub(crate) fn output<T>(self, z: T, drift: T) -> T
    where
        T: Limits + Real<Element = T, SimdBool = bool>,
    {
        match (self.compensated, z.finite()) {
            (false, _) => drift,
            (true, true) => (z.within(T::MAX_RAW) - drift).within(T::MAX_RAW),
            (true, false) => T::of(f64::NAN),
        }
    }
}

/// Parameters of a [`DriftFilter`](crate::DriftFilter).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Params {
    /// Samples per second.
    pub rate: f64,
    /// Adaptive covariances.
    pub method: Method,
    /// Fading factor b of the measurement noise in (0, 1], used by [`Method::Fading`].
    pub fading: f64,
    /// Kind of variance for the measurement noise.
    pub noise: AllanKind,
    /// Time after the start-up during which the drift model is learned, s; `None`: always.
    pub adapt_for: Option<f64>,
    /// Forgetting factor λ of the drift model's least squares in (0, 1].
    pub forgetting_factor: f64,
    /// Initial process noise G₀ and covariance P₀, as shares of the samples' variance in the
    /// start-up.
    pub process_noise: f64,
    /// Weight of G₀ in samples, in the weight 1/k of Sage-Husa.
    pub process_noise_memory: f64,
    /// Length of the start-up window, s.
    pub startup: f64,
    /// Standard deviation of the noise in the samples' unit, if known.
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

/// Smallest number of samples in a start-up window, at any rate.
const MIN_STARTUP_SAMPLES: f64 = 10.0;

impl Params {
    /// The parameters, if each is in its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first parameter out of range.
    pub fn validate(self) -> Result<Self, Error> {
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

    /// Fading factor of the measurement noise: 1 unless the method fades.
    pub(crate) fn fading_factor(&self) -> f64 {
        if self.method == Method::Fading { self.fading } else { 1.0 }
    }
}

/// Number of samples in a start-up window.
fn window(rate: f64, startup: f64) -> u64 {
    rounded((startup * rate).max(MIN_STARTUP_SAMPLES))
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
