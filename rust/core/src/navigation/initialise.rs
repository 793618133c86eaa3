//! The first fix, or the first fix after a gap: start position, and heading.

use nalgebra::{Matrix3, RealField, Vector3};
use serde::{Deserialize, Serialize};

use super::covariance::{GYRO, PHI, R, STATES, V};
use super::earth::{LocalEarth, MAX_HEIGHT, MAX_LATITUDE, wrap};
use super::filter::{
    GAP_VARIANCES_RAD2, MAX_UNKNOWN_S, NavigationFilter, Observer, Sums, is_known,
};
use super::fix::{Given, Verdict};
use super::innovation_gate::InnovationGate;
use super::motion::{Motion, rotation};
use crate::math::Real;
use crate::math::validity::is_within;

/// Standard deviation of an unknown velocity, m/s.
const UNKNOWN_VELOCITY_SIGMA_M_S: f64 = 10.0;
/// Limits for a course as heading: smallest speed, m/s, and in its standard deviations, and
/// smallest standard deviation of the course, rad.
const MIN_COURSE_SPEED_M_S: f64 = 1.0;
const MIN_COURSE_SIGMAS: f64 = 10.0;
const MIN_COURSE_SIGMA_RAD: f64 = 0.03;
/// Limits for a velocity from two fixes: smallest distance in standard deviations of their
/// positions, and longest interval, s.
const MIN_APART_SIGMAS: f64 = 20.0;
const MAX_APART_S: f64 = 10.0;

/// A fix from which a velocity is computed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Before {
    time: f64,
    position: [f64; 3],
}

/// Velocity of the antenna, and its standard deviation per axis.
#[derive(Debug, Clone, Copy)]
struct Moves {
    velocity: Vector3<f64>,
    sigma: Vector3<f64>,
}

impl NavigationFilter {
    /// Begins at a fix, if it has a position and the heading is known or can be found.
    pub(crate) fn begin_from<W: Observer>(
        &mut self,
        given: &Given,
        age: f64,
        observer: &mut W,
    ) -> Verdict {
        let Some(position) = given.position.filter(|_| self.sensors.gyro_age <= MAX_UNKNOWN_S)
        else {
            return Verdict::Refused;
        };
        let measured =
            given.velocity.map(|velocity| Moves { velocity, sigma: given.velocity_sigma });
        let moves = measured.or_else(|| self.between(given, position));
        let mut heading_sigma = None;
        if !self.heading_known || self.aids.has_started() {
            heading_sigma = moves.filter(|_| self.start.course).and_then(|m| self.look_along(&m));
            if heading_sigma.is_some() {
                self.heading_known = true;
                self.aids.forget_start();
            }
        }
        if !self.heading_known {
            return Verdict::Refused;
        }
        self.begin_at(given, position, moves, heading_sigma, age);
        if !self.is_somewhere() {
            self.lose(GAP_VARIANCES_RAD2);
            return Verdict::Refused;
        }
        self.refresh_sigma();
        observer.record_start(&self.covariance, &self.motion);
        Verdict::Used
    }

    /// Velocity since an earlier fix, if the receiver gives none.
    fn between(&mut self, given: &Given, position: [f64; 3]) -> Option<Moves> {
        let now = Before { time: given.time, position };
        let before = *self.before.get_or_insert(now);
        let seconds = given.time - before.time;
        let local_earth = LocalEarth::at(position[0], position[2]);
        let [latitude, longitude, height] = before.position;
        let way = Vector3::new(
            (position[0] - latitude) / local_earth.north,
            wrap(position[1] - longitude) / local_earth.east,
            height - position[2],
        );
        let far = way.xy().norm() > MIN_APART_SIGMAS * given.position_sigma.xy().amax();
        if far || !(0.0..=MAX_APART_S).contains(&seconds) {
            self.before = Some(now);
        }
        let velocity = way / seconds;
        let possible = seconds > 0.0 && seconds <= MAX_APART_S && is_known(&velocity);
        // Errors of two positions, and a velocity that has changed meanwhile.
        let sigma = given.position_sigma * (2.0 / seconds.at_least(0.1));
        (possible && far).then_some(Moves { velocity, sigma })
    }

    /// Sets the heading to the course, if the body moves forward fast enough; returns its standard
    /// deviation.
    fn look_along(&mut self, moves: &Moves) -> Option<f64> {
        let (v, sigma) = (moves.velocity, moves.sigma.xy().amax());
        let speed = v.xy().norm();
        if speed < MIN_COURSE_SPEED_M_S || speed < MIN_COURSE_SIGMAS * sigma {
            return None;
        }
        // The axle moves forward; a point ahead of it moves sideways in a turn.
        let across = self.params.wheels.map_or(0.0, |wheels| {
            let rate = self.sensors.gyro.z - self.gyro_bias.z;
            rate * (self.antenna.x - wheels.axle[0])
        });
        let drift = RealField::atan2(across.within(speed), speed);
        let off = RealField::atan2(v.y, v.x) - drift - self.motion.heading();
        self.motion.attitude = rotation(&Vector3::new(0.0, 0.0, off)) * self.motion.attitude;
        let course = sigma / speed;
        Some((course * course + MIN_COURSE_SIGMA_RAD * MIN_COURSE_SIGMA_RAD).simd_sqrt())
    }

    fn begin_at(
        &mut self,
        given: &Given,
        position: [f64; 3],
        moves: Option<Moves>,
        heading_sigma: Option<f64>,
        age: f64,
    ) {
        let [latitude, longitude, height] = position;
        let mut motion = Motion::new(self.motion.attitude, latitude, longitude, height);
        let antenna = self.antenna;
        let lever = motion.attitude * antenna;
        let rate = self.sensors.gyro - self.gyro_bias;
        let lever_arm_velocity = motion.attitude * rate.cross(&antenna);
        let zero = Vector3::zeros();
        let velocity = moves.map(|moves| moves.velocity);
        let start = velocity.map_or(zero, |v| v - lever_arm_velocity);
        // Correct by the lever arm, and by the distance since the fix.
        motion.correct(&(lever - velocity.unwrap_or(zero) * age), &zero, &zero);
        motion.velocity = start;
        self.motion = motion;
        self.motion.settle();
        let mut variances = [0.0; STATES];
        for i in PHI..STATES {
            variances[i] = self.covariance.at(i, i);
        }
        for i in 0..3 {
            // Only the gyro has given the orientation since its start.
            let t = self.alone;
            let bias = variances[GYRO + i];
            variances[PHI + i] += (self.params.gyro_noise[i] + bias * t) * t;
            let sigma = moves.map_or(UNKNOWN_VELOCITY_SIGMA_M_S, |moves| {
                moves.sigma[i].at_most(UNKNOWN_VELOCITY_SIGMA_M_S)
            });
            variances[R + i] = given.position_sigma[i] * given.position_sigma[i];
            variances[V + i] = sigma * sigma;
            variances[PHI + i] = variances[PHI + i].min(10.0);
        }
        if let Some(sigma) = heading_sigma {
            variances[PHI + 2] = sigma * sigma;
        }
        let compass = self.take_heading_start();
        variances[PHI + 2] = compass.unwrap_or(variances[PHI + 2]);
        self.covariance = self.covariance.with_variances(&variances);
        if compass.is_some() {
            self.covariance.couple_heading();
        }
        // The uncertainty of the antenna adds to the position's uncertainty.
        if self.params.has_antenna_sigma() {
            let turn = self.motion.attitude;
            let lever_arm_rate = turn * rate.cross_matrix();
            let factor = if velocity.is_some() { 1.0 } else { 0.0 };
            let row = |m: &Matrix3<f64>, i: usize| [m[(i, 0)], m[(i, 1)], m[(i, 2)]];
            let of = |i: usize| {
                if i < 3 { row(&turn, i) } else { row(&(lever_arm_rate * factor), i - 3) }
            };
            self.covariance.propagate_antenna(&core::array::from_fn(of));
        }
        // The error of the velocity is defined in the assumed frame.
        self.covariance.couple(&start);
        self.gates.iter_mut().for_each(InnovationGate::restart);
        self.aids.restart();
        self.navigating = true;
        self.sums = Sums::new();
        (self.alone, self.wheels) = (0.0, 0.0);
    }
}

impl Before {
    pub fn is_valid(&self) -> bool {
        let [latitude, longitude, height] = self.position;
        is_within(self.time, 4e9)
            && is_within(latitude, MAX_LATITUDE)
            && is_within(longitude, 7.0)
            && is_within(height, MAX_HEIGHT)
    }
}
