//! The robust filter of Wu & Ran 2021 (section 2): three zones of the innovation.
//!
//! It equals [`DriftFilter`] with `akf`, but classifies every innovation before its use. Unlike the
//! source it can leave rejection: a step of the signal is not an outlier.
#![allow(non_snake_case)]

mod validity;
mod zones;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

pub(super) use self::zones::ZONES_EXPECTED;
use self::zones::{Gate, Verdict};
pub use self::zones::{RobustParams, Zones};
use super::kalman::{Correction, State};
use super::options::Options;
use super::start::Start;
use super::{
    Drift, DriftFilter, DriftLoop, DriftNumber, DriftStream, Method, Params, PublishedFilter,
    Snapshot, Status, Tally,
};
use crate::error::Error;
use crate::math::{Limits, Real, Symmetric};
use crate::rest::MotionAware;
use crate::stream::checkpoint::Checkpoint;
use crate::stream::{Field, Number, Scaling, Stream, Traced};

/// Drift filter of one signal that rejects outliers; `N = p + 1`, `M = p + q + 1`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct RobustFilter<T, const N: usize, const M: usize> {
    filter: DriftFilter<T, N, M>,
    gate: Gate<T>,
}

impl<T, const N: usize, const M: usize> RobustFilter<T, N, M>
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    /// A filter before its first sample. R adapts as in [`Method::Akf`], for any method in
    /// `params`.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter out of range.
    pub fn new(params: Params, robust: RobustParams) -> Result<Self, Error> {
        Self::around(DriftFilter::new(adapting(params))?, robust)
    }

    /// A filter that is ready at its first sample.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a parameter or a number of the start out of range.
    pub fn started(
        params: Params,
        robust: RobustParams,
        start: Start<T, N, M>,
    ) -> Result<Self, Error> {
        Self::around(DriftFilter::started(adapting(params), start)?, robust)
    }

    fn around(filter: DriftFilter<T, N, M>, robust: RobustParams) -> Result<Self, Error> {
        let gate = Gate::new(robust.validate()?, filter.params().rate);
        Ok(Self { filter, gate })
    }

    #[inline(always)]
    fn advance(&mut self, z: T) -> T {
        let gate = &mut self.gate;
        let estimate = self.filter.advance_by(z, |inner, scaling, z| step(inner, gate, scaling, z));
        // The scale was proved wrong, and all innovations with it.
        if !self.filter.ready() {
            self.gate.restart();
        }
        estimate
    }

    /// Gain of an outlier, from the covariance after it.
    fn damped_gain(&self) -> SVector<T, N> {
        let (inner, law) = (&self.filter.inner, &self.gate.law);
        let S = inner.last.variance;
        let left = decay(T::of(law.fall()), inner.measurement_noise.variance() / S);
        inner.state.column() * (T::of(law.damping) / (S * left))
    }
}

fn adapting(params: Params) -> Params {
    Params { method: Method::Akf, ..params }
}

/// Processes one sample after the start-up.
#[inline(always)]
fn step<T, const N: usize, const M: usize>(
    inner: &mut DriftLoop<T, N, M>,
    gate: &mut Gate<T>,
    scaling: &Scaling<T>,
    z: T,
) -> (T, bool, bool)
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    if z.finite() {
        gate_sample(inner, gate, scaling.normalise(z), scaling.scale());
        return (scaling.raw(inner.state.x[0]), false, false);
    }
    gate.outlier = false;
    let (y, _) = inner.step(T::of(f64::NAN), false);
    (scaling.raw(y), true, false)
}

/// Updates state, noise and model by the sample `y`, according to the zone of its innovation.
#[inline(always)]
fn gate_sample<T, const N: usize, const M: usize>(
    inner: &mut DriftLoop<T, N, M>,
    gate: &mut Gate<T>,
    y: T,
    scale: T,
) where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    let (mut prior, _) = inner.predict();
    let innovation = y - prior.x[0];
    let R = inner.measurement_noise.variance();
    let P = prior.P.at(0, 0);
    let verdict = gate.classify(innovation, P, P + R, scale);
    if verdict == Verdict::Exit {
        open_level(&mut prior, &inner.row(), R + innovation * innovation);
    }
    let taken = learning_sample(&verdict, &gate.law, prior.x[0], y);
    inner.learn(taken, taken.finite());
    let R = inner.measurement_noise.variance();
    let last = match verdict {
        Verdict::Damped(gain, fall) => damp(&mut inner.state, &prior, innovation, R, gain, fall),
        Verdict::Corrected(shift) => {
            prior.x[0] += shift;
            // As in the paper the innovation is not computed again: the gain adds the prediction's
            // shift a second time.
            let again = if gate.law.zones == Zones::Published { shift } else { T::zero() };
            inner.state.correct(&prior, y + again, true, R)
        }
        _ => inner.state.correct(&prior, taken, true, R),
    };
    inner.last = Correction { innovation, ..last };
}

/// The sample that model and noise learn; NaN for an outlier, except in the published form.
#[inline(always)]
fn learning_sample<T>(verdict: &Verdict<T>, law: &RobustParams, predicted: T, y: T) -> T
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    match verdict {
        Verdict::Bounded(innovation) => predicted + *innovation,
        Verdict::Damped(..) if law.zones != Zones::Published => T::of(f64::NAN),
        _ => y,
    }
}

/// Share of the covariance's first row that remains if the covariance decreases by `fall` times
/// `S K Kᵀ`; `ratio` is R/S.
#[inline(always)]
fn decay<T: Real>(fall: T, ratio: T) -> T {
    T::one() - fall + fall * ratio
}

/// [`State::correct`] with the share `damping` of the gain. The covariance decreases by `fall`
/// times `S K Kᵀ`, in Joseph's form 2α - α².
#[inline(always)]
fn damp<T: Real, const N: usize>(
    state: &mut State<T, N>,
    prior: &State<T, N>,
    innovation: T,
    R: T,
    damping: T,
    fall: T,
) -> Correction<T> {
    let variance = prior.P.at(0, 0) + R;
    let inverse = T::one() / variance;
    let left = decay(fall, R * inverse);
    let gain = prior.column() * inverse;
    state.x = prior.x + gain * (damping * innovation);
    state.P.assign(|i, j| match i {
        0 => prior.P.at(0, j) * left,
        _ => prior.P.at(i, j) - gain[i] * prior.P.at(0, j) * fall,
    });
    Correction { innovation, variance, inverse }
}

/// Opens a prediction to a step of the level. Every `y`, and the constant that keeps them there,
/// get the predicted level, with variance `variance` if this is larger.
#[cold]
fn open_level<T, const N: usize>(prior: &mut State<T, N>, row: &SVector<T, N>, variance: T)
where
    T: Limits + Real<Element = T, SimdBool = bool>,
{
    let more = (variance - prior.P.at(0, 0)).at_least(T::zero());
    let rest = row.iter().take(N - 1).fold(T::one(), |rest, phi| rest - *phi);
    let mut level = SVector::<T, N>::repeat(T::one());
    level[N - 1] = rest;
    let P = prior.P;
    prior.x = level * prior.x[0];
    prior.P = Symmetric::from_upper(|i, j| P.at(i, j) + more * level[i] * level[j]);
    prior.P.settle(true);
}

impl<T: DriftNumber, const N: usize, const M: usize> Stream for RobustFilter<T, N, M> {
    type Input = T;
    type Output = T;

    #[inline(never)]
    fn update(&mut self, z: T) -> T {
        self.advance(z)
    }

    #[inline]
    fn run(&mut self, inputs: impl Iterator<Item = T>, mut put: impl FnMut(T)) {
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
        self.filter.reset();
        self.gate = Gate::new(self.gate.law, self.filter.params().rate);
    }
}

impl<T: DriftNumber, const N: usize, const M: usize> Traced for RobustFilter<T, N, M> {
    type Snapshot = Snapshot<T, N, M>;

    fn snapshot(&self) -> Snapshot<T, N, M> {
        let known = self.filter.snapshot();
        match self.gate.outlier {
            true => Snapshot { gain: self.damped_gain(), guarded: true, ..known },
            false => known,
        }
    }
}

impl<T: Number, const N: usize, const M: usize> Checkpoint for RobustFilter<T, N, M> {
    const TAG: &'static str = "drift-robust";
    const VERSION: u16 = 1;
    const SIZES: [u8; 2] = [(N - 1) as u8, (M - N) as u8];

    fn is_valid(&self) -> bool {
        self.filter.is_valid()
            && self.filter.params().method == Method::Akf
            && Self::around(self.filter, self.gate.law)
                .is_ok_and(|fresh| self.gate.is_after(&fresh.gate, self.filter.samples_seen))
    }

    fn is_like(&self, other: &Self) -> bool {
        self.filter.is_like(&other.filter) && self.gate.law == other.gate.law
    }
}

impl<T: DriftNumber, const N: usize, const M: usize> MotionAware for RobustFilter<T, N, M> {}

impl<T: DriftNumber, const N: usize, const M: usize> DriftStream<T> for RobustFilter<T, N, M> {
    const START: &'static [Field] = DriftFilter::<T, N, M>::START;

    fn options(&self) -> Options {
        Options { robust: Some(self.gate.law), ..self.filter.options() }
    }

    fn samples_seen(&self) -> u64 {
        self.filter.samples_seen()
    }

    fn ready(&self) -> bool {
        self.filter.ready()
    }

    fn status(&self) -> Status {
        self.filter.status()
    }

    fn drift(&self) -> Drift<T> {
        self.filter.drift()
    }

    fn densities(&self) -> [T; 2] {
        self.filter.densities()
    }

    fn bias_instability(&self) -> T {
        T::of(f64::NAN)
    }

    fn guard_count(&self) -> u64 {
        self.gate.outlier_count
    }

    fn tally(&self) -> Tally {
        Tally { outliers: self.gate.outlier_count, ..Tally::default() }
    }

    fn exit_count(&self) -> u64 {
        self.gate.exit_count
    }

    fn restarts(&self) -> u64 {
        self.filter.restarts()
    }

    fn write_start(&self, numbers: &mut [f64]) -> bool {
        self.filter.write_start(numbers)
    }
}

impl<T: DriftNumber, const N: usize, const M: usize> PublishedFilter<T, N, M>
    for RobustFilter<T, N, M>
{
    const GATED_TAG: &'static str = "robust-gated";

    fn params(&self) -> &Params {
        self.filter.params()
    }

    fn robust(&self) -> Option<&RobustParams> {
        Some(&self.gate.law)
    }

    fn start(&self) -> Option<&Start<T, N, M>> {
        self.filter.start()
    }

    fn estimate(&self) -> T {
        self.filter.estimate()
    }
}
