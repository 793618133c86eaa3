//! Search for the hard iron that explains the field: filters that began at different seconds, and
//! the path of least cost through them.

use nalgebra::{ComplexField, Vector3};
use serde::{Deserialize, Serialize};

use super::sums::{Products, Sums};
use super::ticks::Tick;
use crate::attitude::auto::HeadingCorrection;
use crate::calibrate::magnet::{
    Cost, MAX_EXTRA_COST, MAX_OUTLIER_S, OUTLIER_COST, SPAN_COST, Seen, Span, step_all,
};
use crate::math::validity::{are_within, is_size, is_within};

/// Number of filters.
const FILTERS: usize = 4;
/// Time between two starts, s, and the share of a period that rounding may lose.
const START_INTERVAL_S: f64 = 1.0;
const ROUNDING: f64 = 1e-6;
/// Random walk of the field, in standard deviations of the noise per √s: typical of a room.
const WALK: f64 = 0.5;
/// Time after which the weight of a tick has decreased by a factor of e, s.
const TICK_TIME_CONSTANT_S: f64 = 60.0;
/// Number of ticks whose median gives the size of the field.
const INITIAL_TICKS: usize = 10;
/// Largest ratio of a field to the usual size.
const MAX_FIELD_RATIO: f64 = 20.0;
/// Largest cost; larger costs are not distinguished.
const MAX_COST: f64 = 1e9;
/// Longest time that is counted, s.
const MAX_AGE_S: f64 = 1e9;

/// Noise of a tick: initial value, smallest value, number of ticks for an estimate, rotation needed
/// in them, rate of change, and share of the ticks above it.
const INITIAL_NOISE: f64 = 0.02 * 0.02;
const MIN_NOISE: f64 = 0.005 * 0.005;
const MAX_NOISE: f64 = 1.0;
const NOISE_TICKS: f64 = 20.0;
const MIN_TURN: f64 = 0.3;
const NOISE_GAIN: f64 = 0.2;
const SHARE_ABOVE: f64 = 0.4;

/// One hard iron, from one second on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Start {
    span: Span<f64>,
    pub sums: Sums,
    /// Cost to date minus the cost of the best path with one more span.
    cost: f64,
    pub age: f64,
    /// Derivative of the heading by a hard iron in the sensor's axes since then, and the heading
    /// change by the hard irons subtracted meanwhile, rad.
    shares: Vector3<f64>,
    taken: f64,
}

impl Start {
    fn new(tick: &Tick) -> Self {
        Self {
            span: Span::new(tick.turned.into()),
            sums: Sums::default(),
            cost: 0.0,
            age: 0.0,
            shares: Vector3::zeros(),
            taken: 0.0,
        }
    }

    pub fn iron(&self) -> Vector3<f64> {
        self.span.iron().into()
    }

    /// Heading change by a hard iron that was present all the time and not subtracted.
    pub fn turn_by_iron(&self, iron: &Vector3<f64>) -> f64 {
        self.shares.dot(iron) - self.taken
    }

    /// Processes a tick with this cost in its filter.
    fn take(&mut self, tick: &Products, by: Cost<f64>, seconds: f64) {
        let Cost { determinant, misfit } = by;
        let cost = ComplexField::ln(determinant.max(f64::MIN_POSITIVE)) + misfit;
        self.cost = (self.cost + cost).min(MAX_COST);
        self.age = (self.age + seconds).min(MAX_AGE_S);
        // The same weights as in its filter: outliers count less.
        let weight = if misfit > 9.0 { 18.0 / (misfit + 9.0) } else { 1.0 };
        self.sums.add(tick, weight, (1.0 - seconds / TICK_TIME_CONSTANT_S).max(0.0));
    }

    fn is_valid(&self) -> bool {
        self.span.is_valid()
            && self.sums.is_valid()
            && is_within(self.cost, MAX_COST)
            && is_size(self.age, MAX_AGE_S)
            && are_within(&self.shares, 1e9)
            && is_within(self.taken, 1e12)
    }
}

/// Verdict of the path of least cost on the present second.
#[derive(Debug, Clone, Copy)]
pub enum Present {
    /// There was no field.
    Nothing,
    /// No hard iron explains the field.
    Outlier,
    /// The hard iron of this start explains the field.
    Of(usize),
}

/// Filters, their costs and the noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Learner {
    /// Size of the field in the samples' unit; zero before it is known.
    norm: f64,
    sizes: [f64; INITIAL_TICKS],
    ticks: usize,
    noise: f64,
    windows: f64,
    window: Sums,
    starts: [Option<Start>; FILTERS],
    /// Cost of the path that ends in unexplained seconds, and the number of these seconds.
    outlier_cost: f64,
    outlier_seconds: f64,
    /// Time since the last tick, and time of the present second, s.
    since: f64,
    second: f64,
    seen: bool,
}

impl Default for Learner {
    fn default() -> Self {
        Self {
            norm: 0.0,
            sizes: [0.0; INITIAL_TICKS],
            ticks: 0,
            noise: INITIAL_NOISE,
            windows: 0.0,
            window: Sums::default(),
            starts: [None; FILTERS],
            outlier_cost: 0.0,
            outlier_seconds: 0.0,
            since: 0.0,
            second: 0.0,
            seen: false,
        }
    }
}

impl Learner {
    /// Size of the field, the unit of all values; zero before it is known.
    pub fn norm(&self) -> f64 {
        self.norm
    }

    pub fn start(&self, index: usize) -> Option<&Start> {
        self.starts[index].as_ref()
    }

    /// Notes that the frame of the gyro has changed.
    pub fn interrupt(&mut self) {
        let Self { norm, sizes, ticks, noise, windows, .. } = *self;
        *self = Self { norm, sizes, ticks, noise, windows, ..Self::default() };
    }

    /// Notes the effect of a field on the heading while this hard iron was subtracted.
    pub fn correct_heading(
        &mut self,
        heading_correction: &HeadingCorrection,
        taken: &Vector3<f64>,
    ) {
        let share = heading_correction.share * self.norm;
        for start in self.starts.iter_mut().flatten() {
            start.shares += (share - start.shares) * heading_correction.gain;
            start.taken += (share.dot(taken) - start.taken) * heading_correction.gain;
        }
    }

    /// Notes that the heading was turned by this angle, rad.
    pub fn turn(&mut self, angle: f64) {
        for start in self.starts.iter_mut().flatten() {
            start.taken -= angle;
        }
    }

    /// Notes that the heading no longer depends on any field.
    pub fn forget_heading(&mut self) {
        for start in self.starts.iter_mut().flatten() {
            (start.shares, start.taken) = (Vector3::zeros(), 0.0);
        }
    }

    /// Processes a tick of this duration, s; returns a verdict at the end of a second.
    pub fn take(&mut self, tick: Option<Tick>, seconds: f64) -> Option<Present> {
        self.since += seconds;
        if let Some(tick) = tick.and_then(|tick| self.normalise(tick)) {
            self.see(&tick);
        }
        self.second += seconds;
        if self.second < START_INTERVAL_S - ROUNDING {
            return None;
        }
        self.second = 0.0;
        Some(self.end())
    }

    /// The tick in units of the field's size, once this is known.
    fn normalise(&mut self, tick: Tick) -> Option<Tick> {
        if self.norm == 0.0 {
            self.sizes[self.ticks] = tick.size;
            self.ticks += 1;
            if self.ticks == INITIAL_TICKS {
                self.sizes.sort_unstable_by(f64::total_cmp);
                self.norm =
                    0.5 * (self.sizes[INITIAL_TICKS / 2 - 1] + self.sizes[INITIAL_TICKS / 2]);
                self.ticks = 0;
            }
            return None;
        }
        let size = tick.size / self.norm;
        (size < MAX_FIELD_RATIO).then(|| Tick { turned: tick.turned / self.norm, size, ..tick })
    }

    fn see(&mut self, tick: &Tick) {
        let since = core::mem::take(&mut self.since);
        let products = Products::of(tick);
        self.update_noise(&products);
        if !core::mem::replace(&mut self.seen, true) {
            self.begin(tick);
        }
        let rows: [f64; 9] = core::array::from_fn(|k| tick.rotation[(k / 3, k % 3)]);
        let walked = WALK * WALK * self.noise * since;
        let seen = Seen::of(&tick.turned.into(), &rows, walked, self.noise);
        let mut spans = [Span::new([0.0; 3]); FILTERS];
        for (span, start) in spans.iter_mut().zip(&self.starts) {
            *span = start.map_or(*span, |one| one.span);
        }
        let costs = step_all(&mut spans, &seen);
        for (k, start) in self.starts.iter_mut().enumerate() {
            if let Some(one) = start {
                one.span = spans[k];
                one.take(&products, costs[k], since);
            }
        }
        self.outlier_cost += OUTLIER_COST;
    }

    /// Begins another filter in place of the most expensive filter.
    fn begin(&mut self, tick: &Tick) {
        let dearest = |start: &Option<Start>| start.as_ref().map_or(f64::INFINITY, |one| one.cost);
        let mut index = 0;
        for k in 1..FILTERS {
            if dearest(&self.starts[k]) > dearest(&self.starts[index]) {
                index = k;
            }
        }
        self.starts[index] = Some(Start::new(tick));
    }

    /// Estimates the noise from two seconds of rotation, with the best hard iron.
    fn update_noise(&mut self, tick: &Products) {
        self.window.add(tick, 1.0, 1.0);
        if self.window.weight() < NOISE_TICKS {
            return;
        }
        let window = core::mem::take(&mut self.window);
        if window.turning().trace() < MIN_TURN * MIN_TURN {
            return;
        }
        let Some(iron) = window.iron() else { return };
        let freedom = 3.0 * NOISE_TICKS / (3.0 * NOISE_TICKS - 6.0);
        let above = window.variance(&iron) * freedom > self.noise;
        self.windows += 1.0;
        let step = NOISE_GAIN.max(1.0 / self.windows)
            * if above { 1.0 - SHARE_ABOVE } else { -SHARE_ABOVE };
        self.noise = (self.noise * ComplexField::exp(2.0 * step)).clamp(MIN_NOISE, MAX_NOISE);
    }

    /// Ends a second: drops expensive paths, and makes costs relative to the best path.
    fn end(&mut self) -> Present {
        if !core::mem::take(&mut self.seen) {
            return Present::Nothing;
        }
        self.outlier_seconds += START_INTERVAL_S;
        let (mut least, mut present) = (self.outlier_cost, Present::Outlier);
        for (index, start) in self.starts.iter_mut().enumerate() {
            if let Some(one) = start {
                if !one.is_valid() {
                    *start = None;
                } else if one.cost < least {
                    (least, present) = (one.cost, Present::Of(index));
                }
            }
        }
        let found = least + SPAN_COST;
        for start in &mut self.starts {
            if let Some(one) = start {
                one.cost -= found;
                if one.cost > MAX_EXTRA_COST {
                    *start = None;
                }
            }
        }
        // A run of unexplained seconds continues, or begins after the best path.
        self.outlier_cost -= found;
        if self.outlier_cost > 0.0 || self.outlier_seconds >= MAX_OUTLIER_S as f64 {
            (self.outlier_cost, self.outlier_seconds) = (0.0, 0.0);
        }
        present
    }

    pub fn is_valid(&self) -> bool {
        let sizes = [
            (self.norm, 1e10),
            (self.noise, MAX_NOISE),
            (self.windows, 1e15),
            (self.outlier_seconds, MAX_OUTLIER_S as f64),
            (self.since, MAX_AGE_S),
            (self.second, START_INTERVAL_S),
        ];
        sizes.iter().all(|(x, most)| is_size(*x, *most))
            && self.noise >= MIN_NOISE
            && self.sizes.iter().all(|x| is_size(*x, 1e10))
            && self.ticks < INITIAL_TICKS
            && self.window.is_valid()
            && is_within(self.outlier_cost, MAX_COST)
            && self.starts.iter().flatten().all(Start::is_valid)
    }
}
