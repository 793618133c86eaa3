//! Samples of an IMU: raw, and converted for an estimator.

use nalgebra::Vector3;

use crate::stream::Input;

/// Largest rate, rad/s, and specific force, m/s², that a sensor on a body can measure.
pub(super) const MAX_RATE: f64 = 1e3;
pub(super) const MAX_FORCE: f64 = 1e3;
/// Largest and smallest strength of a magnetic field, in any unit.
pub(super) const MAX_FIELD: f64 = 1e9;
pub(super) const MIN_FIELD: f64 = 1e-9;
/// Smallest specific force, m/s²; a smaller force means no sensor, or free fall.
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
    /// Time since the previous sample, s; NaN is one period of the rate. A negative value means a
    /// clock that was set back. It counts as an unknown second, or as ten unknown seconds below -1
    /// s.
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

/// A sample converted for an estimator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertial {
    /// Mean angular rate since the previous sample, rad/s; the last known rate if it is missing.
    pub gyro: Vector3<f64>,
    /// True if the rate is known, or was known less than 50 ms ago.
    pub known: bool,
    /// Time since the previous sample without a known rate, s.
    pub unknown: f64,
    /// Time since the last known rate, s: zero if this rate is known, infinite before the first.
    pub age: f64,
    /// Specific force, m/s²; `None` if it is missing.
    pub accel: Option<Vector3<f64>>,
    /// Magnetic field, in any unit; `None` if it is missing.
    pub mag: Option<Vector3<f64>>,
    /// Time since the previous sample, s, not negative.
    pub dt: f64,
}

/// Specific force in m/s², `None` if it is missing; a force of zero is missing.
#[inline(always)]
pub(super) fn force(accel: [f64; 3], unit: f64) -> Option<Vector3<f64>> {
    measure(Vector3::from(accel) * unit, MIN_FORCE, MAX_FORCE)
}

/// Magnetic field, `None` if it is missing.
#[inline(always)]
pub(super) fn field(mag: [f64; 3]) -> Option<Vector3<f64>> {
    measure(Vector3::from(mag), MIN_FIELD, MAX_FIELD)
}

/// The vector if its size is in range; `None` for NaN and if a square overflows.
#[inline(always)]
fn measure(v: Vector3<f64>, least: f64, most: f64) -> Option<Vector3<f64>> {
    let square = v.norm_squared();
    ((square >= least * least) & (square <= most * most)).then_some(v)
}
