//! Options of the named methods: a table of their constants.

use serde::{Deserialize, Serialize};

use crate::error::{Error, require};

/// Names of all methods; the first is the default.
pub const METHODS: [&str; 6] = ["auto", "complementary", "mahony", "madgwick", "ekf", "ukf"];

/// Methods with an initial bias.
pub const BIAS_METHODS: &[&str] = &["auto", "mahony", "ekf", "ukf"];
/// Methods with a standard deviation of the initial bias.
pub const BIAS_SIGMA_METHODS: &[&str] = &["auto", "ekf", "ukf"];

/// Largest bias, rad/s, and largest initial standard deviation.
pub(super) const MAX_BIAS: f64 = 10.0;
pub(super) const MAX_BIAS_SIGMA: f64 = 0.2;
/// Standard deviation of an unknown bias, rad/s.
const BIAS_SIGMA: f64 = 0.5 * core::f64::consts::PI / 180.0;

/// Gradient steps of Madgwick's report, rad/s: with a magnetometer and without.
const BETA: f64 = 0.041;
const BETA_WITHOUT_FIELD: f64 = 0.033;

/// Constants of all named methods; each method uses some.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Constants {
    /// Time constant of the complementary filter, s.
    pub time_constant: f64,
    /// Proportional gain of Mahony, 1/s.
    pub kp: f64,
    /// Integral gain of Mahony, 1/s².
    pub ki: f64,
    /// Step of Madgwick, rad/s; by default the report's.
    pub beta: Option<f64>,
    /// White noise of the gyro, rad/s/√Hz.
    pub gyro_noise: f64,
    /// White noise of the accelerometer, m/s²/√Hz.
    pub accel_noise: f64,
    /// White noise of the magnetic heading, rad/√Hz.
    pub mag_noise: f64,
    /// Random walk of the gyro's bias, rad/s/√s.
    pub bias_walk: f64,
}

impl Default for Constants {
    fn default() -> Self {
        Self {
            time_constant: 0.5,
            kp: 1.0,
            ki: 0.3,
            beta: None,
            gyro_noise: 2e-4,
            accel_noise: 0.1,
            mag_noise: 0.1,
            bias_walk: 1e-4,
        }
    }
}

/// One row of the table.
#[derive(Debug, Clone, Copy)]
pub struct Constant<C: 'static = Constants> {
    /// Name in Python.
    pub name: &'static str,
    /// Unit of the constant.
    pub unit: &'static str,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Range in words, for errors.
    pub expected: &'static str,
    /// Meaning, in one sentence without a full stop.
    pub meaning: &'static str,
    /// Methods that use the constant.
    pub methods: &'static [&'static str],
    /// Returns the value; `None` if the method chooses it.
    pub get: fn(&C) -> Option<f64>,
    /// Sets a value.
    pub set: fn(&mut C, f64),
}

impl<C> Constant<C> {
    /// True if the value is in its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] if it is not.
    pub fn check(&self, constants: &C) -> Result<(), Error> {
        let [least, most] = self.range;
        (self.get)(constants).map_or(Ok(()), |value| {
            require(least <= value && value <= most, self.name, self.expected, value)
        })
    }
}

const KALMAN: &[&str] = &["ekf", "ukf"];

/// Every constant.
pub const CONSTANTS: &[Constant] = &[
    Constant {
        name: "time_constant",
        unit: "s",
        range: [1e-6, 1e6],
        expected: "from 1e-6 to 1e6 s",
        meaning: "Time constant towards accelerometer and magnetometer",
        methods: &["complementary"],
        get: |c| Some(c.time_constant),
        set: |c, value| c.time_constant = value,
    },
    Constant {
        name: "kp",
        unit: "1/s",
        range: [0.0, 1e6],
        expected: "from 0 to 1e6 1/s",
        meaning: "Proportional gain: rate per rad of error",
        methods: &["mahony"],
        get: |c| Some(c.kp),
        set: |c, value| c.kp = value,
    },
    Constant {
        name: "ki",
        unit: "1/s^2",
        range: [0.0, 1e6],
        expected: "from 0 to 1e6 1/s^2",
        meaning: "Integral gain: lasting errors become bias; 0: none",
        methods: &["mahony"],
        get: |c| Some(c.ki),
        set: |c, value| c.ki = value,
    },
    Constant {
        name: "beta",
        unit: "rad/s",
        range: [0.0, 1e3],
        expected: "from 0 to 1000 rad/s",
        meaning: "Gradient step of the quaternion, half the body's rate. By default as in the report: \
                  0.041 with a magnetometer, 0.033 without",
        methods: &["madgwick"],
        get: |c| c.beta,
        set: |c, value| c.beta = Some(value),
    },
    Constant {
        name: "gyro_noise",
        unit: "rad/s/sqrt(Hz)",
        range: [1e-9, 10.0],
        expected: "from 1e-9 to 10 rad/s/sqrt(Hz)",
        meaning: "White noise of the gyro",
        methods: KALMAN,
        get: |c| Some(c.gyro_noise),
        set: |c, value| c.gyro_noise = value,
    },
    Constant {
        name: "accel_noise",
        unit: "m/s^2/sqrt(Hz)",
        range: [1e-6, 1e6],
        expected: "from 1e-6 to 1e6 m/s^2/sqrt(Hz)",
        meaning: "White noise of the accelerometer, with the body's acceleration",
        methods: KALMAN,
        get: |c| Some(c.accel_noise),
        set: |c, value| c.accel_noise = value,
    },
    Constant {
        name: "mag_noise",
        unit: "rad/sqrt(Hz)",
        range: [1e-6, 1e6],
        expected: "from 1e-6 to 1e6 rad/sqrt(Hz)",
        meaning: "White noise of the magnetic heading, with disturbances",
        methods: KALMAN,
        get: |c| Some(c.mag_noise),
        set: |c, value| c.mag_noise = value,
    },
    Constant {
        name: "bias_walk",
        unit: "rad/s/sqrt(s)",
        range: [1e-12, 1.0],
        expected: "from 1e-12 to 1 rad/s/sqrt(s)",
        meaning: "Random walk of the gyro's bias",
        methods: KALMAN,
        get: |c| Some(c.bias_walk),
        set: |c, value| c.bias_walk = value,
    },
];

/// Options for the sensor and for the method.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NamedOptions {
    /// True if there is a magnetometer; without one the initial heading is arbitrary.
    pub mag: bool,
    /// Output of the gyro without rotation, rad/s, for methods that learn a bias.
    pub bias: [f64; 3],
    /// Standard deviation of the bias, for methods with a bias.
    pub bias_sigma: [f64; 3],
    /// Constants of all methods.
    pub constants: Constants,
}

impl Default for NamedOptions {
    fn default() -> Self {
        let (bias, bias_sigma) = ([0.0; 3], [BIAS_SIGMA; 3]);
        Self { mag: true, bias, bias_sigma, constants: Constants::default() }
    }
}

impl NamedOptions {
    /// The options, if each number is in its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first number out of range.
    pub fn validate(self) -> Result<Self, Error> {
        for (x, sigma) in self.bias.into_iter().zip(self.bias_sigma) {
            require(x.abs() <= MAX_BIAS, "bias", "a rate of at most 10 rad/s", x)?;
            let expected = "a positive rate of at most 0.2 rad/s";
            require(sigma > 0.0 && sigma <= MAX_BIAS_SIGMA, "bias_sigma", expected, sigma)?;
        }
        CONSTANTS.iter().try_for_each(|constant| constant.check(&self.constants))?;
        Ok(self)
    }

    /// Gradient step of Madgwick.
    pub(super) fn beta(&self) -> f64 {
        let usual = if self.mag { BETA } else { BETA_WITHOUT_FIELD };
        self.constants.beta.unwrap_or(usual)
    }
}
