//! Trust in velocity and gyro, learned from the corrections themselves.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Velocity that a body is expected to have, m/s √s.
const SPEED_NOISE: f64 = 0.25;
/// Seconds over which its accelerations are averaged, and their mean at the start, (m/s)².
const ACCELERATION_TIME_CONSTANT_S: f64 = 5.0;
const INITIAL_MEAN_SQUARED: f64 = 0.25;

/// Half the mean square of the velocity found: how much the body's own accelerations make.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Accelerations {
    square: f64,
}

impl Default for Accelerations {
    fn default() -> Self {
        Self { square: INITIAL_MEAN_SQUARED }
    }
}

impl Accelerations {
    /// Takes the velocity found in a tick; returns the variance of "it is zero" over a second.
    pub fn observe(&mut self, velocity: &[f64; 2], lasting: &Lasting, span: f64) -> f64 {
        let square = 0.5 * (velocity[0] * velocity[0] + velocity[1] * velocity[1]);
        self.square += (span / ACCELERATION_TIME_CONSTANT_S).min(1.0) * (square - self.square);
        self.noise(lasting)
    }

    fn noise(&self, lasting: &Lasting) -> f64 {
        SPEED_NOISE * SPEED_NOISE + self.square.max(lasting.turning())
    }

    /// By how much the variance of the tilt is really larger than the filter's own.
    ///
    /// That allows for errors of accelerometer and mounting that turn with the body, and takes all
    /// of the velocity for white noise over a second, of which an oscillation leaves little in seconds:
    /// too much of both, by a share found in simulation. A velocity that lasts is as much too little,
    /// in its power at slow frequencies against the noise assumed.
    pub fn doubt(&self, lasting: &Lasting) -> f64 {
        // After a recovery the one is of before it: a velocity that lasts is no more than all of it.
        let slow = (lasting.squares[0] / self.noise(lasting)).min(1.0);
        let usual = TILT_VARIANCE_SHARE
            + (1.0 - TILT_VARIANCE_SHARE) * lasting.first / INITIAL_SPEED_SQUARED;
        usual + 2.0 * VELOCITY_TIME_CONSTANT_S * (slow - OSCILLATION_POWER_SHARE).max(0.0)
    }

    /// Forgets: the error found was that of a tilt.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    pub fn is_valid(&self) -> bool {
        (0.0..=1e18).contains(&self.square)
    }
}

/// Seconds of the means that leave oscillations and keep what goes on, and those for which a
/// velocity lasts.
const SLOW_MEAN_S: f64 = 1.5;
const VELOCITY_TIME_CONSTANT_S: f64 = 6.0;
/// Square of the velocity that a body may have from the start, (m/s)².
const INITIAL_SPEED_SQUARED: f64 = 1.0;
/// Share of the filter's variance of the tilt that is left once it goes, and of the power of what
/// oscillates that the slow means keep.
const TILT_VARIANCE_SHARE: f64 = 0.3;
const OSCILLATION_POWER_SHARE: f64 = 0.1;

/// Velocity of a body that is under way: it is not zero in the mean of seconds. It lasts over the
/// ground, or turns with the body, as on a circle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lasting {
    /// Means in the axes of the frame and of the sensor, m/s.
    ground: [f64; 2],
    body: Vector3<f64>,
    /// Half their mean squares, and what is left of the start's, (m/s)².
    squares: [f64; 2],
    first: f64,
}

impl Default for Lasting {
    fn default() -> Self {
        let (ground, body, squares) = ([0.0; 2], Vector3::zeros(), [0.0; 2]);
        Self { ground, body, squares, first: INITIAL_SPEED_SQUARED }
    }
}

impl Lasting {
    /// Of a body that rested.
    pub fn of_rest() -> Self {
        Self { first: 0.0, ..Self::default() }
    }

    /// Takes the velocity found in a tick, and the rotation from the sensor to its frame.
    #[inline(always)]
    pub fn observe(&mut self, velocity: &[f64; 2], rotation: &Matrix3<f64>, span: f64) {
        let weight = (span / SLOW_MEAN_S).min(1.0);
        for (mean, velocity) in self.ground.iter_mut().zip(velocity) {
            *mean += weight * (velocity - *mean);
        }
        let turned = rotation.tr_mul(&Vector3::new(velocity[0], velocity[1], 0.0));
        self.body += (turned - self.body) * weight;
        let weight = (span / ACCELERATION_TIME_CONSTANT_S).min(1.0);
        let ground = self.ground[0] * self.ground[0] + self.ground[1] * self.ground[1];
        for (square, mean) in self.squares.iter_mut().zip([ground, self.body.norm_squared()]) {
            *square += weight * (0.5 * mean - *square);
        }
        self.first -= weight * self.first;
    }

    /// Variance of its change in a second, (m/s)²/s.
    pub fn walk(&self) -> f64 {
        2.0 / VELOCITY_TIME_CONSTANT_S * (self.squares[0] + self.first)
    }

    /// Variance over a second of that which turns with the body, as if it were noise.
    fn turning(&self) -> f64 {
        2.0 * VELOCITY_TIME_CONSTANT_S * (self.squares[1] - self.squares[0]).max(0.0)
    }

    pub fn is_valid(&self) -> bool {
        self.ground.iter().chain(self.body.iter()).all(|x| x.abs() <= 1e9)
            && self.squares.iter().all(|x| (0.0..=1e18).contains(x))
            && (0.0..=INITIAL_SPEED_SQUARED).contains(&self.first)
    }
}

/// Smallest error of a gyro in a rotation, √s, and the factor by which it may grow.
const MIN_SCALE_NOISE: f64 = 0.0015;
const MAX_SCALE_NOISE_RATIO: f64 = 150.0;
/// Seconds over which corrections are added up, and within which the noise follows.
const CORRECTION_SUM_S: f64 = 2.0;
const NOISE_TIME_CONSTANT_S: f64 = 3.0;
/// Share of what is expected that the sum's square has if the noise is right, and the largest.
const EXPECTED_RATIO: f64 = 0.3;
const MAX_RATIO: f64 = 6.0;
/// Square of the rate from which on a lost sample is a turn lost, (rad/s)².
const MIN_TURN_RATE_SQUARED: f64 = 1.5 * 1.5;
const TINY: f64 = 1e-12;

/// Noise of the gyro's scale, raised while the corrections of the tilt keep pointing one way, as
/// they do where samples were lost: accelerations of the body cancel in their sum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScaleNoise {
    square: f64,
    sum: [f64; 2],
    expected: f64,
}

impl Default for ScaleNoise {
    fn default() -> Self {
        Self { square: MIN_SCALE_NOISE * MIN_SCALE_NOISE, sum: [0.0; 2], expected: 0.0 }
    }
}

impl ScaleNoise {
    /// Its square, s.
    pub fn variance(&self) -> f64 {
        self.square
    }

    /// Takes the correction of the tilt in a tick, the variance that it was expected to have, and
    /// the mean square of the rate: a body that hardly turns loses nothing with a sample. Returns
    /// the square of the sum in times of what was expected.
    pub fn observe(
        &mut self,
        correction: &[f64; 2],
        expected: f64,
        speed_squared: f64,
        span: f64,
    ) -> f64 {
        let kept = (1.0 - span / CORRECTION_SUM_S).max(0.0);
        for (sum, correction) in self.sum.iter_mut().zip(correction) {
            *sum = kept * *sum + correction;
        }
        let kept = (1.0 - 2.0 * span / CORRECTION_SUM_S).max(0.0);
        self.expected = kept * self.expected + expected;
        let square = self.sum[0] * self.sum[0] + self.sum[1] * self.sum[1];
        let ratio = square / (self.expected + TINY);
        let share = (span / NOISE_TIME_CONSTANT_S).min(1.0)
            * (speed_squared / MIN_TURN_RATE_SQUARED).min(1.0);
        let grown = self.square * (1.0 + share * (ratio.min(MAX_RATIO) - EXPECTED_RATIO));
        self.square = grown.clamp(
            MIN_SCALE_NOISE * MIN_SCALE_NOISE,
            MAX_SCALE_NOISE_RATIO * MIN_SCALE_NOISE * MIN_SCALE_NOISE,
        );
        ratio
    }

    /// Forgets the corrections: they were made.
    pub fn forget(&mut self) {
        (self.sum, self.expected) = ([0.0; 2], 0.0);
    }

    pub fn is_valid(&self) -> bool {
        let range = MIN_SCALE_NOISE * MIN_SCALE_NOISE
            ..=MAX_SCALE_NOISE_RATIO * MIN_SCALE_NOISE * MIN_SCALE_NOISE;
        range.contains(&self.square)
            && self.sum.iter().all(|x| x.abs() <= 1e9)
            && (0.0..=1e9).contains(&self.expected)
    }
}
