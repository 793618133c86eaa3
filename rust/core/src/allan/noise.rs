//! Measurement noise R from the Allan variance at the shortest averaging time (FH 17, 18, 26–31).

use nalgebra::SimdBool;
use serde::{Deserialize, Serialize};

use crate::error::{Error, require};
use crate::math::validity::{is_sample, is_size};
use crate::math::{Limits, Real, choose};
use crate::stream::checkpoint::Checkpoint;
use crate::stream::{Number, Stream};

/// Difference of samples in the variance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum AllanKind {
    /// First difference, `R = E[(z_k - z_{k-1})²] / 2` (FH 17).
    Allan,
    /// Second difference, `R = E[(z_k - 2 z_{k-1} + z_{k-2})²] / 6`; a constant angular
    /// acceleration does not change it.
    Hadamard,
}

impl AllanKind {
    /// Kind with this name.
    pub fn of_name(name: &str) -> Option<Self> {
        match name {
            "allan" => Some(Self::Allan),
            "hadamard" => Some(Self::Hadamard),
            _ => None,
        }
    }

    /// Name of the kind.
    pub fn name(self) -> &'static str {
        match self {
            Self::Allan => "allan",
            Self::Hadamard => "hadamard",
        }
    }
}

/// Recursive Allan variance with fading memory.
///
/// The weight of FH 30, `w_k = w_{k-1} / (w_{k-1} + b)`, is stored as its reciprocal. This is the
/// sum of the faded weights, `c_k = 1 + b c_{k-1}`, an exact count for `b = 1`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AllanNoise<T> {
    kind: AllanKind,
    fading: T,
    floor: T,
    variance: T,
    weight_sum: T,
    /// Last two samples; NaN is a missing sample, or no sample yet.
    previous: [T; 2],
}

#[cfg(feature = "std")]
crate::math::laned!(AllanNoise [] { fading, floor, variance, weight_sum, previous } common { kind });

impl<T: Real> AllanNoise<T> {
    /// An estimator with fading factor `fading` in (0, 1]; 1 gives all differences equal weight.
    /// The result is at least `floor`.
    ///
    /// # Errors
    /// [`Error::Parameter`] if `fading` or `floor` is out of range.
    pub fn new(fading: f64, kind: AllanKind, floor: f64) -> Result<Self, Error> {
        // `floor` must also be finite in the stream's number type.
        let is_size = floor >= 0.0 && T::of(floor).finite().all();
        require(is_size, "floor", "zero or a positive number", floor)?;
        Self::with_floor(fading, kind, T::of(floor))
    }

    pub(crate) fn with_floor(fading: f64, kind: AllanKind, floor: T) -> Result<Self, Error> {
        crate::error::check_fading(fading)?;
        let is_seen = T::of(fading).simd_gt(T::zero()).all();
        require(is_seen, "fading", "above 0 as a number of the stream", fading)?;
        Ok(Self {
            kind,
            fading: T::of(fading),
            floor,
            variance: T::zero(),
            weight_sum: T::zero(),
            previous: [T::of(f64::NAN); 2],
        })
    }

    /// Fading factor b in (0, 1].
    pub fn fading(&self) -> T {
        self.fading
    }

    /// Difference of samples in the variance.
    pub fn kind(&self) -> AllanKind {
        self.kind
    }

    /// Lower limit of the result.
    pub fn floor(&self) -> T {
        self.floor
    }

    /// Estimate to date; `floor` before the first difference.
    #[inline(always)]
    pub fn variance(&self) -> T {
        self.variance.at_least(self.floor)
    }

    /// Processes one sample. A sample that is not finite is left out, with all differences across
    /// it.
    #[inline(always)]
    pub fn observe(&mut self, z: T) {
        let square = self.squared_difference(z);
        // False for NaN: a sample or its predecessor was missing.
        let seen = square.simd_ge(T::zero());
        // Not a choice between two sums, which a compiler may store lane by lane.
        self.weight_sum = self.weight_sum * choose(seen, self.fading, T::one())
            + choose(seen, T::one(), T::zero());
        let weight = choose(seen, T::one() / self.weight_sum, T::zero());
        self.variance += (choose(seen, square, T::zero()) - self.variance) * weight;
        self.previous = [z, self.previous[0]];
    }

    #[inline(always)]
    fn squared_difference(&self, z: T) -> T {
        let [last, before] = self.previous;
        match self.kind {
            AllanKind::Allan => square(z - last) * T::of(0.5),
            AllanKind::Hadamard => square(z - last - (last - before)) * T::of(1.0 / 6.0),
        }
    }

    /// Notes that the next sample does not follow the last sample.
    pub(crate) fn interrupt(&mut self) {
        self.previous = [T::of(f64::NAN); 2];
    }

    /// The same estimator after its samples were shifted by `offset` and divided by `scale`.
    pub(crate) fn rescaled(&self, offset: T, scale: T) -> Self {
        let ratio = T::one() / scale;
        Self {
            variance: self.variance * ratio * ratio,
            previous: self.previous.map(|z| (z - offset) * ratio),
            ..*self
        }
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> AllanNoise<T> {
    /// Sets the estimate to `variance`, with the weight of `samples` samples without a gap.
    pub(crate) fn set_known(&mut self, variance: T, samples: u64) {
        let order = match self.kind {
            AllanKind::Allan => 1,
            AllanKind::Hadamard => 2,
        };
        let differences = T::of(samples.saturating_sub(order) as f64);
        self.variance = variance;
        let faded = self.fading.powf(differences);
        let sum = (T::one() - faded) / (T::one() - self.fading);
        self.weight_sum = choose(self.fading.simd_lt(T::one()), sum, differences);
    }
}

#[inline(always)]
fn square<T: Real>(x: T) -> T {
    x * x
}

impl<T: Number> Stream for AllanNoise<T> {
    type Input = T;
    type Output = T;

    #[inline]
    fn update(&mut self, z: T) -> T {
        let bound = T::limit(<T::Element as Limits>::MAX_DIFFERENCE);
        self.observe(choose(z.finite(), z.within(bound), T::of(f64::NAN)));
        self.variance()
    }

    fn reset(&mut self) {
        self.variance = T::zero();
        self.weight_sum = T::zero();
        self.previous = [T::of(f64::NAN); 2];
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> AllanNoise<T> {
    /// True if samples within `reach` can have changed `fresh` to this state.
    pub(crate) fn is_after(&self, fresh: &Self, reach: T) -> bool {
        let parameters = |noise: &Self| (noise.kind, noise.fading, noise.floor);
        parameters(self) == parameters(fresh)
            && is_size(self.variance, T::MAX_RAW * T::of(4.0))
            && is_size(self.weight_sum, T::MAX)
            && self.previous.iter().all(|z| is_sample(*z, reach))
    }
}

impl<T: Number> Checkpoint for AllanNoise<T> {
    const TAG: &'static str = "allan-noise";
    const VERSION: u16 = 1;

    fn is_valid(&self) -> bool {
        let Self { fading, kind, floor, .. } = *self;
        Self::new(fading.into(), kind, floor.into())
            .is_ok_and(|fresh| self.is_after(&fresh, T::MAX_DIFFERENCE))
    }

    fn is_like(&self, other: &Self) -> bool {
        (self.kind, self.fading, self.floor) == (other.kind, other.fading, other.floor)
    }
}
