//! The stream of attitudes: units, frame, time and missing samples around an estimator.

use core::f64::consts::FRAC_PI_2;

use nalgebra::{Quaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::events::Events;
use super::frame::{self, Frame};
use super::sample::{self, Inertial, MAX_FORCE, MAX_RATE, Sample};
use super::{Estimator, GRAVITY, Knowledge};
use crate::error::{Error, check_rate, require};
use crate::math::validity::{is_count, is_sample, is_within};
#[cfg(feature = "std")]
use crate::stream::Block;
use crate::stream::checkpoint::Checkpoint;
use crate::stream::{Field, Output, Shape, Stream, Traced};

/// Longest time for which the last rate replaces missing rates, s.
const MAX_HELD_S: f64 = 0.05;
/// Number of periods after the last sample beyond which the difference is not jitter.
const MAX_PERIODS: f64 = 1.5;
/// Shortest time between two samples that is a gap, s.
const MIN_GAP_S: f64 = 1.0;
/// Gap after a clock was set back by more than [`MIN_GAP_S`], s: the recorder has restarted.
const RESTART_GAP_S: f64 = 10.0;
/// Longest gap, s.
const MAX_GAP_S: f64 = 1e9;
/// Share of its range at which a gyro clips.
const CLIPPING_SHARE: f64 = 0.999;
/// Largest rate, rad/s, after which a gyro may have come to rest.
const MAX_SLOW_RATE_RAD_S: f64 = 5.0 * core::f64::consts::PI / 180.0;
/// Largest counted time with zeros of a gyro, s, and times from which zeros are a rate: after a low
/// rate, and after any rate. Time with low rates other than zero is subtracted.
const MAX_ZEROS_S: f64 = 4.0;
const MIN_ZEROS_S: [f64; 2] = [-2.0, 0.5];
/// Range of gravity at rest, m/s²; outside, the accelerometer's unit is wrong.
const GRAVITY_RANGE: [f64; 2] = [9.3, 10.3];

/// Parameters of all estimators.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AttitudeParams {
    /// Samples per second.
    pub rate: f64,
    /// Axes of the earth.
    pub frame: Frame,
    /// True if there is a magnetometer. Without a magnetometer a level sensor starts along the
    /// frame's axes.
    pub mag: bool,
    /// Unit of the gyro in rad/s.
    pub gyro_unit: f64,
    /// Unit of the accelerometer in m/s².
    pub accel_unit: f64,
    /// Range of the gyro, rad/s, if known. Larger rates count as missing.
    pub gyro_range: Option<f64>,
}

impl AttitudeParams {
    /// The parameters, if they are in range.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first parameter out of range.
    pub fn validate(self) -> Result<Self, Error> {
        check_rate(self.rate)?;
        // With a longer period every sample would be a gap.
        require(self.rate >= 1.0 / MIN_GAP_S, "rate", "at least 1 sample a second", self.rate)?;
        for (name, unit) in [("gyro_unit", self.gyro_unit), ("accel_unit", self.accel_unit)] {
            // Units with a finite value in SI.
            let expected = "a unit from 1e-12 to 1e12 of that in SI";
            require((1e-12..=1e12).contains(&unit), name, expected, unit)?;
        }
        if let Some(range) = self.gyro_range {
            let expected = "a positive rate of at most 1000 rad/s";
            require(range > 0.0 && range <= MAX_RATE, "gyro_range", expected, range)?;
        }
        Ok(self)
    }
}

impl AttitudeParams {
    fn limit_squared(&self) -> f64 {
        let limit = self.gyro_range.unwrap_or(MAX_RATE);
        limit * limit
    }

    /// The rate in rad/s, if it is present, within the gyro's range and possible for a body.
    #[cfg(feature = "std")]
    pub(super) fn measured(&self, gyro: [f64; 3]) -> Option<Vector3<f64>> {
        let rate = Vector3::from(gyro) * self.gyro_unit;
        let is_small = rate.norm_squared() <= self.limit_squared();
        if is_small { Some(rate) } else { self.within(rate) }
    }

    /// A rate may be within the range about each axis even if its size is beyond the range.
    #[cold]
    #[inline(never)]
    fn within(&self, rate: Vector3<f64>) -> Option<Vector3<f64>> {
        let range = self.gyro_range? * (1.0 + 1e-9);
        let fits = rate.iter().all(|x| x.abs() <= range) && rate.norm() <= MAX_RATE;
        if fits { Some(rate) } else { None }
    }

    /// Rotation from the estimator's axes to the requested axes. Without a magnetometer the
    /// estimator's first axis is arbitrary: a level sensor starts along the axes of the frame.
    fn frame_from_enu(&self) -> Quaternion<f64> {
        match (self.mag, self.frame) {
            (true, frame) => frame.from_enu(),
            (false, Frame::Enu | Frame::Nwu) => Frame::Enu.from_enu(),
            (false, Frame::Ned) => Quaternion::new(0.0, -1.0, 0.0, 0.0),
        }
    }

    /// Orientation of the estimator in these axes, scalar first.
    #[inline(always)]
    fn components(&self, enu: &Quaternion<f64>) -> [f64; 4] {
        match (self.mag, self.frame) {
            (true, frame) => frame.components(enu),
            (false, Frame::Enu | Frame::Nwu) => Frame::Enu.components(enu),
            (false, Frame::Ned) => [enu.i, -enu.w, enu.k, -enu.j],
        }
    }

    /// The estimate in the frame and in the sensors' units; NaN without a force.
    pub(super) fn shown(
        &self,
        enu: &Quaternion<f64>,
        knowledge: &Knowledge,
        force: &Vector3<f64>,
    ) -> Snapshot {
        let AttitudeParams { gyro_unit, accel_unit, .. } = *self;
        let knowledge = Knowledge {
            bias: knowledge.bias / gyro_unit,
            bias_sigma: knowledge.bias_sigma / gyro_unit,
            ..*knowledge
        };
        let linear_acceleration = (force - frame::up(enu) * GRAVITY) / accel_unit;
        Snapshot {
            quaternion: self.components(enu),
            knowledge,
            linear_acceleration: linear_acceleration.into(),
        }
    }

    /// Direction of the sensor's x axis, clockwise from north, rad.
    fn heading(&self, enu: &Quaternion<f64>) -> f64 {
        let from_north = frame::heading(enu);
        match (self.mag, self.frame) {
            (true, _) | (_, Frame::Enu) => from_north,
            _ if from_north < FRAC_PI_2 => from_north + 3.0 * FRAC_PI_2,
            _ => from_north - FRAC_PI_2,
        }
    }
}

/// Attitude of a body, sample by sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Attitude<E> {
    params: AttitudeParams,
    period: f64,
    estimator: E,
    /// The last known rate, rad/s, and the time since it, s.
    rate: Vector3<f64>,
    unknown: f64,
    /// Time with zeros of the gyro, s, minus the time with other low rates.
    zeros: f64,
    /// Last specific force, m/s², NaN if the last sample had none.
    force: Vector3<f64>,
    samples: u64,
    /// Number of rates left out because no such gyro measures them.
    left_out: u64,
    /// Events at the last sample. They are not part of the state: the next sample clears them.
    #[serde(skip)]
    events: Events,
    /// Square of the largest size for which a rate is surely within the range about each axis,
    /// (rad/s)².
    limit_squared: f64,
}

impl<E: Estimator> Attitude<E> {
    /// A stream around an estimator before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a parameter is out of range.
    pub fn new(params: AttitudeParams, estimator: E) -> Result<Self, Error> {
        let params = params.validate()?;
        let mut this = Self {
            params,
            period: 1.0 / params.rate,
            estimator,
            rate: Vector3::zeros(),
            unknown: 0.0,
            zeros: 0.0,
            force: Vector3::repeat(f64::NAN),
            samples: 0,
            left_out: 0,
            events: Events::default(),
            limit_squared: params.limit_squared(),
        };
        this.forget();
        Ok(this)
    }

    /// Parameters of the stream.
    pub fn params(&self) -> &AttitudeParams {
        &self.params
    }

    /// The estimator.
    pub fn estimator(&self) -> &E {
        &self.estimator
    }

    /// Samples to date, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.samples
    }

    /// Number of rates left out because they exceed the gyro's range or any body's rate.
    pub fn rates_left_out(&self) -> u64 {
        self.left_out
    }

    /// Quaternion from the sensor's axes to the earth's axes, scalar first.
    #[inline(always)]
    pub fn quaternion(&self) -> [f64; 4] {
        self.params.components(&self.estimator.orientation())
    }

    /// Reading after the last sample.
    pub fn reading(&self) -> Reading {
        let (snapshot, enu) = (self.snapshot(), self.estimator.orientation());
        let [w, x, y, z] = snapshot.quaternion;
        let up = frame::up(&enu);
        Reading {
            snapshot,
            euler: frame::euler(&Quaternion::new(w, x, y, z)),
            heading: self.params.heading(&enu),
            up: up.into(),
            gravity: (up * (GRAVITY / self.params.accel_unit)).into(),
            status: self.status(&snapshot.knowledge),
        }
    }

    fn status(&self, known: &Knowledge) -> &'static str {
        match known {
            _ if self.samples == 0 => "starting",
            // The flag is kept in free fall and after a restart.
            Knowledge { wrong_unit: true, .. } => "wrong unit?",
            _ if !known.started => "starting",
            _ if self.is_clipped() => "clipped",
            _ if self.unknown > MAX_HELD_S => "rate missing",
            _ if self.wrong_gravity().is_some() => "wrong unit",
            Knowledge { stuck: true, .. } => "magnetometer stuck",
            Knowledge { unclear: true, .. } => "at rest, or on a rate table: bias_limit",
            Knowledge { disturbed: true, .. } => "disturbed",
            Knowledge { at_rest: true, .. } => "at rest",
            _ => "moving",
        }
    }

    /// Size of the force at rest, m/s², if it cannot be gravity; the accelerometer's unit is then
    /// wrong.
    pub fn wrong_gravity(&self) -> Option<f64> {
        let [least, most] = GRAVITY_RANGE;
        let gravity = self.estimator.knowledge().gravity;
        (gravity < least || gravity > most).then_some(gravity)
    }

    /// Continues from this orientation in the frame, scalar first, of any length except zero.
    pub fn align(&mut self, orientation: [f64; 4], tilt_sigma: f64, heading_sigma: f64) {
        let [w, x, y, z] = orientation;
        let given = Quaternion::new(w, x, y, z).normalize();
        let enu = self.params.frame_from_enu().conjugate() * given;
        self.estimator.align(enu, tilt_sigma, heading_sigma);
    }

    /// Resets the state, except values that the sensor keeps while it is off.
    pub fn power_on(&mut self) {
        self.estimator.power_on();
        self.forget();
    }

    fn forget(&mut self) {
        (self.rate, self.unknown, self.zeros) = (Vector3::zeros(), f64::INFINITY, 0.0);
        (self.force, self.samples) = (Vector3::repeat(f64::NAN), 0);
        (self.left_out, self.events) = (0, Events::default());
    }

    /// Converts a sample to the units of an estimator.
    #[inline(always)]
    fn measure(&mut self, sample: &Sample, dt: f64) -> Inertial {
        let before = self.rate;
        let rate = Vector3::from(sample.gyro) * self.params.gyro_unit;
        let is_small = rate.norm_squared() <= self.limit_squared;
        let rated = if is_small { Some(rate) } else { self.params.within(rate) };
        let given = match rated {
            Some(rate) if rate.norm_squared() <= MAX_SLOW_RATE_RAD_S * MAX_SLOW_RATE_RAD_S => {
                self.slow(rate, dt)
            }
            given => given,
        };
        let accel = sample::force(sample.accel, self.params.accel_unit);
        let mag = sample::field(sample.mag);
        self.force = accel.unwrap_or(Vector3::repeat(f64::NAN));
        let mut gyro = given.unwrap_or(before);
        let (mut known, mut unknown, mut age) = (given.is_some(), 0.0, 0.0);
        self.rate = gyro;
        if !known | (dt > MAX_PERIODS * self.period) {
            if !known {
                self.leave_out(sample.gyro);
            }
            (known, unknown) = self.stretch(known, dt);
            age = self.unknown;
            gyro = if known { (gyro + before) * 0.5 } else { gyro };
        } else {
            self.unknown = 0.0;
        }
        Inertial { gyro, known, unknown, age, accel, mag, dt }
    }

    /// Events at the last sample, including the estimator's events.
    pub(super) fn events(&self, known: Events) -> Events {
        let mut events = self
            .events
            .with(Events::CLIPPED, self.is_clipped())
            .with(Events::MISSING, self.unknown > MAX_HELD_S && self.samples > 0);
        events.add(known);
        events
    }

    /// True if the gyro clips at the last known rate.
    fn is_clipped(&self) -> bool {
        self.params.gyro_range.is_some_and(|range| self.rate.amax() >= CLIPPING_SHARE * range)
    }

    /// Counts a rate that cannot be used; a rate that is not finite and a vector of zeros are
    /// missing.
    #[cold]
    #[inline(never)]
    fn leave_out(&mut self, gyro: [f64; 3]) {
        let given = gyro.iter().all(|x| x.is_finite()) && gyro != [0.0; 3];
        self.left_out += u64::from(given);
        self.events = self.events.with(Events::LEFT_OUT, given);
    }

    /// A low rate; `None` if it is a vector of zeros that means a missing sample.
    ///
    /// A simulated gyro, or a gyro with a dead band, gives zeros at rest, and a real gyro gives
    /// noise. Slow rates show which gyro it is: a body that has just rotated is never exactly
    /// still.
    #[inline(never)]
    fn slow(&mut self, rate: Vector3<f64>, dt: f64) -> Option<Vector3<f64>> {
        if rate.norm_squared() > 0.0 {
            self.zeros = (self.zeros - dt).max(-MAX_ZEROS_S);
            return Some(rate);
        }
        let least = MIN_ZEROS_S
            [usize::from(self.rate.norm_squared() > MAX_SLOW_RATE_RAD_S * MAX_SLOW_RATE_RAD_S)];
        let is_rate = self.zeros > least;
        self.zeros = (self.zeros + dt).min(MAX_ZEROS_S);
        is_rate.then_some(rate)
    }

    /// Replaces a missing rate by the last rate for a limited time. Returns whether the rate is
    /// still known, and for how many of these seconds it is unknown.
    #[cold]
    #[inline(never)]
    fn stretch(&mut self, known: bool, dt: f64) -> (bool, f64) {
        if known {
            self.unknown = 0.0;
            return (true, (dt - MAX_HELD_S).max(0.0));
        }
        let unknown = (self.unknown + dt - MAX_HELD_S).clamp(0.0, dt);
        self.unknown += dt;
        (self.unknown <= MAX_HELD_S, unknown)
    }

    /// Passes a time without any sample, s.
    #[cold]
    #[inline(never)]
    fn bridge(&mut self, seconds: f64) {
        self.unknown += seconds;
        self.events.add(Events::GAP);
        if self.samples > 1 {
            self.estimator.gap(seconds.min(MAX_GAP_S));
        }
    }
}

/// Reading after a sample, in the frame and units of the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// All estimates after the sample.
    pub snapshot: Snapshot,
    /// Roll, pitch, yaw, rad.
    pub euler: [f64; 3],
    /// Direction of the sensor's x axis over ground, clockwise from north, rad.
    pub heading: f64,
    /// Unit vector up, in the sensor's axes.
    pub up: [f64; 3],
    /// Specific force of gravity alone.
    pub gravity: [f64; 3],
    /// Status of the filter.
    pub status: &'static str,
}

/// All estimates after a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snapshot {
    /// Quaternion from the sensor's axes to the earth's axes, scalar first.
    pub quaternion: [f64; 4],
    /// Other estimates; the bias is in the gyro's unit.
    pub knowledge: Knowledge,
    /// Specific force minus gravity, in the sensor's axes and unit.
    pub linear_acceleration: [f64; 3],
}

impl Output for Snapshot {
    const FIELDS: &'static [Field] = &[
        Field { name: "quaternion", shape: Shape::Vector(4) },
        Field { name: "bias", shape: Shape::Vector(3) },
        Field { name: "bias_sigma", shape: Shape::Vector(3) },
        Field { name: "gyro_matrix", shape: Shape::Matrix(3) },
        Field { name: "gyro_matrix_sigma", shape: Shape::Matrix(3) },
        Field { name: "tilt_sigma", shape: Shape::Number },
        Field { name: "heading_sigma", shape: Shape::Number },
        Field { name: "linear_acceleration", shape: Shape::Vector(3) },
        Field { name: "at_rest", shape: Shape::Flag },
        Field { name: "disturbed", shape: Shape::Flag },
        Field { name: "events", shape: Shape::Number },
    ];

    #[inline(always)]
    fn write(self, numbers: &mut [f64], flags: &mut [bool]) {
        let known = &self.knowledge;
        numbers[..4].copy_from_slice(&self.quaternion);
        numbers[4..7].copy_from_slice(known.bias.as_slice());
        numbers[7..10].copy_from_slice(known.bias_sigma.as_slice());
        // Row after row.
        numbers[10..19].copy_from_slice(known.gyro_matrix.transpose().as_slice());
        numbers[19..28].copy_from_slice(known.gyro_matrix_sigma.transpose().as_slice());
        (numbers[28], numbers[29]) = (known.tilt_sigma, known.heading_sigma);
        numbers[30..33].copy_from_slice(&self.linear_acceleration);
        numbers[33] = f64::from(known.events.bits());
        (flags[0], flags[1]) = (known.at_rest, known.disturbed);
    }
}

impl<E: Estimator> Stream for Attitude<E> {
    type Input = Sample;
    type Output = [f64; 4];

    #[inline(always)]
    fn update(&mut self, sample: Sample) -> [f64; 4] {
        self.samples += 1;
        self.events = Events::default();
        let mut dt = if sample.dt >= 0.0 { sample.dt } else { self.period };
        if (dt > MIN_GAP_S) | (sample.dt < 0.0) {
            // While a clock is set back, the time that has passed is unknown.
            let set_back = if sample.dt < -MIN_GAP_S { RESTART_GAP_S } else { MIN_GAP_S };
            self.bridge(if dt > MIN_GAP_S { dt } else { set_back });
            dt = 0.0;
        }
        let measured = self.measure(&sample, dt);
        self.estimator.step(&measured);
        self.quaternion()
    }

    fn reset(&mut self) {
        self.estimator.reset();
        self.forget();
    }

    /// As for any stream, but always with the caller's instruction set.
    #[inline(always)]
    fn run(&mut self, inputs: impl Iterator<Item = Sample>, mut put: impl FnMut([f64; 4])) {
        for input in inputs {
            put(self.update(input));
        }
    }

    /// With instructions beyond the processor family's first: the same operations in fewer
    /// instructions, with bit-identical results.
    #[cfg(feature = "std")]
    fn process_column(&mut self, channel: usize, block: &mut Block<'_>) {
        pulp::Arch::new().dispatch(Column { attitude: self, channel, block });
    }
}

/// One column of a block, for the present processor.
#[cfg(feature = "std")]
struct Column<'a, 'b, E> {
    attitude: &'a mut Attitude<E>,
    channel: usize,
    block: &'a mut Block<'b>,
}

#[cfg(feature = "std")]
impl<E: Estimator> pulp::NullaryFnOnce for Column<'_, '_, E> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.block.run(self.channel, self.attitude);
    }
}

impl<E: Estimator> Traced for Attitude<E> {
    type Snapshot = Snapshot;

    fn snapshot(&self) -> Snapshot {
        let (orientation, known) = (self.estimator.orientation(), self.estimator.knowledge());
        let known = Knowledge { events: self.events(known.events), ..known };
        self.params.shown(&orientation, &known, &self.force)
    }
}

/// Type name of an estimator in a checkpoint.
pub trait Tagged: Estimator + Serialize + serde::de::DeserializeOwned {
    /// As in [`Checkpoint::TAG`].
    const TAG: &'static str;
    /// As in [`Checkpoint::VERSION`].
    const VERSION: u16 = 3;
}

impl<E: Tagged> Checkpoint for Attitude<E> {
    const TAG: &'static str = E::TAG;
    const VERSION: u16 = E::VERSION;

    fn is_valid(&self) -> bool {
        self.params.validate().is_ok()
            && self.period == 1.0 / self.params.rate
            && self.rate.iter().all(|x| is_within(*x, MAX_RATE))
            && self.unknown >= 0.0
            && is_within(self.zeros, MAX_ZEROS_S)
            && self.force.iter().all(|x| is_sample(*x, MAX_FORCE))
            && is_count(self.samples)
            && self.left_out <= self.samples
            && self.limit_squared == self.params.limit_squared()
            && self.estimator.is_valid()
    }

    fn is_like(&self, other: &Self) -> bool {
        (self.params, self.samples) == (other.params, other.samples)
            && self.estimator.is_like(&other.estimator)
    }
}
