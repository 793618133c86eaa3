//! Madgwick's gradient descent.

use nalgebra::{Quaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::body::Body;
use super::{Named, NamedOptions};
use crate::attitude::sample::Inertial;
use crate::attitude::stream::Tagged;
use crate::attitude::{Estimator, Knowledge};
use crate::error::Error;
use crate::math::Real;

/// Shortest gradient with a direction; a shorter gradient is only rounding.
const MIN_GRADIENT: f64 = 1e-12;
/// Largest step of the quaternion per sample; the quaternion has length one.
const MAX_STEP: f64 = 0.5;

/// dq/dt = q ⊗ ω/2 - β ∇F/|∇F|. F is the squared distance of the measured from the expected
/// directions of gravity and field. The expected field lies in the plane of north and up.
///
/// S. O. H. Madgwick, *An efficient orientation filter for inertial and inertial/magnetic sensor
/// arrays*, report, University of Bristol, 2010, eqs. 12-13, 25-34 and 44-46, with β of its
/// experiments and without its bias (eqs. 47-49). The length of the gradient has no effect: an
/// error decreases by 2 β rad/s at most, and a larger bias is never corrected.
/// is mended at 2 β rad/s at most, and a bias beyond that is never caught.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Madgwick {
    options: NamedOptions,
    body: Body,
}

impl Madgwick {
    /// A filter before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if an option is out of range.
    pub fn new(options: NamedOptions) -> Result<Self, Error> {
        Ok(Self { options: options.validate()?, body: Body::default() })
    }

    /// ∇F of all measured directions.
    #[inline]
    fn gradient(
        &self,
        accel: Option<&Vector3<f64>>,
        mag: Option<&Vector3<f64>>,
    ) -> Quaternion<f64> {
        let (body, mut sum) = (&self.body, Quaternion::from_parts(0.0, Vector3::zeros()));
        if body.levelled
            && let Some(accel) = accel
        {
            sum += gradient(&body.orientation, &Vector3::z(), &accel.normalize());
        }
        if body.headed
            && let Some(mag) = mag
        {
            let mag = mag.normalize();
            let h = body.in_earth(&mag);
            let north = (h.x * h.x + h.y * h.y).simd_sqrt();
            sum += gradient(&body.orientation, &Vector3::new(0.0, north, h.z), &mag);
        }
        sum
    }
}

/// Gradient of |q* d q - s|²/2, for a direction d of the earth (north and up) and s of the sensor.
///
/// This is Jᵀf of the report in one product: -2 d q f. The report writes the diagonal of the
/// rotation as 1 - 2(y² + z²). This adds the last term, along q. It rotates nothing, but it is part
/// of the length by which the gradient is divided. North is the first axis in the report.
#[inline]
fn gradient(q: &Quaternion<f64>, d: &Vector3<f64>, s: &Vector3<f64>) -> Quaternion<f64> {
    let pure = |v: Vector3<f64>| Quaternion::from_parts(0.0, v);
    let expected = (q.conjugate() * pure(*d) * q).imag();
    let f = expected - s;
    (pure(*d) * q * pure(f) + q * (d.y * f.x + d.z * f.z)) * -2.0
}

impl Estimator for Madgwick {
    #[inline]
    fn step(&mut self, sample: &Inertial) {
        let mag = sample.mag.as_ref().filter(|_| self.options.mag);
        let (q, dt) = (self.body.orientation, sample.dt);
        let gradient = self.gradient(sample.accel.as_ref(), mag);
        let mut next = q;
        if sample.known {
            next += q * Quaternion::from_parts(0.0, sample.gyro * (0.5 * dt));
        }
        let length = gradient.norm();
        if length > MIN_GRADIENT {
            next -= gradient * ((self.options.beta() * dt).min(MAX_STEP) / length);
        }
        self.body.set(next);
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
        Knowledge { started: self.body.levelled, ..Knowledge::default() }
    }

    fn align(&mut self, orientation: Quaternion<f64>, _tilt_sigma: f64, _heading_sigma: f64) {
        self.body.align(orientation);
    }

    fn reset(&mut self) {
        self.body = Body::default();
    }

    fn is_valid(&self) -> bool {
        self.options.validate().is_ok() && self.body.is_valid()
    }

    fn is_like(&self, other: &Self) -> bool {
        self.options == other.options
    }
}

impl Tagged for Madgwick {
    const TAG: &'static str = "att-madgwick";
}

impl Named for Madgwick {
    const METHOD: &'static str = "madgwick";

    fn options(&self) -> NamedOptions {
        self.options
    }
}
