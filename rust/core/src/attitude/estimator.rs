//! Interface of all attitude estimators.

use nalgebra::{Matrix3, Quaternion, Vector3};

use super::events::Events;
use super::sample::Inertial;

/// An attitude estimator, in rad, s, m/s² and the frame east, north, up.
pub trait Estimator {
    /// Processes one sample in constant time, without allocation or panic.
    fn step(&mut self, sample: &Inertial);

    /// Passes a gap of more than one second, without any sample.
    fn gap(&mut self, seconds: f64);

    /// Rotation from the sensor's axes to the earth's axes, of length one to rounding.
    fn orientation(&self) -> Quaternion<f64>;

    /// Other estimates than the orientation.
    fn knowledge(&self) -> Knowledge {
        Knowledge::default()
    }

    /// Continues from this orientation, of length one, with these standard deviations, rad.
    fn align(&mut self, orientation: Quaternion<f64>, tilt_sigma: f64, heading_sigma: f64);

    /// Reset to the state before the first sample.
    fn reset(&mut self);

    /// Resets to the state before the first sample, except values that the sensor keeps while it is
    /// off.
    fn power_on(&mut self) {
        self.reset();
    }

    /// True if all numbers of a restored state are possible in a running filter.
    fn is_valid(&self) -> bool;

    /// True if another estimator has the same parameters.
    fn is_like(&self, other: &Self) -> bool;
}

/// Estimates other than the orientation, NaN for methods without them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knowledge {
    /// Output of the gyro without rotation, rad/s.
    pub bias: Vector3<f64>,
    /// Standard deviation of `bias`, rad/s.
    pub bias_sigma: Vector3<f64>,
    /// Matrix M in `rate = M (gyro - bias)`.
    pub gyro_matrix: Matrix3<f64>,
    /// Standard deviations of the elements of `gyro_matrix`.
    pub gyro_matrix_sigma: Matrix3<f64>,
    /// Standard deviation of the angle between the true and the estimated vertical, rad.
    pub tilt_sigma: f64,
    /// Standard deviation of the heading, rad.
    pub heading_sigma: f64,
    /// Mean size of the specific force at rest, m/s².
    pub gravity: f64,
    /// True if the sensor rests.
    pub at_rest: bool,
    /// True if the sensor rests with a bias above the limit or turns on a rate table; the two
    /// cannot be distinguished.
    pub unclear: bool,
    /// True if gravity turns in the sensor as if the gyro's rates had another unit.
    pub wrong_unit: bool,
    /// True if the magnetic field differs from the known one.
    pub disturbed: bool,
    /// True if the magnetometer repeats one value while the sensor rotates.
    pub stuck: bool,
    /// True if the first seconds are over.
    pub started: bool,
    /// Events at the last sample.
    pub events: Events,
}

impl Default for Knowledge {
    fn default() -> Self {
        Self {
            bias: Vector3::repeat(f64::NAN),
            bias_sigma: Vector3::repeat(f64::NAN),
            gyro_matrix: Matrix3::repeat(f64::NAN),
            gyro_matrix_sigma: Matrix3::repeat(f64::NAN),
            tilt_sigma: f64::NAN,
            heading_sigma: f64::NAN,
            gravity: f64::NAN,
            at_rest: false,
            unclear: false,
            wrong_unit: false,
            disturbed: false,
            stuck: false,
            started: true,
            events: Events::default(),
        }
    }
}
