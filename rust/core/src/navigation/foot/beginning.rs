//! Beginning of a foot's filter: at rest, or in motion.

use nalgebra::{ComplexField, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::walker::stance_noise;
use super::{DEGREE, FORCE_S, GRAVITY, MAX_GRAVITY_ERROR_M_S2};
#[cfg(feature = "std")]
use crate::navigation::motion::rotation;

/// Initial standard deviations: biases, rad/s and m/s²; level after a rest and without a rest;
/// velocity after a rest and without.
const GYRO_BIAS_SIGMA_RAD_S: f64 = 0.3 * DEGREE;
const ACCEL_BIAS_SIGMA_M_S2: f64 = 0.1;
const LEVEL_SIGMAS_RAD: [f64; 2] = [0.3 * DEGREE, 3.0 * DEGREE];
const MAX_LEVEL_SIGMA_RAD: f64 = 1.0;
const VELOCITY_SIGMA_M_S: f64 = 0.01;
/// Limit of an almost vertical axis: the square of its horizontal part.
#[cfg(feature = "std")]
const MIN_LEVEL_SHARE: f64 = 0.01;
/// Standard deviation of the heading at a rest, rad.
const HEADING_SIGMA_RAD: f64 = 1e-6;

/// Estimates of a gyro and an accelerometer at rest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct AtRest {
    pub gyro_bias: Vector3<f64>,
    pub force: f64,
}

/// Beginning of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Beginning {
    pub attitude: Matrix3<f64>,
    pub gyro_bias: Vector3<f64>,
    pub accel_bias: Vector3<f64>,
    /// Standard deviations of velocity, level, and bias of the gyro.
    pub velocity: f64,
    pub level: f64,
    pub heading: f64,
    pub gyro: f64,
    pub accel: f64,
}

impl Beginning {
    /// Beginning in a rest with this mean force and rate, and the rate's standard deviation.
    pub fn at_rest(force: &Vector3<f64>, rate: &Vector3<f64>, sigma: f64) -> Self {
        let size = force.norm();
        let share = GYRO_BIAS_SIGMA_RAD_S * GYRO_BIAS_SIGMA_RAD_S
            / (GYRO_BIAS_SIGMA_RAD_S * GYRO_BIAS_SIGMA_RAD_S + sigma * sigma);
        let accel_bias =
            if is_gravity(size) { force * ((size - GRAVITY) / size) } else { Vector3::zeros() };
        Self {
            attitude: levelled(force),
            gyro_bias: rate * share,
            accel_bias,
            velocity: VELOCITY_SIGMA_M_S,
            level: LEVEL_SIGMAS_RAD[0],
            heading: HEADING_SIGMA_RAD,
            gyro: sigma * ComplexField::sqrt(share),
            accel: ACCEL_BIAS_SIGMA_M_S2,
        }
    }

    /// Beginning without a rest, in a minimum of the bound with this mean force. A shallow minimum
    /// makes the tilt less certain. Zero velocities are `seconds` apart.
    pub fn in_valley(force: &Vector3<f64>, bound: f64, seconds: f64) -> Self {
        Self {
            attitude: levelled(force),
            gyro_bias: Vector3::zeros(),
            accel_bias: Vector3::zeros(),
            velocity: ComplexField::sqrt(stance_noise(bound, seconds)),
            level: valley_level(bound),
            heading: HEADING_SIGMA_RAD,
            gyro: GYRO_BIAS_SIGMA_RAD_S,
            accel: ACCEL_BIAS_SIGMA_M_S2,
        }
    }

    /// Sets the heading relative to an earlier sample with this orientation, `seconds` before.
    #[cfg(feature = "std")]
    pub fn head_from(&mut self, [w, x, y, z]: [f64; 4], seconds: f64) {
        let heading = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
        self.attitude = rotation(&Vector3::new(0.0, 0.0, -heading)) * self.attitude;
        // A tilt turns the heading of an axis that is not horizontal.
        let slope = 2.0 * (x * z - w * y);
        let level = slope * slope / (1.0 - slope * slope).max(MIN_LEVEL_SHARE);
        let heading = self.gyro * self.gyro * seconds * seconds + self.level * self.level * level;
        self.heading = heading.sqrt().max(HEADING_SIGMA_RAD);
    }
}

/// Standard deviation of a tilt from the force in a minimum, rad: the part of the bound that the
/// force can cause.
pub(super) fn valley_level(bound: f64) -> f64 {
    let tilt = bound / (FORCE_S * GRAVITY);
    let tilt = if tilt < MAX_LEVEL_SIGMA_RAD { tilt } else { MAX_LEVEL_SIGMA_RAD };
    if tilt > LEVEL_SIGMAS_RAD[1] { tilt } else { LEVEL_SIGMAS_RAD[1] }
}

/// True if a force may be gravity.
pub(super) fn is_gravity(size: f64) -> bool {
    (size - GRAVITY).abs() < MAX_GRAVITY_ERROR_M_S2
}

/// Rotation with roll and pitch of a force at rest, without a heading, to axes with the third axis
/// down.
fn levelled(force: &Vector3<f64>) -> Matrix3<f64> {
    let size = force.norm();
    let f = if size > 1e-9 { force / size } else { -Vector3::z() };
    let across = ComplexField::sqrt(f.y * f.y + f.z * f.z);
    let (sr, cr) = if across > 0.0 { (-f.y / across, -f.z / across) } else { (0.0, 1.0) };
    let (sp, cp) = (f.x, across);
    Matrix3::new(cp, sp * sr, sp * cr, 0.0, cr, -sr, -sp, cp * sr, cp * cr)
}
