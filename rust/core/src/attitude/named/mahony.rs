//! Mahony's explicit complementary filter.

use nalgebra::{Quaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::body::Body;
use super::options::MAX_BIAS;
use super::{Named, NamedOptions};
use crate::attitude::sample::Inertial;
use crate::attitude::stream::Tagged;
use crate::attitude::{Estimator, Knowledge};
use crate::error::Error;
use crate::math::Real;
use crate::math::validity::are_within;

/// The error e = a × v̂ is between the measured and the estimated vertical. It turns the
/// orientation by the rate ω - b + k_P e, and changes the bias by db/dt = -k_I e.
///
/// R. Mahony, T. Hamel, J.-M. Pflimlin, *IEEE Trans. Automatic Control* 53(5), 2008, eqs. 32, with
/// the gains of their experiments. The magnetometer adds the sine of its angle to north, only about
/// the vertical, and does not change the tilt (M.-D. Hua et al., *IEEE Trans. Control Systems
/// Technology* 22(1), 2014). Without k_I a bias b leaves the error asin(b / k_P).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Mahony {
    options: NamedOptions,
    body: Body,
    bias: Vector3<f64>,
}

impl Mahony {
    /// A filter before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if an option is out of range.
    pub fn new(options: NamedOptions) -> Result<Self, Error> {
        let options = options.validate()?;
        Ok(Self { options, body: Body::default(), bias: options.bias.into() })
    }

    /// Rotation in the sensor's axes that corrects the measured vertical and north, to first order.
    #[inline]
    fn error(&self, accel: Option<&Vector3<f64>>, mag: Option<&Vector3<f64>>) -> Vector3<f64> {
        let (body, up, mut error) = (&self.body, self.body.up(), Vector3::zeros());
        if body.levelled
            && let Some(accel) = accel
        {
            error += accel.normalize().cross(&up);
        }
        if body.headed
            && let Some(mag) = mag
        {
            let field = body.in_earth(mag);
            let level = (field.x * field.x + field.y * field.y).simd_sqrt();
            if level > 0.0 {
                error += up * (field.x / level);
            }
        }
        error
    }
}

impl Estimator for Mahony {
    #[inline]
    fn step(&mut self, sample: &Inertial) {
        let mag = sample.mag.as_ref().filter(|_| self.options.mag);
        let error = self.error(sample.accel.as_ref(), mag);
        let (kp, ki) = (self.options.constants.kp, self.options.constants.ki);
        let mut rate = error * kp;
        if sample.known {
            let bias = self.bias - error * (ki * sample.dt);
            self.bias = bias.map(|x| x.clamp(-MAX_BIAS, MAX_BIAS));
            rate += sample.gyro - self.bias;
        }
        self.body.turn(&(rate * sample.dt));
        self.body.begin(sample.accel.as_ref(), mag);
    }

    fn gap(&mut self, _seconds: f64) {
        self.body.forget();
    }

    #[inline]
    fn orientation(&self) -> Quaternion<f64> {
        self.body.orientation
    }

    fn knowledge(&self) -> Knowledge {
        Knowledge { bias: self.bias, started: self.body.levelled, ..Knowledge::default() }
    }

    fn align(&mut self, orientation: Quaternion<f64>, _tilt_sigma: f64, _heading_sigma: f64) {
        self.body.align(orientation);
    }

    fn reset(&mut self) {
        (self.body, self.bias) = (Body::default(), self.options.bias.into());
    }

    fn is_valid(&self) -> bool {
        self.options.validate().is_ok() && self.body.is_valid() && are_within(&self.bias, MAX_BIAS)
    }

    fn is_like(&self, other: &Self) -> bool {
        self.options == other.options
    }
}

impl Tagged for Mahony {
    const TAG: &'static str = "att-mahony";
}

impl Named for Mahony {
    const METHOD: &'static str = "mahony";

    fn options(&self) -> NamedOptions {
        self.options
    }
}
