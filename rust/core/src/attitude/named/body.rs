//! Common parts of all named methods: an orientation, its start, and its update by a rate.

use nalgebra::{Quaternion, RealField, Vector3};
use serde::{Deserialize, Serialize};

use crate::attitude::frame;
use crate::math::Real;
use crate::math::rotation::exponential;

/// Limit of a nearly downward force: no rotation upwards is shortest, and any level axis will do.
const UPSIDE_DOWN: f64 = 1e-6;

/// Rotation from the sensor's axes to east, north, up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Body {
    pub orientation: Quaternion<f64>,
    /// Flags: a force has set the vertical, and a field has set north.
    pub levelled: bool,
    pub headed: bool,
}

impl Default for Body {
    fn default() -> Self {
        Self { orientation: Quaternion::identity(), levelled: false, headed: false }
    }
}

impl Body {
    /// Starts from the first force and, if there is a magnetometer, from the first field after it.
    #[inline]
    pub fn begin(&mut self, accel: Option<&Vector3<f64>>, mag: Option<&Vector3<f64>>) {
        if !self.levelled
            && let Some(accel) = accel
        {
            let force = self.in_earth(&accel.normalize());
            self.set(level(&force) * self.orientation);
            self.levelled = true;
        }
        if self.levelled
            && !self.headed
            && let Some(mag) = mag
        {
            self.turn_earth(&Vector3::new(0.0, 0.0, east_of_north(&self.in_earth(mag))));
            self.headed = true;
        }
    }

    /// Sets vertical and north again from the next force and field.
    pub fn forget(&mut self) {
        (self.levelled, self.headed) = (false, false);
    }

    /// Sets a known orientation.
    pub fn align(&mut self, orientation: Quaternion<f64>) {
        self.set(orientation);
        (self.levelled, self.headed) = (true, true);
    }

    /// Rotates by a rotation vector in the sensor's axes.
    #[inline]
    pub fn turn(&mut self, angle: &Vector3<f64>) {
        self.set(self.orientation * exponential(angle).into_inner());
    }

    /// Rotates by a rotation vector in the earth's axes.
    #[inline]
    pub fn turn_earth(&mut self, angle: &Vector3<f64>) {
        self.set(exponential(angle).into_inner() * self.orientation);
    }

    /// Sets the orientation from a quaternion with a length that is not near zero.
    #[inline]
    pub fn set(&mut self, orientation: Quaternion<f64>) {
        self.orientation = orientation.normalize();
    }

    /// Converts a vector from the sensor's axes to the earth's axes.
    #[inline]
    pub fn in_earth(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        let (w, u) = (self.orientation.w, self.orientation.imag());
        let t = u.cross(vector) * 2.0;
        vector + t * w + u.cross(&t)
    }

    /// Unit vector up, in the sensor's axes.
    #[inline]
    pub fn up(&self) -> Vector3<f64> {
        frame::up(&self.orientation)
    }

    pub fn is_valid(&self) -> bool {
        (self.orientation.norm_squared() - 1.0).abs() < 1e-9 && (self.levelled || !self.headed)
    }
}

/// The shortest rotation that turns a direction, of length one, upwards.
fn level(direction: &Vector3<f64>) -> Quaternion<f64> {
    let half = ((1.0 + direction.z) * 0.5).max(0.0).simd_sqrt();
    if half < UPSIDE_DOWN {
        return Quaternion::new(0.0, 1.0, 0.0, 0.0);
    }
    let scale = 0.5 / half;
    Quaternion::new(half, direction.y * scale, -direction.x * scale, 0.0)
}

/// Angle from up to a direction, and the level axis about which the direction must turn to get up.
pub fn tilt(direction: &Vector3<f64>) -> Vector3<f64> {
    let level = (direction.x * direction.x + direction.y * direction.y).simd_sqrt();
    let angle = RealField::atan2(level, direction.z);
    match level > 0.0 {
        true => Vector3::new(direction.y, -direction.x, 0.0) * (angle / level),
        false => Vector3::new(angle, 0.0, 0.0),
    }
}

/// Angle from north to a field in the earth's axes, clockwise, rad; zero for a field of zero.
pub fn east_of_north(field: &Vector3<f64>) -> f64 {
    RealField::atan2(field.x, field.y)
}
