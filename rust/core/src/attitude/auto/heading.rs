//! Correction of the heading, and only the heading, by a magnetometer.

use nalgebra::{ComplexField, Matrix3, RealField, Vector3};

use super::deviation::Correction;
use super::drift::spread_weight;
use super::magnet::Magnet;
use super::strapdown::{self, Sums};
use super::{Auto, DEGREE, FREE_HEADING_VARIANCE_RAD2, square};
use crate::attitude::{events::Events, frame};

/// Time of rest after which the bias is known, s.
const BIAS_REST_S: f64 = 2.0;
/// Factor of the noise of a field that is not used, as evidence of iron.
const UNUSED_NOISE_FACTOR: f64 = 16.0;
/// Noise of the magnetic field's direction, rad √s, and its change during motion, rad/√s.
const FIELD_NOISE: f64 = 25.0 * DEGREE;
pub(super) const FIELD_WALK: f64 = 0.02 * DEGREE;
/// Squared horizontal share of a field below which the noise of its direction grows: a dip of 72
/// degrees.
const LEVEL_SHARE_SQUARED: f64 = 0.1;
/// Squared horizontal share below which a field gives no heading: the rounding of its size.
const VERTICAL_SHARE_SQUARED: f64 = 1e-12;
/// Longest time for which a field is valid, s.
pub(super) const MAX_FIELD_AGE_S: f64 = 1.0;

/// The correction of the heading by a field.
#[derive(Debug, Clone, Copy)]
pub struct HeadingCorrection {
    /// Share of the innovation that corrected the heading.
    pub gain: f64,
    /// Derivative of the field's direction by a field in the sensor's axes, rad per unit.
    pub share: Vector3<f64>,
}

impl Auto {
    /// Corrects the heading, and only the heading, by the mean direction of the field.
    pub(super) fn see_field(
        &mut self,
        sums: &Sums,
        rate: f64,
        news: bool,
    ) -> Option<HeadingCorrection> {
        self.follow_drift(sums.elapsed);
        self.field_age = (self.field_age + sums.elapsed).min(MAX_FIELD_AGE_S);
        if !news {
            return None;
        }
        let field = sums.field / sums.fields;
        let seconds = core::mem::take(&mut self.field_age);
        let doubt = self.magnet.observe(&field, seconds, rate);
        let level_squared = field.x * field.x + field.y * field.y;
        if seconds <= 0.0 || level_squared <= VERTICAL_SHARE_SQUARED * field.norm_squared() {
            return None;
        }
        let level = ComplexField::sqrt(level_squared);
        let field_weight = spread_weight(rate, seconds);
        self.drift.field_spread().observe(level, -field.z, field_weight);
        let rotation = sums.rotation();
        let unused = doubt.unwrap_or(UNUSED_NOISE_FACTOR);
        self.iron.observe(&field, &rotation, seconds, unused, self.drift.walk());
        let innovation = self.east_of_north(&field);
        self.test_drift(innovation, seconds);
        let doubt = doubt?;
        let steep = (LEVEL_SHARE_SQUARED * field.norm_squared() / level_squared).max(1.0);
        let noise = square(FIELD_NOISE) / seconds * doubt * steep;
        let before = self.errors.heading();
        let gain = before / (before + noise);
        self.drift.correct(gain);
        self.errors.correct_heading(gain, noise);
        self.by_bias *= 1.0 - gain;
        let (tilt, east) = (0.5 * self.tilt_variance(), self.east(&rotation));
        let by = Correction {
            gain,
            noise,
            innovation,
            level,
            down: field.z,
            tilt,
            east,
            field_weight,
            span: seconds,
        };
        self.deviation.correct(&by, before, self.errors.heading(), self.iron.strength());
        self.turn_heading(gain * innovation);
        Some(HeadingCorrection { gain, share: east * (1.0 / level) })
    }

    /// Rotation from the sensor's axes to a level frame that only the gyro turns.
    pub fn held(&self) -> &Matrix3<f64> {
        &self.strapdown.rotation
    }

    /// Forgets the shape of the field: later fields have another shape.
    pub fn forget_field(&mut self) {
        self.magnet = Magnet::default();
        self.drift.end();
        self.iron.forget();
    }

    /// Lets the next fields set the heading again; tilt and bias stay.
    pub fn find_heading(&mut self) {
        self.errors.restart_heading(FREE_HEADING_VARIANCE_RAD2);
        self.deviation.restart(FREE_HEADING_VARIANCE_RAD2);
        self.by_bias = Vector3::zeros();
        self.forget_field();
    }

    /// Variance of the heading from a field with this covariance in the sensor's axes, rad².
    pub fn heading_by(&self, covariance: &Matrix3<f64>) -> f64 {
        self.deviation.by_field(covariance)
    }

    /// Turns the heading back at the rate of its drift; not at rest.
    fn follow_drift(&mut self, span: f64) {
        let (turned, grown) = self.drift.predict(self.iron.turning(), self.errors.heading(), span);
        if grown != 0.0 {
            self.blur(0.0, grown);
            self.turn_heading(turned);
        }
        if self.at_rest {
            self.drift.rest(span);
            if self.rest.lasted() >= BIAS_REST_S {
                self.end_drift();
            }
        }
    }

    /// Ends a drift: the bias is known with its variance, and the frame drifts only with this.
    pub(super) fn end_drift(&mut self) {
        self.drift.end();
        self.iron.rest(self.errors.bias_along(&self.up()));
    }

    /// Tests whether the field keeps the heading on one side in motion.
    fn test_drift(&mut self, innovation: f64, span: f64) {
        if self.at_rest || !self.start.over {
            return;
        }
        let (believed, by) = (self.magnet.is_believed(), self.iron.turning());
        let heading = self.errors.heading();
        if let Some(found) = self.drift.test(innovation, heading, believed, by, span) {
            self.events.add(Events::DRIFT);
            self.iron.widen(found.drift);
            self.blur(0.0, found.heading);
            self.by_bias = Vector3::zeros();
        }
    }

    /// Adds these variances to tilt and heading.
    pub(super) fn blur(&mut self, tilt: f64, heading: f64) {
        let shrunk = self.errors.blur(tilt, heading);
        self.drift.shrink(shrunk);
    }

    /// Unit vector up, in the sensor's axes.
    pub(super) fn up(&self) -> Vector3<f64> {
        frame::up(&self.strapdown.orientation)
    }

    /// East in the sensor's axes, for a rotation from the sensor's axes to the frame.
    fn east(&self, rotation: &Matrix3<f64>) -> Vector3<f64> {
        let [c, s] = self.turn;
        let (cosine, sine) = (c * c - s * s, 2.0 * c * s);
        (rotation.row(0) * cosine - rotation.row(1) * sine).transpose()
    }

    /// Angle from north to a direction, clockwise, rad.
    pub(super) fn east_of_north(&self, direction: &Vector3<f64>) -> f64 {
        let [c, s] = self.turn;
        let (cosine, sine) = (c * c - s * s, 2.0 * c * s);
        let east = cosine * direction.x - sine * direction.y;
        let north = sine * direction.x + cosine * direction.y;
        RealField::atan2(east, north)
    }

    pub(super) fn heading_sigma(&self) -> f64 {
        let own = self.errors.heading().max(0.0);
        ComplexField::sqrt(if self.options.mag {
            self.deviation.variance(own, &self.iron)
        } else {
            own + self.first.variance()
        })
    }

    /// Turns the heading clockwise, rad.
    pub fn turn_heading(&mut self, angle: f64) {
        let step = strapdown::small_rotation(&Vector3::new(0.0, 0.0, angle));
        let ([c, s], [w, z]) = (self.turn, [step.w, step.k]);
        let (c, s) = (c * w - s * z, s * w + c * z);
        let near_one = 1.5 - 0.5 * (c * c + s * s);
        self.turn = [c * near_one, s * near_one];
    }
}
