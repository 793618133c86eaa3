//! A body that was switched on under way and never rests, such as a car or a pendulum: it goes
//! straight on for much of the time.
//!
//! No gravity shows the bias along the vertical. But where the rate about it stays the same for
//! seconds it is the bias, more often than not.

use serde::{Deserialize, Serialize};

use super::{DEGREE, square};
use crate::attitude::sample::RATE_MAX;
use crate::math::sound::is_size;

/// How far the rate of a tick lies from the mean of so many seconds, rad/s, and for how long.
const STEADY: f64 = 3.0 * DEGREE;
const MEAN: f64 = 1.5;
/// Density of the rate about the vertical of what goes straight on, rad/s √s.
const NOISE: f64 = DEGREE;

/// Mean rate about the vertical, rad/s, and seconds since which it holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Straight {
    mean: f64,
    since: f64,
}

impl Straight {
    /// Takes the rate about the vertical of a tick, and the largest that can be a bias; returns the
    /// variance of "it is the bias".
    pub fn observe(&mut self, rate: f64, most: f64, span: f64) -> Option<f64> {
        let apart = (rate - self.mean).abs();
        self.mean += (rate - self.mean) * (span / MEAN).min(1.0);
        let steady = apart <= STEADY && self.mean.abs() <= most;
        self.since = if steady { self.since + span } else { 0.0 };
        (self.since >= MEAN * (1.0 - 1e-9)).then(|| square(NOISE) / span)
    }

    /// Nothing is known of a while.
    pub fn interrupt(&mut self) {
        self.since = 0.0;
    }

    pub fn is_sound(&self) -> bool {
        self.mean.abs() <= 2.0 * RATE_MAX && is_size(self.since, 1e18)
    }
}
