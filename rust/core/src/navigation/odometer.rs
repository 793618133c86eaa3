//! Wheels as speed sensors, with an estimated scale and mounting.

use nalgebra::{ComplexField, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::covariance::{
    ANTENNA, CONSTANTS, Constants, ConstantsCovariance, GYRO, PHI, Row, STATES, V,
};
use super::filter::{NavigationFilter, Observer};
use super::params::Wheels;
use crate::error::{Error, require};
use crate::math::Real;

/// Number of the wheels' constants: scale, yaw and pitch, the first constants.
const WHEEL_CONSTANTS: usize = 3;
/// Standard deviations of scale, yaw and pitch before any measurement.
const PRIOR_SIGMAS: [f64; WHEEL_CONSTANTS] = [0.03, 0.035, 0.035];
/// Largest values of the constants, for a scale of one half or a right angle.
pub(crate) const MAX_CONSTANT: f64 = 1.5;
/// Normalised innovation squared beyond which a wheel slips, and longest slip, s. A longer
/// disagreement only reduces the weight, since the filter itself may be wrong.
const MAX_WHEEL_NIS: f64 = 9.0;
const MAX_SLIP_S: f64 = 10.0;
/// Largest standard deviation of a heading, rad, with which wheel speeds are used. A larger error
/// would be mistaken for a rotated mount.
const MAX_HEADING_SIGMA_RAD: f64 = 0.1;
/// Largest speed, m/s.
pub(crate) const MAX_SPEED: f64 = 1e4;
const MAX_SPEED_LEAD_S: f64 = 0.1;
const MAX_SPEED_AGE_S: f64 = 1.0;

/// Wheel speed around a time, s: mean forward speed, m/s, and its standard deviation, NaN for the
/// default of the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rolling {
    /// Time of the measurement, s.
    pub time: f64,
    /// Forward speed, m/s.
    pub speed: f64,
    /// Standard deviation of the speed, m/s.
    pub sigma: f64,
}

/// Scale, yaw and pitch. At a measured speed w, wheels roll (1 + scale) w along an axis that is yaw
/// right of forward and pitch above it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Odometer {
    pub constants: [f64; WHEEL_CONSTANTS],
    /// Time since which the wheels slip, s.
    pub slips: Option<f64>,
    pub sums: Rolled,
}

/// Sums since the last step of the covariance.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rolled {
    pub count: f64,
    pub speed: f64,
    /// Sum of the variances.
    pub variance: f64,
    /// Sums of the velocity in the body's axes, and of the rate with its bias.
    pub velocity: Vector3<f64>,
    pub rate: Vector3<f64>,
}

impl Odometer {
    /// Rotation from the body's axes to the wheels' axes.
    pub fn rotation(&self) -> Matrix3<f64> {
        let [_, yaw, pitch] = self.constants;
        let ((s, c), (t, d)) = (ComplexField::sin_cos(yaw), ComplexField::sin_cos(pitch));
        Matrix3::new(d * c, d * s, -t, -s, c, 0.0, t * c, t * s, d)
    }

    pub fn take_out(&mut self, found: &Constants) {
        for (constant, more) in self.constants.iter_mut().zip(found) {
            *constant = (*constant + more).within(MAX_CONSTANT);
        }
        self.constants[0] = self.constants[0].within(0.5);
    }
}

impl NavigationFilter {
    /// Processes the forward speed of the wheels, m/s, as a mean around a time, s. Without a
    /// standard deviation the default of the parameters is used. Returns whether it will be used:
    /// it must be present and recent, the position known, and the heading known to 0.1 rad.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the vehicle is not on wheels, or the standard deviation not
    /// positive.
    pub fn update_wheels(
        &mut self,
        time: f64,
        speed: f64,
        sigma: Option<f64>,
    ) -> Result<bool, Error> {
        let wheels = self.params.wheels;
        require(wheels.is_some(), "vehicle", "'wheeled' where wheels tell a speed", f64::NAN)?;
        let usual = wheels.map_or(1.0, |wheels| wheels.speed_sigma);
        let sigma = sigma.unwrap_or(usual);
        require(sigma > 0.0, "sigma", "positive", sigma)?;
        let age = self.sensors.time - time;
        let known =
            speed.abs() <= MAX_SPEED && (-MAX_SPEED_LEAD_S..=MAX_SPEED_AGE_S).contains(&age);
        let begun = self.covariance.1.is_some_and(|extra| extra.has(0));
        let looks = begun || self.sigma[PHI + 2] < MAX_HEADING_SIGMA_RAD;
        if !(known && looks && self.navigating) {
            return Ok(false);
        }
        let extra = self.covariance.1.get_or_insert(ConstantsCovariance::NONE);
        if !extra.has(0) {
            *extra = extra.with(0, PRIOR_SIGMAS);
        }
        let moved = self.motion.velocity - self.motion.acceleration * age;
        let sigma = sigma.at_most(MAX_SPEED).at_least(1e-3);
        let sums = &mut self.odometer.sums;
        sums.count += 1.0;
        sums.speed += speed;
        sums.variance += sigma * sigma;
        sums.velocity += self.motion.attitude.transpose() * moved;
        sums.rate += self.sensors.gyro;
        Ok(true)
    }

    /// Applies the wheel speeds since the last step.
    #[inline(never)]
    pub(crate) fn rolled<W: Observer>(&mut self, observer: &mut W) {
        let sums = core::mem::take(&mut self.odometer.sums);
        let Some(wheels) = self.params.wheels.filter(|_| sums.count > 0.0) else { return };
        let each = 1.0 / sums.count;
        let rate = sums.rate * each - self.gyro_bias;
        let rows = self.rows_of_wheels(&wheels, &(sums.velocity * each), &rate);
        let (u, h, mut hw) = (rows.speed.x, rows.errors[0], rows.constants[0]);
        let scale = 1.0 + self.odometer.constants[0];
        // Derivative from the expected speed, since the measured speed has noise.
        hw[0] = u / scale;
        let z = u - scale * sums.speed * each;
        let variance = self.covariance.variance_with_constants(&h, &hw);
        let mut noise = sums.variance * each;
        if z * z > MAX_WHEEL_NIS * (variance + noise) {
            let now = self.sensors.time;
            if now - *self.odometer.slips.get_or_insert(now) < MAX_SLIP_S {
                return;
            }
            noise = noise.at_least(z * z / MAX_WHEEL_NIS - variance);
        } else {
            self.odometer.slips = None;
        }
        let mut found = [0.0; STATES];
        self.covariance.correct_with_constants(&h, &hw, z, noise, &mut found, observer);
        self.apply(&found, observer);
    }

    /// Velocity at the axle in the wheels' axes, and its derivatives by errors and constants.
    pub(crate) fn rows_of_wheels(
        &self,
        wheels: &Wheels,
        velocity: &Vector3<f64>,
        rate: &Vector3<f64>,
    ) -> WheelRows {
        let axle = Vector3::from(wheels.axle);
        let turned = self.odometer.rotation();
        let speed = turned * (velocity + rate.cross(&axle));
        let by_velocity = turned * self.motion.attitude.transpose();
        let by_bias = turned * axle.cross_matrix();
        let errors = core::array::from_fn(|i| {
            let mut h = [0.0; 16];
            for j in 0..3 {
                h[V + j] = by_velocity[(i, j)];
                h[GYRO + j] = -by_bias[(i, j)];
            }
            h
        });
        let of = |yaw: f64, pitch: f64| {
            let mut row = [0.0; CONSTANTS];
            (row[1], row[2]) = (yaw, pitch);
            row
        };
        let constants = [of(-speed.y, speed.z), of(speed.x, 0.0), of(0.0, -speed.x)];
        WheelRows { speed, errors, constants }
    }

    /// Scale, yaw and pitch of the wheels, rad, and their standard deviations; NaN before the first
    /// measurement.
    pub fn wheels(&self) -> [[f64; WHEEL_CONSTANTS]; 2] {
        let estimated = self.covariance.1.as_ref().filter(|extra| extra.has(0));
        estimated.map_or([[f64::NAN; WHEEL_CONSTANTS]; 2], |extra| {
            [self.odometer.constants, core::array::from_fn(|k| extra.sigma(k))]
        })
    }

    /// Vector from the sensor to the antenna, body axes, m, and its standard deviations.
    pub fn antenna(&self) -> [[f64; 3]; 2] {
        let sigma = self
            .covariance
            .1
            .as_ref()
            .map_or([0.0; 3], |extra| core::array::from_fn(|k| extra.sigma(ANTENNA + k)));
        [self.antenna.into(), sigma]
    }
}

/// Result of [`NavigationFilter::rows_of_wheels`].
pub(crate) struct WheelRows {
    pub speed: Vector3<f64>,
    pub errors: [Row; 3],
    pub constants: [Constants; 3],
}
