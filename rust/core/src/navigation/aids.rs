//! Aids: a barometer, a compass and the baseline of two antennas, each with its own gate.
//!
//! The barometer's reference and the compass's offset are estimated constants with a random walk. A
//! disturbed sensor changes only its own constant, never the state of the vehicle.

use nalgebra::{ComplexField, Vector3};
use serde::{Deserialize, Serialize};

use super::aid_gate::{AidDecision, AidGate, Patience};
use super::aiding::MAX_REST_SPEED_M_S;
use super::covariance::{
    BAROMETER, COMPASS, CONSTANTS, Constants, Errors, GYRO, Innovation, PHI, R, Row, STATES, V,
};
use super::earth::{MAX_HEIGHT, wrap};
use super::filter::{MAX_FIX_AGE_S, MAX_FIX_LEAD_S, MAX_UNKNOWN_S, NavigationFilter, Observer};
use super::fix::Verdict;
use super::innovation_gate::MAX_INNOVATION;
use super::motion::rotation;
use super::params::{Adapt, MAX_LEVER};
use crate::error::{Error, require};
use crate::math::Real;
use crate::math::validity::{is_size, is_within};

/// Sensors of aids, in the order of their numbers.
pub const AID_SENSORS: [&str; 3] = ["barometer", "compass", "baseline"];

/// Default standard deviations of a heading, rad, and of a baseline, m.
const HEADING_SIGMA_RAD: f64 = 0.05;
const BASELINE_SIGMA_M: f64 = 0.02;
/// Smallest standard deviations of readings: m, rad, m.
const MIN_SIGMAS: [f64; 3] = [1e-3, 1e-4, 1e-4];
const MAX_SIGMA: f64 = 1e6;
/// Largest standard deviations learned from innovations: m, rad, m. A sensor with more noise jumps.
const MAX_LEARNED_SIGMAS: [f64; 3] = [5.0, 0.2, 0.5];
/// Largest normalised innovation squared of one axis, and of three.
const MAX_NIS: f64 = 9.0;
const MAX_BASELINE_NIS: f64 = 16.27;
/// Times of agreement of each sensor, see [`Patience`].
const PATIENCE: [Patience; 3] = [
    Patience { agreement: 1.0, change: 3.0 },
    Patience { agreement: 2.0, change: 10.0 },
    Patience { agreement: 2.0, change: 10.0 },
];
/// Standard deviation of the barometer's reference before the first reading, m.
const REFERENCE_SIGMA_M: f64 = 1e3;
/// Variance that a changed constant gains, over the square of the detected change. A hundredth of
/// it would change the filter by one percent of its own variance.
const CHANGE_FACTOR: f64 = 100.0;
/// Square of the cosine of the largest pitch for a heading, 80 degrees.
const MIN_LEVEL_SQUARED: f64 = 0.03;
/// Largest difference of a measured baseline's length from the known length, in standard deviations
/// and as a share.
const MAX_LENGTH_SIGMAS: f64 = 4.0;
const MAX_LENGTH_SHARE: f64 = 0.02;
const MIN_BASELINE_M: f64 = 0.01;
/// Largest number of headings in the mean at the start, and standard deviations within which they
/// agree.
const MAX_START_COUNT: f64 = 100.0;
const MAX_START_SIGMAS: f64 = 4.0;

/// Standard atmosphere (ISO 2533): pressures at sea level, at 11 km and at 20 km, Pa; the height, m,
/// and exponent of the troposphere; the scale height of the layer above, m.
const SEA_LEVEL_PA: f64 = 101_325.0;
const TROPOPAUSE_PA: f64 = 22_632.06;
pub(crate) const MIN_PRESSURE_PA: f64 = 5_474.89;
pub(crate) const MAX_PRESSURE_PA: f64 = 115_000.0;
const TROPOSPHERE_M: f64 = 44_330.769_230_769_23;
const EXPONENT: f64 = 0.190_263_237_3;
const SCALE_HEIGHT_M: f64 = 6_341.615_6;

/// Height in the standard atmosphere, m, of a pressure, Pa, and its derivative, m/Pa; `None`
/// outside 0 to 20 km.
pub fn pressure_height(pressure: f64) -> Option<[f64; 2]> {
    if !(MIN_PRESSURE_PA..=MAX_PRESSURE_PA).contains(&pressure) {
        return None;
    }
    if pressure < TROPOPAUSE_PA {
        let height = 11_000.0 + SCALE_HEIGHT_M * ComplexField::ln(TROPOPAUSE_PA / pressure);
        return Some([height, SCALE_HEIGHT_M / pressure]);
    }
    let power = ComplexField::powf(pressure / SEA_LEVEL_PA, EXPONENT);
    Some([TROPOSPHERE_M * (1.0 - power), TROPOSPHERE_M * EXPONENT * power / pressure])
}

/// Measurement of an aid. A number that is not finite, or impossible, is missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reading {
    /// Barometric height above any reference, m.
    Height(f64),
    /// Barometric pressure, Pa.
    Pressure(f64),
    /// Heading of the body's forward axis, from true north over east, rad.
    Heading(f64),
    /// Vector from the first to the second antenna, north, east, down, m, and the vector in body
    /// axes, m; `None` for the vector of the parameters.
    Baseline([f64; 3], Option<[f64; 3]>),
}

/// A reading of an aid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aid {
    /// Time of the measurement, s.
    pub time: f64,
    /// Measurement.
    pub reading: Reading,
    /// Standard deviation of each axis, in the unit of the reading; NaN for the default of the
    /// parameters.
    pub sigma: [f64; 3],
}

/// Numbers of readings by verdict, to date.
pub type AidCounts = [u64; 3];

/// State of one sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AidReport {
    /// Numbers of readings used, rejected and refused.
    pub counts: AidCounts,
    /// Normalised innovation squared of the last reading; NaN before the first.
    pub nis: f64,
    /// Standard deviation from the innovations, m, rad or m; NaN before it is known.
    pub sigma: f64,
    /// True if readings are rejected until they agree with the filter again.
    pub disturbed: bool,
}

/// State of all aids.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Aids {
    pub gates: [AidGate; 3],
    /// Barometric height minus ellipsoidal height, m.
    reference: f64,
    /// Reading of the compass minus true heading, rad.
    offset: f64,
    /// Variances that the constants gain in the next step.
    gains: [f64; 2],
    /// Time of the constants' last random-walk step, s; NaN before the first.
    walked: f64,
    /// Heading from the compass before the first fix.
    start: Option<HeadingStart>,
}

/// Mean of the compass readings before the first fix.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct HeadingStart {
    count: f64,
    /// Variance of the mean, without the compass's offset.
    variance: f64,
    /// Time of the last reading, s.
    time: f64,
}

/// A checked reading.
#[derive(Debug, Clone, Copy)]
struct Given {
    sensor: usize,
    /// The raw reading, and the reading in SI units: m, rad, m.
    raw: Vector3<f64>,
    value: Vector3<f64>,
    sigma: Vector3<f64>,
    baseline: Vector3<f64>,
}

/// Innovations of a reading, and their derivatives by the errors and constants.
struct Measured {
    axes: usize,
    z: Vector3<f64>,
    rows: [Row; 3],
    constant: Option<usize>,
    /// Difference of the reading in axes in which an error of the sensor is constant.
    error: Vector3<f64>,
}

impl Aids {
    pub fn new() -> Self {
        Self {
            gates: [AidGate::new(); 3],
            reference: 0.0,
            offset: 0.0,
            gains: [0.0; 2],
            walked: f64::NAN,
            start: None,
        }
    }

    pub fn take_out(&mut self, found: &Constants) {
        self.reference = (self.reference + found[BAROMETER]).within(2.0 * MAX_INNOVATION);
        self.offset = wrap(self.offset + found[COMPASS]);
    }

    /// Notes that the filter begins, or restarts after a loss.
    pub fn restart(&mut self) {
        self.gates.iter_mut().for_each(AidGate::restart);
        self.start = None;
    }

    /// True if a constant has a random walk.
    #[inline(always)]
    pub fn have_walked(&self) -> bool {
        !self.walked.is_nan()
    }

    /// True if the heading comes from the compass alone.
    pub fn has_started(&self) -> bool {
        self.start.is_some()
    }

    /// Notes that the heading is known from another source.
    pub fn forget_start(&mut self) {
        self.start = None;
    }

    pub fn is_valid(&self) -> bool {
        let start = self.start.is_none_or(|start| {
            (1.0..=MAX_START_COUNT).contains(&start.count)
                && is_size(start.variance, MAX_SIGMA * MAX_SIGMA)
                && is_within(start.time, 4e9)
        });
        start
            && self.gates.iter().all(AidGate::is_valid)
            && is_within(self.reference, 2.0 * MAX_INNOVATION)
            && is_within(self.offset, core::f64::consts::PI)
            && self.gains.iter().all(|gain| is_size(*gain, MAX_GAIN))
            && (self.walked.is_nan() || is_within(self.walked, 4e9))
    }
}

/// Largest variance that a constant gains at once.
const MAX_GAIN: f64 = 1e13;

impl Aid {
    /// Index of its sensor in [`AID_SENSORS`].
    pub fn sensor(&self) -> usize {
        match self.reading {
            Reading::Height(_) | Reading::Pressure(_) => 0,
            Reading::Heading(_) => 1,
            Reading::Baseline(..) => 2,
        }
    }

    /// The checked reading, `None` if it is empty.
    fn look(&self, usual: f64, known: Option<[f64; 3]>) -> Result<Option<Given>, Error> {
        let sensor = self.sensor();
        for sigma in self.sigma {
            require(sigma.is_nan() || sigma > 0.0, "sigma", "positive", sigma)?;
        }
        let zero = Vector3::zeros();
        let (raw, mut scale, mut baseline) = match self.reading {
            Reading::Height(x) | Reading::Heading(x) => (Vector3::new(x, 0.0, 0.0), 1.0, zero),
            Reading::Pressure(x) => (Vector3::new(x, 0.0, 0.0), f64::NAN, zero),
            Reading::Baseline(vector, own) => {
                let baseline = own.or(known).map_or(zero, Vector3::from);
                let long = (MIN_BASELINE_M..=MAX_LEVER).contains(&baseline.norm());
                require(long, "baseline", "from 0.01 to 1000 m long", baseline.norm())?;
                (vector.into(), 1.0, baseline)
            }
        };
        let mut value = raw;
        if let Reading::Pressure(pressure) = self.reading {
            let Some([height, slope]) = pressure_height(pressure) else { return Ok(None) };
            (value.x, scale) = (height, slope);
        }
        let bound = [MAX_HEIGHT, 4.0 * core::f64::consts::PI, 2.0 * MAX_LEVER][sensor];
        if !value.iter().all(|x| x.abs() <= bound) {
            return Ok(None);
        }
        let usual = [usual, HEADING_SIGMA_RAD, BASELINE_SIGMA_M][sensor];
        let sigma = Vector3::from(self.sigma)
            .map(|sigma| if sigma.is_nan() { usual } else { sigma * scale })
            .map(|sigma| sigma.at_most(MAX_SIGMA).at_least(MIN_SIGMAS[sensor]));
        baseline = baseline.map(|x| x.within(MAX_LEVER));
        Ok(Some(Given { sensor, raw, value, sigma, baseline }))
    }
}

impl NavigationFilter {
    /// Processes a reading of an aid.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a standard deviation is not positive, or there is no baseline.
    pub fn update_aid(&mut self, aid: &Aid) -> Result<Verdict, Error> {
        self.update_aid_before(aid, &mut ())
    }

    /// Processes a reading of an aid, with an observer.
    ///
    /// # Errors
    /// As in [`update_aid`](Self::update_aid).
    pub fn update_aid_before<W: Observer>(
        &mut self,
        aid: &Aid,
        observer: &mut W,
    ) -> Result<Verdict, Error> {
        let given = aid.look(self.params.aids.barometer_sigma, self.params.aids.baseline)?;
        let age = self.sensors.time - aid.time;
        let gate = &mut self.aids.gates[aid.sensor()];
        // The age is not a number before the first sample.
        let timely = (-MAX_FIX_LEAD_S..=MAX_FIX_AGE_S).contains(&age)
            && aid.time >= self.start.time
            && (gate.time.is_nan() || aid.time > gate.time);
        let verdict = match given.filter(|_| timely) {
            Some(given) => {
                gate.time = aid.time;
                self.take_aid(&given, age, observer)
            }
            None => Verdict::Refused,
        };
        self.aids.gates[aid.sensor()].counts[verdict as usize] += 1;
        Ok(verdict)
    }

    fn take_aid<W: Observer>(&mut self, given: &Given, age: f64, observer: &mut W) -> Verdict {
        if !self.navigating {
            return if given.sensor == 1 {
                self.start_heading(given, age)
            } else {
                Verdict::Refused
            };
        }
        self.begin_aid_constant(given, age);
        self.propagate(observer);
        if !self.navigating {
            return Verdict::Refused;
        }
        let Some(measured) = self.measure_aid(given, age) else { return Verdict::Refused };
        match self.gate_aid(given, &measured, observer) {
            _ if !self.navigating => Verdict::Refused,
            true => Verdict::Used,
            false => Verdict::Rejected,
        }
    }

    /// Sets the barometer's reference by its first reading, or begins the compass's offset.
    fn begin_aid_constant(&mut self, given: &Given, age: f64) {
        let Some(constant) = constant_of(given.sensor) else { return };
        if self.covariance.has_constant(constant) {
            return;
        }
        if constant == BAROMETER {
            self.aids.reference = given.value.x - self.height_at(age);
            self.covariance.begin_constant(BAROMETER, REFERENCE_SIGMA_M);
        } else {
            self.covariance.begin_constant(COMPASS, self.params.aids.compass_sigma);
        }
        if self.aids.walked.is_nan() {
            self.aids.walked = self.sensors.time;
        }
    }

    /// Propagates the constants of the aids to the present, and adds the variances of detected
    /// changes.
    #[inline(never)]
    pub(crate) fn walk_constants(&mut self) {
        let seconds = (self.sensors.time - self.aids.walked).at_least(0.0);
        self.aids.walked = self.sensors.time;
        let walks = [self.params.aids.barometer_walk, self.params.aids.compass_walk];
        let gains = core::mem::take(&mut self.aids.gains);
        for (k, constant) in [BAROMETER, COMPASS].into_iter().enumerate() {
            let room = MAX_GAIN - self.covariance.constant_variance(constant).min(MAX_GAIN);
            let more = walks[k] * walks[k] * seconds + gains[k];
            self.covariance.widen_constant(constant, more.min(room));
        }
    }

    /// Height of the sensor `age` seconds ago, m.
    fn height_at(&self, age: f64) -> f64 {
        let down = self.motion.velocity.z * age - self.motion.acceleration.z * (0.5 * age * age);
        self.motion.height + down
    }

    /// Heading `age` seconds ago, rad, and its derivatives by rotations about north, east and down;
    /// `None` if the forward axis is nearly vertical.
    fn heading_at(&self, age: f64) -> Option<(f64, Vector3<f64>)> {
        let attitude = &self.motion.attitude;
        let (north, east, down) = (attitude.m11, attitude.m21, attitude.m31);
        let level = north * north + east * east;
        if level < MIN_LEVEL_SQUARED {
            return None;
        }
        let slope = -down / level;
        let row = Vector3::new(slope * north, slope * east, 1.0);
        let rate = attitude * (self.sensors.gyro - self.gyro_bias);
        Some((self.motion.heading() - row.dot(&rate) * age, row))
    }

    fn measure_aid(&self, given: &Given, age: f64) -> Option<Measured> {
        let (mut z, mut rows) = (Vector3::zeros(), [[0.0; 16]; 3]);
        let (mut axes, mut error) = (1, z);
        match given.sensor {
            0 => {
                z.x = (given.value.x - self.aids.reference - self.height_at(age))
                    .within(MAX_INNOVATION);
                rows[0][R + 2] = 1.0;
                error.x = z.x;
            }
            1 => {
                let (heading, row) = self.heading_at(age)?;
                z.x = wrap(given.value.x - self.aids.offset - heading);
                rows[0][PHI..PHI + 3].copy_from_slice(row.as_slice());
                error.x = z.x;
            }
            _ => {
                let attitude = &self.motion.attitude;
                let rate = self.sensors.gyro - self.gyro_bias;
                let turned = attitude * given.baseline;
                z = turned - attitude * rate.cross(&given.baseline) * age - given.value;
                z = z.map(|x| x.within(MAX_INNOVATION));
                let matrix = turned.cross_matrix();
                for (i, row) in rows.iter_mut().enumerate() {
                    (0..3).for_each(|j| row[PHI + j] = matrix[(i, j)]);
                }
                (axes, error) = (3, attitude.transpose() * z);
            }
        }
        Some(Measured { axes, z, rows, constant: constant_of(given.sensor), error })
    }

    /// Processes a reading if the gate accepts it.
    fn gate_aid<W: Observer>(
        &mut self,
        given: &Given,
        measured: &Measured,
        observer: &mut W,
    ) -> bool {
        let time = self.sensors.time;
        let moving = self.is_moving();
        let gate = &mut self.aids.gates[given.sensor];
        let broken = gate.is_frozen(gate.time, &given.raw, moving) || !has_length(given);
        gate.noise.learn(time, &measured.z);
        let noise = self.aid_noise(given);
        let before = self.covariance;
        let mut found = [0.0; STATES];
        let new = self.correct_aid(measured, &noise, &mut found, observer);
        let gate = &mut self.aids.gates[given.sensor];
        gate.new = new;
        gate.average(measured.axes);
        let limit = if measured.axes == 1 { MAX_NIS } else { MAX_BASELINE_NIS };
        let passes = gate.nis(measured.axes) <= limit;
        let decision = if broken {
            gate.freeze();
            AidDecision::Reject
        } else {
            let patience = &PATIENCE[given.sensor];
            gate.decide(time, passes, &measured.error, noise.amax(), patience)
        };
        if decision == AidDecision::Take {
            self.apply(&found, observer);
            return true;
        }
        self.covariance = before;
        if !self.covariance.considers_antenna() {
            observer.drop_scalars(measured.axes);
        }
        if decision == AidDecision::Change {
            self.change_constant(measured);
        }
        false
    }

    fn correct_aid<W: Observer>(
        &mut self,
        measured: &Measured,
        noise: &Vector3<f64>,
        found: &mut Errors,
        observer: &mut W,
    ) -> [Innovation; 3] {
        let mut constants = [0.0; CONSTANTS];
        let estimated = |constant: &usize| self.covariance.has_constant(*constant);
        if let Some(constant) = measured.constant.filter(estimated) {
            constants[constant] = 1.0;
        }
        let mut new = [Innovation::NONE; 3];
        for (i, new) in new.iter_mut().enumerate().take(measured.axes) {
            let (h, z, noise) = (&measured.rows[i], measured.z[i], noise[i]);
            let covariance = &mut self.covariance;
            *new = if covariance.1.is_some() {
                covariance.correct_with_constants(h, &constants, z, noise, found, observer)
            } else {
                covariance.correct(h, z, noise, found, observer)
            };
        }
        new
    }

    /// Noise variance of each axis, limited to the largest value of a working sensor.
    fn aid_noise(&self, given: &Given) -> Vector3<f64> {
        let most = MAX_LEARNED_SIGMAS[given.sensor];
        let (noise, adapt) = (&self.aids.gates[given.sensor].noise, self.params.adapt);
        Vector3::from_fn(|i, _| {
            let stated = given.sigma[i] * given.sigma[i];
            let limit = stated.max(most * most);
            if adapt == Adapt::Fixed { stated } else { noise.variance(i, stated, adapt).min(limit) }
        })
    }

    /// Changes the sensor's constant, if it has one, by the difference of the reading.
    #[cold]
    fn change_constant(&mut self, measured: &Measured) {
        let estimated = |constant: &usize| self.covariance.has_constant(*constant);
        if let Some(constant) = measured.constant.filter(estimated) {
            let gain = &mut self.aids.gains[constant - BAROMETER];
            *gain = (CHANGE_FACTOR * measured.z.x * measured.z.x).min(MAX_GAIN);
        }
    }

    fn is_moving(&self) -> bool {
        let variance = (V..PHI).map(|i| self.sigma[i] * self.sigma[i]).sum::<f64>();
        self.motion.velocity.norm() >= MAX_REST_SPEED_M_S + 3.0 * variance.simd_sqrt()
    }

    /// Before the first fix: sets the heading of the level body to the mean of the readings.
    fn start_heading(&mut self, given: &Given, age: f64) -> Verdict {
        let begun = self.aids.start;
        if (self.heading_known && begun.is_none()) || self.sensors.gyro_age > MAX_UNKNOWN_S {
            return Verdict::Refused;
        }
        let Some((heading, _)) = self.heading_at(age) else { return Verdict::Refused };
        let off = wrap(given.value.x - self.aids.offset - heading);
        let variance = given.sigma.x * given.sigma.x;
        // The mean restarts if a reading disagrees with it.
        let agrees = off * off <= MAX_START_SIGMAS * MAX_START_SIGMAS * 2.0 * variance;
        let before = begun.filter(|_| agrees).map_or(0.0, |start| start.count);
        let count = (before + 1.0).min(MAX_START_COUNT);
        let turn = rotation(&Vector3::new(0.0, 0.0, off / count));
        self.motion.attitude = turn * self.motion.attitude;
        let time = self.sensors.time;
        self.aids.start = Some(HeadingStart { count, variance: variance / count, time });
        self.heading_known = true;
        Verdict::Used
    }

    /// Variance of a heading from the compass at the first fix; its error equals the offset's
    /// error.
    pub(crate) fn take_heading_start(&mut self) -> Option<f64> {
        let start = self.aids.start.take()?;
        if !self.covariance.has_constant(COMPASS) {
            self.covariance.begin_constant(COMPASS, self.params.aids.compass_sigma);
        }
        if self.aids.walked.is_nan() {
            self.aids.walked = self.sensors.time;
        }
        let t = self.sensors.time - start.time;
        let bias = self.covariance.at(GYRO + 2, GYRO + 2);
        let drift = (self.params.gyro_noise[2] + bias * t) * t;
        Some(start.variance + self.covariance.constant_variance(COMPASS) + drift)
    }

    /// State of each sensor of [`AID_SENSORS`].
    pub fn aids(&self) -> [AidReport; 3] {
        core::array::from_fn(|k| {
            let gate = &self.aids.gates[k];
            let axes = if k == 2 { 3 } else { 1 };
            let sigma = gate.noise.standard_deviations()[..axes]
                .iter()
                .fold(0.0, |a: f64, b| if b.is_nan() { f64::NAN } else { a.max(*b) });
            let (counts, nis, disturbed) = (gate.counts, gate.nis(axes), gate.disturbed);
            AidReport { counts, nis, sigma, disturbed }
        })
    }

    /// Barometric height minus ellipsoidal height, m, and its standard deviation; NaN before the
    /// first reading.
    pub fn height_reference(&self) -> [f64; 2] {
        self.aid_constant(BAROMETER, self.aids.reference, self.params.aids.barometer_walk)
    }

    /// Compass reading minus true heading, rad, and its standard deviation; NaN before the first
    /// reading.
    pub fn compass_offset(&self) -> [f64; 2] {
        self.aid_constant(COMPASS, self.aids.offset, self.params.aids.compass_walk)
    }

    fn aid_constant(&self, constant: usize, value: f64, walk: f64) -> [f64; 2] {
        if !self.covariance.has_constant(constant) {
            return [f64::NAN; 2];
        }
        let seconds = (self.sensors.time - self.aids.walked).at_least(0.0);
        let variance = self.covariance.constant_variance(constant) + walk * walk * seconds;
        [value, variance.at_least(0.0).simd_sqrt()]
    }

    /// Bits of the usable outputs, in the order of [`OUTPUTS`](super::OUTPUTS).
    pub fn usable(&self) -> u8 {
        self.usable
    }
}

/// Index of the constant in the readings of a sensor.
fn constant_of(sensor: usize) -> Option<usize> {
    [Some(BAROMETER), Some(COMPASS), None][sensor]
}

/// True if a measured baseline has the known length; for other readings true.
fn has_length(given: &Given) -> bool {
    if given.sensor != 2 {
        return true;
    }
    let known = given.baseline.norm();
    let limit = MAX_LENGTH_SIGMAS * given.sigma.amax() + MAX_LENGTH_SHARE * known;
    (given.value.norm() - known).abs() <= limit
}

#[cfg(test)]
mod tests {
    use super::pressure_height;

    #[test]
    fn heights_are_those_of_the_standard_atmosphere() {
        let table = [
            (101_325.0, 0.0),
            (89_874.6, 1_000.0),
            (54_019.9, 5_000.0),
            (22_632.06, 11_000.0),
            (12_044.6, 15_000.0),
            (5_474.89, 20_000.0),
        ];
        for (pressure, expected) in table {
            let [height, slope] = pressure_height(pressure).expect("in the table");
            assert!((height - expected).abs() < 0.5, "{pressure}: {height}");
            let [other, _] = pressure_height(pressure.min(101_324.0) + 1.0).expect("near");
            let [base, _] = pressure_height(pressure.min(101_324.0)).expect("near");
            assert!(((base - other) / slope - 1.0).abs() < 1e-3, "{pressure}");
        }
        assert!(pressure_height(1_013.25).is_none() && pressure_height(f64::NAN).is_none());
    }
}
