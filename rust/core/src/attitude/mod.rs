//! Attitude: which way a body points, from its gyro, accelerometer and magnetometer.
//!
//! [`Attitude`] is the stream: it takes samples in the units of the sensors, knows what is missing
//! and how long each took, and says the answer in the earth frame asked for. What turns rates,
//! forces and fields into an orientation is an [`Estimator`]; [`Auto`] is the one to use, the others
//! are the named ones of textbooks. [`Tilt`] is one axis alone.
//!
//! Inside, all is in rad, s and m/s², and in the frame east, north, up; a quaternion turns axes of
//! the sensor into axes of the earth, its scalar first.

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
