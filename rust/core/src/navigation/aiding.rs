//! What corrects the filter: fixes, wheels that do not slip, rest.

use nalgebra::{Matrix3, Vector3};

use super::covariance::{ACCEL, Errors, GYRO, Innovation, PHI, R, Row, STATES, V};
use super::filter::{GAP_ANGLES, NavigationFilter, Sums, Witness};
use super::fix::{Given, Verdict, position_rows, velocity_rows};
use super::judge::{INNOVATION_MAX, Judgement};
use super::params::{BIAS_MAX, Wheels};
use crate::math::Real;

/// Variances of level and heading that a filter gains that was wrong, rad².
const WRONG: [f64; 2] = [1e-3, 0.03];
/// Seconds between two looks at the wheels, and speed above which they tell something, m/s.
const WHEELS_EVERY: f64 = 0.2;
const WHEELS_SPEED: f64 = 1.0;
/// Of a body at rest, m/s, and the speed above which one is not believed to rest.
const REST_SIGMA: f64 = 0.05;
const REST_SPEED: f64 = 0.5;
/// Least noise of the mean rate at rest, rad/s.
const REST_RATE: f64 = 1e-7;
/// A correction after which the Earth is that of another place, m.
const FAR: f64 = 1e3;

impl NavigationFilter {
    /// A fix that is neither too old nor ahead.
    pub(crate) fn take<W: Witness>(&mut self, given: &Given, age: f64, witness: &mut W) -> Verdict {
        if !self.navigating {
            return self.begin_from(given, age, witness);
        }
        self.propagate(witness);
        if !self.navigating {
            return Verdict::Refused;
        }
        let mut found = [0.0; STATES];
        let time = self.sensors.time;
        let antenna = Vector3::from(self.params.antenna);
        let lever = self.motion.attitude * antenna;
        let rate = self.sensors.gyro - self.gyro_bias;
        let swing = self.motion.attitude * rate.cross(&antenna);
        let velocity = self.motion.velocity + swing;
        let acceleration = self.motion.acceleration;
        let place = given.position.map(|position| {
            let here = self.motion.offset_from(position) + lever;
            let z = here - velocity * age + acceleration * (0.5 * age * age);
            (limited(&z), position_rows(&lever), given.position_sigma)
        });
        let moved = given.velocity.map(|measured| {
            let z = velocity - acceleration * age - measured;
            let turned = self.motion.attitude * antenna.cross_matrix();
            (limited(&z), velocity_rows(&velocity, &turned), given.velocity_sigma)
        });
        let mut taken = [None; 2];
        for (kind, measured) in [place, moved].into_iter().enumerate() {
            if let Some((z, rows, told)) = measured {
                self.judges[kind].learn(time, &z);
                taken[kind] = Some(self.judged(kind, &z, &rows, &told, &mut found));
            }
        }
        if taken.contains(&Some(true)) {
            self.apply(&found, witness);
        }
        let [position, velocity] = taken;
        match position.or(velocity) {
            _ if !self.navigating => Verdict::Refused,
            Some(true) => Verdict::Used,
            _ => Verdict::Rejected,
        }
    }

    /// Takes one kind of measurement if it is believed.
    fn judged(
        &mut self,
        kind: usize,
        z: &Vector3<f64>,
        rows: &[Row; 3],
        told: &Vector3<f64>,
        found: &mut Errors,
    ) -> bool {
        let judge = &self.judges[kind];
        let noise = [0, 1, 2].map(|i| judge.noise(i, told[i] * told[i], self.params.adapt));
        let before = (self.covariance, *found);
        let new = self.correct(z, rows, &noise, found);
        match self.judges[kind].judge(self.sensors.time, new, self.params.gate) {
            Judgement::Take => return true,
            Judgement::Reject => {
                (self.covariance, *found) = before;
                self.fixes.rejected_of[kind] += 1;
            }
            Judgement::Widen => {
                (self.covariance, *found) = before;
                self.widen(kind, z);
                self.correct(z, rows, &noise, found);
                return true;
            }
        }
        false
    }

    fn correct(
        &mut self,
        z: &Vector3<f64>,
        rows: &[Row; 3],
        noise: &[f64; 3],
        found: &mut Errors,
    ) -> [Innovation; 3] {
        [0, 1, 2].map(|i| self.covariance.correct(&rows[i], z[i], noise[i], found))
    }

    /// The filter was wrong, by as much as the fix says.
    #[cold]
    fn widen(&mut self, kind: usize, z: &Vector3<f64>) {
        if kind == 0 {
            self.fixes.moved += 1;
            self.fixes.last_move = [self.sensors.time, z.norm()];
        }
        let first = [R, V][kind];
        for i in 0..3 {
            self.covariance.widen(first + i, z[i] * z[i]);
        }
        let [level, heading] = WRONG;
        for (i, more) in [level, level, heading].into_iter().enumerate() {
            self.covariance.widen(PHI + i, more);
        }
    }

    /// Takes errors that were found out of the motion and the biases.
    #[inline(never)]
    pub(crate) fn apply<W: Witness>(&mut self, found: &Errors, witness: &mut W) {
        if let Some(beside) = &mut self.covariance.1 {
            self.odometer.take_out(&core::mem::take(&mut beside.found));
        }
        let part = |i: usize| Vector3::new(found[i], found[i + 1], found[i + 2]);
        self.motion.correct(&part(R), &part(V), &part(PHI));
        let within = |b: Vector3<f64>| b.map(|x| x.within(BIAS_MAX));
        self.gyro_bias = within(self.gyro_bias + part(GYRO));
        self.accel_bias = within(self.accel_bias + part(ACCEL));
        if !self.is_somewhere() {
            self.lose(GAP_ANGLES);
            return;
        }
        if part(R).norm_squared() > FAR * FAR {
            self.motion.settle();
        }
        self.refresh_sigma();
        witness.corrected(found, &self.covariance, &self.motion);
    }

    /// Sideways and down a wheel does not go.
    #[inline(always)]
    pub(crate) fn look_at_wheels<W: Witness>(&mut self, witness: &mut W) {
        let Some(wheels) = self.params.wheels else { return };
        if self.wheels >= WHEELS_EVERY - 1e-6 && self.navigating {
            self.wheels = 0.0;
            if self.motion.velocity.norm_squared() > WHEELS_SPEED * WHEELS_SPEED {
                self.roll(&wheels, witness);
            }
        }
    }

    #[inline(never)]
    fn roll<W: Witness>(&mut self, wheels: &Wheels, witness: &mut W) {
        let rate = self.sensors.gyro - self.gyro_bias;
        let velocity = self.motion.attitude.transpose() * self.motion.velocity;
        let rows = self.rows_of_wheels(wheels, &velocity, &rate);
        let noise = wheels.sigma * wheels.sigma;
        let mut found = [0.0; STATES];
        for i in [1, 2] {
            let (h, z) = (&rows.errors[i], rows.speed[i]);
            if self.covariance.1.is_some() {
                self.covariance.correct_beside(h, &rows.constants[i], z, noise, &mut found);
            } else {
                self.covariance.correct(h, z, noise, &mut found);
            }
        }
        self.apply(&found, witness);
    }

    /// All samples of a step were at rest, if the filter does not know better.
    #[inline(never)]
    pub(crate) fn stand<W: Witness>(&mut self, sums: &Sums, witness: &mut W) {
        let speed = self.motion.velocity.norm();
        let sigma = (V..PHI).map(|i| self.sigma[i] * self.sigma[i]).sum::<f64>().simd_sqrt();
        if speed >= REST_SPEED + 3.0 * sigma {
            return;
        }
        let mut found = [0.0; STATES];
        let z = self.motion.velocity;
        let rows = velocity_rows(&z, &Matrix3::zeros());
        self.correct(&z, &rows, &[REST_SIGMA * REST_SIGMA; 3], &mut found);
        if sums.unknown[0] == 0.0 {
            let earth = self.motion.attitude.transpose() * self.motion.place.earth;
            let z = sums.gyro * (1.0 / sums.samples) - self.gyro_bias - earth;
            for i in 0..3 {
                let mut h = [0.0; 16];
                h[GYRO + i] = 1.0;
                let noise = self.params.gyro_noise[i] / sums.seconds + REST_RATE * REST_RATE;
                self.covariance.correct(&h, z[i], noise, &mut found);
            }
        }
        self.apply(&found, witness);
    }
}

fn limited(z: &Vector3<f64>) -> Vector3<f64> {
    z.map(|x| x.within(INNOVATION_MAX))
}
