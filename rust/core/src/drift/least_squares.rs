//! Recursive extended least squares of an ARMA(p, q) model with a constant (FH 8–13).

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::start::{Factors, Start};
use crate::error::{Error, check_forgetting_factor, check_scale};
use crate::math::validity::{is_count, is_size, is_within};
use crate::math::{Limits, Real, choose, vector};
use crate::stream::checkpoint::Checkpoint;
use crate::stream::{Number, Scaling, Startup, Stream, Watch};

/// Least squares on normalised samples, `N = p + 1`, `M = p + q + 1`.
///
/// The covariance is stored as `U D Uᵀ` (Bierman 1977). It is positive semidefinite for any `U`, if
/// no element of `D` is negative.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct Rls<T, const N: usize, const M: usize> {
    /// `1/λ`: growth of the covariance per sample.
    growth: T,
    /// `[φ, θ, c]`.
    parameters: SVector<T, M>,
    /// `[y_{k-1}…y_{k-p}, a_{k-1}…a_{k-q}]`; the last element belongs to the constant.
    history: SVector<T, M>,
    unit_upper: SMatrix<T, M, M>,
    diagonal: SVector<T, M>,
}

#[cfg(feature = "std")]
crate::math::laned!(Rls [N, M] { growth, parameters, history, unit_upper, diagonal } common {});

/// Projection of the covariance on the regressor, before the sample arrives.
#[derive(Debug, Clone, Copy)]
pub struct Projection<T, const M: usize> {
    /// `Uᵀ f`.
    projected: SVector<T, M>,
    /// `D Uᵀ f`.
    spread: SVector<T, M>,
    /// Partial sums of `1 + fᵀ P f`.
    variance: SVector<T, M>,
}

impl<T: Real, const N: usize, const M: usize> Rls<T, N, M> {
    const P: usize = N - 1;
    const Q: usize = M - N;

    /// Initial state: zero parameters, each with a standard deviation of one.
    pub fn new(forgetting_factor: f64) -> Self {
        Self {
            growth: T::of(1.0 / forgetting_factor),
            parameters: SVector::zeros(),
            history: SVector::zeros(),
            unit_upper: SMatrix::identity(),
            diagonal: SVector::repeat(T::one()),
        }
    }

    /// `[φ, θ, c]`.
    #[inline(always)]
    pub fn parameters(&self) -> &SVector<T, M> {
        &self.parameters
    }

    /// Covariance of the parameters over the noise variance, `U D Uᵀ`.
    pub fn covariance(&self) -> SMatrix<T, M, M> {
        SMatrix::from_fn(|i, j| {
            let columns = self.unit_upper.column_iter().zip(self.diagonal.iter());
            columns.fold(T::zero(), |sum, (u, d)| sum + u[i] * u[j] * *d)
        })
    }

    /// Processes `y_k` and returns the a-posteriori residual `a_k` (FH 11).
    ///
    /// A sample that was not `seen` changes nothing; the last sample takes its place in the
    /// regressor.
    #[inline(always)]
    pub fn observe(&mut self, y: T, seen: T::SimdBool) -> T {
        let projection = self.prepare(seen);
        self.learn(&projection, y, seen)
    }

    /// First half of [`observe`](Self::observe), which needs neither the sample nor a division.
    #[inline(always)]
    pub fn prepare(&mut self, seen: T::SimdBool) -> Projection<T, M> {
        self.forget(seen);
        let mut projection = Projection {
            projected: SVector::zeros(),
            spread: SVector::zeros(),
            variance: SVector::zeros(),
        };
        let mut variance = T::one();
        for j in 0..M {
            let mut f = self.regressor(j);
            for i in 0..j {
                f += self.unit_upper[(i, j)] * self.regressor(i);
            }
            let f = choose(seen, f, T::zero());
            projection.projected[j] = f;
            projection.spread[j] = self.diagonal[j] * f;
            variance += f * projection.spread[j];
            projection.variance[j] = variance;
        }
        projection
    }

    /// Second half of [`observe`](Self::observe).
    #[inline(always)]
    pub fn learn(&mut self, projection: &Projection<T, M>, y: T, seen: T::SimdBool) -> T {
        let y = choose(seen, y.within(learned_max()), self.history[0]);
        let error = choose(seen, y - self.prediction(), T::zero());
        let (gain, shrink) = self.measure(projection);
        // The error that remains after the update, and the parameters' change (FH 10, 11).
        let residual = (error * shrink).within(learned_max());
        self.parameters += gain * residual;
        self.shift(y, residual);
        residual
    }

    /// Element `i` of `f = [y_{k-1}…, a_{k-1}…, 1]`.
    #[inline(always)]
    fn regressor(&self, i: usize) -> T {
        if i == M - 1 { T::one() } else { self.history[i] }
    }

    /// `fᵀ β`.
    #[inline(always)]
    fn prediction(&self) -> T {
        let mut sum = self.parameters[M - 1];
        for i in 0..M - 1 {
            sum += self.parameters[i] * self.history[i];
        }
        sum
    }

    /// Multiplies the covariance by 1/λ, but never beyond its initial trace. Without new
    /// information it would grow until it overflows.
    #[inline(always)]
    fn forget(&mut self, seen: T::SimdBool) {
        use nalgebra::SimdBool;
        if self.growth.simd_gt(T::one()).none() {
            return;
        }
        let room = T::of(M as f64) / self.trace();
        let growth = room.at_least(T::one()).at_most(self.growth);
        self.diagonal *= choose(seen, growth, T::one());
    }

    #[inline(always)]
    fn trace(&self) -> T {
        let mut sum = T::zero();
        for j in 0..M {
            let mut column = T::one();
            for i in 0..j {
                column += self.unit_upper[(i, j)] * self.unit_upper[(i, j)];
            }
            sum += self.diagonal[j] * column;
        }
        sum
    }

    /// Bierman's measurement update with unit noise; returns `P f` and `1 / (1 + fᵀ P f)`. Their
    /// product is the gain (FH 13). For a missing sample `f` is zero and nothing changes.
    #[inline(always)]
    fn measure(&mut self, projection: &Projection<T, M>) -> (SVector<T, M>, T) {
        let inverse = vector::<T, M>(|j| T::one() / projection.variance[j]);
        let mut gain = SVector::<T, M>::zeros();
        gain[0] = projection.spread[0];
        self.diagonal[0] *= inverse[0];
        for j in 1..M {
            let slope = projection.projected[j] * inverse[j - 1];
            self.diagonal[j] *= projection.variance[j - 1] * inverse[j];
            for i in 0..j {
                let u = self.unit_upper[(i, j)];
                self.unit_upper[(i, j)] = u - slope * gain[i];
                gain[i] += u * projection.spread[j];
            }
            gain[j] = projection.spread[j];
        }
        (gain, inverse[M - 1])
    }

    #[inline(always)]
    fn shift(&mut self, y: T, residual: T) {
        for i in (1..Self::P).rev() {
            self.history[i] = self.history[i - 1];
        }
        self.history[0] = y;
        for i in (1..Self::Q).rev() {
            self.history[Self::P + i] = self.history[Self::P + i - 1];
        }
        if Self::Q > 0 {
            self.history[Self::P] = residual;
        }
    }
}

impl<T, const N: usize, const M: usize> Rls<T, N, M>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// State from `start`.
    ///
    /// # Errors
    /// [`Error::Parameter`] if the covariance is not valid.
    pub fn started(forgetting_factor: f64, start: &Start<T, N, M>) -> Result<Self, Error> {
        let Factors { unit_upper, diagonal } = Factors::of("covariance", &start.covariance)?;
        let parameters = start.normalised_coefficients();
        let mut rls = Self { parameters, unit_upper, diagonal, ..Self::new(forgetting_factor) };
        let excess = (rls.trace() / T::of(M as f64)).at_least(T::one());
        rls.diagonal /= excess;
        Ok(rls)
    }

    /// True if samples can have changed `fresh`, the initial state, to this state.
    pub(super) fn is_after(&self, fresh: &Self) -> bool {
        let known = (0..M).flat_map(|j| (0..M).map(move |i| (i, j)));
        let is_factor = |(i, j): (usize, usize)| match i < j {
            true => is_within(self.unit_upper[(i, j)], T::MAX_DIFFERENCE),
            false => self.unit_upper[(i, j)] == fresh.unit_upper[(i, j)],
        };
        let most = T::of(2.0 * M as f64);
        self.growth == fresh.growth
            && self.parameters.iter().all(|x| is_within(*x, T::MAX_RAW))
            && self.history.iter().all(|y| is_within(*y, T::MAX_LEARNED))
            && self.diagonal.iter().all(|d| is_size(*d, most))
            && known.into_iter().all(is_factor)
            && self.trace() <= most
    }
}

#[inline(always)]
fn learned_max<T: Real>() -> T {
    T::limit(<T::Element as Limits>::MAX_LEARNED)
}

/// Parameters of [`RecursiveLeastSquares`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RlsParams {
    /// Forgetting factor λ in (0, 1]; 1 never forgets.
    pub forgetting_factor: f64,
    /// Number of samples used to learn offset and scale.
    pub startup: u64,
    /// Standard deviation of the noise, if known; else it is learned.
    pub scale: Option<f64>,
}

impl Default for RlsParams {
    fn default() -> Self {
        Self { forgetting_factor: 1.0, startup: 100, scale: None }
    }
}

/// Online ARMA(p, q) model of a raw signal: [`Rls`] on samples centred and scaled by a start-up
/// window.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct RecursiveLeastSquares<T, const N: usize, const M: usize> {
    params: RlsParams,
    startup: Startup<T>,
    scaling: Option<Scaling<T>>,
    rls: Rls<T, N, M>,
    samples_seen: u64,
    watch: Watch<T>,
}

impl<T: Limits, const N: usize, const M: usize> RecursiveLeastSquares<T, N, M>
where
    T: Real<Element = T, SimdBool = bool>,
{
    /// A model before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a forgetting factor, start-up or scale out of range.
    pub fn new(params: RlsParams) -> Result<Self, Error> {
        check_forgetting_factor(params.forgetting_factor)?;
        check_scale(params.scale)?;
        Ok(Self {
            params,
            startup: Startup::new(params.startup, params.scale)?,
            scaling: None,
            rls: Rls::new(params.forgetting_factor),
            samples_seen: 0,
            watch: Watch::new(),
        })
    }

    /// Parameters of the model.
    pub fn params(&self) -> &RlsParams {
        &self.params
    }

    /// True after the start-up: offset and scale are learned.
    pub fn ready(&self) -> bool {
        self.scaling.is_some()
    }

    /// `[φ, θ, c]`, the constant in the samples' unit; during start-up only the mean.
    pub fn coefficients(&self) -> SVector<T, M> {
        match &self.scaling {
            Some(scaling) => scaling.raw_coefficients::<N, M>(self.rls.parameters()),
            None => {
                let mut mean = SVector::zeros();
                mean[M - 1] = self.startup.mean();
                mean
            }
        }
    }

    /// Covariance of the normalised parameters over the noise variance.
    pub fn covariance(&self) -> SMatrix<T, M, M> {
        self.rls.covariance()
    }

    /// Samples to date, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.samples_seen
    }

    /// Learns the scale again if it was learned and is wrong by orders of magnitude.
    #[cold]
    fn check_scale(&mut self, z: T) {
        let scale_given = self.params.scale.is_some();
        let Some(scaling) = self.scaling.filter(|_| !scale_given) else { return };
        if self.watch.disproves(z, scaling.scale())
            && let Ok(fresh) = Self::new(self.params)
        {
            *self = Self { samples_seen: self.samples_seen, ..fresh };
        }
    }
}

impl<T: Number, const N: usize, const M: usize> Stream for RecursiveLeastSquares<T, N, M> {
    type Input = T;
    type Output = T;

    /// The a-posteriori residual in the samples' unit. During start-up it is the sample minus the
    /// mean to date. It is zero for a missing sample.
    #[inline]
    fn update(&mut self, z: T) -> T {
        self.samples_seen += 1;
        match &self.scaling {
            Some(scaling) => {
                let y = scaling.normalise(z);
                let residual = scaling.raw_difference(self.rls.observe(y, z.finite()));
                if Watch::<T>::is_due(self.samples_seen) {
                    self.check_scale(z);
                }
                residual
            }
            None => {
                self.startup.observe(z);
                self.scaling = self.startup.finished();
                self.startup.difference(z)
            }
        }
    }

    /// The state is plain numbers, which are copied at once and not field by field.
    #[cfg(feature = "std")]
    fn try_clone(&self) -> Result<Self, Error> {
        Ok(*self)
    }

    fn reset(&mut self) {
        if let Ok(fresh) = Self::new(self.params) {
            *self = fresh;
        }
    }
}

impl<T: Number, const N: usize, const M: usize> Checkpoint for RecursiveLeastSquares<T, N, M> {
    const TAG: &'static str = "least-squares";
    const VERSION: u16 = 2;
    const SIZES: [u8; 2] = [(N - 1) as u8, (M - N) as u8];

    fn is_valid(&self) -> bool {
        Self::new(self.params).is_ok_and(|fresh| {
            is_count(self.samples_seen)
                && self.startup.is_after(&fresh.startup, self.samples_seen)
                && self.scaling == self.startup.finished()
                && self.rls.is_after(&fresh.rls)
                && self.watch.is_valid()
        })
    }

    fn is_like(&self, other: &Self) -> bool {
        (self.params, self.samples_seen) == (other.params, other.samples_seen)
    }
}
