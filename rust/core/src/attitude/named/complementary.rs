//! The complementary filter: gyro for fast changes, accelerometer and magnetometer for slow
//! changes.

use nalgebra::{Quaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::body::{Body, east_of_north, tilt};
use super::{Named, NamedOptions};
use crate::attitude::sample::Inertial;
use crate::attitude::stream::Tagged;
use crate::attitude::{Estimator, Knowledge};
use crate::error::Error;

/// Each sample makes three rotations. The first is by the rate. The second is by the share dt/(τ +
/// dt) of the shortest rotation that levels the orientation. The third is about the vertical, by
/// the same share of the angle to magnetic north.
///
/// In one axis that is θ ← a(θ + ω dt) + (1 - a)θ_acc with a = τ/(τ + dt), of first order (W. T.
/// Higgins, *IEEE Trans. Aerospace and Electronic Systems* 11(3), 1975). The correction of tilt
/// before heading, each by a share of its rotation, follows R. G. Valenti, I. Dryanovski, J. Xiao,
/// *Sensors* 15(8), 2015, with constant gain. A bias b of the gyro about a level axis leaves the
/// error b τ at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Complementary {
    options: NamedOptions,
    body: Body,
}

impl Complementary {
    /// A filter before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if an option is out of range.
    pub fn new(options: NamedOptions) -> Result<Self, Error> {
        Ok(Self { options: options.validate()?, body: Body::default() })
    }
}

impl Estimator for Complementary {
    #[inline]
    fn step(&mut self, sample: &Inertial) {
        let mag = sample.mag.as_ref().filter(|_| self.options.mag);
        let body = &mut self.body;
        if sample.known {
            body.turn(&(sample.gyro * sample.dt));
        }
        let share = sample.dt / (self.options.constants.time_constant + sample.dt);
        if body.levelled
            && let Some(accel) = &sample.accel
        {
            body.turn_earth(&(tilt(&body.in_earth(accel)) * share));
        }
        if body.headed
            && let Some(mag) = mag
        {
            let angle = east_of_north(&body.in_earth(mag));
            body.turn_earth(&Vector3::new(0.0, 0.0, share * angle));
        }
        body.begin(sample.accel.as_ref(), mag);
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

impl Tagged for Complementary {
    const TAG: &'static str = "att-complement";
}

impl Named for Complementary {
    const METHOD: &'static str = "complementary";

    fn options(&self) -> NamedOptions {
        self.options
    }
}
