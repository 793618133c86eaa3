//! Bias of a body that was switched on in motion and never rests, such as a car or a pendulum. Much
//! of its motion is straight.
//!
//! Gravity does not show the bias along the vertical. A rate about the vertical that is constant
//! for seconds is usually the bias: straight stretches have one rate, arcs have different rates.

use serde::{Deserialize, Serialize};

use super::{BIAS_SIGMA, DEGREE, square};
use crate::attitude::sample::MAX_RATE;
use crate::math::validity::is_size;

/// Largest distance of a tick's rate from the mean, rad/s, and time of the mean, s.
const MAX_RATE_CHANGE_RAD_S: f64 = 3.0 * DEGREE;
const MIN_STEADY_S: f64 = 1.5;
/// Noise density of the rate about the vertical in straight motion, rad/s √s.
const RATE_NOISE: f64 = DEGREE;
/// Largest distance from the stated bias, rad/s: three standard deviations of an unknown bias.
const MAX_BIAS_RAD_S: f64 = 3.0 * BIAS_SIGMA;
/// Largest distance of a stretch from the usual rate, rad/s, and time constant of the usual rate,
/// s.
const MAX_RATE_DIFFERENCE_RAD_S: f64 = 0.7 * DEGREE;
const RATE_TIME_CONSTANT_S: f64 = 10.0;
/// A stretch has one vote at its beginning, and another after this time, s. Then: largest number of
/// votes, number for a majority, and loss by a stretch with another rate.
const VOTE_INTERVAL_S: f64 = 20.0;
const MAX_VOTES: f64 = 10.0;
const MIN_VOTES: f64 = 2.0;
const OPPOSING_VOTE: f64 = 0.5;

/// Mean rate about the vertical, rad/s, and time for which it is constant, s; usual rate of such
/// stretches, and its votes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Straight {
    mean: f64,
    since: f64,
    usual: f64,
    votes: f64,
}

impl Straight {
    /// Processes a tick's rate about the vertical, the stated bias, and the largest possible bias.
    /// Returns the variance of "it is the bias".
    pub fn observe(&mut self, rate: f64, given: f64, most: f64, span: f64) -> Option<f64> {
        let apart = (rate - self.mean).abs();
        self.mean += (rate - self.mean) * (span / MIN_STEADY_S).min(1.0);
        let may_be = (self.mean - given).abs() <= MAX_BIAS_RAD_S && self.mean.abs() <= most;
        let before = self.since;
        self.since = if apart <= MAX_RATE_CHANGE_RAD_S && may_be { before + span } else { 0.0 };
        if !lasts(self.since) {
            return None;
        }
        let vote = if lasts(before) { span / VOTE_INTERVAL_S } else { 1.0 };
        (self.agrees(vote, span) && self.votes >= MIN_VOTES).then(|| square(RATE_NOISE) / span)
    }

    /// True if the present rate is the rate of most stretches.
    fn agrees(&mut self, vote: f64, span: f64) -> bool {
        let apart = self.mean - self.usual;
        if apart.abs() <= MAX_RATE_DIFFERENCE_RAD_S {
            self.votes = (self.votes + vote).min(MAX_VOTES);
            self.usual += apart * (span / RATE_TIME_CONSTANT_S).min(1.0);
            return true;
        }
        self.votes -= OPPOSING_VOTE * vote;
        if self.votes < 0.0 {
            (self.usual, self.votes) = (self.mean, 1.0);
        }
        false
    }

    /// Notes a gap without samples.
    pub fn interrupt(&mut self) {
        self.since = 0.0;
    }

    pub fn is_valid(&self) -> bool {
        self.mean.abs() <= 2.0 * MAX_RATE
            && is_size(self.since, 1e18)
            && self.usual.abs() <= 2.0 * MAX_RATE
            && is_size(self.votes, MAX_VOTES)
    }
}

fn lasts(seconds: f64) -> bool {
    seconds >= MIN_STEADY_S * (1.0 - 1e-9)
}

#[cfg(test)]
mod tests {
    use super::{DEGREE, Straight};

    /// True if the last of these rates, deg/s, each for `seconds` seconds, is accepted as bias.
    fn finds_bias(rates: &[f64], seconds: usize) -> bool {
        let mut straight = Straight::default();
        let mut last = None;
        for rate in rates {
            for _ in 0..10 * seconds {
                last = straight.observe(rate * DEGREE, 0.0, 10.0 * DEGREE, 0.1);
            }
        }
        last.is_some()
    }

    #[test]
    fn a_rate_that_stays_is_the_bias() {
        assert!(!finds_bias(&[0.5], 10), "one stretch has one vote");
        assert!(finds_bias(&[0.5], 30), "and another in twenty seconds");
    }

    #[test]
    fn arcs_are_each_of_another_rate() {
        assert!(!finds_bias(&[1.0, 2.5, -1.5, 2.0, -0.4], 8));
        assert!(!finds_bias(&[4.0, 9.0, 4.0], 20), "beyond three deviations it is none");
    }
}
