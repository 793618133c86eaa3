//! Attitude: orientation of a body from its gyro, accelerometer and magnetometer.
//!
//! [`Attitude`] is the stream. It accepts samples in the units of the sensors, handles missing
//! samples and times, and returns results in the requested earth frame. An [`Estimator`] computes
//! the orientation from rates, forces and fields. Use [`Auto`]; the other estimators are textbook
//! methods. [`Tilt`] estimates the tilt about one axis.
//!
//! Internal units are rad, s and m/s². The internal frame is east, north, up. Quaternions rotate
//! from sensor axes to earth axes, scalar first.

mod auto;
mod compass;
mod estimator;
mod events;
mod frame;
mod iron;
mod named;
mod sample;
mod stream;
mod tilt;

#[cfg(feature = "std")]
pub use auto::{Around, Smoothed};
pub use auto::{Auto, AutoOptions};
pub use compass::{Compass, FieldCorrection};
pub use estimator::{Estimator, Knowledge};
pub use events::{EVENTS, Events};
pub use frame::Frame;
pub use iron::{LearnedIron, Learning};
pub use named::{
    BIAS_METHODS, BIAS_SIGMA_METHODS, CONSTANTS, Complementary, Constant, Constants, Ekf, Kalman,
    Linearised, METHODS, Madgwick, Mahony, Named, NamedOptions, Ukf,
};
pub use sample::{Inertial, Sample};
pub use stream::{Attitude, AttitudeParams, Reading, Snapshot, Tagged};
pub use tilt::{TILT_CONSTANTS, TILT_METHODS, Tilt, TiltConstants, TiltMethod, TiltParams};

/// Gravity, m/s².
pub const GRAVITY: f64 = 9.81;
