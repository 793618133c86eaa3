//! Beginning of a foot's filter: at rest, or in motion.

use nalgebra::{ComplexField, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::{DEGREE, GRAVITY, MAX_GRAVITY_ERROR_M_S2};

/// Deviations before anything is measured: biases, rad/s and m/s²; level after a rest and without;
/// velocity likewise.
const GYRO_BIAS_SIGMA_RAD_S: f64 = 0.3 * DEGREE;
const ACCEL_BIAS_SIGMA_M_S2: f64 = 0.1;
const LEVEL_SIGMAS_RAD: [f64; 2] = [0.3 * DEGREE, 3.0 * DEGREE];
const VELOCITY_SIGMAS_M_S: [f64; 2] = [0.01, 1.0];

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
    /// Deviations: velocity, level, and bias of the gyro.
    pub velocity: f64,
    pub level: f64,
    pub gyro: f64,
    pub accel: f64,
}

impl Beginning {
    /// In a rest with this mean force and rate, the latter with its deviation.
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
            velocity: VELOCITY_SIGMAS_M_S[0],
            level: LEVEL_SIGMAS_RAD[0],
            gyro: sigma * ComplexField::sqrt(share),
            accel: ACCEL_BIAS_SIGMA_M_S2,
        }
    }

    /// Without a rest, where it moves least.
    pub fn in_motion(force: &Vector3<f64>) -> Self {
        Self {
            attitude: levelled(force),
            gyro_bias: Vector3::zeros(),
            accel_bias: Vector3::zeros(),
            velocity: VELOCITY_SIGMAS_M_S[1],
            level: LEVEL_SIGMAS_RAD[1],
            gyro: GYRO_BIAS_SIGMA_RAD_S,
            accel: ACCEL_BIAS_SIGMA_M_S2,
        }
    }
}

/// True if a force may be gravity.
pub(super) fn is_gravity(size: f64) -> bool {
    (size - GRAVITY).abs() < MAX_GRAVITY_ERROR_M_S2
}

/// Roll and pitch of a force at rest, and no heading: to axes of which the third is down.
fn levelled(force: &Vector3<f64>) -> Matrix3<f64> {
    let size = force.norm();
    let f = if size > 1e-9 { force / size } else { -Vector3::z() };
    let across = ComplexField::sqrt(f.y * f.y + f.z * f.z);
    let (sr, cr) = if across > 0.0 { (-f.y / across, -f.z / across) } else { (0.0, 1.0) };
    let (sp, cp) = (f.x, across);
    Matrix3::new(cp, sp * sr, sp * cr, 0.0, cr, -sr, -sp, cp * sr, cp * cr)
}
