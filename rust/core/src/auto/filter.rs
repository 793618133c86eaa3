//! The filter sample by sample: start, rest, motion.
#![allow(non_snake_case)]

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::following::Following;
use super::learned::Learned;
use crate::chain::Snapshot;
use crate::error::Error;
use crate::filter::{Filter, SideBySide};
use crate::motion::Conduct;
use crate::params;
use crate::real::{Limits, Real};
use crate::rest::{Event, RestDetector, Tick};
use crate::startup::Startup;

/// Parameters of an [`AutoFilter`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AutoParams {
    /// Samples a second.
    pub rate: f64,
    /// Seconds of rest after which the noise is taken as known.
    pub startup: f64,
    /// The noise's deviation in the unit of the samples, if it is known.
    pub scale: Option<f64>,
    /// What it does about motion, and what it answers.
    pub conduct: Conduct,
}

/// What the filter is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// The drift is the mean so far.
    Starting,
    /// The drift is learned.
    AtRest,
    /// The drift is held.
    InMotion,
    /// The sensor has moved ever since the start: no drift is known.
    NoRestYet,
}

/// Drift of one signal, learned at rest and held in motion, by a filter that needs no tuning.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct AutoFilter<T> {
    params: AutoParams,
    detector: RestDetector<T>,
    startup: Startup<T>,
    learned: Option<Learned<T>>,
    status: Status,
    /// What is learned was so before the sensor was last switched on.
    experienced: bool,
    estimate: T,
    /// Standard deviation of the estimate, once the noise is known.
    sigma: T,
    following: Following<T>,
    /// The sample minus the estimate before it; zero where it is missing or in motion.
    innovation: T,
    /// Largest sample so far: the drift is no larger as long as nothing else is known.
    reach: T,
    missing: bool,
    samples_seen: u64,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> AutoFilter<T> {
    /// A filter that has seen nothing.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of range.
    pub fn new(params: AutoParams) -> Result<Self, Error> {
        let window = params::checked_window(params.rate, params.startup)?;
        params::check_scale(params.scale)?;
        Ok(Self {
            params,
            detector: RestDetector::new(params.rate)?,
            startup: Startup::new(window, params.scale)?,
            learned: None,
            status: Status::Starting,
            experienced: false,
            estimate: T::zero(),
            sigma: T::zero(),
            following: Following::held(),
            innovation: T::zero(),
            reach: T::zero(),
            missing: false,
            samples_seen: 0,
        })
    }

    /// The parameters it was made with.
    pub fn params(&self) -> &AutoParams {
        &self.params
    }

    /// What it is doing.
    pub fn status(&self) -> Status {
        self.status
    }

    /// The noise is known, and with it how far the drift is.
    pub fn ready(&self) -> bool {
        self.learned.is_some()
    }

    /// Samples given so far, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.samples_seen
    }

    /// The drift.
    pub fn bias(&self) -> T {
        self.estimate
    }

    /// Its standard deviation.
    pub fn bias_sigma(&self) -> T {
        if !begins(self.status) {
            return self.sigma;
        }
        match self.startup.samples() {
            0 | 1 => self.reach,
            n => (self.startup.variance() / T::of(n as f64)).simd_sqrt(),
        }
    }

    /// Variances of a sample's white noise and of the drift's step in a sample, once they are known.
    pub fn noise(&self) -> Option<(T, T)> {
        self.learned.map(|learned| (learned.white_noise(), learned.process_noise()))
    }

    /// The sensor was switched off and on: its drift is forgotten, its noise is not.
    pub fn power_on(&mut self) {
        self.experienced = self.learned.is_some();
        self.detector.reset();
        self.forget();
        self.status = Status::Starting;
    }

    /// Everything known after the last sample.
    pub fn snapshot(&self) -> Snapshot<T, 1, 1> {
        let sigma = self.bias_sigma();
        let variance = (sigma.at_most(T::DIFFERENCE_MAX) * sigma).at_most(T::RAW_MAX);
        let one = |x: T| SVector::<T, 1>::repeat(x);
        let (R, G) = match &self.learned {
            Some(learned) => (learned.measurement_noise(), learned.process_noise()),
            None => (self.startup.variance(), T::zero()),
        };
        let K = if self.missing { T::zero() } else { self.following.gain };
        Snapshot {
            estimate: self.estimate,
            innovation: self.innovation,
            innovation_variance: (R + variance).at_most(T::RAW_MAX),
            gain: one(K),
            measurement_noise: R,
            process_noise: SMatrix::repeat(G),
            coefficients: one(T::one()),
            covariance: SMatrix::repeat(variance),
            missing: self.missing,
            guarded: false,
            bias: self.estimate,
            bias_sigma: sigma,
            at_rest: self.learns(),
        }
    }

    #[inline(always)]
    fn learns(&self) -> bool {
        matches!(self.status, Status::Starting | Status::AtRest)
    }

    fn take(&mut self, tick: &Tick<T>) {
        self.following = Following::held();
        match tick.event.filter(|_| self.params.conduct.hold) {
            Some(Event::Rest) => self.rest(tick),
            Some(Event::Motion) => self.motion(),
            Some(Event::Restart) if self.detector.at_rest() => return self.jump(tick),
            Some(Event::Restart) => self.forget(),
            None => {}
        }
        match self.status {
            Status::Starting => self.finish_startup(),
            Status::AtRest => self.learn(tick),
            Status::InMotion => self.wait(),
            Status::NoRestYet => {}
        }
    }

    fn rest(&mut self, tick: &Tick<T>) {
        match &mut self.learned {
            Some(learned) if !begins(self.status) => {
                if learned.is_another(tick) {
                    learned.listen_anew(tick);
                }
                self.status = Status::AtRest;
            }
            _ => self.status = Status::Starting,
        }
    }

    /// A start-up that it ends has learned nothing.
    fn motion(&mut self) {
        if begins(self.status) {
            self.forget();
        } else {
            self.status = Status::InMotion;
        }
    }

    /// What looked like rest was none.
    fn forget(&mut self) {
        self.startup.reset();
        if !self.experienced {
            self.learned = None;
        }
        self.status = Status::NoRestYet;
        self.estimate = T::zero();
        self.following = Following::held();
    }

    /// Rest at another level, of which the tick is the first to know.
    fn jump(&mut self, tick: &Tick<T>) {
        if self.learned.is_some_and(|learned| learned.is_another(tick)) {
            self.learned = None;
        }
        match &mut self.learned {
            Some(learned) if !begins(self.status) => {
                learned.begin_at(tick.mean, T::of(f64::from(tick.count)));
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
        let samples = T::of(self.startup.samples() as f64);
        let length = T::of(f64::from(self.detector.tick_length()));
        match &mut self.learned {
            Some(learned) => learned.begin_at(self.startup.mean(), samples),
            None => self.learned = Learned::new(scaling, length, samples).ok(),
        }
        self.run();
    }

    fn learn(&mut self, tick: &Tick<T>) {
        if let Some(learned) = &mut self.learned {
            learned.learn(tick);
            self.run();
        }
    }

    /// Goes on from what is learned.
    fn run(&mut self) {
        if let Some(learned) = &self.learned {
            let drift = learned.drift();
            (self.estimate, self.sigma) = (drift.mean, drift.sigma);
            self.following = drift.following;
            self.status = Status::AtRest;
        }
    }

    fn wait(&mut self) {
        if let Some(learned) = &mut self.learned {
            learned.wait();
            let drift = learned.drift();
            (self.estimate, self.sigma) = (drift.mean, drift.sigma);
        }
    }

    #[inline(always)]
    fn answer(&self, z: T) -> T {
        match (self.params.conduct.compensated, self.missing) {
            (false, _) => self.estimate,
            (true, false) => (z.within(T::RAW_MAX) - self.estimate).within(T::RAW_MAX),
            (true, true) => T::of(f64::NAN),
        }
    }

    /// Follows a sample that is there until its tick is judged.
    #[inline(always)]
    fn follow(&mut self, z: T) {
        let z = z.within(T::RAW_MAX);
        self.reach = self.reach.at_least(z.simd_abs());
        if self.learns() {
            self.innovation = (z - self.estimate).within(T::RAW_MAX);
            self.estimate = self.following.step(self.estimate, z);
        }
    }

    /// Answers with the mean so far.
    #[cold]
    fn start(&mut self, z: T) {
        self.startup.observe(z);
        self.estimate = self.startup.mean();
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Filter<T> for AutoFilter<T> {
    #[inline]
    fn update(&mut self, z: T) -> T {
        self.samples_seen += 1;
        self.missing = !z.finite();
        self.innovation = T::zero();
        if !self.missing {
            self.follow(z);
        }
        if self.status == Status::Starting {
            self.start(z);
        }
        if let Some(tick) = self.detector.observe(z) {
            self.take(&tick);
        }
        self.answer(z)
    }

    fn reset(&mut self) {
        if let Ok(new) = Self::new(self.params) {
            *self = new;
        }
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> SideBySide<T> for AutoFilter<T> {}

/// The drift comes from a start-up that is not over.
#[inline(always)]
fn begins(status: Status) -> bool {
    matches!(status, Status::Starting | Status::NoRestYet)
}
