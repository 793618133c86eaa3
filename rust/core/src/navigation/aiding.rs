//! Corrections of the filter: fixes, wheels that do not slip, rest.

use nalgebra::{Matrix3, Vector3};

use super::coasting::TakenFix;
use super::covariance::{
    ACCEL, ANTENNA, CONSTANTS, Constants, Errors, GYRO, Innovation, PHI, R, Row, STATES, V,
};
use super::filter::{GAP_VARIANCES_RAD2, NavigationFilter, Observer, Sums};
use super::fix::{Given, Verdict, position_rows, velocity_rows};
use super::innovation_gate::{GateDecision, MAX_INNOVATION, Return};
use super::params::{MAX_BIAS, MAX_LEVER, Wheels};
use crate::math::Real;

/// Variances of level and heading that are added to a wrong filter, rad².
const WIDENED_VARIANCES_RAD2: [f64; 2] = [1e-3, 0.03];
/// Largest residual of fixes after an outage, squared and over their noise; the probability of a
/// larger residual is one in a thousand.
const MAX_OUTAGE_NIS: f64 = 16.27;
/// Time between two wheel corrections, s, and smallest speed for them, m/s.
const WHEELS_INTERVAL_S: f64 = 0.2;
const MIN_WHEELS_SPEED_M_S: f64 = 1.0;
/// Standard deviation of the velocity at rest, m/s, and largest speed at which rest is plausible.
const REST_SIGMA_M_S: f64 = 0.05;
pub(crate) const MAX_REST_SPEED_M_S: f64 = 0.5;
/// Smallest noise of the mean rate at rest, rad/s.
const MIN_REST_RATE_SIGMA_RAD_S: f64 = 1e-7;
/// Size of a correction after which the Earth's values are computed again, m.
const MAX_EARTH_DISTANCE_M: f64 = 1e3;

/// Innovation of a position or velocity, its derivatives by the errors, and its stated standard
/// deviations.
pub(crate) struct Measured {
    z: Vector3<f64>,
    rows: [Row; 3],
    stated: Vector3<f64>,
}

impl NavigationFilter {
    /// Processes a fix that is neither too old nor ahead of the sensors.
    pub(crate) fn take<W: Observer>(
        &mut self,
        given: &Given,
        age: f64,
        observer: &mut W,
    ) -> Verdict {
        if !self.navigating {
            return self.begin_from(given, age, observer);
        }
        self.propagate(observer);
        if !self.navigating {
            return Verdict::Refused;
        }
        let mut found = [0.0; STATES];
        let measured = self.measure_fix(given, age);
        let taken = match self.after_outage(&measured) {
            Return::None => self.usual(&measured, &mut found, observer),
            Return::First => self.waits(&measured, &mut found),
            Return::Agrees(seconds) => {
                observer.mark_return();
                self.comes_back(&measured, seconds, &mut found)
            }
        };
        if taken.contains(&Some(true)) {
            self.apply(&found, observer);
        }
        let [position, velocity] = taken;
        match position.or(velocity) {
            _ if !self.navigating => Verdict::Refused,
            Some(true) => Verdict::Used,
            _ => Verdict::Rejected,
        }
    }

    /// Innovations of position and velocity of a fix, relative to the expected antenna.
    #[inline(always)]
    fn measure_fix(&self, given: &Given, age: f64) -> [Option<Measured>; 2] {
        let lever = self.motion.attitude * self.antenna;
        let rate = self.sensors.gyro - self.gyro_bias;
        let lever_arm_velocity = self.motion.attitude * rate.cross(&self.antenna);
        let velocity = self.motion.velocity + lever_arm_velocity;
        let acceleration = self.motion.acceleration;
        let position = given.position.map(|position| {
            let here = self.motion.offset_from(position) + lever;
            let z = here - velocity * age + acceleration * (0.5 * age * age);
            Measured { z: clamp(&z), rows: position_rows(&lever), stated: given.position_sigma }
        });
        let velocity = given.velocity.map(|measured| {
            let z = velocity - acceleration * age - measured;
            let turned = self.motion.attitude * self.antenna.cross_matrix();
            let rows = velocity_rows(&velocity, &turned);
            Measured { z: clamp(&z), rows, stated: given.velocity_sigma }
        });
        [position, velocity]
    }

    /// State of the return after an outage: whether a fix is the first, or follows it.
    fn after_outage(&mut self, measured: &[Option<Measured>; 2]) -> Return {
        let time = self.sensors.time;
        let mut after = None;
        for (gate, measured) in self.gates.iter_mut().zip(measured).rev() {
            after = measured.as_ref().and_then(|measured| gate.learn(time, &measured.z));
        }
        let Some(position) = &measured[0] else { return Return::None };
        if after.is_none() && !self.gates[0].waits() {
            return Return::None;
        }
        let noise = self.noise(0, position);
        let walk = [V, V + 1, V + 2].map(|i| self.sigma[i] * self.sigma[i]);
        self.gates[0].classify_return(time, after, &position.z, &noise, &walk)
    }

    /// Processes position and velocity, each if its gate accepts it.
    fn usual<W: Observer>(
        &mut self,
        measured: &[Option<Measured>; 2],
        found: &mut Errors,
        observer: &mut W,
    ) -> [Option<bool>; 2] {
        let mut taken = [None; 2];
        for (kind, measured) in measured.iter().enumerate() {
            if let Some(measured) = measured {
                taken[kind] = Some(self.gate_fix(kind, measured, found, observer));
            }
        }
        taken
    }

    /// The first fix after an outage is only stored: the next fix confirms it or not.
    #[cold]
    fn waits(&mut self, measured: &[Option<Measured>; 2], found: &mut Errors) -> [Option<bool>; 2] {
        let before = (self.covariance, *found);
        self.believe(measured, found);
        (self.covariance, *found) = before;
        self.fixes.rejected_of[0] += 1;
        [Some(false), None]
    }

    /// Processes two fixes after an outage that agree. If the residual is still too large for their
    /// noise, the filter's covariance is too small.
    #[cold]
    fn comes_back(
        &mut self,
        measured: &[Option<Measured>; 2],
        seconds: f64,
        found: &mut Errors,
    ) -> [Option<bool>; 2] {
        let before = (self.covariance, *found);
        self.believe(measured, found);
        if (0..2).any(|kind| self.left(measured, kind, found) > MAX_OUTAGE_NIS) {
            (self.covariance, *found) = before;
            let [position, velocity] = measured.each_ref().map(|one| one.as_ref().map(|m| m.z));
            let z = position.unwrap_or_default();
            self.add_error(R, &z);
            self.add_error(V, &velocity.unwrap_or(z * (2.0 / seconds)));
            self.add_angles();
            let shown = self.gates.map(|gate| gate.new);
            self.believe(measured, found);
            for (gate, new) in self.gates.iter_mut().zip(shown) {
                gate.new = new;
            }
        }
        measured.each_ref().map(|one| one.as_ref().map(|_| true))
    }

    /// Corrects by all measurements. No scalars are recorded, because the filter may have been
    /// widened before.
    fn believe(&mut self, measured: &[Option<Measured>; 2], found: &mut Errors) {
        for (kind, measured) in measured.iter().enumerate() {
            if let Some(measured) = measured {
                let noise = self.noise(kind, measured);
                self.gates[kind].new = self.correct(measured, kind, &noise, found, &mut ());
            }
        }
    }

    /// Squared residual of position or velocity after all corrections, over its noise.
    fn left(&self, measured: &[Option<Measured>; 2], kind: usize, found: &Errors) -> f64 {
        let Some(measured) = &measured[kind] else { return 0.0 };
        let noise = self.noise(kind, measured);
        let constants = self.covariance.1.map_or([0.0; CONSTANTS], |extra| extra.found);
        let moved = self.rows_of_antenna(kind);
        let of = |i: usize| {
            let by_errors = (0..STATES).map(|k| measured.rows[i][k] * found[k]).sum::<f64>();
            let by_constants = (0..CONSTANTS).map(|k| moved[i][k] * constants[k]).sum::<f64>();
            let left = measured.z[i] - by_errors - by_constants;
            left * left / noise[i]
        };
        (0..3).map(of).sum()
    }

    fn noise(&self, kind: usize, measured: &Measured) -> [f64; 3] {
        let stated = &measured.stated;
        let gate = &self.gates[kind];
        [0, 1, 2].map(|i| gate.noise.variance(i, stated[i] * stated[i], self.params.adapt))
    }

    /// Processes a position or velocity if the gate accepts it.
    fn gate_fix<W: Observer>(
        &mut self,
        kind: usize,
        measured: &Measured,
        found: &mut Errors,
        observer: &mut W,
    ) -> bool {
        let noise = self.noise(kind, measured);
        let before = (self.covariance, *found);
        let new = self.correct(measured, kind, &noise, found, observer);
        match self.gates[kind].test(self.sensors.time, new, self.params.gate) {
            GateDecision::Take => {
                if W::TAKES_FIXES {
                    observer.record_fix(&self.taken_fix(kind, measured, noise));
                }
                return true;
            }
            GateDecision::Reject => {
                (self.covariance, *found) = before;
                if !self.covariance.considers_antenna() {
                    observer.drop_scalars(3);
                }
                self.fixes.rejected_of[kind] += 1;
            }
            GateDecision::Widen => {
                (self.covariance, *found) = before;
                observer.mark_widened();
                self.widen(kind, &measured.z);
                self.correct(measured, kind, &noise, found, &mut ());
                return true;
            }
        }
        false
    }

    fn taken_fix(&self, kind: usize, measured: &Measured, noise: [f64; 3]) -> TakenFix {
        let Measured { z, rows, .. } = *measured;
        let constants = self.rows_of_antenna(kind);
        TakenFix { kind, time: self.sensors.time, z, rows, constants, noise }
    }

    fn correct<W: Observer>(
        &mut self,
        measured: &Measured,
        kind: usize,
        noise: &[f64; 3],
        found: &mut Errors,
        observer: &mut W,
    ) -> [Innovation; 3] {
        let Measured { z, rows, .. } = measured;
        let covariance = &mut self.covariance;
        if covariance.1.is_none() {
            return [0, 1, 2]
                .map(|i| covariance.correct(&rows[i], z[i], noise[i], found, observer));
        }
        let constants = self.rows_of_antenna(kind);
        let covariance = &mut self.covariance;
        [0, 1, 2].map(|i| {
            covariance.correct_with_constants(
                &rows[i],
                &constants[i],
                z[i],
                noise[i],
                found,
                observer,
            )
        })
    }

    /// Derivatives of a position or velocity by the antenna's position.
    #[inline(never)]
    pub(crate) fn rows_of_antenna(&self, kind: usize) -> [Constants; 3] {
        let rate = self.sensors.gyro - self.gyro_bias;
        let moved = match kind {
            0 => -self.motion.attitude,
            _ => -(self.motion.attitude * rate.cross_matrix()),
        };
        core::array::from_fn(|i| {
            let mut row = [0.0; CONSTANTS];
            (0..3).for_each(|j| row[ANTENNA + j] = moved[(i, j)]);
            row
        })
    }

    /// Corrects a wrong filter by the whole difference from the fix.
    #[cold]
    fn widen(&mut self, kind: usize, z: &Vector3<f64>) {
        if kind == 0 {
            self.fixes.moved += 1;
            self.fixes.last_move = [self.sensors.time, z.norm()];
        }
        self.add_error([R, V][kind], z);
        self.add_angles();
    }

    fn add_error(&mut self, first: usize, z: &Vector3<f64>) {
        for i in 0..3 {
            self.covariance.widen(first + i, z[i] * z[i]);
        }
    }

    fn add_angles(&mut self) {
        let [level, heading] = WIDENED_VARIANCES_RAD2;
        for (i, more) in [level, level, heading].into_iter().enumerate() {
            self.covariance.widen(PHI + i, more);
        }
    }

    /// Subtracts the estimated errors from the motion and the biases.
    #[inline(never)]
    pub(crate) fn apply<W: Observer>(&mut self, found: &Errors, observer: &mut W) {
        let mut constants = None;
        if let Some(extra) = &mut self.covariance.1 {
            let found = *constants.insert(core::mem::take(&mut extra.found));
            self.odometer.take_out(&found);
            self.aids.take_out(&found);
            let [x, y, z] = [0, 1, 2].map(|i| found[ANTENNA + i]);
            self.antenna = (self.antenna + Vector3::new(x, y, z)).map(|x| x.within(MAX_LEVER));
        }
        let part = |i: usize| Vector3::new(found[i], found[i + 1], found[i + 2]);
        self.motion.correct(&part(R), &part(V), &part(PHI));
        let within = |b: Vector3<f64>| b.map(|x| x.within(MAX_BIAS));
        self.gyro_bias = within(self.gyro_bias + part(GYRO));
        self.accel_bias = within(self.accel_bias + part(ACCEL));
        if !self.is_somewhere() {
            self.lose(GAP_VARIANCES_RAD2);
            return;
        }
        if part(R).norm_squared() > MAX_EARTH_DISTANCE_M * MAX_EARTH_DISTANCE_M {
            self.motion.settle();
        }
        self.refresh_sigma();
        if let Some(constants) = &constants {
            observer.record_constants(constants);
        }
        observer.record_correction(found, &self.covariance, &self.motion);
    }

    /// A wheel does not move sideways or downwards.
    #[inline(always)]
    pub(crate) fn look_at_wheels<W: Observer>(&mut self, observer: &mut W) {
        let Some(wheels) = self.params.wheels else { return };
        if self.wheels >= WHEELS_INTERVAL_S - 1e-6 && self.navigating {
            self.wheels = 0.0;
            if self.motion.velocity.norm_squared() > MIN_WHEELS_SPEED_M_S * MIN_WHEELS_SPEED_M_S {
                self.roll(&wheels, observer);
            }
        }
    }

    #[inline(never)]
    fn roll<W: Observer>(&mut self, wheels: &Wheels, observer: &mut W) {
        let rate = self.sensors.gyro - self.gyro_bias;
        let velocity = self.motion.attitude.transpose() * self.motion.velocity;
        let rows = self.rows_of_wheels(wheels, &velocity, &rate);
        let noise = wheels.sigma * wheels.sigma;
        let mut found = [0.0; STATES];
        for i in [1, 2] {
            let (h, z) = (&rows.errors[i], rows.speed[i]);
            if self.covariance.1.is_some() {
                let constants = &rows.constants[i];
                self.covariance
                    .correct_with_constants(h, constants, z, noise, &mut found, observer);
            } else {
                self.covariance.correct(h, z, noise, &mut found, observer);
            }
        }
        self.apply(&found, observer);
    }

    /// Corrects for rest in all samples of a step, if the filter's speed allows it.
    #[inline(never)]
    pub(crate) fn stand<W: Observer>(&mut self, sums: &Sums, observer: &mut W) {
        let speed = self.motion.velocity.norm();
        let sigma = (V..PHI).map(|i| self.sigma[i] * self.sigma[i]).sum::<f64>().simd_sqrt();
        if speed >= MAX_REST_SPEED_M_S + 3.0 * sigma {
            return;
        }
        let mut found = [0.0; STATES];
        let z = self.motion.velocity;
        let rows = velocity_rows(&z, &Matrix3::zeros());
        for i in 0..3 {
            let noise = REST_SIGMA_M_S * REST_SIGMA_M_S;
            self.covariance.correct(&rows[i], z[i], noise, &mut found, observer);
        }
        if sums.unknown[0] == 0.0 {
            let earth = self.motion.attitude.transpose() * self.motion.local_earth.earth;
            let z = sums.gyro * (1.0 / sums.samples) - self.gyro_bias - earth;
            for i in 0..3 {
                let mut h = [0.0; 16];
                h[GYRO + i] = 1.0;
                let noise = self.params.gyro_noise[i] / sums.seconds
                    + MIN_REST_RATE_SIGMA_RAD_S * MIN_REST_RATE_SIGMA_RAD_S;
                self.covariance.correct(&h, z[i], noise, &mut found, observer);
            }
        }
        self.apply(&found, observer);
    }
}

fn clamp(z: &Vector3<f64>) -> Vector3<f64> {
    z.map(|x| x.within(MAX_INNOVATION))
}
