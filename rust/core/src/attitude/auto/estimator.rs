//! The filter as an attitude estimator: steps, estimates and restart.

use super::errors::{BIAS, MATRIX, VELOCITY};
use super::heading::MAX_FIELD_AGE_S;
use super::lost::Lost;
use super::recovery::Recovery;
use super::start::{MAX_SPEED_CHANGE_M_S, TILT_SIGMA_RAD};
use super::strapdown::Sums;
use super::trust::Lasting;
use super::{
    Auto, GRAVITY_TICKS, MAX_BIAS, MAX_BIAS_TIME_S, MAX_MATRIX, MAX_VELOCITY, TICK, Ticked, square,
};
use crate::attitude::events::Events;
use crate::attitude::stream::Tagged;
use crate::attitude::{Estimator, Inertial, Knowledge};
use crate::math::validity::{are_within, is_size};
use nalgebra::{ComplexField, Matrix3, Quaternion, Vector3};

impl Auto {
    /// Processes one sample; returns the result of a tick that ends with it.
    #[inline(always)]
    pub fn follow(&mut self, sample: &Inertial) -> Option<Ticked> {
        self.events = Events::default();
        let mut driven = sample.gyro - self.bias;
        if sample.age == 0.0 {
            self.lost.end();
        } else {
            driven *= self.lost.fade(sample, &driven);
        }
        let step = self.matrix * driven * sample.dt;
        let angle = self.strapdown.angle(&step);
        if self.strapdown.doubts(&angle) {
            self.look_again(&step, sample);
        } else {
            self.strapdown.turn(&step, &angle);
        }
        let field = sample.mag.as_ref().filter(|mag| self.spikes.pass(mag));
        if !self.start.over
            && let Some(accel) = &sample.accel
        {
            self.begin(accel, sample.mag.as_ref(), field.is_some());
        }
        self.sums.add(sample, field, &driven, &self.strapdown.rotation, TICK);
        // Not a closure, since it would be compiled without the caller's instruction set.
        if self.sums.elapsed + 0.5 * sample.dt < TICK {
            return None;
        }
        Some(self.tick())
    }

    /// Events at the last sample, and conditions since the last tick.
    pub(super) fn all_events(&self) -> Events {
        self.events
            .with(Events::FIELD_HELD, self.held.is_held())
            .with(Events::FIELD_IGNORED, self.magnet.is_ignored())
            .with(Events::UNCLEAR, self.unclear)
            .with(Events::WRONG_UNIT, self.unit.is_wrong())
    }

    #[cold]
    #[inline(never)]
    fn look_again(&mut self, step: &Vector3<f64>, sample: &Inertial) {
        if let Some(wrong) = self.strapdown.doubt(step, &sample.gyro, sample.dt) {
            self.sums.replace(&wrong, &sample.gyro);
            self.events.add(Events::GLITCH);
        }
        let angle = self.strapdown.angle(step);
        self.strapdown.turn(step, &angle);
    }
}

impl Estimator for Auto {
    #[inline(always)]
    fn step(&mut self, sample: &Inertial) {
        self.follow(sample);
    }

    fn gap(&mut self, seconds: f64) {
        self.sums = Sums::new(TICK);
        self.rest.interrupt();
        let turned = self.lost.turned(self.speed_squared, seconds);
        (self.lost, self.recovery) = (Lost::default(), Recovery::default());
        self.unit.interrupt();
        (self.at_rest, self.unclear) = (false, false);
        (self.velocity, self.lasting) = ([0.0; 2], Lasting::default());
        self.errors.restart(&[VELOCITY, VELOCITY + 1], MAX_SPEED_CHANGE_M_S * MAX_SPEED_CHANGE_M_S);
        self.blur(turned, turned);
        self.iron.blur(turned);
        self.strapdown.restart(self.strapdown.orientation);
        if self.errors.variance(0) > TILT_SIGMA_RAD * TILT_SIGMA_RAD {
            self.start.again();
        }
    }

    #[inline(always)]
    fn orientation(&self) -> Quaternion<f64> {
        let ([c, s], q) = (self.turn, &self.strapdown.orientation);
        Quaternion::new(c * q.w - s * q.k, c * q.i - s * q.j, c * q.j + s * q.i, c * q.k + s * q.w)
    }

    fn knowledge(&self) -> Knowledge {
        let doubt = self.doubt();
        let sigma = |i: usize| ComplexField::sqrt(doubt * self.errors.variance(i).max(0.0));
        Knowledge {
            bias: self.bias,
            bias_sigma: Vector3::from_fn(|i, _| sigma(BIAS + i)),
            gyro_matrix: self.matrix,
            gyro_matrix_sigma: Matrix3::from_fn(|i, j| sigma(MATRIX + 3 * i + j)),
            tilt_sigma: ComplexField::sqrt(self.tilt_variance()),
            heading_sigma: self.heading_sigma(),
            gravity: self.mean_gravity(),
            at_rest: self.at_rest,
            unclear: self.unclear,
            wrong_unit: self.unit.is_wrong(),
            disturbed: self.magnet.is_disturbed() || self.held.is_stuck(),
            stuck: self.held.is_stuck(),
            started: self.start.over,
            events: self.all_events(),
        }
    }

    fn align(&mut self, orientation: Quaternion<f64>, tilt_sigma: f64, heading_sigma: f64) {
        self.strapdown.restart(orientation);
        self.turn = [1.0, 0.0];
        self.velocity = [0.0; 2];
        self.errors.restart(&[0, 1], square(tilt_sigma));
        self.errors.restart(&[VELOCITY, VELOCITY + 1], MAX_SPEED_CHANGE_M_S * MAX_SPEED_CHANGE_M_S);
        self.errors.restart_heading(square(heading_sigma));
        self.deviation.restart(square(heading_sigma));
        self.drift.end();
        self.iron.lose_earth();
        (self.lasting, self.recovery) = (Lasting::default(), Recovery::default());
        self.first.align();
        self.start.over = true;
    }

    fn reset(&mut self) {
        *self = Self::with(self.options);
    }

    fn power_on(&mut self) {
        let (matrix, errors) = (self.matrix, self.errors);
        self.reset();
        self.matrix = matrix;
        self.errors.keep_matrix(&errors);
    }

    fn is_valid(&self) -> bool {
        let sizes = [
            (self.velocity[0].abs(), MAX_VELOCITY),
            (self.velocity[1].abs(), MAX_VELOCITY),
            (self.field_age, MAX_FIELD_AGE_S),
            (self.gravity[0], 2e3),
            (self.gravity[1], GRAVITY_TICKS),
            (self.speed_squared, 1e7),
        ];
        let [c, s] = self.turn;
        self.options.validate().is_ok()
            && sizes.iter().all(|(x, most)| is_size(*x, *most))
            && are_within(&self.bias, MAX_BIAS)
            && are_within(&(self.matrix - Matrix3::identity()), MAX_MATRIX + 1e-12)
            && (c * c + s * s - 1.0).abs() < 1e-9
            && self.strapdown.is_valid()
            && self.sums.is_valid()
            && self.drift.is_valid()
            && self.errors.is_valid()
            && self.start.is_valid()
            && self.rest.is_valid()
            && self.accelerations.is_valid()
            && self.lasting.is_valid()
            && self.scale_noise.is_valid()
            && self.spikes.is_valid()
            && self.straight.is_valid()
            && self.recovery.is_valid()
            && self.magnet.is_valid()
            && self.held.is_valid()
            && self.deviation.is_valid_with(&self.iron)
            && self.iron.is_valid()
            && self.lost.is_valid()
            && self.first.is_valid()
            && self.unit.is_valid()
            && are_within(&self.by_bias, MAX_BIAS_TIME_S)
    }

    fn is_like(&self, other: &Self) -> bool {
        self.options == other.options
    }
}

impl Tagged for Auto {
    const TAG: &'static str = "attitude";
    const VERSION: u16 = 6;
}
