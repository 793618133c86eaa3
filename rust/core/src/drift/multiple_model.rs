//! Multiple-model Kalman bank (Magill 1965): filters with different strengths of the drift's random
//! walk, weighed by their likelihoods.
//!
//! Each member assumes its own process noise q, as a ratio to the white noise. The ratios lie on a
//! grid that spans all gyros; one member has no drift. The measurement is the mean of a block, and
//! the drift moves within the block. For a block of length t, the mean differs from the drift at
//! the start by variance q t/3, and the drift at the end by q t. Their covariance is q t/2. With
//! these values innovation variance and gain are exact for any block length.
//!
//! The scale of all variances is unknown, too. With a scaled inverse chi-squared prior the
//! likelihood is Student's t in closed form: West & Harrison, *Bayesian Forecasting and Dynamic
//! Models*, 2nd ed. 1997, sections 4.5 (scale) and 12.2 (weights of several models).
#![allow(non_snake_case)]

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use crate::math::validity::{is_size, is_within};
use crate::math::{Fours, Limits, OnRows, Real, widest};

/// Number of members: one without drift, then two ratios per decade.
pub const MEMBERS: usize = 22;

/// Smallest ratio of a member's process noise in a block to the block's white noise.
const MIN_NOISE_RATIO: f64 = 1e-8;
const NOISE_RATIO_STEP: f64 = 3.162_277_660_168_379_5;

/// Initial weight of the member without drift; the other members share the rest.
const NO_DRIFT_WEIGHT: f64 = 0.3;

/// Number of blocks after which evidence has the weight 1/e: sensors warm up and calm down.
const TIME_CONSTANT_BLOCKS: f64 = 500.0;

/// Degrees of freedom of the scale before the first block.
pub(super) const DEGREES_OF_FREEDOM: f64 = 2.0;

type Each<T> = SVector<T, MEMBERS>;

/// Mean of a block of samples, which may be incomplete.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockMean<T> {
    /// Mean value.
    pub mean: T,
    /// Variance of the mean's white noise.
    pub noise: T,
    /// Length in full blocks.
    pub time: T,
}

/// Drift averaged over the members.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixture<T> {
    /// Mean of the drift.
    pub mean: T,
    /// Variance of the drift, including the disagreement of the members.
    pub variance: T,
    /// Mean of the members' own variances, unscaled as [`BlockMean::noise`].
    pub P: T,
}

/// Effect of a block on one member.
#[derive(Clone, Copy)]
struct Step<T> {
    innovation: T,
    /// Variance of the innovation.
    S: T,
    K: T,
    /// Variance of the drift at the block's end.
    P: T,
}

impl<T: Real> Step<T> {
    /// The drift at the block's end, if it is `x` at its start.
    #[inline(always)]
    fn end(&self, x: T) -> T {
        x + self.K * self.innovation
    }
}

/// All members.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(bound(serialize = "T: Real + Serialize", deserialize = "T: Real + Deserialize<'de>"))]
pub struct KalmanBank<T> {
    /// Process noise of a block.
    q: Each<T>,
    /// Drift at the end of the last block.
    x: Each<T>,
    /// Variance of the drift, unscaled as `q`.
    P: Each<T>,
    /// Sum of the squared normalised innovations.
    S: Each<T>,
    /// Degrees of freedom of the scales.
    degrees: T,
    /// Logarithm of the likelihood relative to the best member.
    evidence: Each<T>,
    weight: Each<T>,
    /// Sum of the weights before normalisation: total likelihood relative to the best member.
    likelihood: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> KalmanBank<T> {
    /// Members for blocks with white noise of variance about `noise`.
    pub fn new(noise: T) -> Self {
        let mut ratio = MIN_NOISE_RATIO / NOISE_RATIO_STEP;
        let q = Each::from_fn(|m, _| {
            ratio *= if m == 0 { 1.0 } else { NOISE_RATIO_STEP };
            if m == 0 { T::zero() } else { noise * T::of(ratio) }
        });
        Self {
            q,
            x: Each::zeros(),
            P: Each::zeros(),
            S: Each::repeat(T::of(DEGREES_OF_FREEDOM)),
            degrees: T::of(DEGREES_OF_FREEDOM),
            evidence: Each::zeros(),
            weight: prior(),
            likelihood: T::one(),
        }
    }

    /// Begins a new drift and keeps the learned noise.
    pub fn begin(&mut self, mean: T, variance: T) {
        self.x = Each::repeat(mean);
        self.P = Each::repeat(variance);
    }

    /// Lets time pass without a measurement.
    pub fn wait(&mut self, blocks: T) {
        for m in 0..MEMBERS {
            self.P[m] = (self.P[m] + self.q[m] * blocks).at_most(T::MAX_COVARIANCE);
        }
    }

    /// The drift at the end of a block, which may be incomplete.
    #[inline]
    pub fn filtered(&self, block: &BlockMean<T>) -> Mixture<T> {
        self.mixture(|m| {
            let step = self.step(m, block);
            (step.end(self.x[m]), step.P)
        })
    }

    /// The drift if no block has begun.
    pub fn predicted(&self) -> Mixture<T> {
        self.mixture(|m| (self.x[m], self.P[m]))
    }

    /// Learns from a full block; returns the logarithm of the likelihood of the best member.
    pub fn correct(&mut self, block: &BlockMean<T>) -> T {
        let (square, variance) = widest(Correction { bank: self, block });
        for m in 0..MEMBERS {
            self.weigh_in(m, square[m], variance[m]);
        }
        self.degrees = self.degrees * kept::<T>() + T::one();
        self.normalise()
    }

    /// Degrees of freedom of the scales.
    pub fn degrees(&self) -> T {
        self.degrees
    }

    /// True before the first block.
    pub fn is_fresh(&self) -> bool {
        self.degrees == T::of(DEGREES_OF_FREEDOM)
    }

    /// Two sums over the members with other priors, `priors`, of no drift and of all walks. The
    /// first sums the likelihoods relative to the best member. The second weighs by them the
    /// variance about the estimate, to which each walk adds its process noise of `blocks` blocks.
    /// `all` is the result of [`predicted`](Self::predicted).
    pub fn reweighed(&self, all: &Mixture<T>, priors: [T; 2], blocks: T) -> [T; 2] {
        let none = priors[0] * T::of(1.0 / NO_DRIFT_WEIGHT) * self.likelihood * self.weight[0];
        let walks = priors[1] * T::of(1.0 / (1.0 - NO_DRIFT_WEIGHT)) * self.likelihood;
        let off = self.x[0] - all.mean;
        let without = self.P[0] * self.scale(0) + off * off;
        let (others, total) = (T::one() - self.weight[0], all.variance - self.weight[0] * without);
        let process = self.weight.component_mul(&self.q).dot(&self.S) / self.degrees;
        let variance = total.at_least(T::zero()) + process * blocks;
        [none + walks * others, none * without + walks * variance]
    }

    /// Process noise of a block, averaged over the members.
    pub fn process_noise(&self) -> T {
        let mut noise = T::zero();
        for m in 0..MEMBERS {
            noise += self.weight[m] * self.q[m] * self.scale(m);
        }
        noise
    }

    /// Mean and variance over members, from each member's mean and variance.
    #[inline(always)]
    fn mixture(&self, member: impl Fn(usize) -> (T, T)) -> Mixture<T> {
        // Each member first, several per register; then the sums, in a fixed order.
        let (mut x, mut own) = (Each::zeros(), Each::zeros());
        for m in 0..MEMBERS {
            (x[m], own[m]) = member(m);
        }
        let origin = x[0];
        let (mut mean, mut square) = (T::zero(), T::zero());
        let (mut P, mut scaled) = (T::zero(), T::zero());
        for m in 0..MEMBERS {
            let apart = x[m] - origin;
            mean += self.weight[m] * apart;
            square += self.weight[m] * apart * apart;
            P += self.weight[m] * own[m];
            scaled += self.weight[m] * own[m] * self.S[m];
        }
        let spread = (square - mean * mean).at_least(T::zero());
        Mixture { mean: origin + mean, variance: scaled / self.degrees + spread, P }
    }

    /// All Kalman steps; returns squared innovations over their variances, and these variances.
    #[inline(always)]
    fn advance(&mut self, block: &BlockMean<T>) -> (Each<T>, Each<T>) {
        let (mut square, mut variance) = (Each::zeros(), Each::zeros());
        for m in 0..MEMBERS {
            let step = self.step(m, block);
            square[m] = step.innovation * step.innovation / step.S;
            variance[m] = step.S;
            self.x[m] = step.end(self.x[m]);
            self.P[m] = step.P;
        }
        (square, variance)
    }

    /// One Kalman step of a member.
    #[inline(always)]
    fn step(&self, m: usize, block: &BlockMean<T>) -> Step<T> {
        let (P, R) = (self.P[m], block.noise);
        let moved = self.q[m] * block.time;
        let third = moved * T::of(1.0 / 3.0);
        let S = P + third + R;
        // P + moved - C^2/S with C = P + moved/2, over one denominator: nothing cancels.
        let left = P * (third + R) + moved * (R + moved * T::of(1.0 / 12.0));
        let inverse = T::one() / S;
        Step {
            innovation: block.mean - self.x[m],
            S,
            K: (P + moved * T::of(0.5)) * inverse,
            P: left * inverse,
        }
    }

    #[inline(always)]
    fn scale(&self, m: usize) -> T {
        self.S[m] / self.degrees
    }

    /// Adds one squared innovation over its variance to the evidence and the scale.
    fn weigh_in(&mut self, m: usize, square: T, variance: T) {
        let spread = (variance * self.scale(m)).ln();
        let tail = (square / self.S[m]).ln_1p() * (self.degrees + T::one());
        self.evidence[m] = self.evidence[m] * kept::<T>() - (spread + tail) * T::of(0.5);
        // A sensor that is stuck for days would reduce it to zero, with an infinite logarithm.
        self.S[m] = (self.S[m] * kept::<T>() + square).at_least(T::VARIANCE_FLOOR);
    }

    fn normalise(&mut self) -> T {
        let best = self.evidence.max();
        let prior = prior::<T>();
        for m in 0..MEMBERS {
            self.evidence[m] -= best;
            self.weight[m] = prior[m] * self.evidence[m].exp();
        }
        self.likelihood = self.weight.sum();
        self.weight /= self.likelihood;
        best
    }
}

/// A block that all members learn from.
struct Correction<'a, T> {
    bank: &'a mut KalmanBank<T>,
    block: &'a BlockMean<T>,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> OnRows for Correction<'_, T> {
    type Output = (Each<T>, Each<T>);

    #[inline(always)]
    fn run<F: Fours>(self, _: F) -> (Each<T>, Each<T>) {
        self.bank.advance(self.block)
    }
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> KalmanBank<T> {
    /// True if blocks with means within `reach` can have changed `fresh` to this state.
    pub(super) fn is_after(&self, fresh: &Self, reach: T) -> bool {
        let every = |values: &Each<T>, holds: &dyn Fn(T) -> bool| values.iter().all(|x| holds(*x));
        let (zero, most) = (T::zero(), T::MAX_DIFFERENCE);
        self.q == fresh.q
            && every(&self.x, &|x| is_within(x, reach))
            && every(&self.P, &|P| is_size(P, most))
            && every(&self.S, &|S| S >= T::VARIANCE_FLOOR && S <= most)
            && self.degrees >= T::one()
            && self.degrees <= T::of(TIME_CONSTANT_BLOCKS + 1.0)
            && every(&self.evidence, &|evidence| is_within(evidence, T::MAX_RAW))
            && self.evidence.max() == zero
            && every(&self.weight, &|weight| is_size(weight, T::one()))
            && is_within(self.weight.sum() - T::one(), T::of(0.01))
            && is_size(self.likelihood, T::of(1.01))
    }
}

/// Factor of the evidence that remains after a block.
pub(super) fn kept<T: Real>() -> T {
    T::of(1.0 - 1.0 / TIME_CONSTANT_BLOCKS)
}

fn prior<T: Real>() -> Each<T> {
    let others = (1.0 - NO_DRIFT_WEIGHT) / (MEMBERS - 1) as f64;
    Each::from_fn(|m, _| T::of(if m == 0 { NO_DRIFT_WEIGHT } else { others }))
}

#[cfg(test)]
mod tests {
    use super::{BlockMean, KalmanBank};

    #[test]
    fn ten_days_of_a_stuck_sensor_leave_every_weight_a_number() {
        let mut bank = KalmanBank::new(1e-2);
        bank.begin(0.0, 1e-2);
        for _ in 0..432_000 {
            bank.correct(&BlockMean { mean: 0.0, noise: 1e-12, time: 1.0 });
        }
        assert!(bank.weight.iter().chain(&bank.x).chain(&bank.S).all(|x: &f64| x.is_finite()));
        assert!(bank.is_after(&KalmanBank::new(1e-2), 1.0));
    }
}
