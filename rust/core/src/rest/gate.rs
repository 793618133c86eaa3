//! The three-zone gate on samples: near ones count, farther ones by a bound, far ones not at all.
//!
//! After Wu & Ran's filter, but on the samples about the level of the last ticks, so that nothing
//! depends on a filter's innovation, and with an exit: a tick with many far samples, or with some
//! in a row on one side, is no tick with outliers. Zones in deviations are followed by counting how
//! many samples lie within one deviation: an outlier counts as one sample, however far it is.

use serde::{Deserialize, Serialize};

use crate::math::validity::is_size;
use crate::math::{Limits, Real};
use crate::stream::Sketch;

/// Bounds of the zones in deviations, and at least in steps of the sensor.
const NEAR_SIGMAS: f64 = 3.0;
const FAR_SIGMAS: f64 = 4.0;
const NEAR_STEPS: f64 = 1.01;
const FAR_STEPS: f64 = 3.0;

/// Share of a normal variable within one deviation.
const WITHIN_ONE_SIGMA: f64 = 0.682_689_492_137_085_9;

/// Gain of the standard deviation towards that share, a tick; and where almost all of a tick's
/// samples lie within one standard deviation, which chance does once in a thousand ticks: after
/// motion, which is no noise, it is to be back soon.
const SHARE_GAIN: f64 = 0.05;
const FAST_SHARE_GAIN: f64 = 0.5;
const MIN_FAST_SHARE: f64 = 0.95;

/// Samples that tell such a share.
const MIN_SHARE_SAMPLES: u32 = 16;

/// Ratio of two deviations that are not of one noise.
const MAX_SIGMA_RATIO: f64 = 2.0;

/// Least deviation in steps: one of zero would never grow.
const MIN_STEPS: f64 = 0.25;

/// Share of samples in a tick, at most, that do not count in full: three in ten.
const MAX_OUTLIER_SHARE: [u32; 2] = [3, 10];

/// Longest run of outliers on one side, in seconds and in samples.
const MAX_SIDE_S: f64 = 0.015;
const MIN_SIDE_SAMPLES: u32 = 3;

/// Samples that a first median is taken of at least.
const MIN_LEARNED: u32 = 32;

/// Fewest of them of which a median distance says anything.
const MIN_MEDIAN_SAMPLES: usize = 8;

/// Zone of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Zone<T> {
    /// Within the bounds; the distance that counts.
    Counts(T),
    Far,
}

/// Zones about the level, and what this tick has shown of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Gate<T> {
    /// Of the first second, in the unit of the samples.
    sketch: Sketch<T>,
    /// Samples that are still to come of that second.
    learning: u32,
    pub(super) scale: T,
    pub(super) near: T,
    pub(super) far: T,
    /// Samples of this tick within one deviation, and beyond three.
    pub(super) inside: u32,
    pub(super) beyond: u32,
    /// Far samples in a row on one side.
    pub(super) side: u32,
    above: bool,
    /// Of these, at most, in a row that may be outliers.
    longest: u32,
    /// In this tick there were more.
    moves: bool,
    /// The last tick had no outliers: whatever is far in it counts.
    open: bool,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Gate<T> {
    pub(super) fn new(rate: f64) -> Self {
        let zero = T::zero();
        Self {
            sketch: Sketch::new(),
            learning: (rate as u32).max(MIN_LEARNED),
            scale: zero,
            near: T::MAX,
            far: T::MAX,
            inside: 0,
            beyond: 0,
            side: 0,
            above: false,
            longest: ((MAX_SIDE_S * rate) as u32).max(MIN_SIDE_SAMPLES),
            moves: false,
            open: true,
        }
    }

    /// Takes so many equal samples at a distance from the level.
    #[inline(always)]
    pub(super) fn take(&mut self, distance: T, times: u32) -> Zone<T> {
        let size = distance.simd_abs();
        self.beyond += if size > self.near { times } else { 0 };
        if size > self.far {
            self.take_far(distance);
            return Zone::Far;
        }
        self.side = 0;
        self.inside += if size < self.scale { times } else { 0 };
        Zone::Counts(distance.within(self.near))
    }

    /// Equal samples are one: an output that stands still is no sign of motion.
    #[inline(never)]
    fn take_far(&mut self, distance: T) {
        let above = distance > T::zero();
        self.side = if above == self.above { self.side.saturating_add(1) } else { 1 };
        self.above = above;
        self.moves |= self.side > self.longest;
    }

    /// The zone of a sample, as far as it is known before its tick is complete.
    pub(super) fn zone(&self, distance: T) -> Zone<T> {
        let lasts = self.side >= self.longest && self.above == (distance > T::zero());
        match distance.simd_abs() > self.far {
            true if self.open || lasts => Zone::Counts(distance),
            true => Zone::Far,
            false => Zone::Counts(distance.within(self.near)),
        }
    }

    /// True if a tick of so many samples shows motion and no outliers.
    pub(super) fn exits(&self, samples: u32) -> bool {
        self.moves || self.beyond * MAX_OUTLIER_SHARE[1] > samples * MAX_OUTLIER_SHARE[0]
    }

    /// Ends a tick of so many samples; `step` is the sensor's. Motion tells nothing of the noise.
    pub(super) fn end_tick(&mut self, samples: u32, exits: bool, step: T) {
        let share = f64::from(self.inside) / f64::from(samples.max(1));
        let too_large = share > MIN_FAST_SHARE && samples >= MIN_SHARE_SAMPLES;
        let rate = match (exits, too_large) {
            (true, _) => 0.0,
            (false, true) => FAST_SHARE_GAIN,
            (false, false) => SHARE_GAIN,
        };
        let growth = T::of(rate * (WITHIN_ONE_SIGMA - share)).exp();
        self.scale = (self.scale * growth).at_least(T::of(MIN_STEPS) * step);
        self.forget_tick();
        self.open = exits;
        self.set_bounds(step);
    }

    /// Leaves out what this tick has shown to date.
    pub(super) fn forget_tick(&mut self) {
        (self.inside, self.beyond, self.moves) = (0, 0, false);
    }

    /// A rest begins whose samples have this deviation: one far off it was that of motion, or of
    /// the noise before.
    pub(super) fn rest(&mut self, deviation: T, step: T) {
        let (most, least) =
            (deviation * T::of(MAX_SIGMA_RATIO), deviation * T::of(1.0 / MAX_SIGMA_RATIO));
        if self.scale > most || self.scale < least {
            self.scale = deviation.at_least(T::of(MIN_STEPS) * step);
            self.set_bounds(step);
        }
    }

    fn set_bounds(&mut self, step: T) {
        let bound = |deviations: f64, steps: f64| {
            (T::of(deviations) * self.scale).at_least(T::of(steps) * step).at_most(T::MAX)
        };
        let is_known = self.scale > T::zero();
        (self.near, self.far) = match is_known {
            true => (bound(NEAR_SIGMAS, NEAR_STEPS), bound(FAR_SIGMAS, FAR_STEPS)),
            false => (T::MAX, T::MAX),
        };
    }

    /// Samples of the first second are still to come.
    #[inline(always)]
    pub(super) fn learns(&self) -> bool {
        self.learning > 0
    }

    /// Takes a sample of the first second, in its own unit.
    #[cold]
    pub(super) fn learn(&mut self, z: T) {
        self.sketch.insert(z);
        self.learning -= 1;
    }

    /// Median of the samples of the first second, in their unit.
    pub(super) fn median(&self) -> T {
        self.sketch.median()
    }

    /// Starts from the first second, given the size of the ticker's unit in that of the samples.
    pub(super) fn start(&mut self, inverse: T, step: T) {
        if self.sketch.held() < MIN_MEDIAN_SAMPLES {
            self.scale = T::zero();
            return self.set_bounds(step);
        }
        self.scale = (self.sketch.deviation() * inverse).at_most(T::MAX_DIFFERENCE.simd_sqrt());
        self.open = false;
        self.set_bounds(step);
    }

    /// True if samples can have made it of `fresh`, at most `position` of them in this tick.
    pub(super) fn is_after(&self, fresh: &Self, position: u32, most: T) -> bool {
        self.sketch.is_valid()
            && self.learning <= fresh.learning
            && self.longest == fresh.longest
            && is_size(self.scale, most)
            && is_size(self.near, T::MAX)
            && is_size(self.far, T::MAX)
            && self.near <= self.far
            && self.inside <= position
            && self.beyond <= position
    }
}
