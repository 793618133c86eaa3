//! The drift filter that tunes itself: start, rest and motion, sample by sample.
//!
//! A quarter second of samples is a tick, and a [`RestDetector`] detects motion in it. Two seconds
//! of ticks at rest are a block. A bank of Kalman filters models the means of blocks as random
//! walks. The filter learns the sensor's white noise from the fading Allan variance of the ticks.
//! It learns the strength of the drift from the likelihood of each walk.
#![allow(non_snake_case)]

#[cfg(feature = "std")]
pub(super) mod side_by_side;
mod validity;

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::options::Options;
use super::sensor::{DriftNow, Interim, SensorModel};
use super::{Behaviour, Drift, DriftNumber, DriftStream, Snapshot, Status, Tally, params};
use crate::error::Error;
use crate::math::{Limits, Real};
use crate::rest::{Event, MotionAware, RestDetector, RestLimits, Tick};
use crate::stream::checkpoint::Checkpoint;
use crate::stream::{Startup, Stream, Traced, Watch};

/// Parameters of an [`AutoFilter`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AutoParams {
    /// Samples per second.
    pub rate: f64,
    /// Time of rest after which the noise counts as known, s.
    pub startup: f64,
    /// Standard deviation of the noise in the samples' unit, if known.
    pub scale: Option<f64>,
    /// Input, treatment of motion, and output.
    pub behaviour: Behaviour,
    /// Limits of rest; used only if motion is held.
    pub limits: RestLimits,
}

/// Drift of one signal, learned at rest and held in motion, by a filter that needs no tuning.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct AutoFilter<T> {
    params: AutoParams,
    detector: RestDetector<T>,
    startup: Startup<T>,
    model: Option<SensorModel<T>>,
    status: Status,
    /// True if the learned state is older than the last power-on of the sensor.
    experienced: bool,
    estimate: T,
    /// Standard deviation of the mean drift over the next ten seconds, once the noise is known.
    sigma: T,
    /// Standard deviation of the estimate from the Kalman filters.
    walk_sigma: T,
    interim: Interim<T>,
    /// The sample minus the previous estimate; zero if it is missing or in motion.
    innovation: T,
    /// Largest sample to date: a bound of the drift while nothing else is known.
    reach: T,
    missing: bool,
    saturated: bool,
    samples_seen: u64,
    tally: Tally,
    watch: Watch<T>,
    restarts: u64,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> AutoFilter<T> {
    /// A filter before its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of range.
    pub fn new(params: AutoParams) -> Result<Self, Error> {
        let window = params::checked_window(params.rate, params.startup)?;
        crate::error::check_scale(params.scale)?;
        params.behaviour.validate()?;
        Ok(Self {
            params,
            detector: RestDetector::new(params.rate, params.limits)?,
            startup: Startup::new(window, params.scale)?,
            model: None,
            status: params.first_status(),
            experienced: false,
            estimate: T::zero(),
            sigma: T::zero(),
            walk_sigma: T::zero(),
            interim: Interim::held(),
            innovation: T::zero(),
            reach: T::zero(),
            missing: false,
            saturated: false,
            samples_seen: 0,
            tally: Tally::default(),
            watch: Watch::new(),
            restarts: 0,
        })
    }

    /// Status of the filter.
    pub fn status(&self) -> Status {
        match self.status.after(self.restarts) {
            _ if self.detector.is_stuck() => Status::Stuck,
            Status::AtRest if self.is_provisional() => Status::Provisional,
            status => status,
        }
    }

    /// Present drift.
    pub fn bias(&self) -> T {
        self.estimate
    }

    /// Standard deviation of the mean drift over the next ten seconds, relative to the bias. While
    /// the assumed rest may be motion, it is at least the error of a motion as large as the
    /// samples.
    pub fn bias_sigma(&self) -> T {
        self.cautious(self.own_sigma(self.sigma))
    }

    /// Standard deviation of the mean drift over the next `seconds`. Zero means the present drift,
    /// including fast flicker.
    ///
    /// # Errors
    /// [`Error::Parameter`] if `seconds` is negative or not finite.
    pub fn bias_sigma_over(&self, seconds: f64) -> Result<T, Error> {
        if !(seconds >= 0.0 && seconds.is_finite()) {
            return Err(Error::Parameter {
                name: "seconds",
                expected: "a finite number of at least 0",
                value: seconds,
            });
        }
        let sigma = match &self.model {
            Some(model) if !begins(self.status) => model.sigma_over(seconds),
            _ => self.sigma,
        };
        Ok(self.cautious(self.own_sigma(sigma)))
    }

    fn cautious(&self, sigma: T) -> T {
        if !self.is_provisional() {
            return sigma;
        }
        let (level, noise) = match &self.model {
            Some(model) if !begins(self.status) => (self.estimate, model.measurement_noise()),
            _ => (self.startup.mean(), self.startup.variance()),
        };
        sigma.at_least((level.simd_abs() + noise.simd_sqrt()).at_most(T::MAX_RAW))
    }

    /// The filter's own standard deviation, if rest is certain.
    fn own_sigma(&self, learned: T) -> T {
        match (self.status, self.startup.samples()) {
            (status, _) if !begins(status) => learned,
            (Status::NoRestYet, _) | (_, 0 | 1) => self.reach,
            (_, n) => (self.startup.variance() / T::of(n as f64)).simd_sqrt(),
        }
    }

    fn is_provisional(&self) -> bool {
        self.params.behaviour.hold_in_motion && self.detector.is_provisional()
    }

    /// True if the standard deviation depends on the sample.
    fn varies(&self) -> bool {
        begins(self.status) || self.is_provisional()
    }

    /// Variances of a sample's white noise and of the drift's step per sample, once known.
    pub fn noise(&self) -> Option<(T, T)> {
        self.model.map(|model| (model.white_noise(), model.process_noise()))
    }

    /// Variance of a sample's white noise, once both the noise and the drift are known.
    #[cfg(feature = "std")]
    pub(crate) fn settled_noise(&self) -> Option<T> {
        self.model.as_ref().filter(|_| !begins(self.status)).map(SensorModel::white_noise)
    }

    /// True if the sensor repeats one sample.
    #[inline(always)]
    #[cfg(feature = "std")]
    pub(crate) fn is_stuck(&self) -> bool {
        self.detector.is_stuck()
    }

    /// Smallest step of the samples to date.
    #[cfg(feature = "std")]
    pub(crate) fn resolution(&self) -> T {
        self.detector.resolution()
    }

    /// Number of samples in a tick.
    #[cfg(feature = "std")]
    pub(crate) fn tick_length(&self) -> u32 {
        self.detector.tick_length()
    }

    /// Parameters of the filter.
    #[cfg(feature = "std")]
    pub(crate) fn params(&self) -> &AutoParams {
        &self.params
    }

    /// Restarts after power-on: forgets the drift, keeps the noise.
    pub fn switch_on(&mut self) {
        self.experienced = self.model.is_some();
        self.detector.restart();
        self.forget();
        self.status = self.params.first_status();
    }

    #[inline(always)]
    fn learns(&self) -> bool {
        matches!(self.status, Status::Starting | Status::AtRest)
    }

    fn take(&mut self, tick: &Tick<T>) {
        self.interim = Interim::held();
        self.tally.add(tick);
        match tick.event.filter(|_| self.params.behaviour.hold_in_motion) {
            Some(Event::Rest) => self.rest(tick),
            Some(Event::Motion) => self.motion(),
            Some(Event::Restart) if self.detector.at_rest() => return self.jump(tick),
            Some(Event::Restart) => self.forget(),
            None => {}
        }
        if self.disproves(tick) {
            return self.restart_from_scratch();
        }
        if self.status == Status::NoRestYet && self.detector.standing() <= 1 {
            self.startup.reset();
        }
        match self.status {
            Status::Starting => self.finish_startup(),
            Status::AtRest => self.learn(tick),
            Status::InMotion => self.wait(),
            _ => {}
        }
    }

    fn rest(&mut self, tick: &Tick<T>) {
        match &mut self.model {
            Some(model) if !begins(self.status) => {
                if model.is_another(tick) {
                    model.relearn_noise(tick);
                }
                self.status = Status::AtRest;
            }
            _ => self.status = Status::Starting,
        }
    }

    /// Begins a motion. A start-up that it ends has learned nothing.
    fn motion(&mut self) {
        if begins(self.status) {
            self.forget();
        } else {
            self.status = Status::InMotion;
        }
    }

    /// Forgets a false rest.
    fn forget(&mut self) {
        self.startup.reset();
        if !self.experienced {
            self.model = None;
        }
        self.status = Status::NoRestYet;
        self.estimate = T::zero();
        self.interim = Interim::held();
    }

    /// Begins a rest at another level; the tick is its first.
    fn jump(&mut self, tick: &Tick<T>) {
        if self.model.is_some_and(|model| model.is_another(tick)) {
            self.model = None;
        }
        match &mut self.model {
            Some(model) if !begins(self.status) => {
                model.begin_at(tick.mean, T::of(f64::from(tick.count)));
                self.run();
            }
            _ => {
                self.startup.reset();
                self.status = Status::Starting;
                self.start(tick.mean);
            }
        }
    }

    fn finish_startup(&mut self) {
        let Some(scaling) = self.startup.finished() else { return };
        let samples = self.startup.worth();
        let length = T::of(f64::from(self.detector.tick_length()));
        let rate = self.params.rate;
        match &mut self.model {
            Some(model) => model.begin_at(self.startup.mean(), samples),
            None => self.model = SensorModel::new(scaling, length, samples, rate).ok(),
        }
        self.run();
    }

    fn learn(&mut self, tick: &Tick<T>) {
        if let Some(model) = &mut self.model {
            let drift = model.learn(tick);
            self.go_on(&drift);
        }
    }

    /// True if a rest's noise is wrong by orders of magnitude: it was never this sensor's noise.
    fn disproves(&mut self, tick: &Tick<T>) -> bool {
        let learned = self.status == Status::AtRest && self.params.scale.is_none();
        match self.model.filter(|_| learned) {
            Some(model) => self.watch.disproves_by_tick(tick.deviation, model.scale()),
            None => false,
        }
    }

    /// Learns noise and drift again, from the next sample on.
    fn restart_from_scratch(&mut self) {
        self.startup.reset();
        (self.model, self.experienced) = (None, false);
        self.interim = Interim::held();
        self.watch = Watch::new();
        self.restarts += 1;
        self.status = Status::Starting;
    }

    /// Continues from the learned state.
    fn run(&mut self) {
        if let Some(model) = &self.model {
            let drift = model.drift();
            self.go_on(&drift);
        }
    }

    fn go_on(&mut self, drift: &DriftNow<T>) {
        (self.estimate, self.sigma) = (drift.mean, drift.sigma);
        (self.walk_sigma, self.interim) = (drift.walk_sigma, drift.interim);
        self.status = Status::AtRest;
    }

    fn wait(&mut self) {
        if let Some(model) = &mut self.model {
            model.wait();
            let drift = model.drift();
            (self.estimate, self.sigma) = (drift.mean, drift.sigma);
            self.walk_sigma = drift.walk_sigma;
        }
    }

    /// Follows a sample that is present until its tick is tested.
    #[inline(always)]
    fn follow(&mut self, z: T) {
        let z = z.within(T::MAX_RAW);
        self.reach = self.reach.at_least(z.simd_abs());
        if self.learns() {
            self.innovation = (z - self.estimate).within(T::MAX_RAW);
            self.estimate = self.interim.step(self.estimate, z);
        }
    }

    /// The estimate is the mean to date; zero while no rest has been seen.
    #[cold]
    fn start(&mut self, z: T) {
        match self.status {
            Status::Starting => {
                self.startup.observe(z);
                self.estimate = self.believed(self.startup.mean());
            }
            _ if self.params.waits_for_rest() => {
                self.startup.observe(z);
            }
            _ => {}
        }
    }

    /// Processes one sample. If `moving`, the body is known to move; else its motion is unknown.
    #[inline(always)]
    fn step(&mut self, z: T, moving: bool) -> T {
        self.samples_seen += 1;
        self.saturated = self.params.behaviour.saturates(z);
        let z = if self.saturated { T::of(f64::NAN) } else { z };
        self.tally.saturated += u64::from(self.saturated);
        self.missing = !z.finite();
        self.innovation = T::zero();
        if !self.missing {
            self.follow(z);
        }
        if begins(self.status) {
            self.start(z);
        }
        if let Some(tick) = self.detector.observe_while(z, moving) {
            self.take(&tick);
        }
        self.params.behaviour.output(z, self.estimate)
    }

    /// The level, or zero if it cannot be a bias.
    fn believed(&self, level: T) -> T {
        match self.params.limits.bias {
            Some(limit) if level.simd_abs() > T::of(limit) => T::zero(),
            _ => level,
        }
    }
}

impl Default for AutoParams {
    fn default() -> Self {
        Self {
            rate: 100.0,
            startup: 1.0,
            scale: None,
            behaviour: Behaviour::default(),
            limits: RestLimits::default(),
        }
    }
}

impl AutoParams {
    /// True if limits are known and the sensor has not yet shown rest.
    fn waits_for_rest(&self) -> bool {
        self.behaviour.hold_in_motion && self.limits.rest.is_some()
    }

    fn first_status(&self) -> Status {
        if self.waits_for_rest() { Status::NoRestYet } else { Status::Starting }
    }
}

impl<T: DriftNumber> Stream for AutoFilter<T> {
    type Input = T;
    type Output = T;

    #[inline]
    fn update(&mut self, z: T) -> T {
        self.step(z, false)
    }

    /// The state is plain numbers, which are copied at once and not field by field.
    #[cfg(feature = "std")]
    fn try_clone(&self) -> Result<Self, Error> {
        Ok(*self)
    }

    fn reset(&mut self) {
        if let Ok(new) = Self::new(self.params) {
            *self = new;
        }
    }

    #[cfg(feature = "std")]
    fn process_block(filters: &mut [Self], block: &mut crate::stream::Block<'_>) {
        T::process_block_of_auto(filters, block);
    }
}

impl<T: DriftNumber> MotionAware for AutoFilter<T> {
    #[inline]
    fn update_while(&mut self, z: T, moving: bool) -> T {
        self.step(z, moving)
    }
}

impl<T: DriftNumber> Traced for AutoFilter<T> {
    type Snapshot = Snapshot<T, 1, 1>;

    fn snapshot(&self) -> Snapshot<T, 1, 1> {
        let sigma = self.own_sigma(self.walk_sigma);
        let variance = (sigma.at_most(T::MAX_DIFFERENCE) * sigma).at_most(T::MAX_RAW);
        let one = |x: T| SVector::<T, 1>::repeat(x);
        let (R, G) = match &self.model {
            Some(model) => (model.measurement_noise(), model.process_noise()),
            None => (self.startup.variance(), T::zero()),
        };
        let K = if self.missing { T::zero() } else { self.interim.gain };
        Snapshot {
            estimate: self.estimate,
            innovation: self.innovation,
            innovation_variance: (R + variance).at_most(T::MAX_RAW),
            gain: one(K),
            measurement_noise: R,
            process_noise: SMatrix::repeat(G),
            coefficients: one(T::one()),
            covariance: SMatrix::repeat(variance),
            missing: self.missing,
            guarded: false,
            bias: self.estimate,
            bias_sigma: self.bias_sigma(),
            at_rest: self.learns(),
            saturated: self.saturated,
            stuck: self.detector.is_stuck(),
        }
    }
}

impl<T: DriftNumber> Checkpoint for AutoFilter<T> {
    const TAG: &'static str = "drift-auto";
    const VERSION: u16 = 5;

    fn is_valid(&self) -> bool {
        Self::new(self.params).is_ok_and(|fresh| self.is_after(&fresh))
    }

    fn is_like(&self, other: &Self) -> bool {
        (self.params, self.samples_seen) == (other.params, other.samples_seen)
    }
}

impl<T: DriftNumber> DriftStream<T> for AutoFilter<T> {
    fn options(&self) -> Options {
        let AutoParams { rate, startup, scale, behaviour, limits } = self.params;
        let mut options = Options::of(None, rate);
        (options.params.startup, options.params.scale) = (startup, scale);
        Options { behaviour, limits, ..options }
    }

    fn samples_seen(&self) -> u64 {
        self.samples_seen
    }

    fn ready(&self) -> bool {
        self.model.is_some()
    }

    fn status(&self) -> Status {
        self.status()
    }

    fn drift(&self) -> Drift<T> {
        Drift { bias: self.estimate, sigma: self.bias_sigma(), at_rest: self.learns() }
    }

    /// Between ticks the flag of rest is constant. The standard deviation is constant, too, if rest
    /// is certain.
    fn follow(
        &mut self,
        inputs: impl Iterator<Item = (T, bool)>,
        mut put: impl FnMut(Drift<T>, bool),
    ) {
        let mut drift = DriftStream::drift(self);
        let mut varies = self.varies();
        for (z, moving) in inputs {
            self.step(z, moving);
            drift.bias = self.estimate;
            if varies || self.detector.begins() {
                drift = DriftStream::drift(self);
                varies = self.varies();
            }
            put(drift, self.detector.is_stuck());
        }
    }

    fn densities(&self) -> [T; 2] {
        let rate = T::of(self.params.rate);
        match self.noise() {
            Some((R, G)) => [(R / rate).simd_sqrt(), (G * rate).simd_sqrt()],
            None => [T::of(f64::NAN); 2],
        }
    }

    fn bias_instability(&self) -> T {
        self.model.as_ref().map_or(T::of(f64::NAN), SensorModel::bias_instability)
    }

    fn bias_sigma_over(&self, seconds: f64) -> Option<Result<T, Error>> {
        Some(AutoFilter::bias_sigma_over(self, seconds))
    }

    fn restarts(&self) -> u64 {
        self.restarts
    }

    fn tally(&self) -> Tally {
        self.tally
    }

    fn power_on(&mut self) -> bool {
        self.switch_on();
        true
    }
}

/// True while the drift comes from a start-up.
#[inline(always)]
fn begins(status: Status) -> bool {
    matches!(status, Status::Starting | Status::NoRestYet)
}
