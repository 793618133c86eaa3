//! Fu & Han's filters, kept from mistaking motion for drift.

use serde::{Deserialize, Serialize};

use crate::chain::{DriftFilter, Snapshot};
use crate::error::Error;
use crate::filter::{Filter, SideBySide};
use crate::real::{Limits, Real};
use crate::rest::{Event, RestDetector, Tick};

/// What a filter does about motion, and what it answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Conduct {
    /// In motion every sample is missing, and the two ticks in which it began are taken back.
    pub hold: bool,
    /// Answers the sample minus the drift, instead of the drift.
    pub compensated: bool,
}

/// A [`DriftFilter`] that learns at rest only, or that answers the compensated rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct MotionSafe<T, const N: usize, const M: usize> {
    conduct: Conduct,
    detector: RestDetector<T>,
    filter: DriftFilter<T, N, M>,
    /// The filter as it was after the last tick at rest, and after the one before: a motion is
    /// seen in its second tick at times.
    calm: [DriftFilter<T, N, M>; 2],
    at_rest: bool,
    missing: bool,
    samples_seen: u64,
}

impl<T, const N: usize, const M: usize> MotionSafe<T, N, M>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// `filter`, which has seen nothing, with manners.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a rate out of range.
    pub fn new(filter: DriftFilter<T, N, M>, conduct: Conduct) -> Result<Self, Error> {
        Ok(Self {
            conduct,
            detector: RestDetector::new(filter.params().rate)?,
            filter,
            calm: [filter; 2],
            at_rest: true,
            missing: false,
            samples_seen: 0,
        })
    }

    /// The filter inside.
    pub fn filter(&self) -> &DriftFilter<T, N, M> {
        &self.filter
    }

    /// What it does about motion, and what it answers.
    pub fn conduct(&self) -> Conduct {
        self.conduct
    }

    /// Samples given so far, missing ones included.
    pub fn samples_seen(&self) -> u64 {
        self.samples_seen
    }

    /// Everything known after the last sample.
    pub fn snapshot(&self) -> Snapshot<T, N, M> {
        Snapshot { at_rest: self.at_rest, missing: self.missing, ..self.filter.snapshot() }
    }

    #[inline]
    fn step(&mut self, z: T) -> T {
        if !self.conduct.hold {
            return self.filter.update(z);
        }
        self.filter.update(if self.at_rest { z } else { T::of(f64::NAN) });
        if let Some(tick) = self.detector.observe(z) {
            self.take(&tick);
        }
        self.filter.estimate()
    }

    fn take(&mut self, tick: &Tick<T>) {
        match tick.event {
            Some(Event::Rest) => self.at_rest = true,
            Some(Event::Motion) => {
                self.filter = self.calm[1];
                self.at_rest = false;
            }
            Some(Event::Restart) => {
                self.filter.reset();
                self.at_rest = self.detector.at_rest();
            }
            None => {}
        }
        if self.at_rest {
            self.calm = [self.filter, self.calm[0]];
        }
    }
}

impl<T, const N: usize, const M: usize> Filter<T> for MotionSafe<T, N, M>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    #[inline]
    fn update(&mut self, z: T) -> T {
        self.samples_seen += 1;
        self.missing = !z.finite();
        let estimate = self.step(z);
        match (self.conduct.compensated, self.missing) {
            (false, _) => estimate,
            (true, false) => (z.within(T::RAW_MAX) - estimate).within(T::RAW_MAX),
            (true, true) => T::of(f64::NAN),
        }
    }

    fn reset(&mut self) {
        self.filter.reset();
        self.detector.reset();
        self.calm = [self.filter; 2];
        (self.at_rest, self.missing, self.samples_seen) = (true, false, 0);
    }
}

impl<T, const N: usize, const M: usize> SideBySide<T> for MotionSafe<T, N, M> where
    T: Limits + Real<Element = T, SimdBool = bool>
{
}
