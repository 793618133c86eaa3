//! Bias from a rest, and the corrections that it reverses: after a jump of the bias, or if no rest
//! has shown the bias before.

use nalgebra::{ComplexField, Matrix3, Vector3};

use super::errors::{BIAS, Errors};
use super::rest::{self, Known, State};
use super::strapdown::Sums;
use super::trust::ScaleNoise;
use super::{
    Auto, AutoOptions, DEGREE, FREE_HEADING_VARIANCE_RAD2, MAX_BIAS, MAX_FOLLOWED_BIAS_RAD_S,
    square, start_variances,
};
use crate::attitude::events::Events;

/// Standard deviations after a rest that refutes others: smallest value of the bias, rad/s, and of
/// the tilt, rad.
const REFUTED_BIAS_SIGMA_RAD_S: f64 = 0.02 * DEGREE;
const REFUTED_TILT_SIGMA_RAD: f64 = 0.2;

impl Auto {
    /// Processes a rest, if the body rests, and reverses wrong corrections.
    #[inline(always)]
    pub(super) fn rest(&mut self, sums: &Sums, news: bool) -> Option<(Vector3<f64>, f64)> {
        let field = news.then(|| self.strapdown.rotation.tr_mul(&(sums.field / sums.fields)));
        let variance = (0..3).fold(0.0, |most: f64, i| most.max(self.errors.variance(BIAS + i)));
        let limit = self.options.bias_limit;
        let known =
            Known { bias: self.bias, variance, most: limit, pushed: self.recovery.is_strong() };
        let had_rest = self.rest.has_evidence();
        let state = self.rest.observe(sums, field.as_ref(), &known);
        self.at_rest = !matches!(state, State::Motion | State::Denied | State::Unclear(_));
        self.unclear = matches!(state, State::Unclear(_));
        if self.knowing {
            self.at_rest = matches!(state, State::Rest(_));
            return None;
        }
        match state {
            State::Motion => None,
            State::Unclear(up) => {
                // This is part of the heading's standard deviation.
                let more = square(limit) - self.errors.bias_along(&up);
                self.errors.widen_bias_along(&up, more);
                None
            }
            State::Rest(measured) => measured,
            State::Refuted(level, noise) => {
                self.events = self.events.with(Events::REST_UNDONE, had_rest);
                self.undo(&level, [noise; 3])
            }
            State::Denied => {
                self.events.add(Events::REST_UNDONE);
                let AutoOptions { bias, bias_sigma, .. } = self.options;
                self.undo(&Vector3::from(bias), bias_sigma.map(square));
                self.by_bias = Vector3::zeros();
                None
            }
            State::Jumped(level) => {
                self.events.add(Events::BIAS_JUMP);
                self.restart_gyro(level);
                let seconds = sums.elapsed;
                Some((sums.gyro / sums.samples, square(rest::RATE_NOISE) / seconds))
            }
        }
    }

    /// Processes a rest far from the bias: everything learned of the gyro is wrong.
    #[cold]
    fn restart_gyro(&mut self, level: Vector3<f64>) {
        let heading = self.errors.heading().max(if self.options.mag {
            FREE_HEADING_VARIANCE_RAD2
        } else {
            0.0
        });
        self.forget_gyro(level, [MAX_FOLLOWED_BIAS_RAD_S; 3], heading);
    }

    /// Processes a false rest that has set the bias. Its effect on the heading is known.
    #[cold]
    fn undo(&mut self, level: &Vector3<f64>, noise: [f64; 3]) -> Option<(Vector3<f64>, f64)> {
        self.turn_heading(self.by_bias.dot(&(level - self.bias)));
        let sigma =
            noise.map(|noise| ComplexField::sqrt(noise.max(square(REFUTED_BIAS_SIGMA_RAD_S))));
        self.forget_gyro(*level, sigma, self.errors.heading());
        self.errors.restart(&[0, 1], square(REFUTED_TILT_SIGMA_RAD));
        None
    }

    fn forget_gyro(&mut self, level: Vector3<f64>, sigma: [f64; 3], heading: f64) {
        self.bias = level.map(|x| x.clamp(-MAX_BIAS, MAX_BIAS));
        self.matrix = Matrix3::from(self.options.matrix).transpose();
        let variances = start_variances(&sigma, &self.options.matrix_sigma);
        self.errors = Errors::new(&variances, heading);
        (self.velocity, self.scale_noise) = ([0.0; 2], ScaleNoise::default());
        self.end_drift();
    }
}
