//! Offset and scale of a signal, learned from its own first samples: no filter needs a unit.

mod validity;

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::sketch::Sketch;
use crate::error::Error;
use crate::math::{Limits, Real, Symmetric, choose};

/// Fewest samples that can tell a deviation.
const MIN_WINDOW: u64 = 2;

/// Fewest samples of which a median says more than their mean.
const MIN_MEDIAN_SAMPLES: usize = 8;

/// Variance of a mean of normal variables over that of their median.
const MEDIAN_EFFICIENCY: f64 = core::f64::consts::FRAC_2_PI;

/// Deviation over that of the median distance, beyond which a few samples have spoilt it; a
/// thousandth below which its unit has: no distribution of a sensor comes near to either.
const MAX_DEVIATION_RATIO: f64 = 4.0;
const MIN_DEVIATION_RATIO: f64 = 1e-3;

/// Running mean and variance of the first samples, or, where a few of these are far from all
/// others, median and median distance.
///
/// They are counted from the first sample in units of the first difference that is not zero, so
/// neither a large offset nor a small unit costs precision.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Startup<T> {
    window: u64,
    known_scale: Option<T>,
    samples: u64,
    origin: T,
    /// Zero as long as all samples were equal.
    unit: T,
    mean: T,
    sum_of_squares: T,
    peak: T,
    sketch: Sketch<T>,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Startup<T> {
    /// Waits for `window` samples that are not all equal, or only for `window` samples if the
    /// scale is known.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the window is shorter than two samples.
    pub fn new(window: u64, known_scale: Option<f64>) -> Result<Self, Error> {
        if window < MIN_WINDOW {
            return Err(Error::Parameter {
                name: "startup",
                expected: "at least two samples long",
                value: window as f64,
            });
        }
        let zero = T::zero();
        Ok(Self {
            window,
            known_scale: known_scale.map(|scale| match T::of(scale) {
                // It is positive, which its number need not be.
                none if none == T::zero() => T::TINY,
                scale => scale.at_most(T::MAX),
            }),
            samples: 0,
            origin: zero,
            unit: zero,
            mean: zero,
            sum_of_squares: zero,
            peak: zero,
            sketch: Sketch::new(),
        })
    }

    /// Takes one sample; returns it in the start-up's own units, NaN if it is missing.
    pub fn observe(&mut self, z: T) -> T {
        if !z.finite() {
            return T::of(f64::NAN);
        }
        let z = z.within(T::MAX_RAW);
        if self.samples == 0 {
            self.origin = z;
            self.unit = self.known_scale.unwrap_or(T::zero());
        }
        let difference = z - self.origin;
        if self.unit == T::zero() {
            self.unit = difference.simd_abs();
        }
        let y = self.in_units(difference);
        self.samples += 1;
        self.sketch.insert(z);
        let before = y - self.mean;
        self.mean += before / T::of(self.samples as f64);
        self.sum_of_squares += before * (y - self.mean);
        self.peak = y.simd_abs().at_least(self.peak);
        y
    }

    /// The scaling learned, once the window is full.
    pub fn finished(&self) -> Option<Scaling<T>> {
        let deviation = match self.known_scale {
            Some(scale) => scale,
            None => self.typical().map_or(self.unit * self.sample_deviation(), |(_, d)| d),
        };
        let ready = self.samples >= self.window && self.unit > T::zero();
        ready.then(|| Scaling::new(self.mean(), deviation))
    }

    /// Mean of the samples to date; zero before the first.
    pub fn mean(&self) -> T {
        self.typical().map_or(self.origin + self.unit * self.mean, |(median, _)| median)
    }

    /// Variance of the samples to date.
    pub fn variance(&self) -> T {
        match self.typical() {
            Some((_, deviation)) => {
                (deviation.at_most(T::MAX_DIFFERENCE) * deviation).at_most(T::MAX_RAW)
            }
            None => {
                let deviation = self.sample_deviation();
                self.raw_variance(deviation * deviation)
            }
        }
    }

    /// Median and deviation from it, where a few samples far from all others have spoilt mean and
    /// variance.
    fn typical(&self) -> Option<(T, T)> {
        if self.sketch.held() < MIN_MEDIAN_SAMPLES {
            return None;
        }
        let (deviation, typical) = (self.unit * self.sample_deviation(), self.sketch.deviation());
        let spoilt = deviation > T::of(MAX_DEVIATION_RATIO) * typical
            || deviation < T::of(MIN_DEVIATION_RATIO) * typical;
        (spoilt && typical > T::zero()).then(|| (self.sketch.median(), typical))
    }

    /// The raw size of a variance in the start-up's own units.
    pub(crate) fn raw_variance(&self, v: T) -> T {
        (v * self.unit * self.unit).at_most(T::MAX_RAW)
    }

    /// Distance of `z` from the mean to date; zero for a missing sample.
    pub fn difference(&self, z: T) -> T {
        choose(z.finite(), z.within(T::MAX_RAW) - self.mean(), T::zero())
    }

    /// Samples that were not missing.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Samples whose mean would be as exact as this one.
    pub(crate) fn worth(&self) -> T {
        match self.typical() {
            Some(_) => T::of(self.sketch.held() as f64 * MEDIAN_EFFICIENCY),
            None => T::of(self.samples as f64),
        }
    }

    /// Mean and deviation in the start-up's own units, and a bound of all normalised samples; none
    /// where a few samples have spoilt them.
    pub(crate) fn own_scaling(&self) -> Option<(T, T, T)> {
        let deviation = match self.known_scale {
            Some(_) => T::one(),
            None => self.sample_deviation(),
        };
        let peak = (self.peak + self.mean.simd_abs()) / deviation;
        self.typical().is_none().then_some((self.mean, deviation, peak))
    }

    /// Reset to the state before the first sample.
    pub fn reset(&mut self) {
        let zero = T::zero();
        *self = Self {
            samples: 0,
            origin: zero,
            unit: zero,
            mean: zero,
            sum_of_squares: zero,
            peak: zero,
            sketch: Sketch::new(),
            ..*self
        };
    }

    fn sample_deviation(&self) -> T {
        if self.samples < MIN_WINDOW {
            return T::zero();
        }
        (self.sum_of_squares / T::of((self.samples - 1) as f64)).simd_sqrt()
    }

    fn in_units(&self, difference: T) -> T {
        if self.unit == T::zero() {
            return T::zero();
        }
        (difference / self.unit).within(T::MAX_INPUT)
    }
}

/// Between raw samples and samples of about zero mean and unit deviation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Scaling<T> {
    offset: T,
    scale: T,
    inverse: T,
}

#[cfg(feature = "std")]
crate::math::laned!(Scaling [] { offset, scale, inverse } common {});

impl<T: Real> Scaling<T> {
    /// `(z - offset) / scale`.
    pub fn new(offset: T, scale: T) -> Self {
        let scale = scale.at_least(T::one() / Self::raw_max());
        Self { offset, scale, inverse: T::one() / scale }
    }

    #[inline(always)]
    fn raw_max() -> T {
        T::limit(<T::Element as Limits>::MAX_RAW)
    }

    /// A raw sample, centred and scaled; NaN if it is missing.
    #[inline(always)]
    pub fn normalise(&self, z: T) -> T {
        let y = (z.within(Self::raw_max()) - self.offset) * self.inverse;
        let y = y.within(T::limit(<T::Element as Limits>::MAX_INPUT));
        choose(z.finite(), y, T::of(f64::NAN))
    }

    /// The raw value of a normalised one.
    #[inline(always)]
    pub fn raw(&self, y: T) -> T {
        self.offset + self.scale * y
    }

    /// The raw size of a normalised difference, limited to what the type can hold.
    #[inline(always)]
    pub fn raw_difference(&self, y: T) -> T {
        (self.scale * y).within(Self::raw_max())
    }

    /// The normalised size of a raw difference.
    #[inline(always)]
    pub(crate) fn normalised_difference(&self, y: T) -> T {
        (y * self.inverse).within(T::limit(<T::Element as Limits>::MAX_INPUT))
    }

    /// The raw size of a normalised variance, limited to what the type can hold.
    #[inline(always)]
    pub fn raw_variance(&self, v: T) -> T {
        (v * self.scale * self.scale).within(Self::raw_max())
    }

    /// The raw size of a normalised covariance, as a whole limited to what the type can hold: zero
    /// where its digits would be lost, and with them that it is semidefinite.
    pub(crate) fn raw_covariance<const N: usize>(
        &self,
        covariance: &Symmetric<T, N>,
    ) -> SMatrix<T, N, N> {
        let bound = Self::raw_max() / covariance.trace().at_least(T::one());
        let size = (self.scale * self.scale).at_most(bound);
        let whole = size.simd_gt(T::tiny() / T::limit(<T::Element as Limits>::ROUNDING));
        covariance.to_matrix() * choose(whole, size, T::zero())
    }

    /// `[φ, θ, c]` of the raw signal: only the constant has a unit, and moves with the offset.
    pub(crate) fn raw_coefficients<const N: usize, const M: usize>(
        &self,
        normalised: &SVector<T, M>,
    ) -> SVector<T, M> {
        let mut raw = *normalised;
        let mut rest = T::one();
        for i in 0..N - 1 {
            rest -= raw[i];
        }
        raw[M - 1] = self.raw_difference(raw[M - 1]) + (rest * self.offset).within(Self::raw_max());
        raw
    }

    /// The deviation of the start-up window.
    pub fn scale(&self) -> T {
        self.scale
    }
}
