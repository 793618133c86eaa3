//! Weights of velocity and gyro, learned from the corrections.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Expected velocity of a body, m/s √s.
const SPEED_NOISE: f64 = 0.25;
/// Time constant of the mean acceleration, s, and its initial value, (m/s)².
const ACCELERATION_TIME_CONSTANT_S: f64 = 5.0;
const INITIAL_MEAN_SQUARED: f64 = 0.25;

/// Half the mean square of the estimated velocity, caused by the body's own accelerations.
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
    /// Processes the velocity of a tick; returns the variance of "it is zero" over a second.
    pub fn observe(&mut self, velocity: &[f64; 2], lasting: &Lasting, span: f64) -> f64 {
        let square = 0.5 * (velocity[0] * velocity[0] + velocity[1] * velocity[1]);
        self.square += (span / ACCELERATION_TIME_CONSTANT_S).min(1.0) * (square - self.square);
        self.noise(lasting)
    }

    fn noise(&self, lasting: &Lasting) -> f64 {
        SPEED_NOISE * SPEED_NOISE + self.square.max(lasting.turning())
    }

    /// Ratio of the tilt's real variance to the filter's variance.
    ///
    /// The filter allows for errors of accelerometer and mounting that turn with the body. It
    /// treats the whole velocity as white noise over a second; an oscillation leaves little of it
    /// after seconds. The two assumptions overestimate the variance, by a share found in
    /// simulation. A lasting velocity is underestimated, by the ratio of its power at low
    /// frequencies to the assumed noise.
    pub fn doubt(&self, lasting: &Lasting) -> f64 {
        // After a recovery the noise is older: a lasting velocity is at most all of it.
        let slow = (lasting.squares[0] / self.noise(lasting)).min(1.0);
        let usual = TILT_VARIANCE_SHARE
            + (1.0 - TILT_VARIANCE_SHARE) * lasting.first / INITIAL_SPEED_SQUARED;
        usual + 2.0 * VELOCITY_TIME_CONSTANT_S * (slow - OSCILLATION_POWER_SHARE).max(0.0)
    }

    /// Forgets the velocity: its cause was a wrong tilt.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    pub fn is_valid(&self) -> bool {
        (0.0..=1e18).contains(&self.square)
    }
}

/// Time of the means that remove oscillations, s, and time for which a velocity lasts, s.
const SLOW_MEAN_S: f64 = 1.5;
const VELOCITY_TIME_CONSTANT_S: f64 = 6.0;
/// Squared initial velocity of a body, (m/s)².
const INITIAL_SPEED_SQUARED: f64 = 1.0;
/// Share of the filter's tilt variance that remains after a lasting velocity, and share of an
/// oscillation's power that the slow means keep.
const TILT_VARIANCE_SHARE: f64 = 0.3;
const OSCILLATION_POWER_SHARE: f64 = 0.1;

/// Velocity of a moving body, which is not zero over seconds. It is constant over ground, or turns
/// with the body, as on a circle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lasting {
    /// Means in the axes of the frame and of the sensor, m/s.
    ground: [f64; 2],
    body: Vector3<f64>,
    /// Half their mean squares, and remaining initial value, (m/s)².
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
    /// Velocity of a body that rested.
    pub fn of_rest() -> Self {
        Self { first: 0.0, ..Self::default() }
    }

    /// Processes the velocity of a tick, and the rotation from the sensor to its frame.
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

    /// Variance of its change per second, (m/s)²/s.
    pub fn walk(&self) -> f64 {
        2.0 / VELOCITY_TIME_CONSTANT_S * (self.squares[0] + self.first)
    }

    /// Variance over a second of the part that turns with the body, as if it were noise.
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
/// Time over which corrections are summed, s, and time constant of the noise, s.
const CORRECTION_SUM_S: f64 = 2.0;
const NOISE_TIME_CONSTANT_S: f64 = 3.0;
/// Expected ratio of the squared sum with a correct noise, and the largest ratio.
const EXPECTED_RATIO: f64 = 0.3;
const MAX_RATIO: f64 = 6.0;
/// Squared rate above which a lost sample is a lost rotation, (rad/s)².
const MIN_TURN_RATE_SQUARED: f64 = 1.5 * 1.5;
const TINY: f64 = 1e-12;

/// Noise of the gyro's scale. It is raised while the tilt's corrections keep one direction, as
/// after lost samples; accelerations of the body cancel in their sum.
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
    /// Square of the noise, s.
    pub fn variance(&self) -> f64 {
        self.square
    }

    /// Processes the tilt's correction in a tick, its expected variance, and the mean square of the
    /// rate: a body that hardly turns loses no rotation with a sample. Returns the ratio of the
    /// squared sum to its expectation.
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
