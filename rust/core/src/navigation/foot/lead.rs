//! The samples before the minimum in which the filter begins: the same strapdown, backwards.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::GRAVITY;
use crate::navigation::earth::LocalEarth;
use crate::navigation::filter::quaternion;
use crate::navigation::motion::{Motion, Step};

/// State of the standing foot, and biases of its sensors, rad/s and m/s².
#[derive(Debug, Clone, Copy)]
pub struct Stand {
    /// Rotation from the sensor's axes to north, east, down.
    pub attitude: Matrix3<f64>,
    /// Bias of the gyro.
    pub gyro_bias: Vector3<f64>,
    /// Bias of the accelerometer.
    pub accel_bias: Vector3<f64>,
}

impl Stand {
    /// State from a quaternion, scalar first, from the sensor's axes to ahead, right, down, and two
    /// biases.
    pub fn new([w, x, y, z]: [f64; 4], biases: &[[f64; 3]]) -> Self {
        let turn = Quaternion::new(w, x, y, z);
        let attitude = UnitQuaternion::from_quaternion(turn).to_rotation_matrix().into_inner();
        let of = |k: usize| biases.get(k).map_or(Vector3::zeros(), |bias| Vector3::from(*bias));
        Self { attitude, gyro_bias: of(0), accel_bias: of(1) }
    }
}

/// Integrates backwards from the last of these samples, at which the foot stands, to the first.
/// Calls `put` for each sample except the last, with its index, position, velocity and orientation.
pub fn go_back(
    time: &[f64],
    [gyro, accel]: [&[[f64; 3]]; 2],
    from: &Stand,
    mut put: impl FnMut(usize, [f64; 3], Vector3<f64>, [f64; 4]),
) {
    let mut motion = Motion::new(from.attitude, 0.0, 0.0, 0.0);
    motion.local_earth = LocalEarth::plane(GRAVITY);
    let of = |k: usize| (Vector3::from(gyro[k]), Vector3::from(accel[k]));
    for k in (1..time.len()).rev() {
        let dt = time[k] - time[k - 1];
        let ((now, pushed), (next, force)) = (of(k), of(k - 1));
        // Backwards in time, rates and velocities change their sign, forces do not.
        let turn = (from.gyro_bias - (now + next) * 0.5) * dt + now.cross(&next) * (dt * dt / 12.0);
        let mean = ((pushed + force) * 0.5 - from.accel_bias) * dt;
        let sculling = (now.cross(&force) + pushed.cross(&next)) * (-dt * dt / 12.0);
        let gain = mean + sculling + turn.cross(&mean) * 0.5;
        motion.advance(&Step { turn, gain, dt });
        motion.settle();
        put(
            k - 1,
            motion.offset_from([0.0; 3]).into(),
            -motion.velocity,
            quaternion(&motion.attitude),
        );
    }
}
