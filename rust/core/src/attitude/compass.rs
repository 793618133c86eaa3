//! The filter with a calibrated magnetometer.

use nalgebra::{Matrix3, Quaternion, Vector3};
use serde::{Deserialize, Serialize};

#[cfg(feature = "std")]
use super::Around;
use super::named::Named;
use super::stream::Tagged;
use super::{Auto, Estimator, Inertial, Knowledge, NamedOptions};
use crate::error::{Error, require};

/// Largest element of a matrix, and largest hard iron in any unit.
const MAX_MATRIX: f64 = 10.0;
const MAX_IRON: f64 = 1e9;

/// Correction of a magnetometer by a calibration: the field is `matrix (sample - iron)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FieldCorrection {
    /// Hard iron, in the samples' unit.
    pub iron: [f64; 3],
    /// Rows of the matrix.
    pub matrix: [[f64; 3]; 3],
}

impl FieldCorrection {
    /// The correction, if its numbers are in range.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first number out of range.
    pub fn validate(self) -> Result<Self, Error> {
        for x in self.iron {
            require(x.abs() <= MAX_IRON, "magnetometer", "a hard iron of at most 1e9", x)?;
        }
        for x in self.matrix.as_flattened() {
            let expected = "a matrix of elements of at most 10";
            require(x.abs() <= MAX_MATRIX, "magnetometer", expected, *x)?;
        }
        Ok(self)
    }

    /// The field of a sample.
    #[inline(always)]
    pub fn of(&self, sample: &Vector3<f64>) -> Vector3<f64> {
        Matrix3::from(self.matrix).transpose() * (sample - Vector3::from(self.iron))
    }
}

/// The filter; it gets corrected fields instead of samples of the magnetometer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Compass {
    auto: Auto,
    correction: FieldCorrection,
}

impl Compass {
    /// A filter behind a calibration.
    ///
    /// # Errors
    /// [`Error::Parameter`] if its numbers are out of their ranges.
    pub fn new(auto: Auto, correction: FieldCorrection) -> Result<Self, Error> {
        Ok(Self { auto, correction: correction.validate()? })
    }

    /// The calibration.
    pub fn correction(&self) -> &FieldCorrection {
        &self.correction
    }
}

impl Estimator for Compass {
    #[inline(always)]
    fn step(&mut self, sample: &Inertial) {
        let mag = sample.mag.as_ref().map(|mag| self.correction.of(mag));
        self.auto.step(&Inertial { mag, ..*sample });
    }

    fn gap(&mut self, seconds: f64) {
        self.auto.gap(seconds);
    }

    #[inline(always)]
    fn orientation(&self) -> Quaternion<f64> {
        self.auto.orientation()
    }

    fn knowledge(&self) -> Knowledge {
        self.auto.knowledge()
    }

    fn align(&mut self, orientation: Quaternion<f64>, tilt_sigma: f64, heading_sigma: f64) {
        self.auto.align(orientation, tilt_sigma, heading_sigma);
    }

    fn reset(&mut self) {
        self.auto.reset();
    }

    fn power_on(&mut self) {
        self.auto.power_on();
    }

    fn is_valid(&self) -> bool {
        self.correction.validate().is_ok() && self.auto.is_valid()
    }

    fn is_like(&self, other: &Self) -> bool {
        self.correction == other.correction && self.auto.is_like(&other.auto)
    }
}

impl Tagged for Compass {
    const TAG: &'static str = "attitude-compass";
    const VERSION: u16 = 3;
}

impl Named for Compass {
    const METHOD: &'static str = Auto::METHOD;

    fn options(&self) -> NamedOptions {
        Named::options(&self.auto)
    }

    fn is_calibrated(&self) -> bool {
        self.auto.is_calibrated()
    }

    fn bias_limit(&self) -> Option<f64> {
        self.auto.bias_limit()
    }

    fn correction(&self) -> Option<&FieldCorrection> {
        Some(&self.correction)
    }
}

#[cfg(feature = "std")]
impl Around for Compass {
    fn auto(&self) -> &Auto {
        &self.auto
    }

    fn field(&self, mag: [f64; 3]) -> [f64; 3] {
        self.correction.of(&Vector3::from(mag)).into()
    }
}

#[cfg(test)]
mod tests {
    use super::{Compass, FieldCorrection};
    use crate::attitude::{Auto, AutoOptions, Estimator, Inertial};
    use nalgebra::{Matrix3, Vector3};

    #[test]
    fn samples_with_iron_give_what_fields_give() {
        let (iron, soft) = (Vector3::new(30.0, -10.0, 5.0), 1.0 / 1.25);
        let matrix = [[soft, 0.0, 0.0], [0.0, 1.0, 0.1], [0.0, 0.0, 1.0]];
        let auto = Auto::new(AutoOptions::default()).expect("usual options");
        let correction = FieldCorrection { iron: iron.into(), matrix };
        let mut compass = Compass::new(auto, correction).expect("numbers within reason");
        let mut plain = auto;
        let spoil = Matrix3::from(matrix).transpose().try_inverse().expect("a regular matrix");
        for k in 0..300 {
            let t = 0.01 * f64::from(k);
            let field = Vector3::new(20.0 * (2.0 * t).cos(), -20.0 * (2.0 * t).sin(), -40.0);
            let mut sample = Inertial {
                gyro: Vector3::new(0.0, 0.0, 2.0),
                known: true,
                unknown: 0.0,
                age: 0.0,
                accel: Some(Vector3::new(0.0, 0.0, 9.81)),
                mag: Some(field),
                dt: 0.01,
            };
            plain.step(&sample);
            sample.mag = Some(spoil * field + iron);
            compass.step(&sample);
        }
        let apart = compass.orientation() - plain.orientation();
        assert!(apart.norm() < 1e-12, "{apart}");
        assert!(compass.is_valid());
        let wrong = FieldCorrection { iron: [f64::NAN, 0.0, 0.0], matrix };
        assert!(Compass::new(auto, wrong).is_err());
    }
}
