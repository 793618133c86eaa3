//! Ticks: sums over a quarter of a second of samples.

use serde::{Deserialize, Serialize};

use super::LEAST;
use crate::math::sound::{is_sample, is_size, is_within};
use crate::math::{Limits, Real, choose};

/// Ticks in a row whose samples the origin or the unit swallows, and after which both are lost.
const LOST: u32 = 4;

/// Level over the origin at most, where the origin is far from all samples; deviation and steps over
/// the rounding of the origin at most, where little of the samples is left beside it.
const FAR: f64 = 1e-3;
const LITTLE: f64 = 16.0;

/// Level and deviation over the bound at least, where the unit is far too small.
const NEAR_BOUND: f64 = 0.1;

/// Sums over the samples of the tick that is under way.
///
/// Samples are counted from the first one, in units of the first difference that is not zero, and
/// summed up about the level of the tick before, so neither an offset nor a unit costs precision.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Ticker<T> {
    length: u32,
    /// NaN before the first sample.
    origin: T,
    /// Zero as long as all samples were equal.
    unit: T,
    inverse: T,
    bound: T,
    /// In the unit of the samples; NaN after a missing one.
    previous: T,
    /// The smallest difference of successive samples so far that is not zero, in their unit.
    step: T,
    /// Ticks in a row that origin or unit has swallowed.
    swallowed: u32,
    centre: T,
    position: u32,
    count: u32,
    sum: T,
    squares: T,
    /// The samples farthest below and above the centre, from there.
    lowest: T,
    highest: T,
}

/// One tick, in the ticker's own units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TickSums<T> {
    /// Samples that were not missing; none of a tick that origin or unit has swallowed.
    pub count: u32,
    /// Mean of the samples, in their unit.
    pub mean: T,
    /// Deviation of the samples, in their unit.
    pub deviation: T,
    /// Mean of the samples without the farthest.
    pub level: T,
    /// Their variance without the farthest, about that mean.
    pub variance: T,
    /// What brings a difference from the level to the deviation that one of a full tick has.
    pub weight: T,
    /// One step of the sensor's output: no motion, however quiet it is.
    pub step: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Ticker<T> {
    pub(super) fn new(length: u32) -> Self {
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
            count: 0,
            sum: zero,
            squares: zero,
            lowest: zero,
            highest: zero,
        }
    }

    /// Takes one sample; returns the tick that it completes.
    #[inline(always)]
    pub(super) fn observe(&mut self, z: T) -> Option<TickSums<T>> {
        if z.finite() {
            self.add(z);
        } else {
            self.previous = T::of(f64::NAN);
        }
        self.position += 1;
        (self.position >= self.length).then(|| self.end())
    }

    #[inline(always)]
    fn add(&mut self, z: T) {
        let z = z.within(T::RAW_MAX);
        if self.unit == T::zero() {
            self.find_unit(z);
        }
        let change = (z - self.previous).simd_abs();
        if change > T::zero() && change < self.step {
            self.step = change;
        }
        self.previous = z;
        let y = ((z - self.origin) * self.inverse).within(self.bound);
        let distance = y - self.centre;
        self.lowest = distance.at_most(self.lowest);
        self.highest = distance.at_least(self.highest);
        self.count += 1;
        self.sum += distance;
        self.squares += distance * distance;
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

    #[cold]
    fn end(&mut self) -> TickSums<T> {
        let count = T::of(f64::from(self.count.max(1)));
        let mean = self.origin + self.unit * (self.centre + self.sum / count);
        let (level, variance) = self.without_farthest();
        // Sums of samples that are all equal are off their mean by some roundings.
        let rounding = T::ROUNDING * level.simd_abs();
        self.note_swallowed(mean, level, variance);
        let seen = TickSums {
            count: if self.swallowed > 0 { 0 } else { self.count },
            mean,
            deviation: self.unit * self.variance_about_mean().simd_sqrt(),
            level,
            variance,
            weight: (count / T::of(f64::from(self.length))).simd_sqrt(),
            step: self.least_step().at_least(rounding),
        };
        self.begin(level);
        seen
    }

    /// The smallest step so far, zero if there was none.
    fn least_step(&self) -> T {
        choose(self.step < T::MAX, self.step * self.inverse, T::zero()).at_most(self.bound)
    }

    /// Whether neither origin nor unit fits the samples: their first ones were far from all others.
    pub(super) fn is_lost(&self) -> bool {
        self.swallowed >= LOST
    }

    /// Counts ticks whose samples vanish beside the origin, or leave the range of the unit.
    fn note_swallowed(&mut self, mean: T, level: T, variance: T) {
        if self.count < LEAST {
            return;
        }
        let (origin, deviation) = (self.origin.simd_abs(), variance.simd_sqrt());
        let rounding = T::of(LITTLE) * T::ROUNDING * origin;
        let coarse = self.step <= rounding && self.unit * deviation <= rounding;
        let beside = coarse && mean.simd_abs() < T::of(FAR) * origin;
        let range = self.highest - self.lowest;
        let small = range > T::zero() && range < T::one() / self.bound;
        let large = level.simd_abs() + deviation >= self.bound * T::of(NEAR_BOUND);
        self.swallowed = if beside || small || large { self.swallowed + 1 } else { 0 };
    }

    fn variance_about_mean(&self) -> T {
        let count = T::of(f64::from(self.count));
        let squares = self.squares - self.sum * self.sum / count.at_least(T::one());
        squares.at_least(T::zero()) / (count - T::one()).at_least(T::one())
    }

    /// Level and variance: one sample far off is an outlier and no motion.
    fn without_farthest(&self) -> (T, T) {
        if self.count < LEAST {
            return (self.centre, T::zero());
        }
        let n = T::of(f64::from(self.count - 1));
        let sum = self.sum - self.farthest();
        let farthest = self.highest.at_least(-self.lowest);
        let squares = self.squares - farthest * farthest;
        let variance = (squares - sum * sum / n) / (n - T::one());
        (self.centre + sum / n, variance.at_least(T::zero()))
    }

    /// Of two as far, one below and one above, neither: a sign must change nothing.
    fn farthest(&self) -> T {
        let lower = choose(-self.lowest > self.highest, self.lowest, T::zero());
        choose(self.highest > -self.lowest, self.highest, lower)
    }

    fn begin(&mut self, centre: T) {
        let zero = T::zero();
        self.centre = centre;
        self.position = 0;
        self.count = 0;
        self.sum = zero;
        self.squares = zero;
        self.lowest = zero;
        self.highest = zero;
    }
}

/// Largest sample in the ticker's own units: fourth powers of differences must be finite.
pub(super) fn level_max<T: Limits + Real<Element = T>>() -> T {
    T::DIFFERENCE_MAX.simd_sqrt()
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Ticker<T> {
    /// Whether samples can have made it of `fresh`.
    pub(super) fn is_after(&self, fresh: &Self) -> bool {
        // Raw, it must not overflow.
        let reach = (T::RAW_MAX * T::of(4.0) * self.inverse).at_most(self.bound);
        (self.length, self.bound) == (fresh.length, fresh.bound)
            && is_sample(self.origin, T::RAW_MAX)
            && self.has_unit()
            && is_sample(self.previous, T::RAW_MAX)
            && self.swallowed < LOST
            && self.step > T::zero()
            && self.step <= T::MAX
            && is_within(self.centre, reach + reach)
            && self.position < self.length
            && self.count <= self.position
            && self.has_sums(reach)
    }

    fn has_unit(&self) -> bool {
        let inverse = match self.unit == T::zero() {
            true => T::zero(),
            false => T::one() / self.unit.at_least(T::TINY),
        };
        is_size(self.unit, T::RAW_MAX + T::RAW_MAX)
            && self.inverse == inverse
            && (self.origin.finite() || self.unit == T::zero())
    }

    fn has_sums(&self, reach: T) -> bool {
        let (most, count) = (reach * T::of(4.0), T::of(f64::from(self.count)));
        is_within(self.sum, most * count)
            && is_size(self.squares, most * most * count)
            && is_size(-self.lowest, most)
            && is_size(self.highest, most)
    }
}
