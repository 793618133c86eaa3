//! Ticks: sums over a quarter of a second of samples.

use serde::{Deserialize, Serialize};

use super::MIN_SAMPLES;
use super::gate::{Gate, Zone};
use super::repeats::Repeats;
use super::sums::Sums;
use crate::math::validity::{is_sample, is_size, is_within};
use crate::math::{Limits, Real, choose};

/// Ticks in a row whose samples the origin or the unit swallows, and after which both are lost.
const MAX_SWALLOWED_TICKS: u32 = 4;

/// Level over the origin at most, where the origin is far from all samples; deviation and steps over
/// the rounding of the origin at most, where little of the samples is left next to it.
const MAX_LEVEL_RATIO: f64 = 1e-3;
const MAX_ROUNDING_RATIO: f64 = 16.0;

/// Level and deviation over the bound at least, where the unit is far too small.
const MIN_BOUND_RATIO: f64 = 0.1;

/// Ticks that a few samples wait for more at most: sixteen seconds.
const MAX_WAIT_TICKS: u32 = 64;

/// Steps at most by which a coarse output leaves a value that it has stood still at: two, whatever
/// rounding makes of them.
pub(super) const MAX_COARSE_STEPS: f64 = 2.5;

/// Part of a tick's distance by which the centre follows it; the whole if the sensor moves.
const CENTRE_GAIN: f64 = 0.25;

/// Sums over the samples of the tick that is under way.
///
/// Samples are counted from the first one, in units of the first difference that is not zero, and
/// summed up about the level of the ticks before, so neither an offset nor a unit costs precision.
/// Outliers by a [`Gate`], and samples of a stuck sensor by [`Repeats`], are not
/// in what a tick tells.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Ticker<T> {
    pub(super) length: u32,
    /// NaN before the first sample.
    pub(super) origin: T,
    /// Zero as long as all samples were equal.
    pub(super) unit: T,
    pub(super) inverse: T,
    pub(super) bound: T,
    /// In the unit of the samples; NaN after a missing one.
    pub(super) previous: T,
    /// The smallest difference of successive samples to date that is not zero, in their unit.
    pub(super) step: T,
    /// Ticks in a row that origin or unit has swallowed.
    pub(super) swallowed: u32,
    pub(super) centre: T,
    pub(super) position: u32,
    pub(super) repeats: Repeats,
    pub(super) gate: Gate<T>,
    /// All samples, and those that the gate lets through.
    pub(super) plain: Sums<T>,
    pub(super) kept: Sums<T>,
    /// Ticks in a row that had too few samples for a decision.
    pub(super) waited: u32,
}

/// Relation of a sample to the run of equal ones that the one before it belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Run {
    /// It differs from the one before, or either is missing.
    Begins,
    /// It repeats the one before, as a sensor that works may do.
    GoesOn,
    /// So it does, and with it the run is a stuck sensor's.
    Stuck,
}

/// One tick, in the ticker's own units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TickSums<T> {
    /// Samples that count; none of a tick that origin or unit has swallowed, or that waits for the
    /// next since it has too few.
    pub count: u32,
    /// Mean of the samples, in their unit.
    pub mean: T,
    /// Deviation of the samples, in their unit.
    pub deviation: T,
    /// Mean of the samples without the farthest.
    pub level: T,
    /// Their variance without the farthest, about that mean.
    pub variance: T,
    /// Factor from a difference from the level to the standard deviation of a full tick.
    pub weight: T,
    /// One step of the sensor's output: no motion, however quiet it is.
    pub step: T,
    /// Number of outliers.
    pub outliers: u32,
    /// Samples of a sensor that is stuck.
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

    /// True if nothing of the first second is to be learned any more.
    #[cfg(feature = "std")]
    pub(super) fn is_settled(&self) -> bool {
        !self.gate.learns() && self.unit != T::zero()
    }

    /// Takes one sample; returns the tick that it completes.
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

    /// Sums are a sample behind: only the next tells whether its run of equal ones goes on.
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

    /// From the centre, in the ticker's unit.
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

    /// A sample as the gate sees it before its tick is complete: within the bounds, NaN if it is far
    /// from the level or the sensor is stuck.
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

    /// The relation of the next sample to the run of equal ones that the last one belongs to.
    pub(super) fn run_with(&self, z: T) -> Run {
        match z == self.previous {
            false => Run::Begins,
            true if self.repeats.is_stuck_by_one_more() => Run::Stuck,
            true => Run::GoesOn,
        }
    }

    /// The sensor has given the same sample for longer than chance does.
    pub(super) fn is_stuck(&self) -> bool {
        self.repeats.is_stuck()
    }

    /// Samples to date that the end of the tick may call outliers, or those of a stuck sensor.
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

    /// The statistics of sums.
    fn summarise(&self, sums: &Sums<T>) -> TickSums<T> {
        let (above, variance) = sums.without_farthest(self.rounding(sums));
        let level = self.centre + above;
        let share = T::of(f64::from(sums.count)) / T::of(f64::from(self.length));
        // Sums of samples that are all equal are off their mean by some roundings.
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

    /// Of distances, whose centre has come through the sums of many ticks.
    fn rounding(&self, sums: &Sums<T>) -> T {
        T::of(8.0) * T::ROUNDING * (self.centre.simd_abs() + sums.range())
    }

    /// A rest begins whose samples have this variance.
    pub(super) fn rest(&mut self, variance: T) {
        self.gate.rest(variance.simd_sqrt(), self.least_step());
    }

    /// The smallest step to date, zero if there was none.
    fn least_step(&self) -> T {
        choose(self.step < T::MAX, self.step * self.inverse, T::zero()).at_most(self.bound)
    }

    /// The same in the unit of the samples.
    #[cfg(feature = "std")]
    pub(super) fn resolution(&self) -> T {
        choose(self.step < T::MAX, self.step, T::zero())
    }

    /// Few samples are tested with those of the next ticks.
    fn wait(&mut self) {
        self.waited += 1;
        if self.waited > MAX_WAIT_TICKS {
            self.gate.forget_tick();
            (self.plain, self.kept, self.waited) = (Sums::none(), Sums::none(), 0);
        }
    }

    /// True if neither origin nor unit fits the samples: their first ones were far from all others.
    pub(super) fn is_lost(&self) -> bool {
        self.swallowed >= MAX_SWALLOWED_TICKS
    }

    /// Counts ticks whose samples vanish next to the origin, or leave the range of the unit.
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

    /// The next tick, after one whose sums are used.
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

/// Largest sample in the ticker's own units: fourth powers of differences must be finite.
pub(super) fn level_max<T: Limits + Real<Element = T>>() -> T {
    T::MAX_DIFFERENCE.simd_sqrt()
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Ticker<T> {
    /// True if samples can have made it of `fresh`.
    pub(super) fn is_after(&self, fresh: &Self) -> bool {
        // Raw, it must not overflow.
        let reach = (T::MAX_RAW * T::of(4.0) * self.inverse).at_most(self.bound);
        // A few samples wait for those of the next ticks.
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
