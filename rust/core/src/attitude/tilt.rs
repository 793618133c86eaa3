//! Tilt about one axis, from the rate about it and the accelerometer's angle.
#![allow(non_snake_case)]

use serde::{Deserialize, Serialize};

use super::named::Constant;
use crate::error::{Error, check_rate};
use crate::math::validity::{is_count, is_within};
use crate::math::{Real, Symmetric};
use crate::stream::Stream;
use crate::stream::checkpoint::Checkpoint;

/// Longest time for which the last rate replaces missing rates, s.
const MAX_HELD_S: f64 = 0.05;
/// Longest time between two samples, s.
const MAX_SPAN: f64 = 1e9;
/// Largest rate and angle of a sample and of their results; largest variance.
const MAX_SAMPLE: f64 = 1e150;
const MAX_STATE: f64 = 1e170;
const MAX_VARIANCE: f64 = 1e100;
/// Largest loss of a difference's variance by rounding, relative to the terms.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Filter that combines rate and angle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum TiltMethod {
    /// The complementary filter of first order.
    #[default]
    Complementary,
    /// The Kalman filter of angle and bias.
    Kalman,
}

/// Names of the methods.
pub const TILT_METHODS: [&str; 2] = ["complementary", "kalman"];

impl TiltMethod {
    /// Name of the method.
    pub fn name(self) -> &'static str {
        TILT_METHODS[self as usize]
    }

    /// Method with this name.
    pub fn of_name(name: &str) -> Option<Self> {
        [Self::Complementary, Self::Kalman].into_iter().find(|method| method.name() == name)
    }
}

/// Constants of all methods; each method uses some.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TiltConstants {
    /// Time constant of the complementary filter, s.
    pub time_constant: f64,
    /// Growth of the angle's variance per second, unit²/s.
    pub q_angle: f64,
    /// Growth of the bias's variance per second, (unit/s)²/s.
    pub q_bias: f64,
    /// Variance of one sample of the accelerometer's angle, unit².
    pub r_measure: f64,
    /// Variance of angle and bias at the start, unit² and (unit/s)².
    pub p_start: f64,
}

impl Default for TiltConstants {
    fn default() -> Self {
        Self { time_constant: 0.5, q_angle: 1e-3, q_bias: 3e-3, r_measure: 3e-2, p_start: 1.0 }
    }
}

const KALMAN: &[&str] = &["kalman"];

/// Every constant.
pub const TILT_CONSTANTS: &[Constant<TiltConstants>] = &[
    Constant {
        name: "time_constant",
        unit: "s",
        range: [1e-6, 1e6],
        expected: "from 1e-6 to 1e6 s",
        meaning: "Time constant of the angle towards the accelerometer's",
        methods: &["complementary"],
        get: |c| Some(c.time_constant),
        set: |c, value| c.time_constant = value,
    },
    Constant {
        name: "q_angle",
        unit: "unit^2/s",
        range: [0.0, 1e60],
        expected: "zero or a positive number up to 1e60",
        meaning: "Variance that the angle gains in a second",
        methods: KALMAN,
        get: |c| Some(c.q_angle),
        set: |c, value| c.q_angle = value,
    },
    Constant {
        name: "q_bias",
        unit: "(unit/s)^2/s",
        range: [0.0, 1e60],
        expected: "zero or a positive number up to 1e60",
        meaning: "Variance that the bias gains in a second",
        methods: KALMAN,
        get: |c| Some(c.q_bias),
        set: |c, value| c.q_bias = value,
    },
    Constant {
        name: "r_measure",
        unit: "unit^2",
        range: [1e-60, 1e60],
        expected: "from 1e-60 to 1e60",
        meaning: "Variance of one sample of the accelerometer's angle",
        methods: KALMAN,
        get: |c| Some(c.r_measure),
        set: |c, value| c.r_measure = value,
    },
    Constant {
        name: "p_start",
        unit: "unit^2",
        range: [0.0, 1e60],
        expected: "zero or a positive number up to 1e60",
        meaning: "Variance of angle and bias before the first sample",
        methods: KALMAN,
        get: |c| Some(c.p_start),
        set: |c, value| c.p_start = value,
    },
];

/// Parameters of a tilt filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TiltParams {
    /// Samples per second.
    pub rate: f64,
    /// Filter that combines rate and angle.
    pub method: TiltMethod,
    /// Constants of the two methods.
    pub constants: TiltConstants,
}

impl TiltParams {
    fn validate(self) -> Result<Self, Error> {
        check_rate(self.rate)?;
        TILT_CONSTANTS.iter().try_for_each(|constant| constant.check(&self.constants))?;
        Ok(self)
    }
}

/// Tilt about one axis, in the unit of the accelerometer's angle.
///
/// A sample has three numbers. The first is the rate about the axis, in that unit per second; the
/// second is the accelerometer's angle; the third is the time since the previous sample, s. NaN is
/// a missing rate or angle, and as time it is one period. The filter begins with the first angle.
///
/// Complementary: θ ← a(θ + ω dt) + (1 - a)θ_acc with a = τ/(τ + dt). A bias b leaves an error of b
/// τ.
///
/// Kalman: states angle and bias, F = [1, -dt; 0, 1], Q = diag(q_θ, q_b) dt, H = [1, 0]. R is the
/// variance of one sample: the same constants are another filter at another rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Tilt {
    params: TiltParams,
    period: f64,
    begun: bool,
    angle: f64,
    bias: f64,
    P: Symmetric<f64, 2>,
    /// The last known rate, and the time since it, s.
    rate: f64,
    unknown: f64,
    samples: u64,
}

impl Tilt {
    /// A filter before its first sample.
    ///
    /// [`Error::Parameter`] if a parameter is out of range.
    /// [`Error::Parameter`] if a parameter is out of its range.
    pub fn new(params: TiltParams) -> Result<Self, Error> {
        let params = params.validate()?;
        Ok(Self {
            params,
            period: 1.0 / params.rate,
            begun: false,
            angle: 0.0,
            bias: 0.0,
            P: Symmetric::diagonal(params.constants.p_start),
            rate: 0.0,
            unknown: 0.0,
            samples: 0,
        })
    }

    /// Parameters of the filter.
    pub fn params(&self) -> &TiltParams {
        &self.params
    }

    /// Tilt; NaN before the first angle of the accelerometer.
    pub fn angle(&self) -> f64 {
        if self.begun { self.angle } else { f64::NAN }
    }

    /// The gyro's bias from the Kalman filter; else NaN.
    pub fn bias(&self) -> f64 {
        if self.is_kalman() { self.bias } else { f64::NAN }
    }

    /// Standard deviation of the tilt from the Kalman filter; else NaN.
    pub fn angle_sigma(&self) -> f64 {
        self.sigma(0)
    }

    /// Standard deviation of the bias from the Kalman filter; else NaN.
    pub fn bias_sigma(&self) -> f64 {
        self.sigma(1)
    }

    /// Samples to date, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.samples
    }

    fn sigma(&self, i: usize) -> f64 {
        if self.is_kalman() { self.P.at(i, i).max(0.0).simd_sqrt() } else { f64::NAN }
    }

    fn is_kalman(&self) -> bool {
        self.params.method == TiltMethod::Kalman
    }

    /// Stores the rate, or keeps the last rate; returns the time for which it is valid, s.
    fn hold(&mut self, gyro: f64, dt: f64) -> f64 {
        if is_within(gyro, MAX_SAMPLE) {
            (self.rate, self.unknown) = (gyro, 0.0);
            return dt;
        }
        let left = (MAX_HELD_S - self.unknown).max(0.0);
        self.unknown = (self.unknown + dt).min(MAX_SPAN);
        dt.min(left)
    }

    fn complement(&mut self, angle: Option<f64>, dt: f64, held: f64) {
        self.angle += self.rate * held;
        if let Some(angle) = angle {
            let tau = self.params.constants.time_constant;
            let a = tau / (tau + dt);
            self.angle = a * self.angle + (1.0 - a) * angle;
        }
    }

    fn predict(&mut self, dt: f64, held: f64) {
        let constants = &self.params.constants;
        self.angle += (self.rate - self.bias) * held;
        let (p, q, r) = (self.P.at(0, 0), self.P.at(0, 1), self.P.at(1, 1));
        let (grown, rounding) = (held * held * r, ROUNDING * (p + held * held * r));
        self.P.set(0, 0, p + (grown - 2.0 * held * q) + constants.q_angle * dt + rounding);
        self.P.set(0, 1, q - held * r);
        self.P.set(1, 1, r + constants.q_bias * dt + ROUNDING * r);
        self.limit();
    }

    fn correct(&mut self, angle: f64) {
        let R = self.params.constants.r_measure;
        let (p, q, r) = (self.P.at(0, 0), self.P.at(0, 1), self.P.at(1, 1));
        let S = p + R;
        let (k, b, left) = (p / S, q / S, R / S);
        let e = angle - self.angle;
        self.angle += k * e;
        self.bias += b * e;
        // (I - K H) P, computed without a difference to keep the digits.
        self.P.set(0, 0, left * p);
        self.P.set(0, 1, left * q);
        self.P.set(1, 1, r - b * q + ROUNDING * r);
    }

    /// Limits the variances without a change of the correlation, and the covariance to the value
    /// that the variances allow.
    fn limit(&mut self) {
        for i in 0..2 {
            let variance = self.P.at(i, i);
            if variance > MAX_VARIANCE {
                self.P.set(0, 1, self.P.at(0, 1) * (MAX_VARIANCE / variance).simd_sqrt());
                self.P.set(i, i, MAX_VARIANCE);
            }
        }
        let [angle, bias] = [0, 1].map(|i| self.P.at(i, i).max(0.0).simd_sqrt());
        let most = angle * bias;
        self.P.set(0, 1, self.P.at(0, 1).clamp(-most, most));
    }
}

impl Stream for Tilt {
    type Input = [f64; 3];
    type Output = f64;

    #[inline]
    fn update(&mut self, [gyro, angle, dt]: [f64; 3]) -> f64 {
        let dt = if dt >= 0.0 { dt.min(MAX_SPAN) } else { self.period };
        let angle = is_within(angle, MAX_SAMPLE).then_some(angle);
        let held = self.hold(gyro, dt);
        self.samples += 1;
        if !self.begun
            && let Some(angle) = angle
        {
            (self.begun, self.angle) = (true, angle);
        }
        if !self.begun {
            return self.angle();
        }
        match self.params.method {
            TiltMethod::Complementary => self.complement(angle, dt, held),
            TiltMethod::Kalman => {
                self.predict(dt, held);
                angle.into_iter().for_each(|angle| self.correct(angle));
            }
        }
        self.angle = self.angle.clamp(-MAX_STATE, MAX_STATE);
        self.bias = self.bias.clamp(-MAX_STATE, MAX_STATE);
        self.angle
    }

    fn reset(&mut self) {
        if let Ok(new) = Self::new(self.params) {
            *self = new;
        }
    }
}

impl Checkpoint for Tilt {
    const TAG: &'static str = "tilt";
    const VERSION: u16 = 1;

    fn is_valid(&self) -> bool {
        // Limiting raises a variance by some rounding errors.
        let most = MAX_VARIANCE * (1.0 + 1e-9);
        self.params.validate().is_ok()
            && self.period == 1.0 / self.params.rate
            && is_within(self.angle, MAX_STATE)
            && is_within(self.bias, MAX_STATE)
            && self.P.is_covariance(2.0 * most)
            && is_within(self.rate, MAX_SAMPLE)
            && (0.0..=MAX_SPAN).contains(&self.unknown)
            && is_count(self.samples)
    }

    fn is_like(&self, other: &Self) -> bool {
        (self.params, self.samples) == (other.params, other.samples)
    }
}

#[cfg(test)]
mod tests {
    use super::{TILT_CONSTANTS, Tilt, TiltConstants, TiltMethod, TiltParams};
    use crate::stream::Stream;
    use crate::stream::checkpoint::Checkpoint;
    use proptest::prelude::*;

    fn number() -> impl Strategy<Value = f64> {
        let decade = -200.0..200.0_f64;
        prop_oneof![
            8 => (-1.0..1.0_f64, decade).prop_map(|(x, decade)| x * 10.0_f64.powf(decade)),
            4 => -10.0..10.0_f64,
            1 => Just(f64::NAN),
            1 => Just(f64::INFINITY),
        ]
    }

    proptest! {
        #[test]
        fn no_sample_makes_an_invalid_state(
            ends in prop::collection::vec(0..3_usize, TILT_CONSTANTS.len()),
            kalman in any::<bool>(),
            samples in prop::collection::vec((number(), number(), number()), 1..120),
        ) {
            let mut constants = TiltConstants::default();
            for (row, end) in TILT_CONSTANTS.iter().zip(ends) {
                if end < 2 {
                    (row.set)(&mut constants, row.range[end]);
                }
            }
            let method = if kalman { TiltMethod::Kalman } else { TiltMethod::Complementary };
            let mut tilt = Tilt::new(TiltParams { rate: 100.0, method, constants }).unwrap();
            for (gyro, angle, dt) in samples {
                tilt.update([gyro, angle, dt]);
                prop_assert!(tilt.is_valid(), "{gyro:e} {angle:e} {dt:e}: {tilt:?}");
            }
        }
    }
}
