//! Offset and scale of a signal, learned from its first samples: no filter needs a unit.

mod validity;

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::sketch::Sketch;
use crate::error::Error;
use crate::math::{Limits, Real, Symmetric, choose};

/// Smallest number of samples for a standard deviation.
const MIN_WINDOW: u64 = 2;

/// Smallest number of samples for which a median is better than a mean.
const MIN_MEDIAN_SAMPLES: usize = 8;

/// Variance of a mean of normal variables over the variance of their median.
const MEDIAN_EFFICIENCY: f64 = core::f64::consts::FRAC_2_PI;

/// Ratio of the standard deviation to its estimate from the median distance beyond which a few
/// samples have spoilt it. A thousandth of that estimate is the lower limit of the unit. No
/// distribution of a sensor comes near these limits.
const MAX_DEVIATION_RATIO: f64 = 4.0;
const MIN_DEVIATION_RATIO: f64 = 1e-3;

/// Running mean and variance of the first samples; median and median distance if a few samples are
/// far from the others.
///
/// Samples are relative to the first sample, in units of the first difference that is not zero.
/// Neither a large offset nor a small unit reduces precision.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Startup<T> {
    window: u64,
    known_scale: Option<T>,
    samples: u64,
    origin: T,
    /// Unit; zero while all samples were equal.
    unit: T,
    mean: T,
    sum_of_squares: T,
    peak: T,
    sketch: Sketch<T>,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Startup<T> {
    /// Waits for `window` samples that are not all equal, or for any `window` samples if the scale
    /// is known.
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
                // The scale is positive, but may be zero in this number type.
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

    /// Processes one sample; returns it in the start-up's units, NaN if it is missing.
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

    /// Learned scaling, once the window is full.
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

    /// Median and standard deviation from it, if a few samples far from the others have spoilt mean
    /// and variance.
    fn typical(&self) -> Option<(T, T)> {
        if self.sketch.held() < MIN_MEDIAN_SAMPLES {
            return None;
        }
        let (deviation, typical) = (self.unit * self.sample_deviation(), self.sketch.deviation());
        let spoilt = deviation > T::of(MAX_DEVIATION_RATIO) * typical
            || deviation < T::of(MIN_DEVIATION_RATIO) * typical;
        (spoilt && typical > T::zero()).then(|| (self.sketch.median(), typical))
    }

    /// Raw size of a variance in the start-up's units.
    pub(crate) fn raw_variance(&self, v: T) -> T {
        (v * self.unit * self.unit).at_most(T::MAX_RAW)
    }

    /// Distance of `z` from the mean to date; zero for a missing sample.
    pub fn difference(&self, z: T) -> T {
        choose(z.finite(), z.within(T::MAX_RAW) - self.mean(), T::zero())
    }

    /// Number of samples that were not missing.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Number of samples whose mean would be as precise as this mean or median.
    pub(crate) fn worth(&self) -> T {
        match self.typical() {
            Some(_) => T::of(self.sketch.held() as f64 * MEDIAN_EFFICIENCY),
            None => T::of(self.samples as f64),
        }
    }

    /// Mean and standard deviation in the start-up's units, and a bound of all normalised samples;
    /// `None` if a few samples have spoilt them.
    pub(crate) fn own_scaling(&self) -> Option<(T, T, T)> {
        let deviation = match self.known_scale {
            Some(_) => T::one(),
            None => self.sample_deviation(),
        };
        let peak = (self.peak + self.mean.simd_abs()) / deviation;
        self.typical().is_none().then_some((self.mean, deviation, peak))
    }

    /// Resets to the state before the first sample.
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

/// Conversion between raw samples and samples with a mean of about zero and a standard deviation of
/// one.
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

    /// Raw size of a normalised difference, limited to the range of the type.
    #[inline(always)]
    pub fn raw_difference(&self, y: T) -> T {
        (self.scale * y).within(Self::raw_max())
    }

    /// The normalised size of a raw difference.
    #[inline(always)]
    pub(crate) fn normalised_difference(&self, y: T) -> T {
        (y * self.inverse).within(T::limit(<T::Element as Limits>::MAX_INPUT))
    }

    /// Raw size of a normalised variance, limited to the range of the type.
    #[inline(always)]
    pub fn raw_variance(&self, v: T) -> T {
        (v * self.scale * self.scale).within(Self::raw_max())
    }

    /// Raw size of a normalised covariance, limited as a whole to the range of the type. It is zero
    /// if its digits would be lost, since it would no longer be semidefinite.
    pub(crate) fn raw_covariance<const N: usize>(
        &self,
        covariance: &Symmetric<T, N>,
    ) -> SMatrix<T, N, N> {
        let bound = Self::raw_max() / covariance.trace().at_least(T::one());
        let size = (self.scale * self.scale).at_most(bound);
        let whole = size.simd_gt(T::tiny() / T::limit(<T::Element as Limits>::ROUNDING));
        covariance.to_matrix() * choose(whole, size, T::zero())
    }

    /// `[φ, θ, c]` of the raw signal: only the constant has a unit and depends on the offset.
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

    /// Standard deviation of the start-up window.
    pub fn scale(&self) -> T {
        self.scale
    }
}
