//! The default filter: a Kalman filter that also learns the gyro's scale and misalignment from
//! gravity. The magnetometer corrects only the heading.
//!
//! Each sample is integrated. Ticks of a tenth of a second correct the errors. The force is
//! integrated to a velocity in a frame that the gyro holds level, and this velocity must stay near
//! zero. If it does not, the tilt is wrong, or the bias and matrix of the gyro that have turned it.
//! The frame follows D. Laidig and T. Seel (VQF, *Information Fusion* 91, 2023); the gyro errors as
//! states are an addition.

mod deviation;
mod drift;
mod errors;
mod estimator;
mod first;
mod heading;
mod iron;
mod lost;
mod magnet;
mod options;
mod recovery;
mod rest;
#[cfg(feature = "std")]
mod smooth;
mod start;
mod straight;
mod strapdown;
mod trust;
mod undo;
mod unit;

use nalgebra::{ComplexField, Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use self::deviation::Deviation;
use self::drift::HeadingDrift;
use self::errors::{BIAS, Errors, Found, MATRIX, States, Transition, VELOCITY};
use self::first::FirstRest;
use self::heading::FIELD_WALK;
pub use self::heading::HeadingCorrection;
use self::iron::Iron;
use self::lost::Lost;
use self::magnet::{Held, Magnet, Spikes};
pub use self::options::AutoOptions;
use self::recovery::{Recovery, Wrong};
use self::rest::Rest;
#[cfg(feature = "std")]
pub use self::smooth::{Around, Smoothed};
use self::start::{MAX_SPEED_CHANGE_M_S, Start, TILT_SIGMA_RAD};
use self::straight::Straight;
use self::strapdown::{Strapdown, Sums};
use self::trust::{Accelerations, Lasting, ScaleNoise};
use self::unit::UnitWatch;
use super::GRAVITY;
use super::events::Events;
use super::sample::MIN_FIELD;
use crate::error::Error;

/// Duration of a tick, s.
const TICK: f64 = 0.1;
const DEGREE: f64 = core::f64::consts::PI / 180.0;
/// Noise of the angle, rad/√s, and error of accelerometer and mounting per rotation, rad/√rad.
const ANGLE_NOISE: f64 = 0.01 * DEGREE;
const TURN_NOISE: f64 = 0.003;
/// Random walk of the bias, rad/s/√s; limit of its variance's growth; and initial standard
/// deviation, rad/s. Motion reveals a large bias, and an ordinary bias is not lost in motion.
const BIAS_WALK: f64 = 0.01 * DEGREE;
const MAX_FOLLOWED_BIAS_RAD_S: f64 = 0.5 * DEGREE;
const BIAS_SIGMA: f64 = DEGREE;
/// Default of the gyro's largest bias, rad/s.
const BIAS_LIMIT: f64 = 10.0 * DEGREE;
/// Bias error to assume with a wrong tilt, rad/s. A larger value finds a jump sooner, and mistakes
/// a car's long accelerations for a jump.
const RECOVERY_BIAS_SIGMA_RAD_S: f64 = 0.15 * DEGREE;
/// Rate about level axes at which gravity shows the whole bias, rad/s.
const LEANING_RATE_RAD_S: f64 = 20.0 * DEGREE;
/// Random walk of the matrix elements, 1/√s, and their initial standard deviations on the diagonal
/// and off it.
const MATRIX_WALK: f64 = 1e-5;
const MATRIX_SIGMAS: [f64; 2] = [0.008, 0.005];
/// Variance of an unknown tilt, rad²: half of it about each level axis.
const MAX_TILT_VARIANCE_RAD2: f64 = 1.0;
/// Bias of a consumer accelerometer, m/s².
const ACCEL_BIAS: f64 = 0.05;
/// Noise of the velocity, m/s/√s.
const VELOCITY_NOISE: f64 = 0.01;
/// Velocity at rest, m/s √s.
const REST_VELOCITY: f64 = 1e-2;
/// Standard deviation of values that are not learned, rad/s and 1.
#[cfg(feature = "std")]
const FIXED_SIGMA: f64 = 1e-7;
/// Number of ticks at rest for the mean of gravity, and number after which the mean is known.
const GRAVITY_TICKS: f64 = 100.0;
const MIN_GRAVITY_TICKS: f64 = 20.0;
/// Initial variances of the heading, rad²: before a magnetometer's first field, and without a
/// magnetometer.
const FREE_HEADING_VARIANCE_RAD2: f64 = 10.0;
const CHOSEN_HEADING_VARIANCE_RAD2: f64 = 1e-6;
/// Largest plausible bias, rad/s, and largest plausible element of the matrix error.
const MAX_BIAS: f64 = 10.0;
const MAX_MATRIX: f64 = 0.2;
const MAX_VELOCITY: f64 = 1e4;
/// Longest time with one bias in the heading's error, s.
const MAX_BIAS_TIME_S: f64 = 1e9;

/// The filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Auto {
    options: AutoOptions,
    /// True if bias and matrix are not learned, because the rates are already corrected.
    knowing: bool,
    strapdown: Strapdown,
    sums: Sums,
    errors: Errors,
    bias: Vector3<f64>,
    /// I + S.
    matrix: Matrix3<f64>,
    /// Velocity in the frame of the orientation, m/s.
    velocity: [f64; 2],
    /// Cosine and sine of half the angle between that frame and the earth.
    turn: [f64; 2],
    start: Start,
    rest: Rest,
    accelerations: Accelerations,
    lasting: Lasting,
    scale_noise: ScaleNoise,
    spikes: Spikes,
    straight: Straight,
    recovery: Recovery,
    magnet: Magnet,
    held: Held,
    drift: HeadingDrift,
    iron: Iron,
    deviation: Deviation,
    lost: Lost,
    first: FirstRest,
    unit: UnitWatch,
    /// Derivative of the heading by the bias, s: its rotation per rad/s since power-on.
    by_bias: Vector3<f64>,
    /// Seconds since the field was last used.
    field_age: f64,
    /// Mean size of the force at rest, and its number of ticks.
    gravity: [f64; 2],
    at_rest: bool,
    /// True if the body rests or turns steadily; the two cannot be distinguished.
    unclear: bool,
    /// Mean square of the rate in the last tick, (rad/s)².
    speed_squared: f64,
    /// Events at the last sample. They are not part of the state: the next sample clears them.
    #[serde(skip)]
    events: Events,
}

/// Up in the sensor's axes, the hidden share of the bias along it, and the variances of this share
/// and of the heading before a correction.
struct Hidden {
    up: Vector3<f64>,
    share: f64,
    bias: f64,
    heading: f64,
}

/// Result of a tick.
#[derive(Debug, Clone, Copy)]
pub struct Ticked {
    /// Duration of the tick, s.
    pub seconds: f64,
    /// True if the field was constant while the body turned: the magnetometer is stuck.
    pub held: bool,
    /// Correction of the heading by the tick's field; `None` if it was not used.
    pub heading_correction: Option<HeadingCorrection>,
}

impl Auto {
    /// A filter before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if an option is out of range.
    pub fn new(options: AutoOptions) -> Result<Self, Error> {
        Ok(Self::with(options.validate()?))
    }

    fn with(options: AutoOptions) -> Self {
        let heading =
            if options.mag { FREE_HEADING_VARIANCE_RAD2 } else { CHOSEN_HEADING_VARIANCE_RAD2 };
        Self {
            options,
            knowing: false,
            strapdown: Strapdown::default(),
            sums: Sums::new(TICK),
            errors: Errors::new(
                &start_variances(&options.bias_sigma, &options.matrix_sigma),
                heading,
            ),
            bias: Vector3::from(options.bias),
            matrix: Matrix3::from(options.matrix).transpose(),
            velocity: [0.0; 2],
            turn: [1.0, 0.0],
            start: Start::default(),
            rest: Rest::default(),
            accelerations: Accelerations::default(),
            lasting: Lasting::default(),
            scale_noise: ScaleNoise::default(),
            spikes: Spikes::default(),
            straight: Straight::default(),
            recovery: Recovery::default(),
            magnet: Magnet::default(),
            held: Held::default(),
            drift: HeadingDrift::default(),
            iron: Iron::default(),
            deviation: Deviation::new(heading),
            lost: Lost::default(),
            first: FirstRest::default(),
            unit: UnitWatch::default(),
            by_bias: Vector3::zeros(),
            field_age: 0.0,
            gravity: [0.0; 2],
            at_rest: false,
            unclear: false,
            speed_squared: 0.0,
            events: Events::default(),
        }
    }

    /// A filter for rates without bias, from a gyro without errors.
    #[cfg(feature = "std")]
    fn knowing(options: AutoOptions) -> Self {
        let usual = AutoOptions { mag: options.mag, ..AutoOptions::default() };
        let sure = AutoOptions {
            bias_sigma: [FIXED_SIGMA; 3],
            matrix_sigma: [[FIXED_SIGMA; 3]; 3],
            ..usual
        };
        Self { knowing: true, options: usual, ..Self::with(sure) }
    }

    /// Options of the filter.
    pub fn options(&self) -> &AutoOptions {
        &self.options
    }

    /// In the first second every sample levels the frame, and the first field gives north.
    #[cold]
    #[inline(never)]
    fn begin(&mut self, accel: &Vector3<f64>, mag: Option<&Vector3<f64>>, known: bool) {
        if let Some(up) = self.start.add(&(self.strapdown.rotation * accel)) {
            self.strapdown.set((up * self.strapdown.orientation).normalize());
        }
        if let Some(mag) = mag
            && self.options.mag
            && self.start.is_first_field(known)
        {
            self.turn_heading(self.east_of_north(&(self.strapdown.rotation * mag)));
        }
    }

    #[inline(always)]
    fn tick(&mut self) -> Ticked {
        let sums = self.sums;
        self.sums = Sums::new(TICK);
        let news = self.has_news(&sums);
        if !self.unit.is_right() {
            self.watch_unit(&sums, news);
        }
        if self.errors.variance(0) > TILT_SIGMA_RAD * TILT_SIGMA_RAD && sums.forces == 0.0 {
            // The gap is so long that the tilt is unknown: the next force gives it.
            self.start.again();
        }
        let state = self.rest(&sums, news);
        self.speed_squared = sums.spread(&self.bias, &Vector3::zeros()).0.max(0.0);
        let rate = ComplexField::sqrt(self.speed_squared);
        let moving = self.predict(&sums, rate);
        if !self.options.mag {
            let up = self.strapdown.rotation.row(2).transpose();
            self.first.observe(self.rest.is_quiet(), up.dot(&self.bias), sums.elapsed);
        }
        let starting = self.start.observe(sums.elapsed, &mut self.errors);
        if starting || !moving {
            self.velocity = [0.0; 2];
        }
        self.correct(&sums, state, moving && !starting);
        let heading_correction =
            if self.options.mag { self.see_field(&sums, rate, news) } else { None };
        self.strapdown.settle();
        let held = self.options.mag && sums.fields > 0.0 && !news;
        Ticked { seconds: sums.elapsed, held, heading_correction }
    }

    #[inline(never)]
    fn watch_unit(&mut self, sums: &Sums, news: bool) {
        if sums.unknown > 0.0 || sums.forces == 0.0 {
            return self.unit.interrupt();
        }
        let (rate, force) = (sums.gyro / sums.samples, sums.accel / sums.forces);
        // Iron may change the field's size, but its direction rotates with the body.
        let field = news.then(|| self.strapdown.rotation.tr_mul(&sums.field));
        let direction = field.and_then(|field| field.try_normalize(MIN_FIELD));
        self.unit.observe(&rate, &force, direction.as_ref(), sums.elapsed);
    }

    /// True if a tick has a field of a magnetometer that is not stuck.
    #[inline(always)]
    fn has_news(&mut self, sums: &Sums) -> bool {
        if !self.options.mag || sums.fields == 0.0 {
            return false;
        }
        let turned = (sums.gyro / sums.samples - self.bias) * sums.elapsed;
        self.held.observe(self.spikes.last(), &turned, sums.elapsed)
    }

    /// Propagates velocity and errors through a tick; false if the tick has no known force.
    #[inline(always)]
    fn predict(&mut self, sums: &Sums, rate: f64) -> bool {
        let span = sums.elapsed;
        let force = sums.force / sums.forces.max(1.0);
        let scale = self.scale_noise.variance() * rate * rate;
        let unknown = self.lost.take(self.speed_squared, span, sums.unknown);
        let angle = span * (square(ANGLE_NOISE) + scale + square(TURN_NOISE) * rate) + unknown;
        let walk = if self.options.mag { span * square(FIELD_WALK) } else { 0.0 };
        let mut drivers = [sums.drivers(0), sums.drivers(1), sums.drivers(2)];
        if self.drift.is_active() {
            // The heading follows bias and drift together, and gives no information on the bias
            // alone.
            drivers[2].fixed_rows_mut::<3>(0).fill(0.0);
        }
        let of_bias = drivers[2].fixed_rows::<3>(0);
        self.by_bias = (self.by_bias + of_bias).map(|x| x.clamp(-MAX_BIAS_TIME_S, MAX_BIAS_TIME_S));
        let learns = if self.knowing { 0.0 } else { span };
        let shrunk = self.errors.predict(&Transition {
            drivers,
            lift: span * force.z,
            tilt_noise: angle,
            heading_noise: angle + walk,
            bias_noise: learns * square(BIAS_WALK),
            matrix_noise: learns * square(MATRIX_WALK),
            velocity_noise: span * (square(VELOCITY_NOISE) + self.lasting.walk()),
            bias_cap: square(MAX_FOLLOWED_BIAS_RAD_S),
            matrix_caps: MATRIX_SIGMAS.map(|sigma| sigma * sigma),
        });
        self.drift.shrink(shrunk);
        let known = sums.forces > 0.0;
        if known {
            self.velocity[0] += span * force.x;
            self.velocity[1] += span * force.y;
        } else {
            self.errors
                .restart(&[VELOCITY, VELOCITY + 1], MAX_SPEED_CHANGE_M_S * MAX_SPEED_CHANGE_M_S);
        }
        known
    }

    /// Corrects by a velocity near zero. At rest it is zero, and the rate is the bias.
    #[inline(always)]
    fn correct(&mut self, sums: &Sums, level: Option<(Vector3<f64>, f64)>, moving: bool) {
        let mut found = Found { states: States::zeros(), heading: 0.0 };
        let persistence = if moving { self.correct_velocity(sums, &mut found) } else { None };
        if let Some((level, noise)) = level {
            self.errors.correct(BIAS, (level - self.bias).into(), noise, &mut found);
        }
        if self.at_rest {
            self.weigh(sums);
        } else if moving && !self.knowing && !self.rest.tells() {
            self.go_straight(sums, &mut found);
        }
        self.apply(&found);
        if moving {
            self.recover(sums, persistence);
        }
    }

    /// Returns the persistence of tilt corrections in one direction, relative to its expectation.
    #[inline(always)]
    fn correct_velocity(&mut self, sums: &Sums, found: &mut Found) -> Option<f64> {
        let (span, velocity) = (sums.elapsed, self.velocity);
        let noise = if self.at_rest {
            self.lasting = Lasting::of_rest();
            square(REST_VELOCITY) / span
        } else {
            self.lasting.observe(&velocity, &self.strapdown.rotation, span);
            let variance = self.accelerations.observe(&velocity, &self.lasting, span);
            self.recovery.doubt() * variance / span
        };
        let expected = self.expected(noise);
        let shown = self.at_rest || self.knowing || self.rest.has_evidence();
        let hidden = if shown { None } else { self.hidden(sums) };
        self.errors.correct(VELOCITY, velocity.map(|x| -x), noise, found);
        if let Some(hidden) = &hidden {
            self.give_back(hidden, found);
        }
        if self.at_rest {
            return None;
        }
        let tilt = [found.states[0], found.states[1]];
        Some(self.scale_noise.observe(&tilt, expected, self.speed_squared, span))
    }

    /// The part of the bias along the vertical of a level body: hidden from gravity while no rest
    /// has shown it.
    #[inline(always)]
    fn hidden(&self, sums: &Sums) -> Option<Hidden> {
        let up = self.strapdown.rotation.row(2).transpose();
        let rate = sums.gyro * (1.0 / sums.samples) - self.bias;
        let along = up.dot(&rate);
        let leaning = (rate.norm_squared() - along * along).max(0.0);
        if leaning >= square(LEANING_RATE_RAD_S) {
            return None;
        }
        let (bias, heading) = (self.errors.bias_along(&up), self.errors.heading());
        Some(Hidden { up, share: 1.0 - leaning / square(LEANING_RATE_RAD_S), bias, heading })
    }

    /// Reverses corrections that came from the body's accelerations.
    #[inline(never)]
    fn give_back(&mut self, hidden: &Hidden, found: &mut Found) {
        let Hidden { up, share, bias, heading } = hidden;
        let mut states = found.states.fixed_rows_mut::<3>(BIAS);
        states -= up * (share * up.dot(&states));
        found.heading *= 1.0 - share;
        self.errors.widen_bias_along(up, share * (bias - self.errors.bias_along(up)));
        self.errors.widen_heading(share * (heading - self.errors.heading()));
    }

    /// Motion in a straight line shows a bias that no rest has shown.
    #[inline(always)]
    fn go_straight(&mut self, sums: &Sums, found: &mut Found) {
        if sums.unknown > 0.0 {
            return self.straight.interrupt();
        }
        let up = self.up();
        let (rate, span) = (up.dot(&sums.gyro) / sums.samples, sums.elapsed);
        let (given, most) = (up.dot(&Vector3::from(self.options.bias)), self.options.bias_limit);
        if let Some(noise) = self.straight.observe(rate, given, most, span) {
            self.errors.correct_bias_along(&up, rate - up.dot(&self.bias), noise, found);
        }
    }

    /// Detects a tilt that is wrong although its variance is small.
    #[inline(always)]
    fn recover(&mut self, sums: &Sums, persistence: Option<f64>) {
        let (force, felt) = (sums.force / sums.forces, sums.accel / sums.forces);
        let known = self.known_gravity();
        self.recovery.observe(&force, &felt, self.speed_squared, known, sums.elapsed);
        let variance = self.errors.variance(0) + self.errors.variance(1);
        match self.recovery.test(persistence, variance, known.unwrap_or(GRAVITY)) {
            None => {}
            Some(Wrong::Fallen) => {
                self.events.add(Events::FALL);
                self.start.again();
            }
            Some(Wrong::Tilted(variance)) => {
                self.events.add(Events::KNOCK);
                self.errors.restart(
                    &[VELOCITY, VELOCITY + 1],
                    MAX_SPEED_CHANGE_M_S * MAX_SPEED_CHANGE_M_S,
                );
                self.errors.widen_tilt(variance);
                if !self.knowing {
                    let up = self.up();
                    self.errors.widen_level_bias(square(RECOVERY_BIAS_SIGMA_RAD_S), &up);
                }
                self.velocity = [0.0; 2];
                self.accelerations.forget();
                self.scale_noise.forget();
            }
        }
    }

    /// Variance of the tilt's correction by the two components of the velocity; it is the same for
    /// any level axes.
    fn expected(&self, noise: f64) -> f64 {
        let p = self.errors.covariance();
        let variance = |j: usize| p[(VELOCITY + j, VELOCITY + j)] + noise;
        let (one, other, both) = (variance(0), variance(1), p[(VELOCITY, VELOCITY + 1)]);
        let of_tilt = |i: usize| {
            let (x, y) = (p[(i, VELOCITY)], p[(i, VELOCITY + 1)]);
            x * x * other - 2.0 * x * y * both + y * y * one
        };
        ((of_tilt(0) + of_tilt(1)) / (one * other - both * both)).max(0.0)
    }

    #[inline(always)]
    fn apply(&mut self, found: &Found) {
        let states = &found.states;
        self.strapdown.correct(&Vector3::new(states[0], states[1], 0.0));
        if self.options.mag {
            self.iron.learned(self.up().dot(&states.fixed_rows::<3>(BIAS)));
        }
        for i in 0..3 {
            self.bias[i] = (self.bias[i] + states[BIAS + i]).clamp(-MAX_BIAS, MAX_BIAS);
            for j in 0..3 {
                let usual = if i == j { 1.0 } else { 0.0 };
                let element = self.matrix[(i, j)] + states[MATRIX + 3 * i + j] - usual;
                self.matrix[(i, j)] = usual + element.clamp(-MAX_MATRIX, MAX_MATRIX);
            }
        }
        for j in 0..2 {
            let velocity = self.velocity[j] + states[VELOCITY + j];
            self.velocity[j] = velocity.clamp(-MAX_VELOCITY, MAX_VELOCITY);
        }
        self.turn_heading(found.heading);
    }

    /// Variance of the angle between the true and the estimated vertical, rad². Corrections do not
    /// show the bias of an accelerometer.
    fn tilt_variance(&self) -> f64 {
        let own = (self.errors.variance(0) + self.errors.variance(1)).max(0.0);
        let doubt = self.accelerations.doubt(&self.lasting);
        (doubt * own).min(MAX_TILT_VARIANCE_RAD2) + 2.0 * square(ACCEL_BIAS / GRAVITY)
    }

    /// Factor on the stated variances of bias and matrix. A lasting velocity affects them in the
    /// same way as the tilt.
    fn doubt(&self) -> f64 {
        self.accelerations.doubt(&self.lasting).max(1.0)
    }

    /// Mean size of the force at rest, m/s²; NaN before the first rest.
    fn mean_gravity(&self) -> f64 {
        if self.gravity[1] > 0.0 { self.gravity[0] } else { f64::NAN }
    }

    /// Mean size of the force at rest, once rests have shown it.
    fn known_gravity(&self) -> Option<f64> {
        if self.gravity[1] >= MIN_GRAVITY_TICKS { Some(self.gravity[0]) } else { None }
    }

    fn weigh(&mut self, sums: &Sums) {
        let force = (sums.accel / sums.forces).norm();
        self.gravity[1] = (self.gravity[1] + 1.0).min(GRAVITY_TICKS);
        self.gravity[0] += (force - self.gravity[0]) / self.gravity[1];
    }
}

fn square(x: f64) -> f64 {
    x * x
}

/// Initial variances of all states.
fn start_variances(bias_sigma: &[f64; 3], matrix_sigma: &[[f64; 3]; 3]) -> States {
    States::from_fn(|i, _| match i {
        0..BIAS => TILT_SIGMA_RAD * TILT_SIGMA_RAD,
        BIAS..MATRIX => square(bias_sigma[i - BIAS]),
        MATRIX..VELOCITY => square(matrix_sigma.as_flattened()[i - MATRIX]),
        _ => MAX_SPEED_CHANGE_M_S * MAX_SPEED_CHANGE_M_S,
    })
}

#[cfg(test)]
mod tests {
    use super::{Auto, AutoOptions, ScaleNoise};
    use crate::attitude::Estimator;
    use crate::attitude::sample::Inertial;
    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;

    /// A hand that turns and shakes, with any fields.
    fn samples(fields: &[Option<[f64; 3]>]) -> impl Iterator<Item = Inertial> {
        fields.iter().enumerate().map(|(k, field)| {
            let t = 0.01 * k as f64;
            Inertial {
                gyro: Vector3::new(2.0 * t.sin(), (3.0 * t).cos(), 1.5 * (0.7 * t).sin()),
                known: k % 50 != 7,
                unknown: 0.0,
                age: if k % 50 == 7 { 0.1 } else { 0.0 },
                accel: (k % 9 != 4).then(|| Vector3::new((5.0 * t).sin(), 0.4, 9.5 + t.cos())),
                mag: field.map(Vector3::from),
                dt: 0.01,
            }
        })
    }

    fn followed(fields: &[Option<[f64; 3]>]) -> Auto {
        let mut filter = Auto::with(AutoOptions::default());
        samples(fields).for_each(|sample| filter.step(&sample));
        filter
    }

    proptest! {
        #[test]
        fn a_field_turns_the_heading_and_nothing_else(
            fields in prop::collection::vec(
                prop::option::weighted(0.8, prop::array::uniform3(-1e3..1e3_f64)), 400..600),
        ) {
            let (with, without) = (followed(&fields), followed(&[None; 600][..fields.len()]));
            prop_assert_eq!(with.strapdown, without.strapdown);
            prop_assert_eq!((with.bias, with.matrix), (without.bias, without.matrix));
            prop_assert_eq!(with.velocity, without.velocity);
            prop_assert_eq!(with.errors.covariance(), without.errors.covariance());
            prop_assert_eq!(with.scale_noise, without.scale_noise);
            prop_assert!(with.is_valid());
            prop_assert!(with.errors.heading() < without.errors.heading());
        }

        #[test]
        fn the_level_axes_may_lie_anyhow(angle in -3.0..3.0_f64) {
            let begun = |heading: f64| {
                let mut filter = Auto::with(AutoOptions::default());
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
                filter.align(turn.into_inner(), 0.1, 0.1);
                samples(&[None; 1500]).for_each(|sample| filter.step(&sample));
                filter
            };
            let (one, other) = (begun(0.0), begun(angle));
            // Persistent corrections: the learned noise is not the smallest noise.
            prop_assert!(one.scale_noise != ScaleNoise::default());
            prop_assert!((one.bias - other.bias).amax() < 1e-12);
            prop_assert!((one.matrix - other.matrix).amax() < 1e-12);
            let (one, other) = (one.knowledge(), other.knowledge());
            prop_assert!((one.tilt_sigma - other.tilt_sigma).abs() < 1e-12);
            prop_assert!((one.gyro_matrix_sigma - other.gyro_matrix_sigma).amax() < 1e-12);
        }
    }
}
