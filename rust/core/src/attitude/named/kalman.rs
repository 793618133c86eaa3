//! Kalman filters of the attitude's error and the gyro's bias: common part of the two
//! linearisations.
#![allow(non_snake_case)]

use core::marker::PhantomData;

use nalgebra::{Quaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::body::{Body, east_of_north};
use super::extended::Extended;
use super::options::MAX_BIAS;
use super::unscented::Unscented;
use super::{Named, NamedOptions};
use crate::attitude::sample::Inertial;
use crate::attitude::stream::Tagged;
use crate::attitude::{Estimator, GRAVITY, Knowledge};
use crate::error::Error;
use crate::math::validity::are_within;
use crate::math::{Real, Symmetric};

/// Standard deviation of a tilt, and of a heading, from one sample, rad.
const SAMPLE_SIGMA_RAD: f64 = 0.5;
/// Variance of a heading before the first field, rad², and standard deviation of a heading that was
/// chosen, rad.
const FREE_HEADING_VARIANCE_RAD2: f64 = 10.0;
const CHOSEN_HEADING_SIGMA_RAD: f64 = 1e-3;
/// Variance per second of an angle without a known rate, rad²/s.
const UNKNOWN_RATE_VARIANCE: f64 = 1.0;
/// Shortest time for which a measurement has a weight, s; below, its variance R = n²/dt may be
/// infinite.
const MIN_MEASURED_S: f64 = 1e-9;
/// Largest variances of an angle, rad², and of a bias, (rad/s)².
const MAX_VARIANCES: [f64; 2] = [FREE_HEADING_VARIANCE_RAD2, 1.0];
/// First index of the bias in the error state, after the three angles.
pub const BIAS: usize = 3;

/// Orientation, bias and the covariance of their errors. The errors of the orientation are three
/// angles in the earth's axes, from the estimated to the true orientation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gauss {
    pub body: Body,
    pub bias: Vector3<f64>,
    pub P: Symmetric<f64, 6>,
}

/// One step of prediction.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// Rate of the gyro, rad/s, and its duration, s; `None` if it is unknown.
    pub gyro: Vector3<f64>,
    pub dt: f64,
    /// Variances that are added to each angle and to each bias.
    pub angle: f64,
    pub bias: f64,
}

/// Propagation of a mean and a covariance through nonlinear functions.
pub trait Linearised: core::fmt::Debug + Clone + Copy + PartialEq {
    /// Name of the method.
    const METHOD: &'static str;
    /// Tag in a checkpoint.
    const TAG: &'static str;

    /// Propagates mean and covariance through a step.
    fn predict(state: &mut Gauss, step: &Step);

    /// Corrects by the direction of the force, of length one, in the estimated axes of the earth.
    /// The expected direction is up, with variance R on each axis.
    fn see_up(state: &mut Gauss, force: &Vector3<f64>, R: f64);

    /// Corrects by the angle from the estimated to the magnetic north, about the vertical.
    fn see_north(state: &mut Gauss, angle: f64, R: f64);
}

/// A multiplicative Kalman filter of six states (E. J. Lefferts, F. L. Markley, M. D. Shuster, *J.
/// Guidance, Control, and Dynamics* 5(5), 1982). The gyro drives the prediction, the accelerometer
/// measures the direction of up, the magnetometer measures the heading.
///
/// Errors of the angles are in the earth's axes (J. Solà, *Quaternion kinematics for the
/// error-state Kalman filter*, 2017, section 7). The variance of a sample follows from the noise
/// density n and the sample's time: R = n²/dt.
/// its time, R = n²/dt.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Kalman<L> {
    options: NamedOptions,
    state: Gauss,
    by: PhantomData<L>,
}

/// The extended Kalman filter.
pub type Ekf = Kalman<Extended>;
/// The unscented Kalman filter.
pub type Ukf = Kalman<Unscented>;

impl<L: Linearised> Kalman<L> {
    /// A filter before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if an option is out of range.
    pub fn new(options: NamedOptions) -> Result<Self, Error> {
        Ok(Self::with(options.validate()?))
    }

    fn with(options: NamedOptions) -> Self {
        let heading = if options.mag {
            FREE_HEADING_VARIANCE_RAD2
        } else {
            CHOSEN_HEADING_SIGMA_RAD * CHOSEN_HEADING_SIGMA_RAD
        };
        let mut P = Symmetric::diagonal(SAMPLE_SIGMA_RAD * SAMPLE_SIGMA_RAD);
        P.set(2, 2, heading);
        (0..3).for_each(|i| P.set(BIAS + i, BIAS + i, squared(options.bias_sigma[i])));
        let state = Gauss { body: Body::default(), bias: options.bias.into(), P };
        Self { options, state, by: PhantomData }
    }

    /// Corrects by the measurements of the last `dt` seconds.
    #[inline]
    fn correct(&mut self, accel: Option<&Vector3<f64>>, mag: Option<&Vector3<f64>>, dt: f64) {
        let (state, constants) = (&mut self.state, &self.options.constants);
        if state.body.levelled
            && let Some(accel) = accel
        {
            let force = state.body.in_earth(&accel.normalize());
            L::see_up(state, &force, squared(constants.accel_noise / GRAVITY) / dt);
        }
        if state.body.headed
            && let Some(mag) = mag
        {
            let field = state.body.in_earth(mag);
            if field.x != 0.0 || field.y != 0.0 {
                L::see_north(state, east_of_north(&field), squared(constants.mag_noise) / dt);
            }
        }
    }

    fn begin(&mut self, accel: Option<&Vector3<f64>>, mag: Option<&Vector3<f64>>) {
        let before = self.state.body;
        self.state.body.begin(accel, mag);
        if self.state.body.headed && !before.headed {
            self.state.restart(2, SAMPLE_SIGMA_RAD * SAMPLE_SIGMA_RAD);
        }
    }
}

impl Gauss {
    /// Applies a computed correction.
    pub fn apply(&mut self, found: &nalgebra::SVector<f64, 6>) {
        self.body.turn_earth(&found.fixed_rows::<3>(0).into_owned());
        let bias = self.bias + found.fixed_rows::<3>(BIAS);
        self.bias = bias.map(|x| x.clamp(-MAX_BIAS, MAX_BIAS));
    }

    /// Sets the variance of one error, and its covariances to zero.
    pub fn restart(&mut self, i: usize, variance: f64) {
        (0..6).for_each(|j| self.P.set(i, j, 0.0));
        self.P.set(i, i, variance);
    }

    /// Limits every variance without a change of the correlations.
    pub fn limit(&mut self) {
        for i in 0..6 {
            let (variance, cap) = (self.P.at(i, i), MAX_VARIANCES[i / 3]);
            if variance > cap {
                let scale = (cap / variance).simd_sqrt();
                (0..6).for_each(|j| self.P.set(i, j, self.P.at(i, j) * scale));
                self.P.set(i, i, cap);
            }
        }
    }

    fn is_valid(&self) -> bool {
        // After a restart a variance may exceed its limit by rounding.
        let caps = MAX_VARIANCES.map(|cap| cap * (1.0 + 1e-9));
        self.body.is_valid()
            && are_within(&self.bias, MAX_BIAS)
            && self.P.is_covariance(3.0 * (caps[0] + caps[1]))
            && (0..6).all(|i| self.P.at(i, i) <= caps[i / 3])
    }
}

impl<L: Linearised> Estimator for Kalman<L> {
    #[inline]
    fn step(&mut self, sample: &Inertial) {
        let mag = sample.mag.as_ref().filter(|_| self.options.mag);
        let (dt, constants) = (sample.dt, &self.options.constants);
        L::predict(
            &mut self.state,
            &Step {
                gyro: sample.gyro,
                dt: if sample.known { dt } else { 0.0 },
                angle: squared(constants.gyro_noise) * dt + UNKNOWN_RATE_VARIANCE * sample.unknown,
                bias: squared(constants.bias_walk) * dt,
            },
        );
        self.state.limit();
        if dt >= MIN_MEASURED_S {
            self.correct(sample.accel.as_ref(), mag, dt);
        }
        self.begin(sample.accel.as_ref(), mag);
    }

    fn gap(&mut self, seconds: f64) {
        let (state, walked) =
            (&mut self.state, squared(self.options.constants.bias_walk) * seconds);
        state.body.forget();
        (0..2).for_each(|i| state.restart(i, SAMPLE_SIGMA_RAD * SAMPLE_SIGMA_RAD));
        let heading = if self.options.mag {
            FREE_HEADING_VARIANCE_RAD2
        } else {
            state.P.at(2, 2) + UNKNOWN_RATE_VARIANCE * seconds
        };
        state.restart(2, heading);
        for i in BIAS..6 {
            state.P.set(i, i, state.P.at(i, i) + walked);
        }
        state.limit();
    }

    #[inline]
    fn orientation(&self) -> Quaternion<f64> {
        self.state.body.orientation
    }

    fn knowledge(&self) -> Knowledge {
        let Gauss { body, bias, P } = &self.state;
        Knowledge {
            bias: *bias,
            bias_sigma: Vector3::from_fn(|i, _| P.at(BIAS + i, BIAS + i).max(0.0).simd_sqrt()),
            tilt_sigma: (P.at(0, 0) + P.at(1, 1)).max(0.0).simd_sqrt(),
            heading_sigma: P.at(2, 2).max(0.0).simd_sqrt(),
            started: body.levelled,
            ..Knowledge::default()
        }
    }

    fn align(&mut self, orientation: Quaternion<f64>, tilt_sigma: f64, heading_sigma: f64) {
        self.state.body.align(orientation);
        for (i, sigma) in [tilt_sigma, tilt_sigma, heading_sigma].into_iter().enumerate() {
            self.state.restart(i, squared(sigma));
        }
        self.state.limit();
    }

    fn reset(&mut self) {
        *self = Self::with(self.options);
    }

    fn is_valid(&self) -> bool {
        self.options.validate().is_ok() && self.state.is_valid()
    }

    fn is_like(&self, other: &Self) -> bool {
        self.options == other.options
    }
}

impl<L: Linearised> Tagged for Kalman<L> {
    const TAG: &'static str = L::TAG;
}

impl<L: Linearised> Named for Kalman<L> {
    const METHOD: &'static str = L::METHOD;

    fn options(&self) -> NamedOptions {
        self.options
    }
}

fn squared(x: f64) -> f64 {
    x * x
}
