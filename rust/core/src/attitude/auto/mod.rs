//! The default filter: a Kalman filter that also learns the gyro's scale and misalignment from
//! gravity, and lets a magnetometer touch the heading only.
//!
//! Each sample is integrated. Ticks of a tenth of a second correct: the velocity that the force makes
//! in a frame that the gyro holds level stays near zero, or the tilt is wrong, or bias and matrix of
//! the gyro that have turned it. After D. Laidig and T. Seel (VQF, *Information Fusion* 91, 2023)
//! in what a frame of the gyro's own is good for; the errors of the gyro as states are our own.

mod errors;
mod magnet;
mod rest;
#[cfg(feature = "std")]
mod smooth;
mod start;
mod strapdown;
mod trust;

use nalgebra::{ComplexField, Matrix3, Quaternion, RealField, Vector3};
use serde::{Deserialize, Serialize};

use self::errors::{BIAS, Errors, Found, MATRIX, States, Transition, VELOCITY};
use self::magnet::{Magnet, Spikes};
use self::rest::{Rest, State};
use self::start::{SPEED, Start, TILT};
use self::strapdown::{Strapdown, Sums};
use self::trust::{Accelerations, FieldErrors, Lasting, ScaleNoise};
use super::sample::Inertial;
use super::stream::Tagged;
use super::{Estimator, GRAVITY, Knowledge};
use crate::error::{Error, require};
use crate::math::sound::{are_within, is_size};

/// Seconds of a tick.
const TICK: f64 = 0.1;
const DEGREE: f64 = core::f64::consts::PI / 180.0;
/// Noise of the angle, rad/√s, and what of every turn accelerometer and mounting leave, rad/√rad.
const ANGLE_NOISE: f64 = 0.01 * DEGREE;
const TURN_NOISE: f64 = 0.003;
/// Random walk of the bias, rad/s/√s, and its spread at the start, rad/s.
const BIAS_WALK: f64 = 0.01 * DEGREE;
const BIAS_SIGMA: f64 = 0.5 * DEGREE;
/// Random walk of the matrix' elements, 1/√s, and their spread on the diagonal and off it.
const MATRIX_WALK: f64 = 1e-5;
const MATRIX_SIGMAS: [f64; 2] = [0.008, 0.005];
/// Bias of an accelerometer, m/s², as consumer devices have it.
const ACCEL_BIAS: f64 = 0.05;
/// Noise of the velocity, m/s/√s.
const VELOCITY_NOISE: f64 = 0.01;
/// Velocity at rest, m/s √s, and the rate's mean there, rad/s √s.
const REST_VELOCITY: f64 = 1e-2;
const REST_RATE: f64 = 0.04 * DEGREE;
/// Direction of the magnetic field, rad √s, and how it changes on the way, rad/√s.
const FIELD: f64 = 25.0 * DEGREE;
const FIELD_WALK: f64 = 0.02 * DEGREE;
/// Ticks at rest over which the strength of gravity is averaged.
const WEIGHED: f64 = 100.0;
/// Square of the share of a field that is level, from which on the noise of its direction grows: of
/// a dip of 72 degrees.
const LEVEL: f64 = 0.1;
/// The same of a field that tells no heading at all, as far as its size can be rounded.
const VERTICAL: f64 = 1e-12;
/// Longest time that a field stands for, s.
const FIELD_HOLDS: f64 = 1.0;
/// Variances of the heading at the start, rad²: to be found by a magnetometer, and chosen.
const HEADING_FREE: f64 = 10.0;
const HEADING_CHOSEN: f64 = 1e-6;
/// Variance per second of an angle while no rate is known, rad²/s.
const UNKNOWN: f64 = 1.0;
/// Rate of a sensor that seemed to rest before a gap, rad/s.
const STILL: f64 = 0.01;
/// Largest bias, rad/s, and element of the matrix' error that are believed.
const BIAS_MAX: f64 = 10.0;
const MATRIX_MAX: f64 = 0.2;
const VELOCITY_MAX: f64 = 1e4;

/// What a person may say of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AutoOptions {
    /// Whether there is a magnetometer; without one the heading at the start is chosen.
    pub mag: bool,
    /// The gyro's output without rotation, rad/s.
    pub bias: [f64; 3],
    /// Its standard deviation.
    pub bias_sigma: [f64; 3],
    /// M in `rate = M (gyro - bias)`, its rows.
    pub matrix: [[f64; 3]; 3],
    /// Standard deviations of its elements.
    pub matrix_sigma: [[f64; 3]; 3],
}

impl Default for AutoOptions {
    fn default() -> Self {
        Self {
            mag: true,
            bias: [0.0; 3],
            bias_sigma: [BIAS_SIGMA; 3],
            matrix: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            matrix_sigma: [0, 1, 2].map(|i| [0, 1, 2].map(|j| MATRIX_SIGMAS[usize::from(i != j)])),
        }
    }
}

impl AutoOptions {
    fn checked(self) -> Result<Self, Error> {
        for (x, sigma) in self.bias.into_iter().zip(self.bias_sigma) {
            require(x.abs() <= BIAS_MAX, "bias", "a rate of at most 10 rad/s", x)?;
            let expected = "a positive rate of at most 0.2 rad/s";
            require(sigma > 0.0 && sigma <= 0.2, "bias_sigma", expected, sigma)?;
        }
        for (i, x) in self.matrix.as_flattened().iter().enumerate() {
            let error = x - if i % 4 == 0 { 1.0 } else { 0.0 };
            require(error.abs() <= MATRIX_MAX, "gyro_matrix", "the identity within 0.2", *x)?;
        }
        for sigma in self.matrix_sigma.as_flattened() {
            let expected = "a number from 0 to 0.1";
            require((0.0..=0.1).contains(sigma), "gyro_matrix_sigma", expected, *sigma)?;
        }
        Ok(self)
    }
}

/// The filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Auto {
    options: AutoOptions,
    strapdown: Strapdown,
    sums: Sums,
    errors: Errors,
    bias: Vector3<f64>,
    /// I + S.
    matrix: Matrix3<f64>,
    /// In the frame of the orientation, m/s.
    velocity: [f64; 2],
    /// Cosine and sine of half the angle by which that frame is turned against the earth.
    turn: [f64; 2],
    start: Start,
    rest: Rest,
    accelerations: Accelerations,
    lasting: Lasting,
    scale_noise: ScaleNoise,
    spikes: Spikes,
    magnet: Magnet,
    field_errors: FieldErrors,
    /// Seconds since the field was last used.
    field_age: f64,
    /// Mean strength of the force in rests, and how many ticks it is of.
    gravity: [f64; 2],
    at_rest: bool,
    /// Mean square of the rate in the last tick, (rad/s)².
    speed_squared: f64,
}

impl Auto {
    /// A filter that has seen nothing.
    ///
    /// # Errors
    /// [`Error::Parameter`] if an option is out of its range.
    pub fn new(options: AutoOptions) -> Result<Self, Error> {
        Ok(Self::with(options.checked()?))
    }

    fn with(options: AutoOptions) -> Self {
        let heading = if options.mag { HEADING_FREE } else { HEADING_CHOSEN };
        Self {
            options,
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
            magnet: Magnet::default(),
            field_errors: FieldErrors::default(),
            field_age: 0.0,
            gravity: [0.0; 2],
            at_rest: false,
            speed_squared: 0.0,
        }
    }

    /// What was chosen.
    pub fn options(&self) -> &AutoOptions {
        &self.options
    }

    /// The first second levels the frame sample by sample; the first field says where north is.
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
    fn tick(&mut self) {
        let sums = self.sums;
        self.sums = Sums::new(TICK);
        let state = self.rest.observe(&sums, &self.bias);
        self.at_rest = state == State::Rest;
        if state == State::FarRest {
            self.restart_gyro();
        }
        self.speed_squared = sums.spread(&self.bias, &Vector3::zeros()).0.max(0.0);
        let rate = ComplexField::sqrt(self.speed_squared);
        let moving = self.predict(&sums, rate);
        if self.start.observe(sums.elapsed, &mut self.errors) || !moving {
            self.velocity = [0.0; 2];
        } else {
            self.correct(&sums);
        }
        if self.options.mag {
            self.see_field(&sums, rate);
        }
        self.strapdown.settle();
    }

    /// Carries velocity and errors through a tick; false where no force was known in it.
    #[inline(always)]
    fn predict(&mut self, sums: &Sums, rate: f64) -> bool {
        let span = sums.elapsed;
        let force = sums.force / sums.forces.max(1.0);
        let scale = self.scale_noise.variance() * rate * rate;
        let unknown = UNKNOWN * sums.unknown;
        let angle = span * (square(ANGLE_NOISE) + scale + square(TURN_NOISE) * rate) + unknown;
        let walk = if self.options.mag { span * square(FIELD_WALK) } else { 0.0 };
        self.errors.predict(&Transition {
            drivers: [0, 1, 2].map(|i| sums.drivers(i)),
            lift: span * force.z,
            tilt_noise: angle,
            heading_noise: angle + walk,
            bias_noise: span * square(BIAS_WALK),
            matrix_noise: span * square(MATRIX_WALK),
            velocity_noise: span * (square(VELOCITY_NOISE) + self.lasting.walk()),
            bias_cap: square(BIAS_SIGMA),
            matrix_caps: MATRIX_SIGMAS.map(|sigma| sigma * sigma),
        });
        let known = sums.forces > 0.0;
        if known {
            self.velocity[0] += span * force.x;
            self.velocity[1] += span * force.y;
        } else {
            self.errors.restart(&[VELOCITY, VELOCITY + 1], SPEED * SPEED);
        }
        known
    }

    /// The velocity stays near zero; at rest it is zero, and the rate is the bias.
    #[inline(always)]
    fn correct(&mut self, sums: &Sums) {
        let (span, velocity) = (sums.elapsed, self.velocity);
        let noise = if self.at_rest {
            self.lasting = Lasting::of_rest();
            square(REST_VELOCITY) / span
        } else {
            self.lasting.observe(&velocity, &self.strapdown.rotation, span);
            self.accelerations.observe(&velocity, &self.lasting, span) / span
        };
        let mut found = Found { states: States::zeros(), heading: 0.0 };
        let expected = self.expected(noise);
        self.errors.correct(VELOCITY, velocity.map(|x| -x), noise, &mut found);
        if self.at_rest {
            let level = sums.gyro / sums.samples - self.bias;
            self.errors.correct(BIAS, level.into(), square(REST_RATE) / span, &mut found);
            self.weigh(sums);
        } else {
            let tilt = [found.states[0], found.states[1]];
            self.scale_noise.observe(&tilt, expected, span);
        }
        self.apply(&found);
    }

    /// Variance of the tilt's correction by both components of the velocity at once: the same along
    /// whatever level axes.
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
        for i in 0..3 {
            self.bias[i] = (self.bias[i] + states[BIAS + i]).clamp(-BIAS_MAX, BIAS_MAX);
            for j in 0..3 {
                let usual = if i == j { 1.0 } else { 0.0 };
                let element = self.matrix[(i, j)] + states[MATRIX + 3 * i + j] - usual;
                self.matrix[(i, j)] = usual + element.clamp(-MATRIX_MAX, MATRIX_MAX);
            }
        }
        for j in 0..2 {
            let velocity = self.velocity[j] + states[VELOCITY + j];
            self.velocity[j] = velocity.clamp(-VELOCITY_MAX, VELOCITY_MAX);
        }
        self.turn_heading(found.heading);
    }

    /// The mean direction of the field corrects the heading, and nothing else.
    fn see_field(&mut self, sums: &Sums, rate: f64) {
        self.field_age = (self.field_age + sums.elapsed).min(FIELD_HOLDS);
        if sums.fields == 0.0 {
            return;
        }
        let field = sums.field / sums.fields;
        let seconds = core::mem::take(&mut self.field_age);
        let Some(doubt) = self.magnet.observe(&field, seconds, rate) else { return };
        let level_squared = field.x * field.x + field.y * field.y;
        if seconds <= 0.0 || level_squared <= VERTICAL * field.norm_squared() {
            return;
        }
        let steep = (LEVEL * field.norm_squared() / level_squared).max(1.0);
        let noise = square(FIELD) / seconds * doubt * steep;
        let gain = self.errors.heading() / (self.errors.heading() + noise);
        let parts = [ComplexField::sqrt(level_squared), field.z];
        self.field_errors.observe(gain, noise, parts, 0.5 * self.tilt_variance());
        self.errors.correct_heading(gain, noise);
        self.turn_heading(gain * self.east_of_north(&field));
    }

    /// The angle from north to a direction, clockwise, rad.
    fn east_of_north(&self, direction: &Vector3<f64>) -> f64 {
        let [c, s] = self.turn;
        let (cosine, sine) = (c * c - s * s, 2.0 * c * s);
        let east = cosine * direction.x - sine * direction.y;
        let north = sine * direction.x + cosine * direction.y;
        RealField::atan2(east, north)
    }

    /// Of the angle between true and estimated up, rad²: no corrections see the bias of an
    /// accelerometer.
    fn tilt_variance(&self) -> f64 {
        let own = (self.errors.variance(0) + self.errors.variance(1)).max(0.0);
        let doubt = self.accelerations.doubt(&self.lasting);
        doubt * own + 2.0 * square(ACCEL_BIAS / GRAVITY)
    }

    fn turn_heading(&mut self, angle: f64) {
        let step = strapdown::small_rotation(&Vector3::new(0.0, 0.0, angle));
        let ([c, s], [w, z]) = (self.turn, [step.w, step.k]);
        let (c, s) = (c * w - s * z, s * w + c * z);
        let near_one = 1.5 - 0.5 * (c * c + s * s);
        self.turn = [c * near_one, s * near_one];
    }

    /// A rest far from the bias: nothing that was learned of the gyro holds.
    #[cold]
    fn restart_gyro(&mut self) {
        self.bias = self.rest.level().map(|x| x.clamp(-BIAS_MAX, BIAS_MAX));
        self.matrix = Matrix3::identity();
        let heading = self.errors.heading().max(if self.options.mag { HEADING_FREE } else { 0.0 });
        self.errors = Errors::new(
            &start_variances(&[BIAS_SIGMA; 3], &AutoOptions::default().matrix_sigma),
            heading,
        );
        (self.velocity, self.scale_noise) = ([0.0; 2], ScaleNoise::default());
        self.at_rest = true;
    }

    fn weigh(&mut self, sums: &Sums) {
        let force = (sums.accel / sums.forces).norm();
        self.gravity[1] = (self.gravity[1] + 1.0).min(WEIGHED);
        self.gravity[0] += (force - self.gravity[0]) / self.gravity[1];
    }
}

fn square(x: f64) -> f64 {
    x * x
}

/// Variances of all states at the start.
fn start_variances(bias_sigma: &[f64; 3], matrix_sigma: &[[f64; 3]; 3]) -> States {
    States::from_fn(|i, _| match i {
        0..BIAS => TILT * TILT,
        BIAS..MATRIX => square(bias_sigma[i - BIAS]),
        MATRIX..VELOCITY => square(matrix_sigma.as_flattened()[i - MATRIX]),
        _ => SPEED * SPEED,
    })
}

impl Estimator for Auto {
    #[inline(always)]
    fn step(&mut self, sample: &Inertial) {
        let driven = sample.gyro - self.bias;
        let driven = if sample.known { driven } else { Vector3::zeros() };
        self.strapdown.turn(self.matrix * driven * sample.dt);
        let field = sample.mag.as_ref().filter(|mag| self.spikes.pass(mag));
        if !self.start.over
            && let Some(accel) = &sample.accel
        {
            self.begin(accel, sample.mag.as_ref(), field.is_some());
        }
        self.sums.add(sample, field, &driven, &self.strapdown.rotation, TICK);
        if self.sums.elapsed + 0.5 * sample.dt >= TICK {
            self.tick();
        }
    }

    fn gap(&mut self, seconds: f64) {
        self.sums = Sums::new(TICK);
        self.rest = Rest::default();
        self.at_rest = false;
        (self.velocity, self.lasting) = ([0.0; 2], Lasting::default());
        // It may have turned as it did, another way every second.
        let turned = (self.speed_squared + STILL * STILL) * seconds;
        self.errors.restart(&[VELOCITY, VELOCITY + 1], SPEED * SPEED);
        self.errors.blur(turned, turned);
        self.strapdown.restart(self.strapdown.orientation);
        if self.errors.variance(0) > TILT * TILT {
            self.start.again();
        }
    }

    #[inline(always)]
    fn orientation(&self) -> Quaternion<f64> {
        let ([c, s], q) = (self.turn, &self.strapdown.orientation);
        Quaternion::new(c * q.w - s * q.k, c * q.i - s * q.j, c * q.j + s * q.i, c * q.k + s * q.w)
    }

    fn knowledge(&self) -> Knowledge {
        // What a velocity that lasts does to the tilt, it does to what is learned from it.
        let doubt = self.accelerations.doubt(&self.lasting).max(1.0);
        let sigma = |i: usize| ComplexField::sqrt(doubt * self.errors.variance(i).max(0.0));
        Knowledge {
            bias: self.bias,
            bias_sigma: Vector3::from_fn(|i, _| sigma(BIAS + i)),
            gyro_matrix: self.matrix,
            gyro_matrix_sigma: Matrix3::from_fn(|i, j| sigma(MATRIX + 3 * i + j)),
            tilt_sigma: ComplexField::sqrt(self.tilt_variance()),
            heading_sigma: ComplexField::sqrt(
                self.field_errors.variance(self.errors.heading().max(0.0)),
            ),
            gravity: if self.gravity[1] > 0.0 { self.gravity[0] } else { f64::NAN },
            at_rest: self.at_rest,
            disturbed: self.magnet.is_disturbed(),
            started: self.start.over,
        }
    }

    fn align(&mut self, orientation: Quaternion<f64>, tilt_sigma: f64, heading_sigma: f64) {
        self.strapdown.restart(orientation);
        self.turn = [1.0, 0.0];
        self.velocity = [0.0; 2];
        self.errors.restart(&[0, 1], square(tilt_sigma));
        self.errors.restart(&[VELOCITY, VELOCITY + 1], SPEED * SPEED);
        self.errors.restart_heading(square(heading_sigma));
        (self.lasting, self.field_errors) = (Lasting::default(), FieldErrors::default());
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

    fn is_sound(&self) -> bool {
        let sizes = [
            (self.velocity[0].abs(), VELOCITY_MAX),
            (self.velocity[1].abs(), VELOCITY_MAX),
            (self.field_age, FIELD_HOLDS),
            (self.gravity[0], 2e3),
            (self.gravity[1], WEIGHED),
            (self.speed_squared, 1e7),
        ];
        let [c, s] = self.turn;
        self.options.checked().is_ok()
            && sizes.iter().all(|(x, most)| is_size(*x, *most))
            && are_within(&self.bias, BIAS_MAX)
            && are_within(&(self.matrix - Matrix3::identity()), MATRIX_MAX + 1e-12)
            && (c * c + s * s - 1.0).abs() < 1e-9
            && self.strapdown.is_sound()
            && self.sums.is_sound()
            && self.errors.is_sound()
            && self.start.is_sound()
            && self.rest.is_sound()
            && self.accelerations.is_sound()
            && self.lasting.is_sound()
            && self.scale_noise.is_sound()
            && self.spikes.is_sound()
            && self.magnet.is_sound()
            && self.field_errors.is_sound()
    }

    fn is_like(&self, other: &Self) -> bool {
        self.options == other.options
    }
}

impl Tagged for Auto {
    const TAG: &'static str = "attitude";
}

#[cfg(test)]
mod tests {
    use super::{Auto, AutoOptions, Estimator, Inertial, ScaleNoise};
    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;

    /// A hand that turns and shakes, and whatever fields.
    fn samples(fields: &[Option<[f64; 3]>]) -> impl Iterator<Item = Inertial> {
        fields.iter().enumerate().map(|(k, field)| {
            let t = 0.01 * k as f64;
            Inertial {
                gyro: Vector3::new(2.0 * t.sin(), (3.0 * t).cos(), 1.5 * (0.7 * t).sin()),
                known: k % 50 != 7,
                unknown: 0.0,
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
            prop_assert!(with.is_sound());
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
            // Of corrections that persist: the noise that is learned from them is not the least.
            prop_assert!(one.scale_noise != ScaleNoise::default());
            prop_assert!((one.bias - other.bias).amax() < 1e-12);
            prop_assert!((one.matrix - other.matrix).amax() < 1e-12);
            let (one, other) = (one.knowledge(), other.knowledge());
            prop_assert!((one.tilt_sigma - other.tilt_sigma).abs() < 1e-12);
            prop_assert!((one.gyro_matrix_sigma - other.gyro_matrix_sigma).amax() < 1e-12);
        }
    }
}
