//! Gate on samples with three zones: near samples count, farther samples are bounded, far samples
//! are left out.
//!
//! It follows Wu & Ran's filter, with two differences. It uses the distance from the level of the
//! last ticks, and does not depend on a filter's innovation. And it has an exit: a tick with many
//! far samples, or with some in a row on one side, has no outliers. The standard deviation follows
//! the share of samples within it. An outlier therefore has the same effect at any distance.

use serde::{Deserialize, Serialize};

use crate::math::validity::is_size;
use crate::math::{Limits, Real};
use crate::stream::Sketch;

/// Bounds of the zones in standard deviations, and smallest bounds in steps of the sensor.
const NEAR_SIGMAS: f64 = 3.0;
const FAR_SIGMAS: f64 = 4.0;
const NEAR_STEPS: f64 = 1.01;
const FAR_STEPS: f64 = 3.0;

/// Share of a normal variable within one standard deviation.
const WITHIN_ONE_SIGMA: f64 = 0.682_689_492_137_085_9;

/// Gain of the standard deviation towards that share, per tick; and gain if almost all samples of a
/// tick lie within one standard deviation, which chance does once in a thousand ticks. After motion
/// the standard deviation then returns quickly.
const SHARE_GAIN: f64 = 0.05;
const FAST_SHARE_GAIN: f64 = 0.5;
const MIN_FAST_SHARE: f64 = 0.95;

/// Smallest number of samples for a share.
const MIN_SHARE_SAMPLES: u32 = 16;

/// Ratio of two standard deviations that do not belong to one noise.
const MAX_SIGMA_RATIO: f64 = 2.0;

/// Smallest standard deviation in steps of the sensor: zero would never grow.
const MIN_STEPS: f64 = 0.25;

/// Largest share of samples in a tick that are not near: three in ten.
const MAX_OUTLIER_SHARE: [u32; 2] = [3, 10];

/// Longest run of outliers on one side, in seconds and in samples.
const MAX_SIDE_S: f64 = 0.015;
const MIN_SIDE_SAMPLES: u32 = 3;

/// Smallest number of samples for a first median.
const MIN_LEARNED: u32 = 32;

/// Smallest number of these samples for a median distance.
const MIN_MEDIAN_SAMPLES: usize = 8;

/// Zone of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Zone<T> {
    /// Within the bounds, with the distance that is used.
    Counts(T),
    Far,
}

/// Zones about the level, and their counts in the present tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Gate<T> {
    /// Samples of the first second, in the samples' unit.
    sketch: Sketch<T>,
    /// Number of samples that the first second still needs.
    learning: u32,
    pub(super) scale: T,
    pub(super) near: T,
    pub(super) far: T,
    /// Numbers of this tick's samples within one standard deviation, and beyond three.
    pub(super) inside: u32,
    pub(super) beyond: u32,
    /// Number of far samples in a row on one side.
    pub(super) side: u32,
    above: bool,
    /// Longest run of far samples that may be outliers.
    longest: u32,
    /// True if a run in this tick was longer.
    moves: bool,
    /// True if the last tick had no outliers: all samples then count.
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

    /// Counts equal samples at a distance from the level.
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

    /// Equal samples count as one sample: a constant output is no sign of motion.
    #[inline(never)]
    fn take_far(&mut self, distance: T) {
        let above = distance > T::zero();
        self.side = if above == self.above { self.side.saturating_add(1) } else { 1 };
        self.above = above;
        self.moves |= self.side > self.longest;
    }

    /// Zone of a sample before its tick is complete.
    pub(super) fn zone(&self, distance: T) -> Zone<T> {
        let lasts = self.side >= self.longest && self.above == (distance > T::zero());
        match distance.simd_abs() > self.far {
            true if self.open || lasts => Zone::Counts(distance),
            true => Zone::Far,
            false => Zone::Counts(distance.within(self.near)),
        }
    }

    /// True if a tick with this number of samples shows motion instead of outliers.
    pub(super) fn exits(&self, samples: u32) -> bool {
        self.moves || self.beyond * MAX_OUTLIER_SHARE[1] > samples * MAX_OUTLIER_SHARE[0]
    }

    /// Ends a tick with this number of samples; `step` is the sensor's step. Motion gives no
    /// information on the noise.
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

    /// Discards the counts of the present tick.
    pub(super) fn forget_tick(&mut self) {
        (self.inside, self.beyond, self.moves) = (0, 0, false);
    }

    /// Begins a rest with samples of this standard deviation. A very different earlier value came
    /// from motion, or from an earlier noise.
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

    /// True while samples of the first second are missing.
    #[inline(always)]
    pub(super) fn learns(&self) -> bool {
        self.learning > 0
    }

    /// Processes a sample of the first second, in its own unit.
    #[cold]
    pub(super) fn learn(&mut self, z: T) {
        self.sketch.insert(z);
        self.learning -= 1;
    }

    /// Median of the samples of the first second, in their unit.
    pub(super) fn median(&self) -> T {
        self.sketch.median()
    }

    /// Starts from the first second; `inverse` converts from the samples' unit to the ticker's
    /// unit.
    pub(super) fn start(&mut self, inverse: T, step: T) {
        if self.sketch.held() < MIN_MEDIAN_SAMPLES {
            self.scale = T::zero();
            return self.set_bounds(step);
        }
        self.scale = (self.sketch.deviation() * inverse).at_most(T::MAX_DIFFERENCE.simd_sqrt());
        self.open = false;
        self.set_bounds(step);
    }

    /// True if samples can have changed `fresh` to this state, at most `position` of them in this
    /// tick.
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
