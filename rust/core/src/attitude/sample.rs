//! Samples of an IMU: as they are given, and as an estimator takes them.

use nalgebra::Vector3;

use crate::stream::Input;

/// Largest rate, rad/s, and specific force, m/s², that a sensor of a body can have felt.
pub(super) const MAX_RATE: f64 = 1e3;
pub(super) const MAX_FORCE: f64 = 1e3;
/// Largest and least strength of a magnetic field, in whatever unit.
pub(super) const MAX_FIELD: f64 = 1e9;
pub(super) const MIN_FIELD: f64 = 1e-9;
/// Less than this is no specific force: a sensor that is not there, or free fall.
const MIN_FORCE: f64 = 1e-9;

/// A raw sample: three axes of gyro, accelerometer and magnetometer in their units, and the time
/// since the previous sample, s. Missing values are NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Angular rate.
    pub gyro: [f64; 3],
    /// Specific force: up at rest.
    pub accel: [f64; 3],
    /// Magnetic field, in any unit.
    pub mag: [f64; 3],
    /// Time since the previous sample, s; NaN for one period of the rate. A negative value (a clock
    /// set back) counts as an unknown second, or as ten if it is below -1 s.
    pub dt: f64,
}

impl Input for Sample {
    const NUMBERS: usize = 10;

    #[inline(always)]
    fn read(z: &[f64]) -> Self {
        let z: &[f64; 10] = z.first_chunk().expect("as many numbers as a sample has");
        Self {
            gyro: [z[0], z[1], z[2]],
            accel: [z[3], z[4], z[5]],
            mag: [z[6], z[7], z[8]],
            dt: z[9],
        }
    }
}

/// A sample as an estimator takes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertial {
    /// Mean angular rate since the sample before, rad/s; the last one known where it is missing.
    pub gyro: Vector3<f64>,
    /// True if the rate is known, or was less than 50 ms ago.
    pub known: bool,
    /// Seconds since the sample before for which nothing is known of the rate.
    pub unknown: f64,
    /// Seconds since the last rate that is known, zero if this one is; infinite if none ever was.
    pub age: f64,
    /// Specific force, m/s², unless it is missing.
    pub accel: Option<Vector3<f64>>,
    /// Magnetic field, in any unit, unless it is missing.
    pub mag: Option<Vector3<f64>>,
    /// Seconds since the sample before, not negative.
    pub dt: f64,
}

/// The specific force in m/s², likewise; none is not one.
#[inline(always)]
pub(super) fn force(accel: [f64; 3], unit: f64) -> Option<Vector3<f64>> {
    measure(Vector3::from(accel) * unit, MIN_FORCE, MAX_FORCE)
}

/// The magnetic field, likewise.
#[inline(always)]
pub(super) fn field(mag: [f64; 3]) -> Option<Vector3<f64>> {
    measure(Vector3::from(mag), MIN_FIELD, MAX_FIELD)
}

/// Not so for NaN, nor where a square is no number any more.
#[inline(always)]
fn measure(v: Vector3<f64>, least: f64, most: f64) -> Option<Vector3<f64>> {
    let square = v.norm_squared();
    ((square >= least * least) & (square <= most * most)).then_some(v)
}
