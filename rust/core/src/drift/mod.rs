//! Filters that learn a gyro's drift: published methods, and the filter that tunes itself.
//!
//! - [`DriftFilter`] is the method of Fu & Han. It is a Kalman filter of an ARMA model. Recursive
//!   least squares ([`RecursiveLeastSquares`]) estimates the model, the Allan variance the
//!   measurement noise, and Sage-Husa the process noise.
//! - [`RobustFilter`] is the filter of Wu & Ran, which rejects outliers.
//! - [`RestGated`] restricts learning to rest.
//! - [`AutoFilter`] weights a bank of Kalman filters by their likelihoods.
//!
//! All of them are [`DriftStream`]s.

mod auto;
mod filter;
mod flicker;
mod gated;
mod kalman;
mod least_squares;
mod multiple_model;
mod number;
pub mod options;
pub(crate) mod params;
mod robust;
mod sage_husa;
mod sensor;
mod start;

pub use auto::{AutoFilter, AutoParams};
pub use filter::{DriftFilter, DriftLoop, Snapshot};
pub use gated::{PublishedFilter, RestGated};
pub use kalman::{Correction, State};
pub use least_squares::{RecursiveLeastSquares, Rls, RlsParams};
pub use number::DriftNumber;
pub use params::{Behaviour, Method, Params};
pub use robust::{RobustFilter, RobustParams, Zones};
pub use sage_husa::{Headroom, adapt, headroom};
use serde::{Deserialize, Serialize};
pub use start::Start;

use self::options::Options;
use crate::error::Error;
use crate::rest::{MotionAware, Tick};
use crate::stream::checkpoint::Checkpoint;
use crate::stream::{Field, Traced};

/// Status of a filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// The drift is the mean to date.
    Starting,
    /// The drift is the mean to date, after the learned scale proved wrong by orders of magnitude.
    Restarting,
    /// The drift is learned.
    AtRest,
    /// The drift is held.
    InMotion,
    /// The sensor has moved since the start, so no drift is known.
    NoRestYet,
    /// The drift is learned from a rest that may be motion.
    Provisional,
    /// The sensor repeats one sample: the drift is held.
    Stuck,
}

impl Status {
    /// Name of the status.
    pub fn name(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::Restarting => "restarting",
            Self::AtRest => "at rest",
            Self::InMotion => "in motion",
            Self::NoRestYet => "no rest yet",
            Self::Provisional => "provisional",
            Self::Stuck => "stuck",
        }
    }

    /// Status of a filter, from two flags: the start-up is over, and the filter learns.
    fn of(ready: bool, at_rest: bool) -> Self {
        match (at_rest, ready) {
            (true, true) => Self::AtRest,
            (true, false) => Self::Starting,
            (false, true) => Self::InMotion,
            (false, false) => Self::NoRestYet,
        }
    }

    /// The status after this number of restarts.
    fn after(self, restarts: u64) -> Self {
        match self {
            Self::Starting if restarts > 0 => Self::Restarting,
            status => status,
        }
    }
}

/// Counts of finite samples that were not used.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tally {
    /// Saturated samples.
    pub saturated: u64,
    /// Outliers; counted when their tick is complete.
    pub outliers: u64,
    /// Samples of a stuck sensor; counted when their tick is complete.
    pub stuck: u64,
}

impl Tally {
    fn add<T>(&mut self, tick: &Tick<T>) {
        self.outliers += u64::from(tick.outliers);
        self.stuck += u64::from(tick.stuck);
    }

    /// True if this number of samples can give the counts, with `pending` samples not yet tested.
    fn is_within(&self, samples: u64, pending: u64) -> bool {
        self.is_within_each(samples, pending, pending)
    }

    /// As [`is_within`](Self::is_within), with separate numbers of samples not yet tested.
    fn is_within_each(&self, samples: u64, maybe_outliers: u64, maybe_stuck: u64) -> bool {
        let few = |count: u64, pending: u64| {
            samples.checked_sub(pending).is_some_and(|tested| count <= tested)
        };
        self.saturated <= samples
            && few(self.outliers, maybe_outliers)
            && few(self.stuck, maybe_stuck)
    }
}

/// Estimate of the drift after a sample, in the samples' unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift<T> {
    /// Mean of the drift.
    pub bias: T,
    /// Standard deviation of the drift.
    pub sigma: T,
    /// True if the drift is learned: the sensor is at rest, or assumed to be at rest.
    pub at_rest: bool,
}

/// Readings of every drift filter in addition to its outputs.
pub trait DriftStream<T>: Traced<Input = T, Output = T> + MotionAware + Checkpoint {
    /// Parts of a [`Start`], for filters that can be started.
    const START: &'static [Field] = &[];

    /// Options that create an equal filter.
    fn options(&self) -> Options;

    /// Samples to date, missing ones included.
    fn samples_seen(&self) -> u64;

    /// True after the start-up.
    fn ready(&self) -> bool;

    /// Status of the filter.
    fn status(&self) -> Status;

    /// Present drift.
    fn drift(&self) -> Drift<T>;

    /// Processes samples. For each, the body is known to move, or its motion is unknown. Passes to
    /// `put` the drift after each sample, and true if the sensor is stuck.
    fn follow(
        &mut self,
        inputs: impl Iterator<Item = (T, bool)>,
        mut put: impl FnMut(Drift<T>, bool),
    ) {
        for (z, moving) in inputs {
            self.update_while(z, moving);
            put(self.drift(), self.status() == Status::Stuck);
        }
    }

    /// Densities of the white noise, samples' unit over root hertz, and of the drift's random walk,
    /// samples' unit over root second; NaN if unknown.
    fn densities(&self) -> [T; 2];

    /// Learned bias instability B in the samples' unit, for flicker with the two-sided density
    /// B²/(2πf); NaN if unknown.
    fn bias_instability(&self) -> T;

    /// Standard deviation of the mean drift over the next `seconds`, relative to the bias; `None`
    /// if the method has no such value.
    fn bias_sigma_over(&self, _seconds: f64) -> Option<Result<T, Error>> {
        None
    }

    /// Number of samples at which the change of the process noise was limited.
    fn guard_count(&self) -> u64 {
        0
    }

    /// Number of runs of outliers that were accepted as a step of the signal.
    fn exit_count(&self) -> u64 {
        0
    }

    /// Number of restarts after the scale was wrong by orders of magnitude.
    fn restarts(&self) -> u64 {
        0
    }

    /// Counts of finite samples that were not used.
    fn tally(&self) -> Tally {
        Tally::default()
    }

    /// Writes the stated start as the numbers of a [`Start`]; false if the filter learned its
    /// start.
    fn write_start(&self, _numbers: &mut [f64]) -> bool {
        false
    }

    /// For a sensor that was switched off and on: forgets the drift but not the noise. Returns
    /// false if the method has no such restart.
    fn power_on(&mut self) -> bool {
        false
    }
}
