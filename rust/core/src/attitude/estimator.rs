//! Interface of all methods of estimating an attitude.

use nalgebra::{Matrix3, Quaternion, Vector3};

use super::events::Events;
use super::sample::Inertial;

/// A method of estimating the attitude, in rad, s, m/s² and the frame east, north, up.
pub trait Estimator {
    /// Takes one sample: constant work, no allocation, no panic.
    fn step(&mut self, sample: &Inertial);

    /// So many seconds passed, more than one, in which nothing is known.
    fn gap(&mut self, seconds: f64);

    /// From the axes of the sensor to those of the earth, of length one to rounding.
    fn orientation(&self) -> Quaternion<f64>;

    /// Estimates next to the orientation.
    fn knowledge(&self) -> Knowledge {
        Knowledge::default()
    }

    /// Goes on from this orientation, of length one, of which tilt and heading are known so well.
    fn align(&mut self, orientation: Quaternion<f64>, tilt_sigma: f64, heading_sigma: f64);

    /// Reset to the state before the first sample.
    fn reset(&mut self);

    /// The same, but for what the sensor keeps while it is off.
    fn power_on(&mut self) {
        self.reset();
    }

    /// True if all numbers of a state that was read can be those of a running one.
    fn is_valid(&self) -> bool;

    /// True if another one has the same parameters.
    fn is_like(&self, other: &Self) -> bool;
}

/// Estimates next to the orientation, NaN where there are none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knowledge {
    /// The gyro's output without rotation, rad/s.
    pub bias: Vector3<f64>,
    /// Its standard deviation.
    pub bias_sigma: Vector3<f64>,
    /// M in `rate = M (gyro - bias)`.
    pub gyro_matrix: Matrix3<f64>,
    /// Standard deviations of its elements.
    pub gyro_matrix_sigma: Matrix3<f64>,
    /// Standard deviation of the angle between true and estimated up, rad.
    pub tilt_sigma: f64,
    /// Standard deviation of the heading, rad.
    pub heading_sigma: f64,
    /// Mean strength of the specific force in rests, m/s².
    pub gravity: f64,
    /// True if the sensor rests.
    pub at_rest: bool,
    /// True if it rests with a bias above the limit or turns on a rate table, which cannot be
    /// distinguished.
    pub unclear: bool,
    /// True if gravity turns in the sensor as if the gyro's rates were in another unit.
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
