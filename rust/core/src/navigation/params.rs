//! Parameters of the navigation filter, and its start.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::earth::MAX_LATITUDE;
use super::usable::{self, Limits};
use crate::error::{Error, check_not_negative, require};

/// Kind of a sensor sample.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// Rates and forces at the time of the sample.
    #[default]
    Rate,
    /// Integrals of rates and forces since the previous sample.
    Increment,
}

/// Adaptation of the receiver's noise to the innovations.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Adapt {
    /// The noise rises above the stated noise if the innovations require it.
    #[default]
    Inflate,
    /// The noise follows the innovations up and down.
    Free,
    /// The noise is the stated noise.
    Fixed,
}

/// Wheels that do not slip sideways and do not leave the ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Wheels {
    /// Vector from the sensor to the unsteered axle, body axes, m.
    pub axle: [f64; 3],
    /// Standard deviation of the velocity across, m/s.
    pub sigma: f64,
    /// Standard deviation of the wheels' speed, m/s.
    pub speed_sigma: f64,
}

/// Parameters of the aids.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AidParams {
    /// Default white noise of a barometric height, m, and random walk of its reference, m/√s.
    pub barometer_sigma: f64,
    /// See `barometer_sigma`.
    pub barometer_walk: f64,
    /// Standard deviation of the compass's offset before the first reading, rad, and its random
    /// walk, rad/√s.
    pub compass_sigma: f64,
    /// See `compass_sigma`.
    pub compass_walk: f64,
    /// Vector from the first to the second antenna, body axes, m.
    pub baseline: Option<[f64; 3]>,
}

impl Default for AidParams {
    fn default() -> Self {
        Self {
            barometer_sigma: 0.5,
            barometer_walk: 0.02,
            compass_sigma: 0.035,
            compass_walk: 0.001,
            baseline: None,
        }
    }
}

impl AidParams {
    fn validate(&self) -> Result<(), Error> {
        let sigma = self.barometer_sigma;
        require((1e-3..=1e3).contains(&sigma), "barometer_sigma", "from 0.001 to 1000 m", sigma)?;
        let walk = self.barometer_walk;
        require((0.0..=1e2).contains(&walk), "barometer_walk", "from 0 to 100 m/sqrt(s)", walk)?;
        let sigma = self.compass_sigma;
        require((0.0..=3.0).contains(&sigma), "compass_sigma", "from 0 to 3 rad", sigma)?;
        let walk = self.compass_walk;
        require((0.0..=1.0).contains(&walk), "compass_walk", "from 0 to 1 rad/sqrt(s)", walk)?;
        let Some(baseline) = self.baseline else { return Ok(()) };
        let length = Vector3::from(baseline).norm();
        require(
            (0.01..=MAX_LEVER).contains(&length),
            "baseline",
            "from 0.01 to 1000 m long",
            length,
        )
    }
}

/// Parameters of a navigation filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NavigationParams {
    /// White noise of the axes of gyro, rad²/s, and accelerometer, m²/s³, squared.
    pub gyro_noise: [f64; 3],
    /// See `gyro_noise`.
    pub accel_noise: [f64; 3],
    /// Random walks of the biases, squared: gyro, rad²/s³, and accelerometer, m²/s⁵.
    pub gyro_walk: [f64; 3],
    /// See `gyro_walk`.
    pub accel_walk: [f64; 3],
    /// Standard deviation of a rate's noise over the standard deviation of its change between
    /// samples, for vibration faster than the samples. Each axis uses its own changes.
    pub gyro_vibration: f64,
    /// Vector from the sensor to the antenna, body axes, m.
    pub antenna: [f64; 3],
    /// Standard deviations of `antenna`, m: zero if it is known, else it is estimated.
    pub antenna_sigma: [f64; 3],
    /// True if the antenna is considered: its standard deviation counts, but it is not estimated.
    pub consider_antenna: bool,
    /// Wheels of a vehicle on wheels.
    pub wheels: Option<Wheels>,
    /// Normalised innovation squared above which a fix is rejected.
    pub gate: f64,
    /// Adaptation of the receiver's noise.
    pub adapt: Adapt,
    /// Time between two steps of the covariance, s.
    pub covariance_step: f64,
    /// Kind of a sample.
    pub kind: Kind,
    /// Parameters of barometer, compass and baseline.
    pub aids: AidParams,
    /// Largest standard deviations of usable outputs.
    pub limits: Limits,
}

/// Largest distance of antenna or axle, m.
pub(crate) const MAX_LEVER: f64 = 1e3;
/// Largest density of noise, its unit squared.
const MAX_NOISE: f64 = 1e4;

impl NavigationParams {
    /// True if the antenna's position is not known exactly.
    pub(crate) fn has_antenna_sigma(&self) -> bool {
        self.antenna_sigma.iter().any(|sigma| *sigma > 0.0)
    }

    /// # Errors
    /// [`Error::Parameter`] if a parameter is out of range.
    pub fn validate(self) -> Result<Self, Error> {
        let noises = [
            ("gyro noise", &self.gyro_noise),
            ("accel noise", &self.accel_noise),
            ("gyro bias walk", &self.gyro_walk),
            ("accel bias walk", &self.accel_walk),
        ];
        for (name, noise) in noises {
            for x in *noise {
                require((0.0..=MAX_NOISE).contains(&x), name, "from 0 to 100 (SI)", x)?;
            }
        }
        let vibration = self.gyro_vibration;
        require((0.0..=1.0).contains(&vibration), "gyro_vibration", "from 0 to 1", vibration)?;
        let axle = self.wheels.map_or([0.0; 3], |wheels| wheels.axle);
        for (name, lever) in [("antenna", &self.antenna), ("axle", &axle)] {
            for x in *lever {
                require(x.abs() <= MAX_LEVER, name, "within 1000 m", x)?;
            }
        }
        for sigma in self.antenna_sigma {
            let within = (0.0..=MAX_LEVER).contains(&sigma);
            require(within, "antenna_sigma", "from 0 to 1000 m", sigma)?;
        }
        if let Some(wheels) = &self.wheels {
            let sigma = wheels.sigma;
            require((1e-3..=1e3).contains(&sigma), "wheel_sigma", "from 0.001 to 1000 m/s", sigma)?;
            let sigma = wheels.speed_sigma;
            require((1e-3..=1e3).contains(&sigma), "speed_sigma", "from 0.001 to 1000 m/s", sigma)?;
        }
        require(self.gate > 0.0, "gate", "a positive number", self.gate)?;
        let step = self.covariance_step;
        require((1e-4..=1.0).contains(&step), "covariance_step", "from 0.0001 to 1 s", step)?;
        self.aids.validate()?;
        usable::validate(&self.limits)?;
        Ok(self)
    }
}

/// State before the first used sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Quaternion from the body's axes to north, east, down, scalar first; any heading if it is
    /// unknown.
    pub quaternion: [f64; 4],
    /// True if the heading is known. Otherwise it is the course, once the body moves forward.
    pub heading_known: bool,
    /// True if the body moves forward, and the course may be used as heading.
    pub course: bool,
    /// Time of the state, s: earlier samples and fixes are skipped.
    pub time: f64,
    /// Latitude, rad, used before the first fix.
    pub latitude: f64,
    /// Bias of the gyro, rad/s.
    pub gyro_bias: [f64; 3],
    /// Bias of the accelerometer, m/s².
    pub accel_bias: [f64; 3],
    /// Standard deviations of roll and pitch, of the heading, rad, and of the biases.
    pub level_sigma: f64,
    /// See `level_sigma`.
    pub heading_sigma: f64,
    /// See `level_sigma`.
    pub gyro_bias_sigma: f64,
    /// See `level_sigma`.
    pub accel_bias_sigma: f64,
}

impl Start {
    /// # Errors
    /// [`Error::Parameter`] if a value is out of range.
    pub fn validate(self) -> Result<Self, Error> {
        let square = self.quaternion.iter().map(|x| x * x).sum::<f64>();
        require((square - 1.0).abs() < 1e-6, "quaternion", "a unit quaternion", square)?;
        require(self.time.abs() <= 4e9, "time", "a time in seconds", self.time)?;
        let latitude = self.latitude;
        require(latitude.abs() <= MAX_LATITUDE, "latitude", "within 89.5 degrees", latitude)?;
        for (name, bias) in [("gyro_bias", &self.gyro_bias), ("accel_bias", &self.accel_bias)] {
            for x in *bias {
                require(x.abs() <= MAX_BIAS, name, "within 10 rad/s or m/s^2", x)?;
            }
        }
        for (name, sigma) in [
            ("level_sigma", self.level_sigma),
            ("heading_sigma", self.heading_sigma),
            ("gyro_bias_sigma", self.gyro_bias_sigma),
            ("accel_bias_sigma", self.accel_bias_sigma),
        ] {
            check_not_negative(name, "zero or a positive number", sigma)?;
            require(sigma <= MAX_BIAS, name, "at most 10", sigma)?;
        }
        Ok(self)
    }
}

/// Largest bias, rad/s and m/s²: a larger bias means a broken sensor, or units other than SI.
pub(crate) const MAX_BIAS: f64 = 10.0;
