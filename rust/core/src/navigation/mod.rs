//! Inertial navigation aided by a satellite receiver: 15 errors, loosely coupled.
//!
//! North, east, down; body axes forward, right, down; SI units and radians. The mechanisation
//! ([`Motion`]) runs at every sample, the covariance of its errors ([`Covariance`]) at steps of its
//! own, measurements one scalar at a time. The errors are those of position, velocity, orientation
//! and of the biases of gyro and accelerometer, in Scherzinger's form: the velocity's is taken in the
//! frame that the filter believes in, so the specific force is not among the coefficients, which
//! change slowly, and a heading that is wrong by a right angle still converges.
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
