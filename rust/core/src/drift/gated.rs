//! Published filters that leave out motion, outliers and saturated samples.

use serde::{Deserialize, Serialize};

use super::options::Options;
use super::{
    Behaviour, Drift, DriftFilter, DriftNumber, DriftStream, Params, RobustParams, Snapshot, Start,
    Status, Tally,
};
use crate::error::Error;
use crate::math::Real;
use crate::math::validity::is_count;
use crate::stream::checkpoint::Checkpoint;
use crate::stream::{Field, Stream, Traced};

use crate::rest::{Event, MotionAware, RestDetector, RestLimits, Run, Tick};

/// A filter that treats every sample as rest.
pub trait PublishedFilter<T, const N: usize, const M: usize>:
    DriftStream<T> + Traced<Snapshot = Snapshot<T, N, M>> + Copy
{
    /// Tag of the checkpoint of a gated filter.
    const GATED_TAG: &'static str;

    /// Parameters of the filter.
    fn params(&self) -> &Params;

    /// Zones of a robust filter.
    fn robust(&self) -> Option<&RobustParams>;

    /// The stated start, `None` if it was learned.
    fn start(&self) -> Option<&Start<T, N, M>>;

    /// Filtered rate after the last sample.
    fn estimate(&self) -> T;
}

/// A published filter with additional behaviour: it learns only at rest, leaves out outliers and
/// saturated samples, or returns the compensated rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(
    serialize = "T: Real + Serialize, F: Serialize",
    deserialize = "T: Real + Deserialize<'de>, F: Deserialize<'de>"
))]
pub struct RestGated<T, const N: usize, const M: usize, F = DriftFilter<T, N, M>> {
    behaviour: Behaviour,
    detector: RestDetector<T>,
    filter: F,
    /// The filter after the last tick at rest, and after the tick before. A motion is sometimes
    /// detected only in its second tick.
    rest_states: [F; 2],
    at_rest: bool,
    missing: bool,
    saturated: bool,
    samples_seen: u64,
    tally: Tally,
    /// Number of this tick's samples that a robust filter left out and that may come from a stuck
    /// sensor: the samples of the present run of equal samples.
    suspects: u64,
}

impl<T, const N: usize, const M: usize, F> RestGated<T, N, M, F>
where
    T: DriftNumber,
    F: PublishedFilter<T, N, M>,
{
    /// A new `filter` that learns at rest, with the requested output.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a rate or a limit out of range.
    pub fn new(filter: F, behaviour: Behaviour) -> Result<Self, Error> {
        Ok(Self {
            behaviour: behaviour.validate()?,
            detector: RestDetector::new(filter.params().rate, RestLimits::default())?,
            filter,
            rest_states: [filter; 2],
            at_rest: true,
            missing: false,
            saturated: false,
            samples_seen: 0,
            tally: Tally::default(),
            suspects: 0,
        })
    }

    #[inline]
    fn step(&mut self, z: T, moving: bool) -> T {
        let Behaviour { hold_in_motion, reject_outliers, .. } = self.behaviour;
        if !self.looks() {
            return self.filter.update(z);
        }
        let run = self.detector.run_with(z);
        let accepted = match reject_outliers {
            true => self.detector.gate_sample(z),
            false if run == Run::Stuck => T::of(f64::NAN),
            false => z,
        };
        let left_out = self.filter.tally().outliers;
        self.filter.update(if self.at_rest { accepted } else { T::of(f64::NAN) });
        self.count(self.filter.tally().outliers.saturating_sub(left_out), run);
        if let Some(tick) = self.detector.observe_while(z, moving) {
            let outliers = if reject_outliers { tick.outliers } else { 0 };
            self.tally.add(&Tick { outliers, ..tick });
            self.suspects = 0;
            if hold_in_motion {
                self.take(&tick);
            }
        }
        self.filter.estimate()
    }

    /// Counts outliers of a filter that classifies samples itself. If a run proves to be a stuck
    /// sensor, its samples are counted only as stuck.
    fn count(&mut self, outliers: u64, run: Run) {
        if run == Run::Begins {
            self.suspects = 0;
        }
        self.suspects += outliers;
        self.tally.outliers += outliers;
        if run == Run::Stuck {
            self.tally.outliers -= core::mem::take(&mut self.suspects);
        }
    }

    /// True if a detector checks the samples.
    fn looks(&self) -> bool {
        self.behaviour.hold_in_motion || self.behaviour.reject_outliers
    }

    /// True if the sensor is stuck; unknown without a detector.
    fn is_stuck(&self) -> bool {
        self.detector.is_stuck()
    }

    fn take(&mut self, tick: &Tick<T>) {
        match tick.event {
            Some(Event::Rest) => self.at_rest = true,
            Some(Event::Motion) => {
                self.filter = self.rest_states[1];
                self.at_rest = false;
            }
            Some(Event::Restart) => {
                self.filter.reset();
                self.at_rest = self.detector.at_rest();
            }
            None => {}
        }
        if self.at_rest {
            self.rest_states = [self.filter, self.rest_states[0]];
        }
    }
}

impl<T, const N: usize, const M: usize, F> Stream for RestGated<T, N, M, F>
where
    T: DriftNumber,
    F: PublishedFilter<T, N, M>,
{
    type Input = T;
    type Output = T;

    #[inline]
    fn update(&mut self, z: T) -> T {
        self.update_while(z, false)
    }

    /// The state is plain numbers, which are copied at once and not field by field.
    #[cfg(feature = "std")]
    fn try_clone(&self) -> Result<Self, Error> {
        Ok(*self)
    }

    fn reset(&mut self) {
        self.filter.reset();
        self.detector.restart();
        self.rest_states = [self.filter; 2];
        (self.at_rest, self.missing, self.saturated) = (true, false, false);
        (self.samples_seen, self.tally, self.suspects) = (0, Tally::default(), 0);
    }
}

impl<T, const N: usize, const M: usize, F> MotionAware for RestGated<T, N, M, F>
where
    T: DriftNumber,
    F: PublishedFilter<T, N, M>,
{
    #[inline]
    fn update_while(&mut self, z: T, moving: bool) -> T {
        self.samples_seen += 1;
        self.saturated = self.behaviour.saturates(z);
        let z = if self.saturated { T::of(f64::NAN) } else { z };
        self.tally.saturated += u64::from(self.saturated);
        self.missing = !z.finite();
        let estimate = self.step(z, moving);
        self.behaviour.output(z, estimate)
    }
}

impl<T, const N: usize, const M: usize, F> Traced for RestGated<T, N, M, F>
where
    T: DriftNumber,
    F: PublishedFilter<T, N, M>,
{
    type Snapshot = Snapshot<T, N, M>;

    fn snapshot(&self) -> Snapshot<T, N, M> {
        Snapshot {
            at_rest: self.at_rest,
            missing: self.missing,
            saturated: self.saturated,
            stuck: self.is_stuck(),
            ..self.filter.snapshot()
        }
    }
}

impl<T, const N: usize, const M: usize, F> Checkpoint for RestGated<T, N, M, F>
where
    T: DriftNumber,
    F: PublishedFilter<T, N, M>,
{
    const TAG: &'static str = F::GATED_TAG;
    const VERSION: u16 = 4;
    const SIZES: [u8; 2] = [(N - 1) as u8, (M - N) as u8];

    fn is_valid(&self) -> bool {
        let made =
            |filter: &F| (*filter.params(), filter.robust().copied(), filter.start().copied());
        let pending = self.detector.pending();
        // A filter that classifies samples itself does this at once.
        let judges = self.filter.robust().is_some() || !self.behaviour.reject_outliers;
        let maybe_outliers = if judges { 0 } else { pending };
        let made_alike = |filter: &F| made(filter) == made(&self.filter);
        is_count(self.samples_seen)
            && self.tally.is_within_each(self.samples_seen, maybe_outliers, pending)
            && self.suspects <= pending.min(self.tally.outliers)
            && self.filter.samples_seen() <= self.samples_seen
            && self.filter.is_valid()
            && self.rest_states.iter().all(|filter| made_alike(filter) && filter.is_valid())
            && self.detector.is_valid()
            && Self::new(self.filter, self.behaviour)
                .is_ok_and(|fresh| self.detector.is_like(&fresh.detector))
    }

    fn is_like(&self, other: &Self) -> bool {
        let made =
            |filter: &F| (*filter.params(), filter.robust().copied(), filter.start().is_some());
        (self.behaviour, self.samples_seen) == (other.behaviour, other.samples_seen)
            && made(&self.filter) == made(&other.filter)
    }
}

impl<T, const N: usize, const M: usize, F> DriftStream<T> for RestGated<T, N, M, F>
where
    T: DriftNumber,
    F: PublishedFilter<T, N, M>,
{
    const START: &'static [Field] = F::START;

    fn options(&self) -> Options {
        Options { behaviour: self.behaviour, ..self.filter.options() }
    }

    fn samples_seen(&self) -> u64 {
        self.samples_seen
    }

    fn ready(&self) -> bool {
        self.filter.ready()
    }

    fn status(&self) -> Status {
        match self.is_stuck() {
            true => Status::Stuck,
            false => Status::of(self.filter.ready(), self.at_rest).after(self.restarts()),
        }
    }

    fn drift(&self) -> Drift<T> {
        Drift { at_rest: self.at_rest, ..self.filter.drift() }
    }

    fn densities(&self) -> [T; 2] {
        self.filter.densities()
    }

    fn bias_instability(&self) -> T {
        T::of(f64::NAN)
    }

    fn guard_count(&self) -> u64 {
        self.filter.guard_count()
    }

    fn restarts(&self) -> u64 {
        self.filter.restarts()
    }

    fn exit_count(&self) -> u64 {
        self.filter.exit_count()
    }

    /// Without a detector, only a filter that classifies samples itself has counts.
    fn tally(&self) -> Tally {
        match self.looks() {
            true => self.tally,
            false => Tally { outliers: self.filter.tally().outliers, ..self.tally },
        }
    }

    fn write_start(&self, numbers: &mut [f64]) -> bool {
        self.filter.write_start(numbers)
    }
}
