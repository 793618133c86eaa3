//! Correction of samples by a calibration, sample by sample.

use serde::{Deserialize, Serialize};

use crate::error::{Error, require};
use crate::math::validity::{is_sample, is_within};
use crate::math::{Real, choose};
use crate::stream::checkpoint::Checkpoint;
use crate::stream::{Field, Output, Shape, Stream};

type Vector = [f64; 3];
type Matrix = [Vector; 3];

/// Largest number of a correction, raw sample and temperature: all results are then finite.
const MAX_NUMBER: f64 = 1e50;
const MAX_SAMPLE: f64 = 1e150;
const MAX_TEMPERATURE: f64 = 1e6;
/// Largest force.
const MAX_FORCE: f64 = 1e201;

/// Correction of raw samples: `force = accel_matrix (accel - accel_bias)` and
/// `rate = gyro_matrix (gyro - bias - g_sensitivity force)`. Matrices are stored as rows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Correction {
    /// Inverse of the gyro's matrix.
    pub gyro_matrix: Matrix,
    /// Bias of the gyro if no temperature is known.
    pub gyro_bias: Vector,
    /// Inverse of the accelerometer's matrix.
    pub accel_matrix: Matrix,
    /// Bias of the accelerometer.
    pub accel_bias: Vector,
    /// Response of the raw gyro to a corrected force.
    pub g_sensitivity: Matrix,
    /// Bias of the gyro over temperature, `None` if it is unknown.
    pub temperature: Option<TemperatureCurve>,
}

impl Default for Correction {
    /// The identity.
    fn default() -> Self {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self {
            gyro_matrix: identity,
            gyro_bias: [0.0; 3],
            accel_matrix: identity,
            accel_bias: [0.0; 3],
            g_sensitivity: [[0.0; 3]; 3],
            temperature: None,
        }
    }
}

impl Correction {
    /// The correction, if all its numbers are finite and in range.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first number out of range.
    pub fn validate(self) -> Result<Self, Error> {
        check("gyro_matrix", self.gyro_matrix.as_flattened())?;
        check("gyro_bias", &self.gyro_bias)?;
        check("accel_matrix", self.accel_matrix.as_flattened())?;
        check("accel_bias", &self.accel_bias)?;
        check("g_sensitivity", self.g_sensitivity.as_flattened())?;
        self.temperature.map_or(Ok(()), |curve| curve.check())?;
        Ok(self)
    }

    /// The gyro minus its bias and its response to the force.
    #[inline(always)]
    fn rate(&self, gyro: Vector, bias: &Vector, force: &Vector) -> Vector {
        let felt = product(&self.g_sensitivity, force);
        let driven = [0, 1, 2].map(|i| gyro[i].within(MAX_SAMPLE) - bias[i] - felt[i]);
        shown(gyro, product(&self.gyro_matrix, &driven))
    }

    /// The corrected accelerometer; NaN for missing axes.
    #[inline(always)]
    fn force(&self, accel: Vector) -> Vector {
        let driven = [0, 1, 2].map(|i| accel[i].within(MAX_SAMPLE) - self.accel_bias[i]);
        product(&self.accel_matrix, &driven)
    }
}

/// Bias of the gyro over temperature T, degC: for each axis the sum of
/// `c_k ((T - reference) / 10)^k` within the calibrated range. Outside, it continues along the
/// tangent for the length of the range, then stays constant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TemperatureCurve {
    /// Temperature of `c_0`, degC.
    pub reference: f64,
    /// Lowest and highest temperature of the data, degC.
    pub range: [f64; 2],
    /// `c_0` to `c_3` of each axis, raw unit.
    pub coefficients: [[f64; 4]; 3],
}

impl TemperatureCurve {
    fn check(&self) -> Result<(), Error> {
        check("coefficients", self.coefficients.as_flattened())?;
        let expected = "a temperature within 1e6 degC";
        let [low, high] = self.range;
        for (name, value) in [("reference", self.reference), ("range", low), ("range", high)] {
            require(is_within(value, MAX_TEMPERATURE), name, expected, value)?;
        }
        require(low <= high, "range", "least and highest temperature", low)
    }

    /// Bias of each axis.
    #[inline(always)]
    pub fn bias(&self, temperature: f64) -> Vector {
        let [low, high] = self.range;
        let (temperature, span) = (temperature.within(MAX_TEMPERATURE), high - low);
        let inside = temperature.at_least(low).at_most(high);
        let beyond = temperature.at_least(low - span).at_most(high + span) - inside;
        let (x, dx) = ((inside - self.reference) * 0.1, beyond * 0.1);
        self.coefficients.map(|c| {
            let value = ((c[3] * x + c[2]) * x + c[1]) * x + c[0];
            let slope = (3.0 * c[3] * x + 2.0 * c[2]) * x + c[1];
            value + slope * dx
        })
    }
}

fn check(name: &'static str, numbers: &[f64]) -> Result<(), Error> {
    let expected = "of finite numbers, at most 1e50 in size";
    let wrong = numbers.iter().find(|x| !is_within(**x, MAX_NUMBER));
    wrong.map_or(Ok(()), |x| require(false, name, expected, *x))
}

#[inline(always)]
fn product(matrix: &Matrix, v: &Vector) -> Vector {
    [0, 1, 2].map(|i| matrix[i][0] * v[0] + matrix[i][1] * v[1] + matrix[i][2] * v[2])
}

/// True if no axis is missing.
#[inline(always)]
fn present(sample: Vector) -> bool {
    sample[0].is_finite() & sample[1].is_finite() & sample[2].is_finite()
}

/// The corrected sample, NaN if an axis is missing.
#[inline(always)]
fn shown(sample: Vector, corrected: Vector) -> Vector {
    let present = present(sample);
    corrected.map(|x| choose(present, x, f64::NAN))
}

/// Gyro and accelerometer, corrected; NaN where an axis is missing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Imu {
    /// Angular rate.
    pub gyro: [f64; 3],
    /// Specific force.
    pub accel: [f64; 3],
}

impl Output for Imu {
    const FIELDS: &'static [Field] = &[
        Field { name: "gyro", shape: Shape::Vector(3) },
        Field { name: "accel", shape: Shape::Vector(3) },
    ];

    #[inline(always)]
    fn write(self, numbers: &mut [f64], _: &mut [bool]) {
        numbers[..3].copy_from_slice(&self.gyro);
        numbers[3..6].copy_from_slice(&self.accel);
    }
}

/// A corrector for samples of `N` numbers: 3 of the gyro, then 3 of the accelerometer, then the
/// temperature in degC.
///
/// If an axis is missing, its sensor's output is NaN. The gyro is corrected with the last known
/// force and temperature. Before the first, no force and the bias without temperature are used.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ImuCorrector<const N: usize> {
    correction: Correction,
    /// Last known force, zero before the first.
    force: Vector,
    /// Last known temperature, NaN before the first.
    temperature: f64,
}

impl<const N: usize> ImuCorrector<N> {
    /// A corrector before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a number of the correction is not finite or too large.
    pub fn new(correction: Correction) -> Result<Self, Error> {
        let correction = correction.validate()?;
        Ok(Self { correction, force: [0.0; 3], temperature: f64::NAN })
    }

    /// Correction of the samples.
    pub fn correction(&self) -> &Correction {
        &self.correction
    }

    /// The last known specific force; zero before the first force.
    pub fn force(&self) -> [f64; 3] {
        self.force
    }

    /// Present bias of the raw gyro.
    #[inline(always)]
    pub fn bias(&self) -> [f64; 3] {
        match &self.correction.temperature {
            Some(curve) if !self.temperature.is_nan() => curve.bias(self.temperature),
            _ => self.correction.gyro_bias,
        }
    }

    /// Stores a force, or keeps the last force if an axis is missing.
    #[inline(always)]
    fn feel(&mut self, accel: Vector) -> Vector {
        let (present, force) = (present(accel), self.correction.force(accel));
        self.force = [0, 1, 2].map(|i| choose(present, force[i], self.force[i]));
        force.map(|x| choose(present, x, f64::NAN))
    }

    /// Corrects the samples of gyro and accelerometer.
    #[inline(always)]
    fn both(&mut self, gyro: Vector, accel: Vector) -> Imu {
        let accel = self.feel(accel);
        Imu { gyro: self.correction.rate(gyro, &self.bias(), &self.force), accel }
    }

    fn is_valid_after(&self, forces: bool, temperatures: bool) -> bool {
        let most = if forces { MAX_FORCE } else { 0.0 };
        Self::new(self.correction).is_ok()
            && self.force.iter().all(|x| is_within(*x, most))
            && is_sample(self.temperature, MAX_TEMPERATURE)
            && (temperatures || self.temperature.is_nan())
    }
}

macro_rules! corrector {
    ($n:literal, $tag:literal, $output:ty, |$this:ident, $z:ident| $update:expr) => {
        impl Stream for ImuCorrector<$n> {
            type Input = [f64; $n];
            type Output = $output;

            #[inline(always)]
            fn update(&mut self, $z: [f64; $n]) -> $output {
                let $this = self;
                $update
            }

            fn reset(&mut self) {
                (self.force, self.temperature) = ([0.0; 3], f64::NAN);
            }
        }

        impl Checkpoint for ImuCorrector<$n> {
            const TAG: &'static str = $tag;
            const VERSION: u16 = 1;

            fn is_valid(&self) -> bool {
                self.is_valid_after($n > 3, $n > 6)
            }

            fn is_like(&self, other: &Self) -> bool {
                self.correction == other.correction
            }
        }
    };
}

corrector!(3, "corrector-3", [f64; 3], |this, z| {
    this.correction.rate(z, &this.correction.gyro_bias, &[0.0; 3])
});
corrector!(6, "corrector-6", Imu, |this, z| this.both([z[0], z[1], z[2]], [z[3], z[4], z[5]]));
corrector!(7, "corrector-7", Imu, |this, z| {
    let temperature = z[6].within(MAX_TEMPERATURE);
    this.temperature = choose(z[6].is_finite(), temperature, this.temperature);
    this.both([z[0], z[1], z[2]], [z[3], z[4], z[5]])
});
