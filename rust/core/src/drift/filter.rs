//! The published drift filter: model, measurement noise, Kalman step, process noise.
#![allow(non_snake_case)]

#[cfg(feature = "std")]
pub(super) mod side_by_side;
mod validity;

use nalgebra::{SMatrix, SVector, SimdBool};
use serde::{Deserialize, Serialize};

use super::kalman::{Correction, State};
use super::least_squares::Rls;
use super::options::Options;
use super::start::{MAX_NORMALISED_SAMPLE, Start};
use super::{
    Behaviour, Drift, DriftNumber, DriftStream, Params, PublishedFilter, RobustParams, Status,
    sage_husa,
};
use crate::allan::AllanNoise;
use crate::error::Error;
use crate::math::{Limits, Real, Symmetric, choose, indicator, vector};
use crate::rest::{MotionAware, RestLimits};
use crate::stream::checkpoint::Checkpoint;
use crate::stream::{Field, Number, Output, Scaling, Shape, Startup, Stream, Traced, Watch};

/// Largest coefficient of a stationary autoregression of order three.
const MAX_COEFFICIENT: f64 = 3.0;

/// The filter on normalised samples, one signal per lane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct DriftLoop<T, const N: usize, const M: usize> {
    adapts_measurement_noise: bool,
    adapts_process_noise: bool,
    /// Number of samples for which the model still learns, missing ones included.
    learning_left: u64,
    model: Rls<T, N, M>,
    pub(super) measurement_noise: AllanNoise<T>,
    process_noise: Symmetric<T, N>,
    pub(super) state: State<T, N>,
    pub(super) last: Correction<T>,
    /// `k` of Sage-Husa: number of samples that were not missing, plus the weight of G₀.
    count: T,
    /// Largest sample to date.
    peak: T,
    guards: T,
}

impl<T: Real, const N: usize, const M: usize> DriftLoop<T, N, M> {
    /// A filter that starts with the next sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of range.
    pub fn new(params: &Params) -> Result<Self, Error> {
        const { assert!(N >= 2 && M >= N, "N = p + 1 >= 2, M = p + q + 1 >= N") };
        let params = params.validate()?;
        let floor = Self::floor();
        // Limit of the trace.
        let most = T::limit(<T::Element as Limits>::MAX_COVARIANCE) / T::of(N as f64);
        let start = T::of(params.process_noise).at_least(floor).at_most(most);
        Ok(Self {
            adapts_measurement_noise: params.adapts_measurement_noise(),
            adapts_process_noise: params.adapts_process_noise(),
            learning_left: params.adapt_samples(),
            model: Rls::new(params.forgetting_factor),
            measurement_noise: AllanNoise::with_floor(params.fading_factor(), params.noise, floor)?,
            process_noise: Symmetric::diagonal(start),
            state: State::new(start),
            last: Correction { innovation: T::zero(), variance: T::one(), inverse: T::zero() },
            count: T::of(params.process_noise_memory).at_most(T::limit(T::Element::MAX)),
            peak: T::zero(),
            guards: T::zero(),
        })
    }

    #[inline(always)]
    fn floor() -> T {
        T::limit(<T::Element as Limits>::VARIANCE_FLOOR)
    }

    /// Processes one sample and returns the estimate. `seen` is false for a missing sample, with
    /// NaN as `y`.
    ///
    /// The prediction uses the model learned from earlier samples only, and the innovation is
    /// independent of this sample.
    #[inline(always)]
    pub fn step(&mut self, y: T, seen: T::SimdBool) -> (T, T::SimdBool) {
        if self.adapts_measurement_noise {
            self.measurement_noise.observe(y);
        }
        let (prior, large) = self.predict();
        let guarded = if self.learning_left > 0 {
            self.learning_left -= 1;
            // Least squares and Kalman filter do their divisions in parallel.
            let projection = self.model.prepare(seen);
            let guarded = self.correct(&prior, y, seen, large);
            self.model.learn(&projection, y, seen);
            guarded
        } else {
            self.correct(&prior, y, seen, large)
        };
        self.keep_peak(y, seen);
        (self.state.x[0], guarded)
    }

    /// The state before the next sample, and a flag for a large covariance.
    #[inline(always)]
    pub(super) fn predict(&self) -> (State<T, N>, T::SimdBool) {
        let row = self.row();
        let mut prior = self.state.predict(&row, &self.process_noise, self.peak);
        let large = prior.is_large(&self.state);
        if large.any() {
            prior.settle(&self.state, &row, large);
        }
        (prior, large)
    }

    /// First row of the transition matrix, `[φ, 1]`, limited to coefficients of a stationary model.
    #[inline(always)]
    pub(super) fn row(&self) -> SVector<T, N> {
        let parameters = self.model.parameters();
        vector(|i| match i {
            i if i < N - 1 => parameters[i].within(T::of(MAX_COEFFICIENT)),
            _ => T::one(),
        })
    }

    /// Updates state and process noise; returns a mask of guarded process noise.
    #[inline(always)]
    fn correct(
        &mut self,
        prior: &State<T, N>,
        y: T,
        seen: T::SimdBool,
        large: T::SimdBool,
    ) -> T::SimdBool {
        let R = self.measurement_noise.variance();
        self.last = self.state.correct(prior, y, seen, R);
        self.adapt_process_noise(prior, seen, large)
    }

    #[inline(always)]
    fn adapt_process_noise(
        &mut self,
        prior: &State<T, N>,
        seen: T::SimdBool,
        large: T::SimdBool,
    ) -> T::SimdBool {
        if !self.adapts_process_noise {
            return T::one().simd_lt(T::zero());
        }
        self.count += choose(seen, T::one(), T::zero());
        let weight = choose(seen, T::one() / self.count, T::zero());
        let (floor, column) = (Self::floor(), prior.column());
        let G = &mut self.process_noise;
        let guarded = sage_husa::adapt(G, floor, column, self.last, weight, large);
        self.guards += indicator(guarded);
        guarded
    }

    /// Updates noise, model and peak after a sample; the state is corrected separately.
    #[inline(always)]
    pub(super) fn learn(&mut self, y: T, seen: T::SimdBool) {
        if self.adapts_measurement_noise {
            self.measurement_noise.observe(y);
        }
        if self.learning_left > 0 {
            self.learning_left -= 1;
            self.model.observe(y, seen);
        }
        self.keep_peak(y, seen);
    }

    #[inline(always)]
    fn keep_peak(&mut self, y: T, seen: T::SimdBool) {
        self.peak = choose(seen, y.simd_abs(), T::zero()).simd_max(self.peak);
    }

    /// Kalman gain of the last sample, from the corrected covariance: `K = P Hᵀ / R`.
    fn gain(&self) -> SVector<T, N> {
        let seen = self.last.inverse.simd_gt(T::zero());
        let gain = self.state.column() / self.measurement_noise.variance();
        gain.map(|k| choose(seen, k, T::zero()))
    }
}

impl<T, const N: usize, const M: usize> DriftLoop<T, N, M>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// A filter with the model of `start`, with the confidence that a start-up would give.
    fn started(params: &Params, start: &Start<T, N, M>) -> Result<Self, Error> {
        let mut inner = Self::new(params)?;
        let samples = params.startup_samples();
        inner.model = Rls::started(params.forgetting_factor, start)?;
        let R = start.normalised_variance(start.measurement_noise);
        inner.measurement_noise.set_known(R, samples);
        let G = start.normalised_variance(start.process_noise).at_least(Self::floor());
        inner.process_noise = Symmetric::diagonal(Self::floor());
        inner.process_noise.set(0, 0, G);
        inner.state = Self::started_state(start)?;
        inner.last.variance = inner.state.P.at(0, 0) + inner.measurement_noise.variance();
        inner.count += T::of(samples as f64);
        let reach = Scaling::new(start.offset, start.scale).reach();
        inner.peak = T::of(MAX_NORMALISED_SAMPLE).at_most(reach);
        Ok(inner)
    }

    /// State at the mean. The constant of the model is zero around the mean.
    fn started_state(start: &Start<T, N, M>) -> Result<State<T, N>, Error> {
        let P = start.normalised_state_covariance()?;
        let mut state = State::new(T::zero());
        state.P = Symmetric::from_upper(|i, j| P[(i, j)]);
        state.x[N - 1] = start.normalised_coefficients()[M - 1];
        Ok(state)
    }
}

/// All estimates after a sample, in the samples' unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snapshot<T, const N: usize, const M: usize> {
    /// Filtered rate.
    pub estimate: T,
    /// Sample minus prediction; zero for a missing sample.
    pub innovation: T,
    /// Variance of the innovation.
    pub innovation_variance: T,
    /// Kalman gain.
    pub gain: SVector<T, N>,
    /// Measurement noise variance R.
    pub measurement_noise: T,
    /// Process noise covariance G.
    pub process_noise: SMatrix<T, N, N>,
    /// `[φ, θ, c]`.
    pub coefficients: SVector<T, M>,
    /// State covariance P.
    pub covariance: SMatrix<T, N, N>,
    /// True if the sample was missing.
    pub missing: bool,
    /// True if the change of the process noise was limited.
    pub guarded: bool,
    /// Drift, learned at rest.
    pub bias: T,
    /// Standard deviation of the drift.
    pub bias_sigma: T,
    /// True if the sensor is at rest, or assumed to be at rest.
    pub at_rest: bool,
    /// True if the sample was saturated; it counts as missing.
    pub saturated: bool,
    /// True if the sensor repeats one sample.
    pub stuck: bool,
}

impl<T, const N: usize, const M: usize> Output for Snapshot<T, N, M>
where
    T: Copy + nalgebra::Scalar + Into<f64>,
{
    // In the order of `write`.
    const FIELDS: &'static [Field] = &[
        Field { name: "estimate", shape: Shape::Number },
        Field { name: "innovation", shape: Shape::Number },
        Field { name: "innovation_variance", shape: Shape::Number },
        Field { name: "measurement_noise", shape: Shape::Number },
        Field { name: "bias", shape: Shape::Number },
        Field { name: "bias_sigma", shape: Shape::Number },
        Field { name: "gain", shape: Shape::Vector(N) },
        Field { name: "process_noise", shape: Shape::Matrix(N) },
        Field { name: "coefficients", shape: Shape::Vector(M) },
        Field { name: "covariance", shape: Shape::Matrix(N) },
        Field { name: "missing", shape: Shape::Flag },
        Field { name: "guarded", shape: Shape::Flag },
        Field { name: "at_rest", shape: Shape::Flag },
        Field { name: "saturated", shape: Shape::Flag },
        Field { name: "stuck", shape: Shape::Flag },
    ];

    fn write(self, numbers: &mut [f64], flags: &mut [bool]) {
        let scalars = [
            self.estimate,
            self.innovation,
            self.innovation_variance,
            self.measurement_noise,
            self.bias,
            self.bias_sigma,
        ];
        // Column after column equals row after row: the matrices are symmetric.
        let parts = [
            scalars.as_slice(),
            self.gain.as_slice(),
            self.process_noise.as_slice(),
            self.coefficients.as_slice(),
            self.covariance.as_slice(),
        ];
        let mut slots = numbers;
        for part in parts {
            let (own, others) = slots.split_at_mut(part.len());
            for (slot, number) in own.iter_mut().zip(part) {
                *slot = (*number).into();
            }
            slots = others;
        }
        flags.copy_from_slice(&[
            self.missing,
            self.guarded,
            self.at_rest,
            self.saturated,
            self.stuck,
        ]);
    }
}

/// Online drift filter of one signal: ARMA(p, q) by recursive least squares, R by Allan variance,
/// Kalman filter, G by Sage-Husa. `N = p + 1`, `M = p + q + 1`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct DriftFilter<T, const N: usize, const M: usize> {
    params: Params,
    startup: Startup<T>,
    scaling: Option<Scaling<T>>,
    pub(super) inner: DriftLoop<T, N, M>,
    pub(super) samples_seen: u64,
    estimate: T,
    missing: bool,
    guarded: bool,
    start: Option<Start<T, N, M>>,
    watch: Watch<T>,
    restarts: u64,
}

impl<T, const N: usize, const M: usize> DriftFilter<T, N, M>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// A filter before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of range.
    pub fn new(params: Params) -> Result<Self, Error> {
        let inner = DriftLoop::new(&params)?;
        Ok(Self {
            params,
            startup: Startup::new(params.startup_samples(), params.scale)?,
            scaling: None,
            inner,
            samples_seen: 0,
            estimate: T::zero(),
            missing: false,
            guarded: false,
            start: None,
            watch: Watch::new(),
            restarts: 0,
        })
    }

    /// A filter that is ready at its first sample. R and the count of Sage-Husa's update are the
    /// same as after the start-up in `params`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter or a number of the start out of range.
    pub fn started(params: Params, start: Start<T, N, M>) -> Result<Self, Error> {
        let start = start.validate()?;
        Ok(Self {
            inner: DriftLoop::started(&params, &start)?,
            scaling: Some(Scaling::new(start.offset, start.scale)),
            estimate: start.offset,
            start: Some(start),
            ..Self::new(params)?
        })
    }

    /// The filter before its first sample.
    fn fresh(&self) -> Result<Self, Error> {
        match self.start {
            None => Self::new(self.params),
            Some(start) => Self::started(self.params, start),
        }
    }

    /// Parameters of the filter.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// Filtered rate after the last sample.
    pub fn estimate(&self) -> T {
        self.estimate
    }

    /// True after the start-up: offset, scale and noise are learned.
    pub fn ready(&self) -> bool {
        self.scaling.is_some()
    }

    /// The stated start, `None` if it was learned.
    pub fn start(&self) -> Option<&Start<T, N, M>> {
        self.start.as_ref()
    }

    fn running_snapshot(&self, scaling: &Scaling<T>) -> Snapshot<T, N, M> {
        let inner = &self.inner;
        Snapshot {
            estimate: self.estimate,
            innovation: scaling.raw_difference(inner.last.innovation),
            innovation_variance: scaling.raw_variance(inner.last.variance),
            gain: inner.gain(),
            measurement_noise: scaling.raw_variance(inner.measurement_noise.variance()),
            process_noise: scaling.raw_covariance(&inner.process_noise),
            coefficients: scaling.raw_coefficients::<N, M>(inner.model.parameters()),
            covariance: scaling.raw_covariance(&inner.state.P),
            missing: self.missing,
            guarded: self.guarded,
            bias: self.estimate,
            bias_sigma: self.sigma(scaling),
            at_rest: true,
            saturated: false,
            stuck: false,
        }
    }

    fn sigma(&self, scaling: &Scaling<T>) -> T {
        scaling.raw_difference(self.inner.state.P.at(0, 0).simd_sqrt())
    }

    /// Process noise and covariance during start-up.
    fn startup_noise(&self) -> T {
        (self.startup.variance() * T::of(self.params.process_noise)).at_most(T::MAX_RAW)
    }

    /// Measurement noise during start-up.
    fn startup_measurement_noise(&self) -> T {
        match self.startup.own_scaling() {
            Some(_) => self.startup.raw_variance(self.inner.measurement_noise.variance()),
            None => self.startup.variance(),
        }
    }

    /// Snapshot during start-up: the running mean, with its gain and variances.
    fn startup_snapshot(&self) -> Snapshot<T, N, M> {
        let variance = self.startup.variance();
        let start = self.startup_noise();
        let mut gain = SVector::zeros();
        if !self.missing && self.startup.samples() > 0 {
            gain[0] = T::one() / T::of(self.startup.samples() as f64);
        }
        let mut coefficients = SVector::zeros();
        coefficients[M - 1] = self.startup.mean();
        Snapshot {
            estimate: self.estimate,
            innovation: self.inner.last.innovation,
            innovation_variance: variance,
            gain,
            measurement_noise: self.startup_measurement_noise(),
            process_noise: SMatrix::from_diagonal_element(start),
            coefficients,
            covariance: SMatrix::from_diagonal_element(start),
            missing: self.missing,
            guarded: false,
            bias: self.estimate,
            bias_sigma: start.simd_sqrt(),
            at_rest: true,
            saturated: false,
            stuck: false,
        }
    }

    /// Processes one sample after the start-up.
    #[inline(always)]
    fn step(inner: &mut DriftLoop<T, N, M>, scaling: &Scaling<T>, z: T) -> (T, bool, bool) {
        let y = scaling.normalise(z);
        let missing = !z.finite();
        // The step is written twice: the compiler drops the masks from the first.
        let (y, guarded) = if missing { inner.step(y, false) } else { inner.step(y, true) };
        (scaling.raw(y), missing, guarded)
    }

    /// Processes one sample.
    #[inline(always)]
    fn advance(&mut self, z: T) -> T {
        self.advance_by(z, Self::step)
    }

    /// Processes one sample by `step`. It returns the estimate, and flags for a missing sample and
    /// guarded noise.
    #[inline(always)]
    pub(super) fn advance_by(
        &mut self,
        z: T,
        step: impl FnOnce(&mut DriftLoop<T, N, M>, &Scaling<T>, T) -> (T, bool, bool),
    ) -> T {
        self.samples_seen += 1;
        match &self.scaling {
            Some(scaling) => {
                (self.estimate, self.missing, self.guarded) = step(&mut self.inner, scaling, z);
                if Watch::<T>::is_due(self.samples_seen) && self.disproves(z) {
                    self.restart_if_disproved();
                }
            }
            None => {
                self.missing = !z.finite();
                self.estimate = self.learn_scale(z);
            }
        }
        self.estimate
    }

    /// Start-up: returns the mean to date, zero before the first sample.
    #[cold]
    fn learn_scale(&mut self, z: T) -> T {
        self.inner.last.innovation = self.startup.difference(z);
        let y = self.startup.observe(z);
        self.inner.measurement_noise.observe(y);
        self.scaling = self.startup.finished();
        if let Some(scaling) = self.scaling {
            self.begin(&scaling);
        }
        self.startup.mean()
    }

    /// Converts from the start-up's units to the filter's units.
    fn begin(&mut self, scaling: &Scaling<T>) {
        let (inner, startup) = (&mut self.inner, &self.startup);
        let noise = &mut inner.measurement_noise;
        match startup.own_scaling() {
            Some((mean, deviation, peak)) => {
                *noise = noise.rescaled(mean, deviation);
                inner.peak = peak;
            }
            None => {
                let deviation = scaling.normalised_difference(startup.variance().simd_sqrt());
                noise.interrupt();
                noise.set_known(deviation * deviation, startup.samples());
                inner.peak = T::of(MAX_NORMALISED_SAMPLE).at_most(scaling.reach());
            }
        }
        inner.count += T::of(startup.samples() as f64);
        inner.last = Correction {
            innovation: inner.last.innovation / scaling.scale(),
            variance: T::one(),
            inverse: T::zero(),
        };
    }

    /// True if a sample proves a learned scale wrong by orders of magnitude.
    #[cold]
    fn disproves(&mut self, z: T) -> bool {
        let scale_given = self.start.is_some() || self.params.scale.is_some();
        match self.scaling.filter(|_| !scale_given) {
            Some(scaling) => self.watch.disproves(z, scaling.scale()),
            None => false,
        }
    }

    /// Restarts the learning if the scale is proved wrong.
    #[cold]
    fn restart_if_disproved(&mut self) {
        if self.watch.has_disproved()
            && let Ok(fresh) = Self::new(self.params)
        {
            let Self { samples_seen, estimate, missing, .. } = *self;
            let restarts = self.restarts + 1;
            *self = Self { samples_seen, estimate, missing, restarts, ..fresh };
        }
    }
}

impl<T: DriftNumber, const N: usize, const M: usize> Stream for DriftFilter<T, N, M> {
    type Input = T;
    type Output = T;

    // Compiled once per type, not into every caller: a step is long, and there are twelve orders.
    #[inline(never)]
    fn update(&mut self, z: T) -> T {
        self.advance(z)
    }

    #[inline]
    fn run(&mut self, inputs: impl Iterator<Item = T>, mut put: impl FnMut(T)) {
        // A copy on the stack: processors forward its fixed addresses fastest.
        let mut filter = *self;
        for z in inputs {
            put(filter.advance(z));
        }
        *self = filter;
    }

    /// The state is plain numbers, which are copied at once and not field by field.
    #[cfg(feature = "std")]
    fn try_clone(&self) -> Result<Self, Error> {
        Ok(*self)
    }

    fn reset(&mut self) {
        if let Ok(fresh) = self.fresh() {
            *self = fresh;
        }
    }

    #[cfg(feature = "std")]
    fn lane_count() -> usize {
        T::lane_count()
    }

    #[cfg(feature = "std")]
    fn process_block(filters: &mut [Self], block: &mut crate::stream::Block<'_>) {
        T::process_block(filters, block);
    }
}

impl<T: DriftNumber, const N: usize, const M: usize> MotionAware for DriftFilter<T, N, M> {}

impl<T: DriftNumber, const N: usize, const M: usize> Traced for DriftFilter<T, N, M> {
    type Snapshot = Snapshot<T, N, M>;

    fn snapshot(&self) -> Snapshot<T, N, M> {
        match &self.scaling {
            Some(scaling) => self.running_snapshot(scaling),
            None => self.startup_snapshot(),
        }
    }
}

impl<T: Number, const N: usize, const M: usize> Checkpoint for DriftFilter<T, N, M> {
    const TAG: &'static str = "drift";
    const VERSION: u16 = 2;
    const SIZES: [u8; 2] = [(N - 1) as u8, (M - N) as u8];

    fn is_valid(&self) -> bool {
        self.fresh().is_ok_and(|fresh| self.is_after(&fresh))
    }

    fn is_like(&self, other: &Self) -> bool {
        self.params == other.params
            && self.samples_seen == other.samples_seen
            && self.start.is_some() == other.start.is_some()
    }
}

impl<T: DriftNumber, const N: usize, const M: usize> DriftStream<T> for DriftFilter<T, N, M> {
    const START: &'static [Field] = Start::<T, N, M>::FIELDS;

    fn options(&self) -> Options {
        Options {
            method: Some(self.params.method),
            order: (N - 1, M - N),
            params: self.params,
            robust: None,
            behaviour: Behaviour::PUBLISHED,
            limits: RestLimits::default(),
        }
    }

    fn samples_seen(&self) -> u64 {
        self.samples_seen
    }

    fn ready(&self) -> bool {
        self.scaling.is_some()
    }

    fn status(&self) -> Status {
        Status::of(self.ready(), true).after(self.restarts)
    }

    fn drift(&self) -> Drift<T> {
        let sigma = match &self.scaling {
            Some(scaling) => self.sigma(scaling),
            None => self.startup_noise().simd_sqrt(),
        };
        Drift { bias: self.estimate, sigma, at_rest: true }
    }

    /// R is the white noise; the drift is not a random walk.
    fn densities(&self) -> [T; 2] {
        let unknown = T::of(f64::NAN);
        let R = self.inner.measurement_noise.variance();
        let R = self.scaling.map_or(unknown, |scaling| scaling.raw_variance(R));
        [(R / T::of(self.params.rate)).simd_sqrt(), unknown]
    }

    fn bias_instability(&self) -> T {
        T::of(f64::NAN)
    }

    fn guard_count(&self) -> u64 {
        self.inner.guards.to_subset().map_or(0, |count: f64| count as u64)
    }

    fn restarts(&self) -> u64 {
        self.restarts
    }

    fn write_start(&self, numbers: &mut [f64]) -> bool {
        self.start.map(|start| start.write(numbers, &mut [])).is_some()
    }
}

impl<T: DriftNumber, const N: usize, const M: usize> PublishedFilter<T, N, M>
    for DriftFilter<T, N, M>
{
    const GATED_TAG: &'static str = "drift-rest-gated";

    fn params(&self) -> &Params {
        &self.params
    }

    fn robust(&self) -> Option<&RobustParams> {
        None
    }

    fn start(&self) -> Option<&Start<T, N, M>> {
        self.start.as_ref()
    }

    fn estimate(&self) -> T {
        self.estimate
    }
}
