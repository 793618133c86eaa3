//! Kalman filters with flicker, only for the standard deviation of the drift.
//!
//! Flicker of bias instability B has the two-sided density B²/(2πf). Below 0.15 Hz it is modelled
//! as a sum: two Gauss-Markov processes with time constants of 5 s and 100 s, each with variance B²
//! ln(20)/π, and a random walk. Faster flicker is no state and adds its variance to the mean of a
//! block. There is one filter for each of eight levels of B². The filters change no estimate. Their
//! likelihoods, with those of the walks of the [`KalmanBank`], weigh the variance of the mean drift
//! over a span.
#![allow(non_snake_case)]

use nalgebra::{ComplexField, SVector};
use serde::{Deserialize, Serialize};

use super::multiple_model::{BlockMean, DEGREES_OF_FREEDOM, KalmanBank, Mixture, kept};
use crate::math::validity::{is_size, is_within};
use crate::math::{Fours, Limits, OnRows, Real, choose, widest};

/// Number of flicker levels: B² begins at 1/1000 of the white noise of a block's mean, times five
/// each.
const LEVELS: usize = 8;
const MIN_LEVEL_RATIO: f64 = 1e-3;
const LEVEL_STEP: f64 = 5.0;

/// Time constants of the Gauss-Markov processes, s, and their variance over B²: ln(20)/π.
const TIME_CONSTANTS: [f64; 2] = [5.0, 100.0];
const PROCESS_VARIANCE: f64 = 0.953_571_199_032_079_3;

/// Variance per second, over B², of the walk for all slower flicker.
const WALK_VARIANCE: f64 = 0.003;

/// Time constants of fast flicker, s, see [`unseen`]: one sets the flicker faster than the states
/// in a mean. The other is eight times the shortest time that a state follows, and sets the fastest
/// flicker of a sampled sensor.
const FAST_TIME: f64 = 2.6;
const RATE_FACTOR: f64 = 8.94;

/// Flicker over B² in the noise from the Allan variance of a block's eight ticks: 2 ln 2/π/8.
const IN_TICKS: f64 = 0.055_158_900_038_162_9;

/// Prior probabilities of no drift, of all walks and of all levels of flicker.
const NO_DRIFT_PRIOR: f64 = 0.05;
const WALKS_PRIOR: f64 = 0.10;
const FLICKER_PRIOR: f64 = 0.85;

/// Factor on the variance of the stated interval: no drift fits these models exactly.
const VARIANCE_FACTOR: f64 = 1.21;

/// Default span of the mean drift with a stated standard deviation, s.
const STATED_SECONDS: f64 = 10.0;

/// Ratio of the largest state to the largest sample.
const MAX_STATE: f64 = 64.0;

/// Logarithm of a likelihood ratio below which a level has no weight.
const MAX_EVIDENCE_LOSS: f64 = 50.0;

/// Largest factor of B² or of a block.
const MAX_FACTOR: f64 = 1e30;

type Each<T> = SVector<T, LEVELS>;

/// Indices of the covariances: xx, xy, xz, yy, yz, zz.
const XX: usize = 0;
const XY: usize = 1;
const XZ: usize = 2;
const YY: usize = 3;
const YZ: usize = 4;
const ZZ: usize = 5;

/// Propagation of the states without a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Passage<T> {
    /// Share of each process that remains.
    phi: [T; 2],
    /// New variance of each process and of the walk, over B².
    arises: [T; 3],
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Passage<T> {
    fn new(seconds: f64) -> Self {
        let phi = TIME_CONSTANTS.map(|time| ComplexField::exp(-seconds / time));
        let [fast, slow] = phi.map(|phi| PROCESS_VARIANCE * (1.0 - phi * phi));
        let walk = (WALK_VARIANCE * seconds).min(MAX_FACTOR);
        Self { phi: phi.map(T::of), arises: [fast, slow, walk].map(T::of) }
    }
}

/// The mean drift over a span that begins now.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Mean<T> {
    /// Share of each present process in the mean.
    parts: [T; 2],
    /// Covariance of the mean with the new part of each state, over B².
    common: [T; 3],
    /// New variance of the mean, over B², from the states and from faster flicker.
    arises: T,
    /// Length of the span in blocks.
    blocks: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Mean<T> {
    fn new(seconds: f64, block: f64, fast: f64) -> Self {
        let ratios = TIME_CONSTANTS.map(|time| seconds / time);
        let parts = ratios.map(part_of_start);
        let walk = WALK_VARIANCE * seconds;
        let within = PROCESS_VARIANCE * ratios.map(variance_within).iter().sum::<f64>();
        let common = |k: usize| PROCESS_VARIANCE * parts[k] * parts[k] * ratios[k];
        Self {
            parts: parts.map(T::of),
            common: [common(0), common(1), 0.5 * walk].map(|x| T::of(x.min(MAX_FACTOR))),
            arises: T::of((within + walk / 3.0 + fast).min(MAX_FACTOR)),
            blocks: T::of((seconds / block).min(MAX_FACTOR)),
        }
    }
}

/// Share of a process in its mean over the next `r` time constants.
fn part_of_start(r: f64) -> f64 {
    if r < 1e-8 { 1.0 } else { -ComplexField::exp_m1(-r) / r }
}

/// Variance of that mean for a known start, over the variance of the process.
fn variance_within(r: f64) -> f64 {
    if r < 1e-4 {
        return r * 2.0 / 3.0;
    }
    let part = part_of_start(r);
    2.0 * (1.0 - part) / r - part * part
}

/// Variance over B² of flicker faster than the states, in the mean of `seconds`; zero seconds are
/// the instant.
fn unseen(seconds: f64, rate: f64) -> f64 {
    let ratio = (1.0 + FAST_TIME / seconds).min(RATE_FACTOR * rate).max(1.0);
    ComplexField::ln(ratio) / core::f64::consts::PI
}

/// Stated variance of the mean drift over a span.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stated<T> {
    /// Variance of the mean drift.
    pub variance: T,
    /// B², square of the bias instability.
    pub flicker: T,
}

/// All members, in units of the start-up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct FlickerBank<T> {
    /// Seconds per block, and samples per second.
    seconds: f64,
    rate: f64,
    passage: Passage<T>,
    /// Mean over a block, and over the stated span.
    block: Mean<T>,
    ahead: Mean<T>,
    /// B² of each member.
    b: Each<T>,
    /// The two processes and the walk at the end of the last block.
    x: [Each<T>; 3],
    P: [Each<T>; 6],
    /// Sum of the squared normalised innovations.
    S: Each<T>,
    /// Logarithm of the likelihood relative to the best walk.
    evidence: Each<T>,
    /// Blocks without a measurement that the states do not yet include, less than one.
    waiting: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> FlickerBank<T> {
    /// Members for blocks of `seconds` at `rate`; the mean has white noise of variance `noise`.
    pub fn new(noise: T, seconds: f64, rate: f64) -> Self {
        let mut level = MIN_LEVEL_RATIO / LEVEL_STEP;
        let b = Each::from_fn(|_, _| {
            level *= LEVEL_STEP;
            noise * T::of(level)
        });
        let in_noise = (unseen(seconds, rate) - IN_TICKS).max(0.0);
        Self {
            seconds,
            rate,
            passage: Passage::new(seconds),
            block: Mean::new(seconds, seconds, in_noise),
            ahead: Mean::new(STATED_SECONDS, seconds, unseen(STATED_SECONDS, rate)),
            b,
            x: [Each::zeros(); 3],
            P: [Each::zeros(); 6],
            S: Each::repeat(T::of(DEGREES_OF_FREEDOM)),
            evidence: Each::zeros(),
            waiting: T::zero(),
        }
    }

    /// Begins a new drift and keeps the learned noise.
    pub fn begin(&mut self, mean: T, variance: T) {
        let (process, zero) = (self.b * T::of(PROCESS_VARIANCE), Each::zeros());
        let level = (process + process).map(|own| (own + variance).at_most(T::MAX_COVARIANCE));
        self.x = [zero, zero, Each::repeat(mean)];
        self.P = [process, zero, zero, process, zero, level];
        self.waiting = T::zero();
    }

    /// Lets time pass without a measurement; true if the states have been updated.
    pub fn wait(&mut self, blocks: T) -> bool {
        self.waiting += blocks;
        let whole = self.waiting >= T::one();
        if whole {
            self.catch_up();
        }
        whole
    }

    /// Mean drift over a span from now on: variance, including all walks, and estimate of flicker.
    /// Zero seconds are the instant.
    pub fn over(&self, seconds: f64, walks: &KalmanBank<T>) -> Stated<T> {
        let mut now = *self;
        now.catch_up();
        let ahead = Mean::new(seconds, self.seconds, unseen(seconds, self.rate));
        now.stated_of(&ahead, walks, &walks.predicted())
    }

    /// Mean drift over the default span, as [`over`](Self::over).
    pub fn stated(&self, walks: &KalmanBank<T>, all: &Mixture<T>) -> Stated<T> {
        self.stated_of(&self.ahead, walks, all)
    }

    /// Learns from a full block after the walks. They had `degrees` degrees of freedom, and `best`
    /// is the logarithm of the best walk's likelihood.
    pub fn correct(&mut self, block: &BlockMean<T>, degrees: T, best: T) {
        self.catch_up();
        widest(Correction { bank: self, block, degrees, best });
    }

    /// As [`correct`](Self::correct), always inlined.
    #[inline(always)]
    fn correct_inlined(&mut self, block: &BlockMean<T>, degrees: T, best: T) {
        let ([f, s], common) = (self.passage.phi, self.block.common);
        let (mut gain, mut innovation) = ([Each::zeros(); 3], Each::zeros());
        let (mut S, mut inverse) = (Each::zeros(), Each::zeros());
        for m in 0..LEVELS {
            let with_mean = self.with_mean(m, &self.block);
            let (mean, variance) = self.mean(m, &self.block, &with_mean);
            S[m] = variance + block.noise;
            inverse[m] = T::one() / S[m];
            innovation[m] = block.mean - mean;
            gain[0][m] = f * with_mean[0] + self.b[m] * common[0];
            gain[1][m] = s * with_mean[1] + self.b[m] * common[1];
            gain[2][m] = with_mean[2] + self.b[m] * common[2];
        }
        let passage = self.passage;
        self.pass(&passage);
        self.correct_states(&gain, &innovation, &inverse);
        let square = innovation.component_mul(&innovation).component_mul(&inverse);
        self.weigh_in(&square, &S, degrees, best);
    }

    /// Corrects by the covariances of the states at the block's end with its mean.
    #[inline(always)]
    fn correct_states(&mut self, c: &[Each<T>; 3], innovation: &Each<T>, inverse: &Each<T>) {
        let (bound, most) = (T::MAX_INPUT * T::of(MAX_STATE), T::MAX_COVARIANCE);
        for m in 0..LEVELS {
            let K = [c[0][m] * inverse[m], c[1][m] * inverse[m], c[2][m] * inverse[m]];
            for k in 0..3 {
                self.x[k][m] = (self.x[k][m] + K[k] * innovation[m]).within(bound);
            }
            self.P[XX][m] = (self.P[XX][m] - K[0] * c[0][m]).at_least(T::zero()).at_most(most);
            self.P[XY][m] = (self.P[XY][m] - K[0] * c[1][m]).within(most);
            self.P[XZ][m] = (self.P[XZ][m] - K[0] * c[2][m]).within(most);
            self.P[YY][m] = (self.P[YY][m] - K[1] * c[1][m]).at_least(T::zero()).at_most(most);
            self.P[YZ][m] = (self.P[YZ][m] - K[1] * c[2][m]).within(most);
            self.P[ZZ][m] = (self.P[ZZ][m] - K[2] * c[2][m]).at_least(T::zero()).at_most(most);
        }
    }

    #[inline(always)]
    fn weigh_in(&mut self, square: &Each<T>, variance: &Each<T>, degrees: T, best: T) {
        let (inverse, tails) = (T::one() / degrees, degrees + T::one());
        for m in 0..LEVELS {
            let spread = (variance[m] * self.S[m] * inverse).logarithm();
            let tail = (T::one() + square[m] / self.S[m]).logarithm() * tails;
            self.evidence[m] = self.evidence[m] * kept::<T>() - (spread + tail) * T::of(0.5) - best;
            let sum = self.S[m] * kept::<T>() + square[m];
            self.S[m] = sum.at_least(T::VARIANCE_FLOOR).at_most(T::MAX_DIFFERENCE);
        }
    }

    fn catch_up(&mut self) {
        if self.waiting > T::zero() {
            let blocks: f64 = self.waiting.to_subset().unwrap_or(1.0);
            self.pass(&Passage::new(blocks * self.seconds));
            self.waiting = T::zero();
        }
    }

    /// Propagates the states without a measurement.
    #[inline(always)]
    fn pass(&mut self, passage: &Passage<T>) {
        let ([f, s], [fast, slow, walk]) = (passage.phi, passage.arises);
        for m in 0..LEVELS {
            let b = self.b[m];
            self.x[0][m] *= f;
            self.x[1][m] *= s;
            self.P[XX][m] = self.P[XX][m] * (f * f) + b * fast;
            self.P[XY][m] *= f * s;
            self.P[XZ][m] *= f;
            self.P[YY][m] = self.P[YY][m] * (s * s) + b * slow;
            self.P[YZ][m] *= s;
            self.P[ZZ][m] = (self.P[ZZ][m] + b * walk).at_most(T::MAX_COVARIANCE);
        }
    }

    /// Covariances of the present states with the mean.
    #[inline(always)]
    fn with_mean(&self, m: usize, mean: &Mean<T>) -> [T; 3] {
        let ([f, s], P) = (mean.parts, &self.P);
        [
            P[XX][m] * f + P[XY][m] * s + P[XZ][m],
            P[XY][m] * f + P[YY][m] * s + P[YZ][m],
            P[XZ][m] * f + P[YZ][m] * s + P[ZZ][m],
        ]
    }

    /// Mean and its variance.
    #[inline(always)]
    fn mean(&self, m: usize, mean: &Mean<T>, with_mean: &[T; 3]) -> (T, T) {
        let [f, s] = mean.parts;
        let known = (with_mean[0] * f + with_mean[1] * s + with_mean[2]).at_least(T::zero());
        let level = self.x[0][m] * f + self.x[1][m] * s + self.x[2][m];
        (level, known + self.b[m] * mean.arises)
    }

    /// Mixes all members and all walks by their likelihood, about the estimate of the walks.
    fn stated_of(&self, ahead: &Mean<T>, walks: &KalmanBank<T>, all: &Mixture<T>) -> Stated<T> {
        let best = self.evidence.max().at_least(T::zero());
        let scale = T::one() / walks.degrees();
        let priors = [NO_DRIFT_PRIOR, WALKS_PRIOR].map(T::of);
        let walks = walks.reweighed(all, priors, ahead.blocks * T::of(1.0 / 3.0));
        let walks = match best > T::zero() {
            true => walks.map(|sum| sum * (-best).exp()),
            false => walks,
        };
        let of_flicker = widest(Mixing { bank: self, ahead, mean: all.mean, best, scale });
        let weights = walks[0] + of_flicker[0];
        Stated {
            variance: (walks[1] + of_flicker[1]) / weights * T::of(VARIANCE_FACTOR),
            flicker: of_flicker[2] / weights,
        }
    }

    /// Sums over the members: of the weights, of weights times the variance about `center`, and of
    /// weights times B².
    #[inline(always)]
    fn sums(&self, ahead: &Mean<T>, center: T, best: T, scale: T) -> [T; 3] {
        let prior = T::of(FLICKER_PRIOR / LEVELS as f64);
        let (mut weight, mut variance, mut flicker) = (Each::zeros(), Each::zeros(), Each::zeros());
        for m in 0..LEVELS {
            let evidence = self.evidence[m] - best;
            let likelihood = evidence.at_least(T::of(-MAX_EVIDENCE_LOSS)).exponential();
            let counts = evidence >= T::of(-MAX_EVIDENCE_LOSS);
            weight[m] = choose(counts, prior * likelihood, T::zero());
            let (mean, own) = self.mean(m, ahead, &self.with_mean(m, ahead));
            let (off, scale) = (mean - center, self.S[m] * scale);
            variance[m] = weight[m] * (own * scale + off * off);
            flicker[m] = weight[m] * (scale * self.b[m]);
        }
        [weight.sum(), variance.sum(), flicker.sum()]
    }
}

/// A block that all members learn from.
struct Correction<'a, T> {
    bank: &'a mut FlickerBank<T>,
    block: &'a BlockMean<T>,
    degrees: T,
    best: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> OnRows for Correction<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<F: Fours>(self, _: F) {
        self.bank.correct_inlined(self.block, self.degrees, self.best);
    }
}

/// Sums over all members.
struct Mixing<'a, T> {
    bank: &'a FlickerBank<T>,
    ahead: &'a Mean<T>,
    mean: T,
    best: T,
    scale: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> OnRows for Mixing<'_, T> {
    type Output = [T; 3];

    #[inline(always)]
    fn run<F: Fours>(self, _: F) -> [T; 3] {
        self.bank.sums(self.ahead, self.mean, self.best, self.scale)
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> FlickerBank<T> {
    /// True if blocks can have changed `fresh` to this state.
    pub(super) fn is_after(&self, fresh: &Self) -> bool {
        let every = |values: &Each<T>, holds: &dyn Fn(T) -> bool| values.iter().all(|x| holds(*x));
        let most = T::MAX_DIFFERENCE;
        let reach = T::MAX_INPUT * T::of(MAX_STATE);
        let same = Self { x: fresh.x, P: fresh.P, S: fresh.S, evidence: fresh.evidence, ..*self };
        Self { waiting: fresh.waiting, ..same } == *fresh
            && self.x.iter().all(|x| every(x, &|x| is_within(x, reach)))
            && [XX, YY, ZZ].iter().all(|k| every(&self.P[*k], &|P| P >= T::zero()))
            && self.P.iter().all(|P| every(P, &|P| is_within(P, T::MAX_COVARIANCE)))
            && every(&self.S, &|S| S >= T::VARIANCE_FLOOR && S <= most)
            && every(&self.evidence, &|evidence| is_within(evidence, T::MAX_RAW))
            && is_size(self.waiting, T::one())
    }
}
