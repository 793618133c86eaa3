//! The mechanisation: position, velocity and orientation, sample by sample.

use nalgebra::{ComplexField, Matrix3, RealField, Vector3};
use serde::{Deserialize, Serialize};

use super::earth::{LocalEarth, wrap};

/// Square of the angle of a step, rad², up to which its sine and cosine are series.
const MAX_SERIES_ANGLE_SQUARED: f64 = 0.01;

/// Position, velocity and orientation of the body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Rotation from the body's axes to north, east, down.
    pub attitude: Matrix3<f64>,
    /// Velocity north, east, down, m/s.
    pub velocity: Vector3<f64>,
    /// Latitude, rad.
    pub latitude: f64,
    /// Longitude, rad.
    pub longitude: f64,
    /// Height above the ellipsoid, m.
    pub height: f64,
    /// Acceleration in the last step, m/s².
    pub acceleration: Vector3<f64>,
    pub(crate) local_earth: LocalEarth,
}

/// One step of the sensors without biases: rotation vector, rad, and velocity change, m/s, in the
/// body's axes before the step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    pub turn: Vector3<f64>,
    pub gain: Vector3<f64>,
    pub dt: f64,
}

impl Motion {
    /// A body at rest at a place.
    pub fn new(attitude: Matrix3<f64>, latitude: f64, longitude: f64, height: f64) -> Self {
        let (velocity, acceleration) = (Vector3::zeros(), Vector3::zeros());
        let local_earth = LocalEarth::at(latitude, height);
        Self { attitude, velocity, latitude, longitude, height, acceleration, local_earth }
    }

    /// Angular rate of the north, east, down frame, rad/s: by the Earth's rotation and by the
    /// motion.
    #[inline(always)]
    pub(crate) fn frame(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.local_earth.earth, self.local_earth.transport(&self.velocity))
    }

    /// One step.
    #[inline(always)]
    pub(crate) fn advance(&mut self, step: &Step) {
        let (earth, transport) = self.frame();
        let (both, dt) = (earth + transport, step.dt);
        let gain = self.attitude * step.gain;
        let turned = (earth + both).cross(&self.velocity) + both.cross(&gain) * 0.5;
        let mut change = gain - turned * dt;
        change.z += self.local_earth.gravity * dt;
        let mean = self.velocity + change * 0.5;
        self.velocity += change;
        self.acceleration = change * (1.0 / dt);
        self.latitude += mean.x * dt * self.local_earth.north;
        self.longitude += mean.y * dt * self.local_earth.east;
        self.height -= mean.z * dt;
        self.turn(step, &(both * dt));
    }

    /// A step of the orientation alone; the frame rotates by `frame`.
    #[inline(always)]
    pub(crate) fn turn(&mut self, step: &Step, frame: &Vector3<f64>) {
        let turned = self.attitude * rotation(&step.turn);
        // `settle` would treat the term of the frame's squared rotation as a stretch.
        self.attitude = turned - cross_columns(frame, &turned);
    }

    /// Makes one Newton step towards a rotation, and updates the Earth's values to the present
    /// place.
    pub(crate) fn settle(&mut self) {
        let square = self.attitude.transpose() * self.attitude;
        self.attitude *= Matrix3::from_diagonal_element(1.5) - square * 0.5;
        self.longitude = wrap(self.longitude);
        self.local_earth = self.local_earth.relocate(self.latitude, self.height);
    }

    /// Subtracts errors of position, m, velocity, m/s, and orientation, rad.
    pub(crate) fn correct(&mut self, r: &Vector3<f64>, v: &Vector3<f64>, phi: &Vector3<f64>) {
        let turn = rotation(phi);
        self.attitude = turn * self.attitude;
        self.velocity = turn * (self.velocity - v);
        self.latitude -= r.x * self.local_earth.north;
        self.longitude = wrap(self.longitude - r.y * self.local_earth.east);
        self.height += r.z;
    }

    /// Vector from a place (rad, rad, m) to the present position: north, east, down, m.
    pub(crate) fn offset_from(&self, [latitude, longitude, height]: [f64; 3]) -> Vector3<f64> {
        Vector3::new(
            (self.latitude - latitude) / self.local_earth.north,
            wrap(self.longitude - longitude) / self.local_earth.east,
            height - self.height,
        )
    }

    /// Heading of the body's forward axis, rad.
    pub fn heading(&self) -> f64 {
        RealField::atan2(self.attitude.m21, self.attitude.m11)
    }
}

/// Rotation matrix of a rotation vector.
#[inline(always)]
pub(crate) fn rotation(phi: &Vector3<f64>) -> Matrix3<f64> {
    let square = phi.norm_squared();
    // sin(x)/x and (1 - cos x)/x².
    let (s, c) = if square <= MAX_SERIES_ANGLE_SQUARED {
        let x = square;
        (
            1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0 * (1.0 - x / 72.0))),
            0.5 - x / 24.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0 * (1.0 - x / 90.0))),
        )
    } else {
        let angle = ComplexField::sqrt(square);
        let half = ComplexField::sin(0.5 * angle);
        (ComplexField::sin(angle) / angle, 2.0 * half * half / square)
    };
    let (a, b) = (phi * s, phi * c);
    let (xy, xz, yz) = (b.x * phi.y, b.x * phi.z, b.y * phi.z);
    let (xx, yy, zz) = (b.x * phi.x, b.y * phi.y, b.z * phi.z);
    Matrix3::new(
        1.0 - (yy + zz),
        xy - a.z,
        xz + a.y,
        xy + a.z,
        1.0 - (xx + zz),
        yz - a.x,
        xz - a.y,
        yz + a.x,
        1.0 - (xx + yy),
    )
}

/// Cross product of a vector with each column.
#[inline(always)]
pub(crate) fn cross_columns(v: &Vector3<f64>, m: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::new(
        v.y * m.m31 - v.z * m.m21,
        v.y * m.m32 - v.z * m.m22,
        v.y * m.m33 - v.z * m.m23,
        v.z * m.m11 - v.x * m.m31,
        v.z * m.m12 - v.x * m.m32,
        v.z * m.m13 - v.x * m.m33,
        v.x * m.m21 - v.y * m.m11,
        v.x * m.m22 - v.y * m.m12,
        v.x * m.m23 - v.y * m.m13,
    )
}

#[cfg(test)]
mod tests {
    use super::{Motion, Step, rotation};
    use nalgebra::{Matrix3, Rotation3, Vector3};

    /// A perfect sensor at rest at 45°, for this number of seconds at 100 Hz, with an error of tilt
    /// and an error of the gyro.
    fn stand_still(seconds: usize, tilt: Vector3<f64>, gyro: Vector3<f64>) -> Vector3<f64> {
        let latitude = 45.0_f64.to_radians();
        let mut body = Motion::new(rotation(&tilt), latitude, 0.3, 0.0);
        let (local_earth, dt) = (body.local_earth, 0.01);
        for k in 0..seconds * 100 {
            let turn = (local_earth.earth + gyro) * dt;
            let force = Vector3::new(0.0, 0.0, -local_earth.gravity);
            let gain = (force + (local_earth.earth).cross(&force) * (0.5 * dt)) * dt;
            body.advance(&Step { turn, gain, dt });
            if k % 10 == 9 {
                body.settle();
            }
        }
        body.offset_from([latitude, 0.3, 0.0])
    }

    #[test]
    fn a_perfect_sensor_at_rest_stays() {
        assert!(stand_still(600, Vector3::zeros(), Vector3::zeros()).amax() < 1e-5);
    }

    #[test]
    fn errors_grow_as_known() {
        let tilt = stand_still(60, Vector3::new(1e-3, 0.0, 0.0), Vector3::zeros());
        assert!((tilt.y - 17.64).abs() < 0.01, "{tilt}");
        let bias = stand_still(60, Vector3::zeros(), Vector3::new(0.0, 1e-4, 0.0));
        assert!((bias.x + 35.29).abs() < 0.01, "{bias}");
    }

    #[test]
    fn rotations_are_those_of_nalgebra() {
        for angle in [1e-9, 1e-3, 0.0999, 0.1001, 0.5, 2.0, 3.1, 100.0] {
            let phi = Vector3::new(0.36, -0.48, 0.8) * angle;
            let error: Matrix3<f64> = rotation(&phi) - Rotation3::new(phi).matrix();
            assert!(error.amax() < 4e-15 * (1.0 + angle), "{angle}: {error}");
        }
        assert_eq!(rotation(&Vector3::zeros()), Matrix3::identity());
    }
}
