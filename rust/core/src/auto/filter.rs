//! The filter sample by sample: start, rest, motion.
#![allow(non_snake_case)]

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::learned::Learned;
use crate::chain::Snapshot;
use crate::error::Error;
use crate::filter::Filter;
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
    /// The sample minus the estimate before it.
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
        match &self.learned {
            Some(learned) if !self.begins() => learned.deviation(),
            _ if self.startup.samples() > 1 => {
                (self.startup.variance() / T::of(self.startup.samples() as f64)).simd_sqrt()
            }
            _ => self.reach,
        }
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
        let (R, G, K) = match &self.learned {
            Some(learned) => (learned.measurement_noise(), learned.process_noise(), learned.gain()),
            None => (self.startup.variance(), T::zero(), T::zero()),
        };
        Snapshot {
            estimate: self.estimate,
            innovation: self.innovation,
            innovation_variance: (R + variance).at_most(T::RAW_MAX),
            gain: one(if self.learns() && !self.missing { K } else { T::zero() }),
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

    /// The drift comes from a start-up that is not over.
    #[inline(always)]
    fn begins(&self) -> bool {
        matches!(self.status, Status::Starting | Status::NoRestYet)
    }

    #[inline(always)]
    fn learns(&self) -> bool {
        matches!(self.status, Status::Starting | Status::AtRest)
    }

    fn take(&mut self, tick: &Tick<T>) {
        match tick.event.filter(|_| self.params.conduct.hold) {
            Some(Event::Rest) => self.rest(),
            Some(Event::Motion) => self.motion(),
            Some(Event::Forget) => self.forget(),
            Some(Event::Jump) => return self.jump(tick),
            None => {}
        }
        match self.status {
            Status::Starting => self.finish_startup(),
            Status::AtRest => self.learn(tick),
            Status::InMotion => self.wait(),
            Status::NoRestYet => {}
        }
    }

    fn rest(&mut self) {
        self.status = match self.status {
            Status::NoRestYet | Status::Starting => Status::Starting,
            Status::InMotion | Status::AtRest => Status::AtRest,
        };
    }

    /// A start-up that it ends has learned nothing.
    fn motion(&mut self) {
        if self.begins() {
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
    }

    /// Rest at another level, of which the tick is the first to know.
    fn jump(&mut self, tick: &Tick<T>) {
        if self.begins() {
            self.startup.reset();
            self.status = Status::Starting;
        } else if let Some(learned) = &mut self.learned {
            learned.begin_at(tick.mean, tick.present);
            self.estimate = learned.drift();
            self.status = Status::AtRest;
        }
    }

    fn finish_startup(&mut self) {
        let Some(scaling) = self.startup.finished() else { return };
        let samples = T::of(self.startup.samples() as f64);
        match &mut self.learned {
            Some(learned) => learned.begin_at(self.startup.mean(), samples),
            None => {
                self.learned = Learned::new(scaling, self.detector.tick_samples(), samples).ok()
            }
        }
        self.status = Status::AtRest;
    }

    fn learn(&mut self, tick: &Tick<T>) {
        if let Some(learned) = &mut self.learned {
            learned.learn(tick);
            self.estimate = learned.drift();
        }
    }

    fn wait(&mut self) {
        if let Some(learned) = &mut self.learned {
            learned.wait();
            self.estimate = learned.drift();
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
        let present = if self.missing { self.estimate } else { z.within(T::RAW_MAX) };
        self.innovation = (present - self.estimate).within(T::RAW_MAX);
        self.reach = self.reach.at_least(present.simd_abs());
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
