//! Options of a position filter: method, and a table of constants.

use serde::{Deserialize, Serialize};

use crate::attitude::Constant;
use crate::error::{Error, check_rate, require};

/// Largest number of fixes in the moving average.
pub const MAX_WINDOW: usize = 64;

/// Method of filtering.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum PositionMethod {
    /// Doppler and rest determine the change of position; a slow receiver error is a state.
    #[default]
    Aided,
    /// The mean of the last fixes.
    MovingAverage,
    /// Constant velocity.
    Kalman,
    /// A short step that changes the course is ignored.
    Heading,
    /// Constant velocity, with less weight for fixes with weak signals.
    Strength,
}

/// Names of the methods.
pub const POSITION_METHODS: [&str; 5] =
    ["aided", "moving_average", "kalman", "heading", "strength"];

impl PositionMethod {
    /// Name of the method.
    pub fn name(self) -> &'static str {
        POSITION_METHODS[self as usize]
    }

    /// Method with this name.
    pub fn of_name(name: &str) -> Option<Self> {
        let all = [Self::Aided, Self::MovingAverage, Self::Kalman, Self::Heading, Self::Strength];
        all.into_iter().find(|method| method.name() == name)
    }
}

/// Constants of all methods; each method uses some.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PositionConstants {
    /// Number of fixes in the moving average.
    pub window: f64,
    /// White noise of a fix with strong signals, per axis, m.
    pub sigma: f64,
    /// PSD of the acceleration for constant velocity, m²/s³.
    pub process_noise: f64,
    /// Step length from which a step is used with any course, m.
    pub step: f64,
    /// Largest change of course of a shorter step, rad.
    pub turn: f64,
    /// Standard deviation of the receiver's slow error, per axis, m.
    pub error_sigma: f64,
    /// Correlation time of the slow error, s.
    pub error_time: f64,
    /// White noise of the Doppler velocity, per axis, m/s.
    pub speed_sigma: f64,
    /// Density of the velocity's change without Doppler, m/s².
    pub acceleration: f64,
}

impl Default for PositionConstants {
    fn default() -> Self {
        Self {
            window: 10.0,
            sigma: 0.7,
            process_noise: 0.5,
            step: 3.0,
            turn: core::f64::consts::FRAC_PI_3,
            error_sigma: 2.5,
            error_time: 120.0,
            speed_sigma: 0.1,
            acceleration: 1.0,
        }
    }
}

const AIDED: &[&str] = &["aided"];
const HEADING: &[&str] = &["heading"];
const SIZE: [f64; 2] = [0.0, 1e30];
const SIZE_WORDS: &str = "zero or a positive number up to 1e30";

const fn row(
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
    methods: &'static [&'static str],
    get: fn(&PositionConstants) -> Option<f64>,
    set: fn(&mut PositionConstants, f64),
) -> Constant<PositionConstants> {
    Constant { name, unit, range: SIZE, expected: SIZE_WORDS, meaning, methods, get, set }
}

/// Every constant.
pub const POSITION_CONSTANTS: &[Constant<PositionConstants>] = &[
    Constant {
        range: [1.0, MAX_WINDOW as f64],
        expected: "a whole number from 1 to 64",
        ..row(
            "window",
            "",
            "Fixes of the moving average",
            &["moving_average"],
            |c| Some(c.window),
            |c, value| c.window = value,
        )
    },
    Constant {
        range: [1e-30, 1e30],
        expected: "from 1e-30 to 1e30 m",
        ..row(
            "sigma",
            "m",
            "White noise of a fix of strong signals, an axis",
            &["aided", "kalman", "strength"],
            |c| Some(c.sigma),
            |c, value| c.sigma = value,
        )
    },
    Constant {
        range: [0.0, 1e60],
        expected: "zero or a positive number up to 1e60",
        ..row(
            "process_noise",
            "m^2/s^3",
            "Power spectral density of the acceleration",
            &["kalman", "strength"],
            |c| Some(c.process_noise),
            |c, value| c.process_noise = value,
        )
    },
    row(
        "step",
        "m",
        "Length of a step that is used whatever its course",
        HEADING,
        |c| Some(c.step),
        |c, value| c.step = value,
    ),
    Constant {
        range: [0.0, core::f64::consts::PI],
        expected: "an angle from 0 to pi",
        ..row(
            "turn",
            "rad",
            "A shorter step that turns the course by more than this is not taken",
            HEADING,
            |c| Some(c.turn),
            |c, value| c.turn = value,
        )
    },
    row(
        "error_sigma",
        "m",
        "Slow error of the receiver, an axis",
        AIDED,
        |c| Some(c.error_sigma),
        |c, value| c.error_sigma = value,
    ),
    Constant {
        range: [1e-6, 1e9],
        expected: "from 1e-6 to 1e9 s",
        ..row(
            "error_time",
            "s",
            "Time in which the slow error is forgotten by a factor of e",
            AIDED,
            |c| Some(c.error_time),
            |c, value| c.error_time = value,
        )
    },
    row(
        "speed_sigma",
        "m/s",
        "White noise of the Doppler velocity, an axis",
        AIDED,
        |c| Some(c.speed_sigma),
        |c, value| c.speed_sigma = value,
    ),
    row(
        "acceleration",
        "m/s^2",
        "Rate of change of the velocity while it is unknown",
        AIDED,
        |c| Some(c.acceleration),
        |c, value| c.acceleration = value,
    ),
];

/// Parameters of a position filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PositionParams {
    /// Fixes per second.
    pub rate: f64,
    /// Method of filtering.
    pub method: PositionMethod,
    /// Constants of all methods.
    pub constants: PositionConstants,
}

impl PositionParams {
    pub(super) fn validate(self) -> Result<Self, Error> {
        check_rate(self.rate)?;
        POSITION_CONSTANTS.iter().try_for_each(|constant| constant.check(&self.constants))?;
        let window = self.constants.window;
        // The value has been checked to be in range.
        let whole = window == f64::from(window as u8);
        require(whole, "window", "a whole number from 1 to 64", window)?;
        Ok(self)
    }

    /// Number of fixes in the moving average.
    pub(super) fn window(&self) -> u8 {
        self.constants.window as u8
    }
}
