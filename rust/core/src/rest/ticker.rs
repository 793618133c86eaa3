//! Ticks: sums over a quarter of a second of samples.

use serde::{Deserialize, Serialize};

use super::MIN_SAMPLES;
use super::gate::{Gate, Zone};
use super::repeats::Repeats;
use super::sums::Sums;
use crate::math::validity::{is_sample, is_size, is_within};
use crate::math::{Limits, Real, choose};

/// Number of ticks in a row that are lost to rounding by origin or unit, after which both are
/// learned again.
const MAX_SWALLOWED_TICKS: u32 = 4;

/// Limits for an origin far from all samples: ratio of level to origin, and ratio of standard
/// deviation and steps to the rounding of the origin.
const MAX_LEVEL_RATIO: f64 = 1e-3;
const MAX_ROUNDING_RATIO: f64 = 16.0;

/// Smallest ratio of level and standard deviation to the bound, if the unit is far too small.
const MIN_BOUND_RATIO: f64 = 0.1;

/// Largest number of ticks for which few samples wait for more: sixteen seconds.
const MAX_WAIT_TICKS: u32 = 64;

/// Largest number of steps by which a coarse output leaves a constant value: two, with a margin for
/// rounding.
pub(super) const MAX_COARSE_STEPS: f64 = 2.5;

/// Share of a tick's distance by which the centre follows it; in motion it follows fully.
const CENTRE_GAIN: f64 = 0.25;

/// Sums over the samples of the present tick.
///
/// Samples are relative to the first sample, in units of the first difference that is not zero, and
/// summed about the level of the previous ticks. Neither an offset nor a unit reduces precision. A
/// tick's statistics exclude outliers, found by a [`Gate`], and samples of a stuck sensor, found by
/// [`Repeats`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Ticker<T> {
    pub(super) length: u32,
    /// NaN before the first sample.
    pub(super) origin: T,
    /// Unit; zero while all samples are equal.
    pub(super) unit: T,
    pub(super) inverse: T,
    pub(super) bound: T,
    /// Previous sample in the samples' unit; NaN after a missing sample.
    pub(super) previous: T,
    /// Smallest difference of successive samples to date that is not zero, in their unit.
    pub(super) step: T,
    /// Number of ticks in a row that are lost to rounding by origin or unit.
    pub(super) swallowed: u32,
    pub(super) centre: T,
    pub(super) position: u32,
    pub(super) repeats: Repeats,
    pub(super) gate: Gate<T>,
    /// Sums of all samples, and of the samples that pass the gate.
    pub(super) plain: Sums<T>,
    pub(super) kept: Sums<T>,
    /// Number of ticks in a row with too few samples for a decision.
    pub(super) waited: u32,
}

/// Relation of a sample to the run of equal samples at the previous sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Run {
    /// It differs from the previous sample, or one of them is missing.
    Begins,
    /// It repeats the previous sample, as a working sensor may do.
    GoesOn,
    /// It repeats the previous sample, and with it the run means a stuck sensor.
    Stuck,
}

/// One tick, in the ticker's own units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TickSums<T> {
    /// Number of samples that count; zero if the tick is lost to rounding or waits for the next
    /// tick.
    pub count: u32,
    /// Mean of the samples, in their unit.
    pub mean: T,
    /// Standard deviation of the samples, in their unit.
    pub deviation: T,
    /// Mean of the samples without the farthest sample.
    pub level: T,
    /// Variance of the samples about `level`, without the farthest sample.
    pub variance: T,
    /// Factor from a difference from the level to the standard deviations of a full tick.
    pub weight: T,
    /// One step of the sensor's output, which is never motion.
    pub step: T,
    /// Number of outliers.
    pub outliers: u32,
    /// Number of samples of a stuck sensor.
    pub stuck: u32,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> TickSums<T> {
    /// Degrees of freedom of the variance.
    pub(super) fn freedom(&self) -> T {
        T::of(f64::from(self.count) - 2.0)
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Ticker<T> {
    pub(super) fn new(rate: f64, length: u32) -> Self {
        let zero = T::zero();
        Self {
            length,
            origin: T::of(f64::NAN),
            unit: zero,
            inverse: zero,
            bound: level_max(),
            previous: T::of(f64::NAN),
            step: T::MAX,
            swallowed: 0,
            centre: zero,
            position: 0,
            repeats: Repeats::new(),
            gate: Gate::new(rate),
            plain: Sums::none(),
            kept: Sums::none(),
            waited: 0,
        }
    }

    /// True if learning from the first second is over.
    #[cfg(feature = "std")]
    pub(super) fn is_settled(&self) -> bool {
        !self.gate.learns() && self.unit != T::zero()
    }

    /// Processes one sample; returns the tick that it completes.
    #[inline(always)]
    pub(super) fn observe(&mut self, z: T) -> Option<TickSums<T>> {
        if z.finite() {
            self.take(z.within(T::MAX_RAW));
        } else {
            self.interrupt();
        }
        self.position += 1;
        self.finished()
    }

    /// The tick, if all its samples have come.
    #[inline(always)]
    pub(super) fn finished(&mut self) -> Option<TickSums<T>> {
        (self.position >= self.length).then(|| self.end())
    }

    /// Sums are one sample behind: only the next sample shows whether its run of equal samples
    /// continues.
    #[inline(always)]
    fn take(&mut self, z: T) {
        if self.gate.learns() {
            self.gate.learn(z);
        }
        if z == self.previous {
            return self.repeats.go_on();
        }
        self.add_held();
        if self.unit == T::zero() {
            self.find_unit(z);
        }
        let change = (z - self.previous).simd_abs();
        if change < self.step {
            self.step = change;
        }
        self.repeats.begin(change <= T::of(MAX_COARSE_STEPS) * self.step);
        self.previous = z;
    }

    #[cold]
    fn interrupt(&mut self) {
        self.add_held();
        self.repeats.interrupt();
        self.previous = T::of(f64::NAN);
    }

    /// Adds the last samples, which are all equal.
    #[inline(always)]
    fn add_held(&mut self) {
        let times = self.repeats.take();
        if times == 0 {
            return;
        }
        let distance = self.distance(self.previous);
        self.plain.add(distance, times);
        if let Zone::Counts(distance) = self.gate.take(distance, times) {
            self.kept.add(distance, times);
        }
    }

    /// Distance from the centre, in the ticker's unit.
    #[inline(always)]
    fn distance(&self, z: T) -> T {
        ((z - self.origin) * self.inverse).within(self.bound) - self.centre
    }

    #[cold]
    fn find_unit(&mut self, z: T) {
        if !self.origin.finite() {
            self.origin = z;
        }
        let difference = (z - self.origin).simd_abs();
        if difference > T::zero() {
            self.unit = difference;
            self.inverse = T::one() / difference.at_least(T::TINY);
        }
    }

    /// A sample limited by the gate before its tick is complete; NaN if it is far from the level or
    /// the sensor is stuck.
    pub(super) fn gate_sample(&self, z: T) -> T {
        if self.is_stuck() && z == self.previous || !z.finite() {
            return T::of(f64::NAN);
        }
        let z = z.within(T::MAX_RAW);
        let distance = self.distance(z);
        match self.gate.zone(distance) {
            Zone::Far => T::of(f64::NAN),
            Zone::Counts(near) if near == distance => z,
            Zone::Counts(near) => self.origin + self.unit * (self.centre + near),
        }
    }

    /// Relation of the next sample to the run of equal samples at the last sample.
    pub(super) fn run_with(&self, z: T) -> Run {
        match z == self.previous {
            false => Run::Begins,
            true if self.repeats.is_stuck_by_one_more() => Run::Stuck,
            true => Run::GoesOn,
        }
    }

    /// True if the sensor has given the same sample for longer than chance does.
    pub(super) fn is_stuck(&self) -> bool {
        self.repeats.is_stuck()
    }

    /// Number of samples that may be found to be outliers, or from a stuck sensor, at the end of
    /// the tick.
    pub(super) fn pending(&self) -> u32 {
        let waiting = self.plain.count.saturating_add(self.repeats.held());
        waiting.max(self.repeats.pending())
    }

    #[cold]
    fn end(&mut self) -> TickSums<T> {
        self.add_held();
        let stuck = self.repeats.end_tick::<T>();
        self.position = 0;
        let far = self.plain.count - self.kept.count;
        let enough = self.plain.count >= MIN_SAMPLES;
        let exits = enough && self.gate.exits(self.plain.count);
        let used = if exits { self.plain } else { self.kept };
        let seen = TickSums { stuck, ..self.summarise(&used) };
        if used.count < MIN_SAMPLES {
            self.wait();
            return TickSums { count: 0, ..seen };
        }
        self.note_swallowed();
        self.begin(&used, exits);
        let outliers = if exits { 0 } else { far };
        TickSums { count: if self.swallowed > 0 { 0 } else { seen.count }, outliers, ..seen }
    }

    /// Statistics of sums.
    fn summarise(&self, sums: &Sums<T>) -> TickSums<T> {
        let (above, variance) = sums.without_farthest(self.rounding(sums));
        let level = self.centre + above;
        let share = T::of(f64::from(sums.count)) / T::of(f64::from(self.length));
        // Sums of equal samples differ from their mean by some rounding errors.
        let rounding = T::ROUNDING * level.simd_abs();
        TickSums {
            count: sums.count,
            mean: self.origin + self.unit * (self.centre + sums.mean()),
            deviation: self.unit * sums.variance_about_mean().simd_sqrt(),
            level,
            variance,
            weight: share.at_most(T::one()).simd_sqrt(),
            step: self.least_step().at_least(rounding),
            outliers: 0,
            stuck: 0,
        }
    }

    /// Rounding of distances, from a centre that is the result of many ticks.
    fn rounding(&self, sums: &Sums<T>) -> T {
        T::of(8.0) * T::ROUNDING * (self.centre.simd_abs() + sums.range())
    }

    /// Begins a rest with samples of this variance.
    pub(super) fn rest(&mut self, variance: T) {
        self.gate.rest(variance.simd_sqrt(), self.least_step());
    }

    /// Smallest step to date, zero without a step.
    fn least_step(&self) -> T {
        choose(self.step < T::MAX, self.step * self.inverse, T::zero()).at_most(self.bound)
    }

    /// Smallest step to date in the samples' unit.
    #[cfg(feature = "std")]
    pub(super) fn resolution(&self) -> T {
        choose(self.step < T::MAX, self.step, T::zero())
    }

    /// Lets few samples wait for the samples of the next ticks.
    fn wait(&mut self) {
        self.waited += 1;
        if self.waited > MAX_WAIT_TICKS {
            self.gate.forget_tick();
            (self.plain, self.kept, self.waited) = (Sums::none(), Sums::none(), 0);
        }
    }

    /// True if neither origin nor unit fits the samples, because the first samples were far from
    /// all others.
    pub(super) fn is_lost(&self) -> bool {
        self.swallowed >= MAX_SWALLOWED_TICKS
    }

    /// Counts ticks with samples that are lost to rounding next to the origin, or exceed the range
    /// of the unit.
    fn note_swallowed(&mut self) {
        let (above, variance) = self.plain.without_farthest(self.rounding(&self.plain));
        let level = self.centre + above;
        let mean = self.origin + self.unit * (self.centre + self.plain.mean());
        let (origin, deviation) = (self.origin.simd_abs(), variance.simd_sqrt());
        let rounding = T::of(MAX_ROUNDING_RATIO) * T::ROUNDING * origin;
        let coarse = self.step <= rounding && self.unit * deviation <= rounding;
        let far_origin = coarse && mean.simd_abs() < T::of(MAX_LEVEL_RATIO) * origin;
        let range = self.plain.range();
        let small = range > T::zero() && range < T::one() / self.bound;
        let large = level.simd_abs() + deviation >= self.bound * T::of(MIN_BOUND_RATIO);
        self.swallowed = if far_origin || small || large { self.swallowed + 1 } else { 0 };
    }

    /// Begins the next tick, after a tick with these sums.
    fn begin(&mut self, used: &Sums<T>, exits: bool) {
        let step = self.least_step();
        let (above, _) = used.without_farthest(self.rounding(used));
        self.gate.end_tick(self.plain.count, exits, step);
        self.centre += above * T::of(if exits { 1.0 } else { CENTRE_GAIN });
        if self.gate.learns() && self.unit > T::zero() {
            self.gate.start(self.inverse, step);
            self.centre = ((self.gate.median() - self.origin) * self.inverse).within(self.bound);
        }
        (self.plain, self.kept, self.waited) = (Sums::none(), Sums::none(), 0);
    }
}

/// Largest sample in the ticker's units: fourth powers of differences must be finite.
pub(super) fn level_max<T: Limits + Real<Element = T>>() -> T {
    T::MAX_DIFFERENCE.simd_sqrt()
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Ticker<T> {
    /// True if samples can have changed `fresh` to this state.
    pub(super) fn is_after(&self, fresh: &Self) -> bool {
        // The raw value must not overflow.
        let reach = (T::MAX_RAW * T::of(4.0) * self.inverse).at_most(self.bound);
        // Some samples wait for the samples of the next ticks.
        let most = self.position.saturating_add(self.length).saturating_add(MIN_SAMPLES);
        (self.length, self.bound) == (fresh.length, fresh.bound)
            && is_sample(self.origin, T::MAX_RAW)
            && self.has_unit()
            && is_sample(self.previous, T::MAX_RAW)
            && self.swallowed < MAX_SWALLOWED_TICKS
            && self.step > T::zero()
            && self.step <= T::MAX
            && is_within(self.centre, reach + reach)
            && self.position < self.length
            && self.repeats.is_valid(self.position, self.previous.finite())
            && self.gate.is_after(&fresh.gate, most, self.bound + self.bound)
            && self.plain.is_valid(most, reach * T::of(4.0))
            && self.kept.is_valid(self.plain.count, reach * T::of(4.0))
            && self.waited <= MAX_WAIT_TICKS
    }

    fn has_unit(&self) -> bool {
        let inverse = match self.unit == T::zero() {
            true => T::zero(),
            false => T::one() / self.unit.at_least(T::TINY),
        };
        is_size(self.unit, T::MAX_RAW + T::MAX_RAW)
            && self.inverse == inverse
            && (self.origin.finite() || self.unit == T::zero())
    }
}
