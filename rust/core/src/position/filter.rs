//! The stream of fixes: missing fixes, times, and methods.
#![allow(non_snake_case)]

use nalgebra::{ComplexField, SMatrix};
use serde::{Deserialize, Serialize};

use super::options::{MAX_WINDOW, PositionConstants, PositionMethod, PositionParams};
use super::pair::{Pair, Plane, Step};
use crate::error::Error;
use crate::math::Real;
use crate::math::validity::{are_within, is_count, is_within};
use crate::stream::checkpoint::Checkpoint;
use crate::stream::{Field, Input, Output, Shape, Stream, Traced};

/// Largest coordinate and velocity of a sample, far above real values.
const MAX_SAMPLE: f64 = 1e150;
/// Longest time between two samples, s.
const MAX_SPAN: f64 = 1e9;
/// Smallest strength of a strong signal, dB-Hz; a strength below zero is missing.
const MIN_STRONG_DB_HZ: f64 = 45.0;
/// Time after which a missing velocity is unknown, s.
const MAX_UNKNOWN_S: f64 = 100.0;
/// Standard deviation of an unknown velocity, as a multiple of `sigma` per second.
const DIFFUSE_SIGMAS: f64 = 100.0;

/// A fix; missing values are NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fix {
    /// Position east and north, m.
    pub position: [f64; 2],
    /// Doppler velocity east and north, m/s.
    pub speed: [f64; 2],
    /// Strength of the signals, carrier over noise density, dB-Hz.
    pub cn0: f64,
    /// True if the platform is known to be at rest.
    pub rest: bool,
    /// Time since the previous fix, s; NaN for one period of the rate.
    pub dt: f64,
}

impl Input for Fix {
    const NUMBERS: usize = 7;

    #[inline(always)]
    fn read(z: &[f64]) -> Self {
        let z: &[f64; 7] = z.first_chunk().expect("as many numbers as a fix has");
        // A value that is not finite is unknown, including the flag of rest.
        let rest = z[5] > 0.5 && z[5].is_finite();
        Self { position: [z[0], z[1]], speed: [z[2], z[3]], cn0: z[4], rest, dt: z[6] }
    }
}

/// All estimates after a fix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionSnapshot {
    /// Position east and north, m; NaN before the first fix.
    pub position: [f64; 2],
    /// Standard deviation of the position per axis, m; NaN if the method has none.
    pub sigma: f64,
    /// Velocity east and north, m/s; NaN if the method has none.
    pub velocity: [f64; 2],
    /// Slow error of the receiver, m; NaN if the method has none.
    pub receiver_error: [f64; 2],
    /// True if the fix was missing.
    pub missing: bool,
    /// True if the fix was present but not used.
    pub held: bool,
}

impl Output for PositionSnapshot {
    const FIELDS: &'static [Field] = &[
        Field { name: "position", shape: Shape::Vector(2) },
        Field { name: "sigma", shape: Shape::Number },
        Field { name: "velocity", shape: Shape::Vector(2) },
        Field { name: "receiver_error", shape: Shape::Vector(2) },
        Field { name: "missing", shape: Shape::Flag },
        Field { name: "held", shape: Shape::Flag },
    ];

    #[inline(always)]
    fn write(self, numbers: &mut [f64], flags: &mut [bool]) {
        numbers[..2].copy_from_slice(&self.position);
        numbers[2] = self.sigma;
        numbers[3..5].copy_from_slice(&self.velocity);
        numbers[5..7].copy_from_slice(&self.receiver_error);
        (flags[0], flags[1]) = (self.missing, self.held);
    }
}

/// Position filter with one of the methods.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PositionFilter {
    params: PositionParams,
    period: f64,
    /// True if there was a fix.
    begun: bool,
    /// True if the last fix was missing, or was not used.
    missing: bool,
    held: bool,
    samples: u64,
    state: State,
}

/// State of each method. Before the first fix only the velocity of [`Aided`] is read.
// The moving average is by far the largest. It is not boxed, since a step may not allocate.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum State {
    Aided(Aided),
    Average(Average),
    /// Constant velocity, for methods "kalman" and "strength".
    Constant(Pair),
    Course(Course),
}

impl PositionFilter {
    /// A filter before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a parameter is out of range.
    pub fn new(params: PositionParams) -> Result<Self, Error> {
        let params = params.validate()?;
        let state = match params.method {
            PositionMethod::Aided => State::Aided(Aided::new()),
            PositionMethod::MovingAverage => State::Average(Average::new()),
            PositionMethod::Kalman | PositionMethod::Strength => State::Constant(Pair::unknown()),
            PositionMethod::Heading => State::Course(Course::new()),
        };
        let period = 1.0 / params.rate;
        Ok(Self { params, period, begun: false, missing: false, held: false, samples: 0, state })
    }

    /// Parameters of the filter.
    pub fn params(&self) -> &PositionParams {
        &self.params
    }

    /// Samples to date, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.samples
    }

    /// Variance of a fix's white noise at this strength: the sigma-ε form.
    fn noise(&self, cn0: f64) -> f64 {
        let sigma = self.params.constants.sigma;
        let weighed =
            matches!(self.params.method, PositionMethod::Strength | PositionMethod::Aided);
        if !weighed || !cn0.is_finite() {
            return sigma * sigma;
        }
        let tenths = (MIN_STRONG_DB_HZ - cn0.clamp(0.0, MIN_STRONG_DB_HZ)) / 10.0;
        sigma * sigma * ComplexField::exp(core::f64::consts::LN_10 * tenths)
    }

    fn position(&self) -> Plane {
        if !self.begun {
            return [f64::NAN; 2];
        }
        match &self.state {
            State::Aided(aided) => aided.position(),
            State::Average(average) => average.mean,
            State::Constant(pair) => pair.first(),
            State::Course(course) => course.position,
        }
    }
}

impl Stream for PositionFilter {
    type Input = Fix;
    type Output = [f64; 2];

    fn update(&mut self, fix: Fix) -> [f64; 2] {
        let dt = if fix.dt >= 0.0 { fix.dt.min(MAX_SPAN) } else { self.period.min(MAX_SPAN) };
        let (known, R) = (plane(fix.position), self.noise(fix.cn0));
        let constants = &self.params.constants;
        let begins = !self.begun && known.is_some();
        self.held = false;
        match &mut self.state {
            State::Aided(aided) => aided.take(known, &fix, R, dt, self.begun, constants),
            State::Average(average) => average.take(known, self.params.window()),
            State::Course(course) => self.held = course.take(known, self.begun, constants),
            State::Constant(pair) if begins => {
                let speed = DIFFUSE_SIGMAS * constants.sigma;
                *pair = Pair::measured(known.unwrap_or_default(), R, speed * speed);
            }
            State::Constant(pair) if self.begun => {
                pair.predict(&constant_velocity(constants.process_noise, dt));
                known.into_iter().for_each(|z| pair.correct(z, R));
            }
            State::Constant(_) => {}
        }
        self.begun |= begins;
        self.missing = known.is_none();
        self.samples += 1;
        self.position()
    }

    fn reset(&mut self) {
        if let Ok(new) = Self::new(self.params) {
            *self = new;
        }
    }
}

impl Traced for PositionFilter {
    type Snapshot = PositionSnapshot;

    fn snapshot(&self) -> PositionSnapshot {
        let (mut velocity, mut receiver_error) = ([f64::NAN; 2], [f64::NAN; 2]);
        let mut variance = f64::NAN;
        match &self.state {
            State::Aided(aided) if self.begun => {
                (velocity, receiver_error) = (aided.velocity, aided.pair.second());
                variance = aided.pair.variance_of_difference();
            }
            State::Constant(pair) if self.begun => {
                (velocity, variance) = (pair.second(), pair.variance());
            }
            _ => {}
        }
        // NaN must remain; `max` would replace it.
        let sigma = if variance < 0.0 { 0.0 } else { variance.simd_sqrt() };
        let (position, missing, held) = (self.position(), self.missing, self.held);
        PositionSnapshot { position, sigma, velocity, receiver_error, missing, held }
    }
}

/// The two axes, `None` if an axis is missing.
fn plane(given: Plane) -> Option<Plane> {
    given.iter().all(|x| is_within(*x, MAX_SAMPLE)).then_some(given)
}

/// Position and velocity over a time T: Q = q [T³/3, T²/2; T²/2, T].
fn constant_velocity(q: f64, dt: f64) -> Step {
    let Q = [q * dt * dt * dt / 3.0, q * dt * dt / 2.0, q * dt];
    Step { a: dt, f: 1.0, shift: [0.0; 2], Q }
}

/// Position p and a Gauss-Markov error g of the receiver. The states are the receiver's position s
/// = p + g, which is measured, and g.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Aided {
    pair: Pair,
    /// The last known velocity, and the time since it, s.
    velocity: Plane,
    unknown: f64,
    /// True if the last sample was at rest.
    at_rest: bool,
}

impl Aided {
    fn new() -> Self {
        Self { pair: Pair::unknown(), velocity: [0.0; 2], unknown: MAX_UNKNOWN_S, at_rest: false }
    }

    fn position(&self) -> Plane {
        let (shown, error) = (self.pair.first(), self.pair.second());
        [shown[0] - error[0], shown[1] - error[1]]
    }

    fn take(
        &mut self,
        known: Option<Plane>,
        fix: &Fix,
        R: f64,
        dt: f64,
        begun: bool,
        constants: &PositionConstants,
    ) {
        let (moved, sigma) = self.moved(fix, dt, constants);
        let spread = constants.error_sigma * constants.error_sigma;
        match known {
            Some(z) if !begun => self.pair = Pair::measured(z, R, spread),
            _ if begun => {
                self.pair.predict(&wandering(moved, sigma, dt, spread, constants.error_time));
                known.into_iter().for_each(|z| self.pair.correct(z, R));
            }
            _ => {}
        }
    }

    /// Displacement since the previous sample, and its standard deviation per axis. It is zero if
    /// the body rests at the two samples. If rest begins or ends, the body moved between them, and
    /// its velocity at rest is zero.
    fn moved(&mut self, fix: &Fix, dt: f64, constants: &PositionConstants) -> (Plane, f64) {
        let rested = core::mem::replace(&mut self.at_rest, fix.rest);
        let (before, unknown) = (self.velocity, self.unknown);
        let now = if fix.rest { Some([0.0; 2]) } else { plane(fix.speed) };
        self.unknown = if now.is_some() { 0.0 } else { (unknown + dt).min(MAX_UNKNOWN_S) };
        self.velocity = now.unwrap_or(before);
        if rested && fix.rest {
            return ([0.0; 2], 0.0);
        }
        let guessed = constants.acceleration * dt.min(MAX_UNKNOWN_S).max(self.unknown);
        let (mean, sigma) = match now {
            Some(v) if unknown == 0.0 => {
                ([0, 1].map(|i| 0.5 * (v[i] + before[i])), constants.speed_sigma)
            }
            _ => (self.velocity, constants.speed_sigma + guessed),
        };
        (mean.map(|v| v * dt), sigma * dt)
    }

    fn is_valid(&self) -> bool {
        self.pair.is_valid()
            && self.velocity.iter().all(|v| is_within(*v, MAX_SAMPLE))
            && (0.0..=MAX_UNKNOWN_S).contains(&self.unknown)
    }
}

/// s ← s + moved - (1 - f) g, g ← f g with f = exp(-T/τ); 1 - f is computed without a loss of
/// digits.
fn wandering(moved: Plane, sigma: f64, dt: f64, spread: f64, time: f64) -> Step {
    let lost = -ComplexField::exp_m1(-dt / time);
    let grown = -spread * ComplexField::exp_m1(-2.0 * dt / time);
    Step { a: -lost, f: 1.0 - lost, shift: moved, Q: [sigma * sigma + grown, grown, grown] }
}

/// The mean of the last fixes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Average {
    /// Fixes, one per column, as a ring.
    fixes: SMatrix<f64, 2, MAX_WINDOW>,
    count: u8,
    next: u8,
    mean: Plane,
}

impl Average {
    fn new() -> Self {
        Self { fixes: SMatrix::zeros(), count: 0, next: 0, mean: [0.0; 2] }
    }

    /// Adds a fix; a missing fix changes nothing.
    fn take(&mut self, known: Option<Plane>, window: u8) {
        let Some(z) = known else { return };
        self.fixes.set_column(usize::from(self.next), &z.into());
        self.next = (self.next + 1) % window;
        self.count = (self.count + 1).min(window);
        // Summed again each time: a running sum would keep the rounding of every fix.
        let count = usize::from(self.count);
        let sum = self.fixes.columns(0, count).column_sum();
        self.mean = [sum[0] / count as f64, sum[1] / count as f64];
    }

    fn is_valid(&self, window: u8, begun: bool) -> bool {
        are_within(&self.fixes, MAX_SAMPLE)
            && self.count <= window
            && self.next == if self.count < window { self.count } else { self.next % window }
            && (self.count > 0) == begun
            && self.mean.iter().all(|x| is_within(*x, 2.0 * MAX_SAMPLE))
    }
}

/// Last fix that was used, and the step to it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Course {
    position: Plane,
    /// Step; zero before the first step.
    step: Plane,
}

impl Course {
    fn new() -> Self {
        Self { position: [0.0; 2], step: [0.0; 2] }
    }

    /// Processes a fix; true if it is ignored. Steps begin at the last fix that was used: after
    /// `step` metres a body that really turns is followed.
    fn take(&mut self, known: Option<Plane>, begun: bool, constants: &PositionConstants) -> bool {
        let Some(z) = known else { return false };
        if !begun {
            self.position = z;
            return false;
        }
        let step = [z[0] - self.position[0], z[1] - self.position[1]];
        let (long, before) = (length(step), length(self.step));
        let along = step[0] * self.step[0] + step[1] * self.step[1];
        if long < constants.step && along < ComplexField::cos(constants.turn) * long * before {
            return true;
        }
        if long > 0.0 {
            (self.position, self.step) = (z, step);
        }
        false
    }

    fn is_valid(&self) -> bool {
        let step = self.step.iter().all(|x| is_within(*x, 2.0 * MAX_SAMPLE));
        step && self.position.iter().all(|x| is_within(*x, MAX_SAMPLE))
    }
}

fn length(v: Plane) -> f64 {
    (v[0] * v[0] + v[1] * v[1]).simd_sqrt()
}

impl Checkpoint for PositionFilter {
    const TAG: &'static str = "position";
    const VERSION: u16 = 1;

    fn is_valid(&self) -> bool {
        // Later checks need valid parameters.
        if self.params.validate().is_err() {
            return false;
        }
        let state = match (&self.state, self.params.method) {
            (State::Aided(aided), PositionMethod::Aided) => aided.is_valid(),
            (State::Average(average), PositionMethod::MovingAverage) => {
                average.is_valid(self.params.window(), self.begun)
            }
            (State::Constant(pair), PositionMethod::Kalman | PositionMethod::Strength) => {
                pair.is_valid()
            }
            (State::Course(course), PositionMethod::Heading) => course.is_valid(),
            _ => false,
        };
        state
            && self.period == 1.0 / self.params.rate
            && is_count(self.samples)
            && (!self.held || self.params.method == PositionMethod::Heading)
    }

    fn is_like(&self, other: &Self) -> bool {
        (self.params, self.samples) == (other.params, other.samples)
    }
}

#[cfg(test)]
mod tests {
    use super::{Fix, PositionFilter};
    use crate::position::{POSITION_CONSTANTS, PositionConstants, PositionMethod, PositionParams};
    use crate::stream::checkpoint::Checkpoint;
    use crate::stream::{Stream, Traced};
    use proptest::prelude::*;

    const METHODS: [PositionMethod; 5] = [
        PositionMethod::Aided,
        PositionMethod::MovingAverage,
        PositionMethod::Kalman,
        PositionMethod::Heading,
        PositionMethod::Strength,
    ];

    fn number() -> impl Strategy<Value = f64> {
        let decade = -200.0..200.0_f64;
        prop_oneof![
            8 => (-1.0..1.0_f64, decade).prop_map(|(x, decade)| x * 10.0_f64.powf(decade)),
            4 => -10.0..10.0_f64,
            1 => Just(f64::NAN),
            1 => Just(f64::INFINITY),
        ]
    }

    fn fix() -> impl Strategy<Value = Fix> {
        let rest = prop_oneof![3 => Just(false), 1 => Just(true)];
        (prop::array::uniform2(number()), prop::array::uniform2(number()), number(), rest, number())
            .prop_map(|(position, speed, cn0, rest, dt)| Fix { position, speed, cn0, rest, dt })
    }

    proptest! {
        #[test]
        fn no_fix_makes_an_invalid_state(
            ends in prop::collection::vec(0..3_usize, POSITION_CONSTANTS.len()),
            method in prop::sample::select(METHODS.to_vec()),
            fixes in prop::collection::vec(fix(), 1..120),
        ) {
            let mut constants = PositionConstants::default();
            for (row, end) in POSITION_CONSTANTS.iter().zip(ends) {
                if end < 2 {
                    (row.set)(&mut constants, row.range[end]);
                }
            }
            let mut filter = PositionFilter::new(PositionParams { rate: 1.0, method, constants }).unwrap();
            let mut begun = false;
            for fix in fixes {
                begun |= fix.position.iter().all(|x| x.abs() <= 1e150);
                let position = filter.update(fix);
                prop_assert!(filter.is_valid(), "{fix:?}: {filter:?}");
                prop_assert!(position.iter().all(|x| x.is_finite() == begun));
                let sigma = filter.snapshot().sigma;
                prop_assert!(sigma.is_nan() || sigma >= 0.0);
            }
        }
    }
}
