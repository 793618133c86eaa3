//! The navigation filter as a stream: samples of the sensors, fixes of the receiver, rest and
//! wheels.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::aids::Aids;
use super::coasting::TakenFix;
use super::covariance::{
    ACCEL, ANTENNA, Constants, ConstantsCovariance, Course, Covariance, Errors, GYRO, Growth,
    Innovation, PHI, STATES, Scalar, Transition, V,
};
use super::earth::{MAX_HEIGHT, MAX_LATITUDE, wrap};
use super::fix::{Fix, Given, Verdict, velocity_rows};
use super::initialise::Before;
use super::innovation_gate::InnovationGate;
use super::motion::{Motion, Step};
use super::odometer::{Odometer, Rolled};
use super::params::{Kind, NavigationParams, Start};
use super::usable;
use crate::error::{Error, require};
use crate::math::Real;

/// Largest sample, rad/s and m/s²; a larger sample is missing.
pub(crate) const MAX_SAMPLE: f64 = 1e4;
/// Longest interval between two samples, s; after a longer interval the filter waits for a fix.
const MAX_SAMPLE_INTERVAL_S: f64 = 1.0;
/// Longest time for which the last sample replaces missing samples, s; then it is unknown.
const MAX_HELD_S: f64 = 0.1;
/// Time without a gyro that is a gap, s: errors of the orientation are no longer small.
pub(crate) const MAX_UNKNOWN_S: f64 = 2.0;
/// Power densities of an unmeasured rate and force, rad²/s and m²/s³.
const UNKNOWN_DENSITIES: [f64; 2] = [1.0, 25.0];
/// Largest age of a fix, s, and largest lead over the sensors, s.
pub(crate) const MAX_FIX_AGE_S: f64 = 1.0;
pub(crate) const MAX_FIX_LEAD_S: f64 = 0.1;
/// Variances of level and heading that a gap adds, rad².
pub(crate) const GAP_VARIANCES_RAD2: [f64; 2] = [1e-2, 0.25];
/// Time without a fix after which the filter coasts, s.
const COASTING_S: f64 = 2.0;
/// Bounds of a known state: velocity, m/s, and sums of variances.
const MAX_VELOCITY: f64 = 1e5;
pub(crate) const MAX_SIZES: [f64; 3] = [1e14, 1e10, 1e3];
/// Largest time, s, with digits for a microsecond.
const MAX_TIME: f64 = 4e9;

/// One sample of the sensors, body axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertial {
    /// Time of the sample, s.
    pub time: f64,
    /// Rate, rad/s, or angle since the previous sample.
    pub gyro: [f64; 3],
    /// Specific force, m/s², or velocity change since the previous sample.
    pub accel: [f64; 3],
    /// True if the body is known to rest: zero velocity and the earth's rate.
    pub rest: bool,
}

/// Status of the filter.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// Waiting for a first fix, or for the next one after a gap.
    #[default]
    Waiting,
    /// Waiting for a heading.
    NoHeading,
    /// Navigating.
    Navigating,
    /// Navigating without fixes.
    Coasting,
    /// Navigating without samples of a sensor.
    Missing,
}

/// All estimates after a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snapshot {
    /// Latitude and longitude, rad, height, m; NaN before the first fix.
    pub position: [f64; 3],
    /// Velocity north, east, down, m/s; NaN before the first fix.
    pub velocity: [f64; 3],
    /// Quaternion from the body's axes to north, east, down, scalar first.
    pub quaternion: [f64; 4],
    /// Bias of the gyro, rad/s.
    pub gyro_bias: [f64; 3],
    /// Bias of the accelerometer, m/s².
    pub accel_bias: [f64; 3],
    /// Standard deviations of position, velocity, orientation and biases at the last step of the
    /// covariance; NaN before the first fix.
    pub sigma: Errors,
    /// Status of the filter.
    pub status: Status,
    /// Bits of the usable outputs, in the order of [`OUTPUTS`](super::OUTPUTS).
    pub usable: u8,
}

/// Records the steps of a filter, for the smoother.
pub trait Observer {
    /// True if it records the measurements of fixes by `record_fix`.
    const TAKES_FIXES: bool = false;
    /// Notes the number of the present sample.
    #[inline(always)]
    fn sample(&mut self, _number: usize) {}
    /// Records the change of a covariance by a step of some seconds, before `record_step`.
    #[inline(always)]
    fn record_growth(&mut self, _transition: &Transition, _growth: &Growth, _seconds: f64) {}
    /// Records a position or velocity that is used, before `record_correction`.
    #[inline(always)]
    fn record_fix(&mut self, _fix: &TakenFix) {}
    /// Records that the present fix ends an outage.
    #[inline(always)]
    fn mark_return(&mut self) {}
    /// Records a step of the covariance, by `transition` to `covariance`.
    fn record_step(&mut self, transition: &Transition, covariance: &Covariance, motion: &Motion);
    /// Records that `found` was subtracted from the motion.
    fn record_correction(&mut self, found: &Errors, covariance: &Covariance, motion: &Motion);
    /// Records the corrections of estimated constants, before `record_correction`.
    #[inline(always)]
    fn record_constants(&mut self, _constants: &Constants) {}
    /// Records a scalar measurement, before `record_correction`. Without scalars the covariances
    /// before and after the correction are used.
    #[inline(always)]
    fn record_scalar(&mut self, _scalar: &Scalar) {}
    /// Removes the last scalars, which were not used after all.
    #[inline(always)]
    fn drop_scalars(&mut self, _scalars: usize) {}
    /// Records that the covariance was widened. The covariance after the correction then does not
    /// follow from scalars alone.
    #[inline(always)]
    fn mark_widened(&mut self) {}
    /// Records a start of the filter, with this covariance.
    fn record_start(&mut self, covariance: &Covariance, motion: &Motion);
}

impl Observer for () {
    #[inline(always)]
    fn record_step(&mut self, _: &Transition, _: &Covariance, _: &Motion) {}
    #[inline(always)]
    fn record_correction(&mut self, _: &Errors, _: &Covariance, _: &Motion) {}
    #[inline(always)]
    fn record_start(&mut self, _: &Covariance, _: &Motion) {}
}

/// The navigation filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NavigationFilter {
    pub(crate) params: NavigationParams,
    pub(crate) start: Start,
    pub(crate) motion: Motion,
    pub(crate) gyro_bias: Vector3<f64>,
    pub(crate) accel_bias: Vector3<f64>,
    pub(crate) covariance: Covariance,
    pub(crate) sigma: Errors,
    pub(crate) gates: [InnovationGate; 2],
    pub(crate) sensors: Sensors,
    pub(crate) sums: Sums,
    pub(crate) before: Option<Before>,
    pub(crate) heading_known: bool,
    pub(crate) navigating: bool,
    /// Time since the start or a gap in which only the gyro has shown the orientation, s.
    pub(crate) alone: f64,
    /// Time since the last wheel correction, s.
    pub(crate) wheels: f64,
    pub(crate) odometer: Odometer,
    /// Vector from the sensor to the antenna, body axes, m.
    pub(crate) antenna: Vector3<f64>,
    /// Time of the last used fix; NaN before the first.
    pub(crate) last_used: f64,
    pub(crate) fixes: FixCounts,
    pub(crate) aids: Aids,
    pub(crate) usable: u8,
}

/// Numbers of fixes by verdict, to date.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FixCounts {
    /// Used fixes, see [`Verdict::Used`].
    pub used: u64,
    /// Rejected fixes, see [`Verdict::Rejected`].
    pub rejected: u64,
    /// Refused fixes, see [`Verdict::Refused`].
    pub refused: u64,
    /// Numbers of positions and velocities rejected by the gate.
    pub rejected_of: [u64; 2],
    /// Number of moves of the filter to a position after repeated rejections.
    pub moved: u64,
    /// Time of the last move, s, and its distance, m; NaN before the first.
    pub last_move: [f64; 2],
}

impl FixCounts {
    fn new() -> Self {
        let (rejected_of, last_move) = ([0; 2], [f64::NAN; 2]);
        Self { used: 0, rejected: 0, refused: 0, rejected_of, moved: 0, last_move }
    }
}

/// The last sample, as rate and force.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sensors {
    /// Time, s; NaN before the first sample.
    pub time: f64,
    pub gyro: Vector3<f64>,
    pub accel: Vector3<f64>,
    /// Times since rate and force were measured, s.
    pub gyro_age: f64,
    pub accel_age: f64,
    pub samples: u64,
}

/// Sums since the last step of the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sums {
    pub seconds: f64,
    pub samples: f64,
    /// Number of samples at rest.
    pub rest_samples: f64,
    pub attitude: Matrix3<f64>,
    pub velocity: Vector3<f64>,
    /// Sum of the rates, with their bias.
    pub gyro: Vector3<f64>,
    /// Sum of squared changes between samples, as angles, rad².
    pub vibration: Vector3<f64>,
    /// Times in which rate and force were unknown, s.
    pub unknown: [f64; 2],
}

impl Sums {
    pub fn new() -> Self {
        Self {
            seconds: 0.0,
            samples: 0.0,
            rest_samples: 0.0,
            attitude: Matrix3::zeros(),
            velocity: Vector3::zeros(),
            gyro: Vector3::zeros(),
            vibration: Vector3::zeros(),
            unknown: [0.0; 2],
        }
    }
}

impl Sensors {
    fn new() -> Self {
        let zero = Vector3::zeros();
        let (gyro_age, accel_age) = (0.0, 0.0);
        Self { time: f64::NAN, gyro: zero, accel: zero, gyro_age, accel_age, samples: 0 }
    }
}

impl NavigationFilter {
    /// A filter before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a parameter is out of range.
    pub fn new(start: Start, params: NavigationParams) -> Result<Self, Error> {
        let (start, params) = (start.validate()?, params.validate()?);
        Ok(Self {
            params,
            start,
            motion: Motion::new(matrix(start.quaternion), start.latitude, 0.0, 0.0),
            gyro_bias: start.gyro_bias.into(),
            accel_bias: start.accel_bias.into(),
            covariance: Self::first_covariance(&start, &params),
            sigma: [f64::NAN; STATES],
            gates: [InnovationGate::new(); 2],
            sensors: Sensors::new(),
            sums: Sums::new(),
            before: None,
            heading_known: start.heading_known,
            navigating: false,
            alone: 0.0,
            wheels: 0.0,
            odometer: Odometer::default(),
            antenna: params.antenna.into(),
            last_used: f64::NAN,
            fixes: FixCounts::new(),
            aids: Aids::new(),
            usable: 0,
        })
    }

    fn first_covariance(start: &Start, params: &NavigationParams) -> Covariance {
        let mut covariance = Covariance::of(&Self::first_variances(start));
        if params.has_antenna_sigma() {
            let known = ConstantsCovariance::NONE.with(ANTENNA, params.antenna_sigma);
            let considers_antenna = params.consider_antenna;
            covariance.1 = Some(ConstantsCovariance { considers_antenna, ..known });
        }
        covariance
    }

    /// Initial variances of orientation and biases; position and velocity are unknown before a fix.
    fn first_variances(start: &Start) -> Errors {
        let mut variances = [0.0; STATES];
        for i in 0..3 {
            let angle = if i < 2 { start.level_sigma } else { start.heading_sigma };
            variances[PHI + i] = angle * angle;
            variances[GYRO + i] = start.gyro_bias_sigma * start.gyro_bias_sigma;
            variances[ACCEL + i] = start.accel_bias_sigma * start.accel_bias_sigma;
        }
        variances
    }

    /// Resets to the state before the first sample.
    pub fn reset(&mut self) {
        if let Ok(new) = Self::new(self.start, self.params) {
            *self = new;
        }
    }

    /// Processes one sample of the sensors. A sample that is not finite or too large is missing:
    /// the previous sample replaces it for a tenth of a second, then it is unknown.
    ///
    /// # Errors
    /// [`Error::Parameter`] if its time is not later than the previous sample's time; the filter is
    /// then unchanged.
    #[inline]
    pub fn update(&mut self, sample: &Inertial) -> Result<(), Error> {
        self.update_before(sample, &mut ())
    }

    /// Processes one sample, with an observer.
    ///
    /// # Errors
    /// As in [`update`](Self::update).
    #[inline]
    pub fn update_before<W: Observer>(
        &mut self,
        sample: &Inertial,
        observer: &mut W,
    ) -> Result<(), Error> {
        let dt = sample.time - self.sensors.time;
        if !(dt > 0.0 && dt <= MAX_SAMPLE_INTERVAL_S) || sample.time.abs() > MAX_TIME {
            return self.begin(sample);
        }
        let step = self.step(sample, dt);
        if !self.navigating {
            if sample.time > self.start.time {
                self.turn(&step);
            }
            self.sums = Sums::new();
            return Ok(());
        }
        self.motion.advance(&step);
        self.accumulate(dt, sample.rest);
        if self.sums.seconds >= self.params.covariance_step - 0.25 * dt {
            self.propagate(observer);
            self.look_at_wheels(observer);
        }
        Ok(())
    }

    /// Processes the first sample, or the first sample after a gap.
    #[cold]
    fn begin(&mut self, sample: &Inertial) -> Result<(), Error> {
        let before = self.sensors.time;
        require(sample.time.abs() <= MAX_TIME, "t", "a time in seconds", sample.time)?;
        require(
            before.is_nan() || sample.time > before,
            "t",
            "later than that of the sample before",
            sample.time,
        )?;
        if !before.is_nan() {
            self.lose(GAP_VARIANCES_RAD2);
        }
        // The first sample of increments covers an unknown time.
        let rates = self.params.kind == Kind::Rate;
        let zero = Vector3::zeros();
        let known = |v: [f64; 3]| (rates && is_known(&v.into())).then_some(v.into());
        let samples = self.sensors.samples + 1;
        let gyro: Option<Vector3<f64>> = known(sample.gyro);
        let accel = known(sample.accel);
        let age = |known: bool| if known { 0.0 } else { MAX_HELD_S };
        self.sensors = Sensors {
            time: sample.time,
            gyro: gyro.unwrap_or(zero),
            accel: accel.unwrap_or(zero),
            gyro_age: age(gyro.is_some()),
            accel_age: age(accel.is_some()),
            samples,
        };
        Ok(())
    }

    /// Measurement of the sensors since the previous sample, without biases.
    #[inline(always)]
    fn step(&mut self, sample: &Inertial, dt: f64) -> Step {
        let (gyro, accel) = (self.sensors.gyro, self.sensors.accel);
        let (now, force) = self.measure(sample, dt);
        if self.params.gyro_vibration > 0.0 {
            let change = (now - gyro) * dt;
            self.sums.vibration += change.component_mul(&change);
        }
        // Increments are already means.
        let (rate, mean) = match self.params.kind {
            Kind::Rate => ((gyro + now) * (0.5 * dt), (accel + force) * (0.5 * dt)),
            Kind::Increment => (now * dt, force * dt),
        };
        let twelfth = dt * dt * (1.0 / 12.0);
        let turn = rate + gyro.cross(&now) * twelfth - self.gyro_bias * dt;
        let sculling = (gyro.cross(&force) + accel.cross(&now)) * twelfth;
        let gain = mean + sculling + rate.cross(&mean) * 0.5 - self.accel_bias * dt;
        let sensors = &mut self.sensors;
        (sensors.gyro, sensors.accel, sensors.time) = (now, force, sample.time);
        sensors.samples += 1;
        Step { turn, gain, dt }
    }

    /// Rate and force of a sample; a missing value is replaced by the last value.
    #[inline(always)]
    fn measure(&mut self, sample: &Inertial, dt: f64) -> (Vector3<f64>, Vector3<f64>) {
        let per = if self.params.kind == Kind::Rate { 1.0 } else { 1.0 / dt };
        let (gyro, accel) = (Vector3::from(sample.gyro) * per, Vector3::from(sample.accel) * per);
        if !(is_known(&gyro) && is_known(&accel)) {
            return self.hold(gyro, accel, dt);
        }
        (self.sensors.gyro_age, self.sensors.accel_age) = (0.0, 0.0);
        (gyro, accel)
    }

    #[cold]
    fn hold(
        &mut self,
        gyro: Vector3<f64>,
        accel: Vector3<f64>,
        dt: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let level = self.motion.attitude.transpose().column(2) * self.motion.local_earth.gravity;
        // Without a better estimate, rotation and motion continue unchanged.
        let unknown = [self.gyro_bias, (self.accel_bias - level).map(|x| x.within(MAX_SAMPLE))];
        let mut found = [self.sensors.gyro, self.sensors.accel];
        let ages = [&mut self.sensors.gyro_age, &mut self.sensors.accel_age];
        for (i, (age, given)) in ages.into_iter().zip([gyro, accel]).enumerate() {
            if is_known(&given) {
                (found[i], *age) = (given, 0.0);
                continue;
            }
            *age = (*age + dt).min(MAX_TIME);
            if *age > MAX_HELD_S {
                found[i] = unknown[i];
                self.sums.unknown[i] += dt;
            }
        }
        (found[0], found[1])
    }

    /// Propagates the orientation while the position is unknown.
    #[inline(never)]
    fn turn(&mut self, step: &Step) {
        self.motion.turn(step, &(self.motion.local_earth.earth * step.dt));
        self.motion.settle();
        self.alone = (self.alone + step.dt).min(MAX_TIME);
    }

    #[inline(always)]
    fn accumulate(&mut self, dt: f64, rest: bool) {
        let sums = &mut self.sums;
        sums.seconds += dt;
        sums.samples += 1.0;
        sums.rest_samples += f64::from(u8::from(rest));
        sums.attitude += self.motion.attitude;
        sums.velocity += self.motion.velocity;
        sums.gyro += self.sensors.gyro;
    }

    /// Propagates the covariance to the last sample.
    #[inline(always)]
    pub(crate) fn propagate<W: Observer>(&mut self, observer: &mut W) {
        self.propagate_with([0.0; 2], observer);
    }

    /// Propagates the covariance and adds these variances to orientation and velocity.
    #[inline(never)]
    pub(crate) fn propagate_with<W: Observer>(&mut self, extra: [f64; 2], observer: &mut W) {
        let sums = self.sums;
        let Sums { seconds, samples, attitude, velocity, vibration, unknown, .. } = sums;
        if samples == 0.0 {
            return;
        }
        self.motion.settle();
        let (earth, transport) = self.motion.frame();
        let course = Course {
            seconds,
            attitude: attitude * (1.0 / samples),
            velocity: velocity * (1.0 / samples),
            earth,
            transport,
            gravity: self.motion.local_earth.gravity,
        };
        let transition = Transition::over(&course);
        let params = &self.params;
        let mut gyro_noise = Vector3::from(params.gyro_noise);
        if params.gyro_vibration > 0.0 {
            // A difference has the noise of two samples.
            let share = params.gyro_vibration * params.gyro_vibration;
            gyro_noise += vibration * (0.5 * share / seconds);
        }
        let mut growth = Growth::over_half(
            &course,
            [&gyro_noise, &params.accel_noise.into()],
            [&params.gyro_walk.into(), &params.accel_walk.into()],
        );
        let more = [0, 1].map(|i| UNKNOWN_DENSITIES[i] * unknown[i] + extra[i]);
        if more != [0.0; 2] {
            growth.add_unknown(&course, 0.5 * more[0], 0.5 * more[1]);
        }
        self.covariance.propagate(&transition, &growth);
        if self.aids.have_walked() {
            self.walk_constants();
        }
        observer.record_growth(&transition, &growth, seconds);
        self.sums = Sums::new();
        self.wheels = (self.wheels + seconds).min(MAX_TIME);
        if !self.is_somewhere() {
            self.lose(GAP_VARIANCES_RAD2);
            return;
        }
        self.refresh_sigma();
        observer.record_step(&transition, &self.covariance, &self.motion);
        if sums.rest_samples == samples {
            self.stand(&sums, observer);
        }
        if self.odometer.sums.count > 0.0 && self.navigating {
            self.rolled(observer);
        }
    }

    /// True if the position is known.
    pub(crate) fn is_somewhere(&self) -> bool {
        let sizes = self.covariance.sizes();
        let known = sizes.iter().zip(MAX_SIZES).all(|(size, most)| *size < most);
        known
            && self.sensors.gyro_age <= MAX_UNKNOWN_S
            && self.motion.velocity.norm_squared() < MAX_VELOCITY * MAX_VELOCITY
            && self.motion.height.abs() < MAX_HEIGHT
            && self.motion.latitude.abs() < MAX_LATITUDE
    }

    /// Loses position and velocity, and most of the orientation; keeps the biases.
    #[cold]
    pub(crate) fn lose(&mut self, [level, heading]: [f64; 2]) {
        let mut variances = [0.0; STATES];
        for i in PHI..STATES {
            variances[i] = self.covariance.at(i, i);
        }
        if self.navigating {
            self.motion.velocity = Vector3::zeros();
        }
        for (i, more) in [level, level, heading].into_iter().enumerate() {
            variances[PHI + i] = (variances[PHI + i] + more).min(10.0);
        }
        if self.navigating && !self.is_on_earth() {
            let motion = Motion::new(self.motion.attitude, self.start.latitude, 0.0, 0.0);
            self.motion = motion;
        }
        self.covariance = self.covariance.with_variances(&variances);
        self.odometer.sums = Rolled::default();
        self.sigma = [f64::NAN; STATES];
        self.aids.restart();
        self.usable = 0;
        self.navigating = false;
        self.heading_known = self.start.heading_known && !self.start.course;
        self.before = None;
        self.alone = 0.0;
        self.sums = Sums::new();
    }

    fn is_on_earth(&self) -> bool {
        let motion = &self.motion;
        motion.height.abs() < MAX_HEIGHT && motion.latitude.abs() < MAX_LATITUDE
    }

    /// Processes a fix.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a required standard deviation is not a positive number.
    pub fn update_gnss(&mut self, fix: &Fix) -> Result<Verdict, Error> {
        self.update_gnss_before(fix, &mut ())
    }

    /// Processes a fix, with an observer.
    ///
    /// # Errors
    /// As in [`update_gnss`](Self::update_gnss).
    pub fn update_gnss_before<W: Observer>(
        &mut self,
        fix: &Fix,
        observer: &mut W,
    ) -> Result<Verdict, Error> {
        let given = Given::validate(fix)?;
        let age = self.sensors.time - fix.time;
        let verdict = match given {
            Some(given)
                if given.time >= self.start.time
                    && (-MAX_FIX_LEAD_S..=MAX_FIX_AGE_S).contains(&age) =>
            {
                self.take(&given, age, observer)
            }
            _ => Verdict::Refused,
        };
        match verdict {
            Verdict::Used => {
                self.fixes.used += 1;
                self.last_used = self.sensors.time;
            }
            Verdict::Rejected => self.fixes.rejected += 1,
            Verdict::Refused => self.fixes.refused += 1,
        }
        Ok(verdict)
    }

    /// Computes the standard deviations; the velocity's error is converted to true axes.
    pub(crate) fn refresh_sigma(&mut self) {
        for i in 0..STATES {
            self.sigma[i] = self.covariance.at(i, i);
        }
        let v = &self.motion.velocity;
        // v̂ - v = δv + v×φ.
        for (i, h) in velocity_rows(v, &Matrix3::zeros()).iter().enumerate() {
            self.sigma[V + i] = self.covariance.variance(h, [V + i, PHI, PHI + 1, PHI + 2]);
        }
        self.usable = usable::judge(self.usable, &self.sigma, &self.params.limits);
        for s in &mut self.sigma {
            *s = s.at_least(0.0).simd_sqrt();
        }
    }

    /// Status of the filter.
    pub fn status(&self) -> Status {
        let sensors = &self.sensors;
        if !self.navigating {
            return if self.heading_known { Status::Waiting } else { Status::NoHeading };
        }
        if sensors.gyro_age > MAX_HELD_S || sensors.accel_age > MAX_HELD_S {
            return Status::Missing;
        }
        let coasts = sensors.time - self.last_used > COASTING_S;
        if coasts { Status::Coasting } else { Status::Navigating }
    }

    /// All estimates after the last sample.
    #[inline]
    pub fn snapshot(&self) -> Snapshot {
        let Motion { attitude, velocity, latitude, longitude, height, .. } = &self.motion;
        let known = |x: [f64; 3]| if self.navigating { x } else { [f64::NAN; 3] };
        Snapshot {
            position: known([*latitude, wrap(*longitude), *height]),
            velocity: known((*velocity).into()),
            quaternion: quaternion(attitude),
            gyro_bias: self.gyro_bias.into(),
            accel_bias: self.accel_bias.into(),
            sigma: self.sigma,
            status: self.status(),
            usable: self.usable,
        }
    }

    /// Parameters of the filter.
    pub fn params(&self) -> &NavigationParams {
        &self.params
    }

    /// State before the first sample.
    pub fn start(&self) -> &Start {
        &self.start
    }

    /// Covariance of the errors at its last step.
    pub fn covariance(&self) -> &Covariance {
        &self.covariance
    }

    /// Time of the last sample, s; NaN before the first.
    pub fn time(&self) -> f64 {
        self.sensors.time
    }

    /// Samples to date, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.sensors.samples
    }

    /// Numbers of fixes by verdict, to date.
    pub fn fixes(&self) -> &FixCounts {
        &self.fixes
    }

    /// Normalised innovations squared of the last position and velocity, 3 on average; NaN before
    /// the first fix.
    pub fn nis(&self) -> [f64; 2] {
        [self.gates[0].nis(), self.gates[1].nis()]
    }

    /// Innovations of the last position and velocity, north, east, down, each after the corrections
    /// by the earlier ones, and their standard deviations. NaN before the first fix.
    pub fn innovations(&self) -> [[f64; 6]; 2] {
        let all = self.gates.map(|gate| gate.new);
        let of = |of: fn(&Innovation) -> f64| core::array::from_fn(|i| of(&all[i / 3][i % 3]));
        [of(|new| new.value), of(|new| new.variance.simd_sqrt())]
    }

    /// Standard deviations of position and velocity learned from the innovations; NaN before they
    /// are known.
    pub fn learned_noise(&self) -> [[f64; 3]; 2] {
        self.gates.map(|gate| gate.noise.standard_deviations())
    }
}

#[inline(always)]
pub(crate) fn is_known(v: &Vector3<f64>) -> bool {
    v.x.abs() <= MAX_SAMPLE && v.y.abs() <= MAX_SAMPLE && v.z.abs() <= MAX_SAMPLE
}

/// Rotation matrix of a unit quaternion, scalar first.
fn matrix([w, x, y, z]: [f64; 4]) -> Matrix3<f64> {
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    *rotation.to_rotation_matrix().matrix()
}

/// Quaternion of a rotation matrix, scalar first.
#[inline(always)]
pub(crate) fn quaternion(m: &Matrix3<f64>) -> [f64; 4] {
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(*m);
    let mut q = UnitQuaternion::from_rotation_matrix(&rotation);
    // Between two steps of the covariance the matrix is slightly stretched.
    q.renormalize();
    [q.w, q.i, q.j, q.k]
}
