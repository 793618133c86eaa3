//! A fix of the receiver: content, validity, and derivatives.

use nalgebra::{Matrix3, Vector3};

use super::covariance::{GYRO, PHI, R, Row, V};
use super::earth::{MAX_HEIGHT, MAX_LATITUDE};
use super::filter::is_known;
use crate::error::{Error, require};
use crate::math::Real;

/// Smallest standard deviation of a fix, m and m/s, and standard deviation of a missing value.
const MIN_SIGMA: f64 = 1e-3;
const MAX_SIGMA: f64 = 1e6;

/// One fix of the receiver; unknown values are NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// Time of the measurement, s.
    pub time: f64,
    /// Latitude and longitude, rad, and height, m, of the antenna.
    pub position: [f64; 3],
    /// Velocity north, east, down, m/s.
    pub velocity: [f64; 3],
    /// Standard deviations of the position north, east, down, m.
    pub position_sigma: [f64; 3],
    /// Standard deviations of the velocity north, east, down, m/s.
    pub velocity_sigma: [f64; 3],
}

/// Verdict on a fix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Used: its position, or its velocity if it has no position.
    Used,
    /// Rejected by the gate; the velocity of a fix with a rejected position may still have
    /// corrected the filter.
    Rejected,
    /// Out of sequence or invalid: too old, ahead of the sensors, before the first sample, empty,
    /// or not on the earth.
    Refused,
}

/// A checked fix: its present values, with standard deviations in the filter's range.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Given {
    pub time: f64,
    pub position: Option<[f64; 3]>,
    pub velocity: Option<Vector3<f64>>,
    pub position_sigma: Vector3<f64>,
    pub velocity_sigma: Vector3<f64>,
}

impl Given {
    /// The checked fix, `None` if it is empty. A height or a vertical velocity may be missing.
    pub fn validate(fix: &Fix) -> Result<Option<Self>, Error> {
        let Fix {
            time,
            position: [latitude, longitude, height],
            velocity: [north, east, down],
            ..
        } = *fix;
        let there = latitude.abs() < MAX_LATITUDE && longitude.abs() < 7.0;
        let flat = !height.is_finite();
        let position = (there && (flat || height.abs() < MAX_HEIGHT)).then_some([
            latitude,
            longitude,
            if flat { 0.0 } else { height },
        ]);
        let level = !down.is_finite();
        let velocity =
            Some(Vector3::new(north, east, if level { 0.0 } else { down })).filter(is_known);
        let sigma = |name, stated: bool, without_down: bool, sigmas: &[f64; 3]| {
            let mut found = Vector3::from_element(MAX_SIGMA);
            let count = if without_down { 2 } else { 3 };
            for (slot, sigma) in found.iter_mut().zip(sigmas).take(count).filter(|_| stated) {
                require(*sigma > 0.0, name, "positive", *sigma)?;
                *slot = sigma.at_most(MAX_SIGMA).at_least(MIN_SIGMA);
            }
            Ok(found)
        };
        let position_sigma =
            sigma("position_sigma", position.is_some(), flat, &fix.position_sigma)?;
        let velocity_sigma =
            sigma("velocity_sigma", velocity.is_some(), level, &fix.velocity_sigma)?;
        let some = position.is_some() || velocity.is_some();
        Ok(some.then_some(Self { time, position, velocity, position_sigma, velocity_sigma }))
    }
}

/// Derivatives of a position: by δr, and by the orientation through the lever arm.
pub(crate) fn position_rows(lever: &Vector3<f64>) -> [Row; 3] {
    let mut rows = [[0.0; 16]; 3];
    let turned = lever.cross_matrix();
    for (i, h) in rows.iter_mut().enumerate() {
        h[R + i] = 1.0;
        (0..3).for_each(|j| h[PHI + j] = turned[(i, j)]);
    }
    rows
}

/// Derivatives of a velocity: by δv, by the orientation, and by the gyro's bias through the lever
/// arm.
pub(crate) fn velocity_rows(velocity: &Vector3<f64>, lever: &Matrix3<f64>) -> [Row; 3] {
    let mut rows = [[0.0; 16]; 3];
    let turned = velocity.cross_matrix();
    for (i, h) in rows.iter_mut().enumerate() {
        h[V + i] = 1.0;
        for j in 0..3 {
            h[PHI + j] = turned[(i, j)];
            h[GYRO + j] = -lever[(i, j)];
        }
    }
    rows
}
