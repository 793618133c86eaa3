//! Inertial navigation aided by a satellite receiver: 15 errors, loosely coupled.
//!
//! Axes of the earth are north, east, down; body axes are forward, right, down; units are SI and
//! radians. The mechanisation ([`Motion`]) runs at every sample. The covariance of its errors
//! ([`Covariance`]) has its own steps. Measurements are processed one scalar at a time. The errors
//! are in position, velocity, orientation, and the biases of gyro and accelerometer, in
//! Scherzinger's form. In this form the velocity error is defined in the frame that the filter
//! assumes. The coefficients then change slowly, because the specific force is none of them. Even a
//! heading error of a right angle converges.
//!
//! B. M. Scherzinger, D. B. Reid, *Modified strapdown inertial navigator error models*, IEEE PLANS,
//! 1994. P. G. Savage, *J. Guidance, Control, and Dynamics* 21(1) and 21(2), 1998.

mod adaptive_noise;
mod aid_gate;
mod aiding;
mod aids;
mod bank;
mod batch;
mod coasting;
mod covariance;
mod earth;
mod event;
mod filter;
mod fix;
pub mod foot;
mod initialise;
mod innovation_gate;
mod motion;
mod odometer;
mod params;
#[cfg(feature = "std")]
mod smoother;
mod usable;
mod validity;

pub use aids::{AID_SENSORS, Aid, AidCounts, AidReport, Reading, pressure_height};
pub use bank::{NOISE_FACTORS, NavigationBank};
pub use batch::{Batch, Known, Navigates, Next, Observed};
pub use coasting::TakenFix;
pub use covariance::{
    CONSTANTS, Constants, Covariance, Errors, Growth, STATES, Scalar, Transition,
};
pub use earth::{LocalEarth, normal_gravity};
pub use event::Event;
pub use filter::{FixCounts, Inertial, NavigationFilter, Observer, Snapshot, Status};
pub use fix::{Fix, Verdict};
pub use motion::Motion;
pub use odometer::Rolling;
pub use params::{Adapt, AidParams, Kind, NavigationParams, Start, Wheels};
#[cfg(feature = "std")]
pub use smoother::{Record, Smoothed};
pub use usable::{LIMITS, Limits, OUTPUTS, WHEELED_LIMITS};
