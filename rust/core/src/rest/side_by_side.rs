//! Ticks of several channels in SIMD lanes, until a tick ends.
//!
//! Each step equals the step of one channel's [`Ticker`], with masks as branches. Counts are
//! floating-point numbers, which are exact. Rare cases are left to the channels: no samples are
//! processed if one of them is far off.

use core::array::from_fn;

use nalgebra::{SimdBool, SimdPartialOrd};
use num_traits::{One, Zero};
use pulp::Simd;

use super::repeats::HALVING_PAIRS;
use super::sums::Sums;
use super::ticker::MAX_COARSE_STEPS;
use super::{RestDetector, Ticker};
use crate::math::{Lane, Laned, MAX_LANES, Mask, Real, choose};

/// One field of each of several states.
macro_rules! each {
    ($states:ident, $($path:tt)+) => {
        Lane::load(&from_fn(|i| f64::from($states[i].$($path)+)))
    };
}

/// Tickers, one per lane.
pub(crate) struct Tickers<S: Simd> {
    /// Constants of the samples.
    origin: Lane<S>,
    inverse: Lane<S>,
    bound: Lane<S>,
    centre: Lane<S>,
    scale: Lane<S>,
    near: Lane<S>,
    far: Lane<S>,
    limit: Lane<S>,
    /// Variables of the samples.
    previous: Lane<S>,
    step: Lane<S>,
    run: Lane<S>,
    held: Lane<S>,
    dropped: Lane<S>,
    equal: Lane<S>,
    pairs: Lane<S>,
    inside: Lane<S>,
    beyond: Lane<S>,
    plain: SumsEach<S>,
    kept: SumsEach<S>,
    taken: u32,
}

/// Sums, one per lane.
struct SumsEach<S: Simd> {
    count: Lane<S>,
    sum: Lane<S>,
    squares: Lane<S>,
    lowest: Lane<S>,
    highest: Lane<S>,
}

impl<S: Simd> Tickers<S> {
    /// Tickers of detectors that are settled.
    #[inline(always)]
    pub(crate) fn of(detectors: [&RestDetector<f64>; MAX_LANES]) -> Self {
        let tickers: [&Ticker<f64>; MAX_LANES] = from_fn(|i| &detectors[i].ticker);
        Self {
            origin: each!(tickers, origin),
            inverse: each!(tickers, inverse),
            bound: each!(tickers, bound),
            centre: each!(tickers, centre),
            scale: each!(tickers, gate.scale),
            near: each!(tickers, gate.near),
            far: each!(tickers, gate.far),
            limit: each!(tickers, repeats.limit),
            previous: each!(tickers, previous),
            step: each!(tickers, step),
            run: each!(tickers, repeats.run),
            held: each!(tickers, repeats.held),
            dropped: each!(tickers, repeats.dropped),
            equal: each!(tickers, repeats.equal),
            pairs: each!(tickers, repeats.pairs),
            inside: each!(tickers, gate.inside),
            beyond: each!(tickers, gate.beyond),
            plain: SumsEach::of(from_fn(|i| &tickers[i].plain)),
            kept: SumsEach::of(from_fn(|i| &tickers[i].kept)),
            taken: 0,
        }
    }

    /// Processes a finite sample of each channel within a tick; processes none if a sample is far
    /// off.
    #[inline(always)]
    pub(crate) fn take(&mut self, z: Lane<S>) -> bool {
        let (repeats, stuck) = (z.simd_eq(self.previous), self.run.simd_ge(self.limit));
        let times = choose(repeats | stuck, Lane::zero(), self.held);
        let counts = times.simd_gt(Lane::zero());
        let level = (self.previous - self.origin) * self.inverse;
        let distance = level.within(self.bound) - self.centre;
        let size = distance.simd_abs();
        if (counts & size.simd_gt(self.far)).any() {
            return false;
        }
        let counted = |condition: Mask<S>| choose(condition & counts, times, Lane::zero());
        self.beyond += counted(size.simd_gt(self.near));
        self.inside += counted(size.simd_lt(self.scale));
        self.plain.add(distance, times, counts);
        self.kept.add(distance.within(self.near), times, counts);
        self.dropped += choose(stuck & !repeats, self.held, Lane::zero());
        self.begin(z, repeats);
        self.taken += 1;
        true
    }

    /// Continues a run of equal samples if a sample `repeats` the last sample; begins a new run
    /// otherwise.
    #[inline(always)]
    fn begin(&mut self, z: Lane<S>, repeats: Mask<S>) {
        let change = (z - self.previous).simd_abs();
        self.step = choose(change.simd_lt(self.step) & !repeats, change, self.step);
        let one_step = change.simd_le(Lane::of(MAX_COARSE_STEPS) * self.step);
        let most = Lane::of(f64::from(HALVING_PAIRS));
        let most = choose(one_step, most, self.limit.at_most(most));
        let longer = (self.run.at_most(most) - Lane::one()).at_least(Lane::zero());
        let longer = choose(repeats, Lane::zero(), longer);
        let first = self.run.simd_gt(Lane::zero()) & !repeats;
        self.equal += longer;
        self.pairs += longer + choose(first, Lane::one(), Lane::zero());
        self.run = choose(repeats, self.run + Lane::one(), Lane::one());
        self.run = self.run.at_most(Lane::of(f64::from(u32::MAX)));
        self.held = choose(repeats, self.held + Lane::one(), Lane::one());
        self.previous = choose(repeats, self.previous, z);
    }

    /// Copies a lane's state back to its detector.
    #[inline(always)]
    pub(crate) fn leave(&self, lane: usize, detector: &mut RestDetector<f64>) {
        let ticker = &mut detector.ticker;
        let count = |numbers: &Lane<S>| numbers.lane(lane) as u32;
        let added = count(&self.plain.count) > ticker.plain.count;
        ticker.previous = self.previous.lane(lane);
        ticker.step = self.step.lane(lane);
        ticker.position += self.taken;
        ticker.repeats.run = count(&self.run);
        ticker.repeats.held = count(&self.held);
        ticker.repeats.dropped = count(&self.dropped);
        ticker.repeats.equal = count(&self.equal);
        ticker.repeats.pairs = count(&self.pairs);
        ticker.gate.inside = count(&self.inside);
        ticker.gate.beyond = count(&self.beyond);
        if added {
            ticker.gate.side = 0;
        }
        ticker.plain = self.plain.lane(lane);
        ticker.kept = self.kept.lane(lane);
    }
}

impl<S: Simd> SumsEach<S> {
    #[inline(always)]
    fn of(sums: [&Sums<f64>; MAX_LANES]) -> Self {
        Self {
            count: each!(sums, count),
            sum: each!(sums, sum),
            squares: each!(sums, squares),
            lowest: each!(sums, lowest),
            highest: each!(sums, highest),
        }
    }

    /// Adds equal distances where they count.
    #[inline(always)]
    fn add(&mut self, distance: Lane<S>, times: Lane<S>, counts: Mask<S>) {
        let weighted = distance * times;
        self.count += times;
        self.sum = choose(counts, self.sum + weighted, self.sum);
        self.squares = choose(counts, self.squares + weighted * distance, self.squares);
        self.lowest = choose(counts, distance.at_most(self.lowest), self.lowest);
        self.highest = choose(counts, distance.at_least(self.highest), self.highest);
    }

    #[inline(always)]
    fn lane(&self, i: usize) -> Sums<f64> {
        Sums {
            count: self.count.lane(i) as u32,
            sum: self.sum.lane(i),
            squares: self.squares.lane(i),
            lowest: self.lowest.lane(i),
            highest: self.highest.lane(i),
        }
    }
}
