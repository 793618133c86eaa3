//! Kalman filters of bias and slope with different random walks of the bias, weighed by their
//! likelihoods (Magill 1965). Each learns its own noise, and the likelihood is Student's (West &
//! Harrison, *Bayesian Forecasting and Dynamic Models*, 2nd ed. 1997, 4.5, 12.2).
//!
//! Covariances are stored as P = U D Uᵀ with U = [1 u; 0 1] and D = diag(v, c), and updated by
//! Bierman's method (*Factorization Methods for Discrete Sequential Estimation*, 1977, V.3). A
//! correction never increases v and c, and P is definite for any rounding.
#![allow(non_snake_case)]

use nalgebra::ComplexField;
use serde::{Deserialize, Serialize};

use super::thermometer::MAX_KELVIN;
use crate::math::Real;
use crate::math::validity::{is_size, is_within};

/// Largest level in standard deviations of the noise.
pub const MAX_LEVEL: f64 = 1e12;
pub const MAX_SLOPE: f64 = 1e8;
const MAX_VARIANCE: f64 = 1e24;

/// Number of filters: one per decade.
const WALKS: usize = 8;

/// Variance that a walk adds in one tick, over the white variance of a full tick.
const RATIOS: Each = [1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0];

/// Median of the prior ratio. The prior of the walk's standard deviation is half-Cauchy; at the
/// median, the walk is as strong as the noise of five seconds.
const MEDIAN_RATIO: f64 = 2.5e-3;

/// Share of the evidence that remains after a tick, and prior weight of the noise before the first
/// tick.
const EVIDENCE_DECAY: f64 = 1.0 - 1.0 / 4000.0;
const DEGREES_OF_FREEDOM: f64 = 2.0;

/// Smallest noise, as a variance over the first tick's variance.
const MIN_NOISE: f64 = 1e-12;

type Each = [f64; WALKS];

/// Bias and slope of every walk, in standard deviations of the samples in the first tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Walks {
    /// Bias at the reference, and slope.
    x: Each,
    k: Each,
    /// Factors of the covariance, over the noise.
    u: Each,
    v: Each,
    c: Each,
    evidence: Each,
    degrees: f64,
    /// Sum of the squared normalised innovations.
    squares: Each,
}

/// Mean and standard deviation over all walks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixture {
    pub mean: f64,
    pub sigma: f64,
}

impl Walks {
    /// State before the first rest.
    pub fn none() -> Self {
        let zero = [0.0; WALKS];
        Self {
            x: zero,
            k: zero,
            u: zero,
            v: zero,
            c: zero,
            evidence: zero,
            degrees: 0.0,
            squares: zero,
        }
    }

    /// Filters with a slope of this mean and standard deviation; `begin` sets the bias.
    pub fn new(slope: f64, sigma: f64) -> Self {
        let (k, c) = ([slope; WALKS], [sigma * sigma; WALKS]);
        Self {
            k,
            c,
            degrees: DEGREES_OF_FREEDOM,
            squares: [DEGREES_OF_FREEDOM; WALKS],
            ..Self::none()
        }
    }

    /// Sets the bias to a tick with this white variance, and keeps the slope.
    pub fn begin(&mut self, y: f64, R: f64, d: f64) {
        for m in 0..WALKS {
            self.x[m] = (y - self.k[m] * d).within(MAX_LEVEL);
            (self.v[m], self.u[m]) = (R, -d);
        }
    }

    /// Moves the learned state to `d` kelvins from the reference.
    pub fn shift(&mut self, d: f64) {
        for m in 0..WALKS {
            self.x[m] = (self.x[m] - self.k[m] * d).within(MAX_LEVEL);
            self.u[m] -= d;
        }
    }

    /// Propagates one tick of the bias's random walk, with this variance if it is known.
    pub fn wait(&mut self, known: Option<f64>, length: f64) {
        for m in 0..WALKS {
            self.v[m] = (self.v[m] + self.step(m, known, length)).min(MAX_VARIANCE);
        }
    }

    /// Variance that a walk adds per tick, over its noise.
    fn step(&self, m: usize, known: Option<f64>, length: f64) -> f64 {
        known.map_or(RATIOS[m] / length, |variance| variance / self.noise(m))
    }

    /// Learns from a tick at rest with white variance R, `d` kelvins from the reference.
    pub fn correct(&mut self, y: f64, R: f64, d: f64) {
        for m in 0..WALKS {
            let (u, v, c) = (self.u[m], self.v[m], self.c[m]);
            let h = u + d;
            let e = y - (self.x[m] + self.k[m] * d);
            let a = R + v;
            let S = a + h * h * c;
            self.weigh_in(m, e * e / S, S);
            self.x[m] = (self.x[m] + (v + u * h * c) / S * e).within(MAX_LEVEL);
            self.k[m] = (self.k[m] + h * c / S * e).within(MAX_LEVEL);
            self.u[m] = u - h * v / a;
            self.v[m] = v * R / a;
            self.c[m] = c * a / S;
        }
        self.degrees = EVIDENCE_DECAY * self.degrees + 1.0;
        for squares in &mut self.squares {
            *squares = squares.max(MIN_NOISE * self.degrees);
        }
    }

    /// Bias, `d` kelvins from the reference.
    pub fn level(&self, d: f64) -> Mixture {
        self.mixture(|m| {
            let h = self.u[m] + d;
            (self.x[m] + self.k[m] * d, self.v[m] + h * h * self.c[m])
        })
    }

    /// Mean bias over the next `ticks`, if the temperature stays `d` kelvins from the reference.
    pub fn ahead(&self, d: f64, known: Option<f64>, length: f64, ticks: f64) -> Mixture {
        self.mixture(|m| {
            let h = self.u[m] + d;
            let walked = (self.step(m, known, length) * ticks / 3.0).min(MAX_VARIANCE);
            (self.x[m] + self.k[m] * d, self.v[m] + h * h * self.c[m] + walked)
        })
    }

    /// Slope over all walks.
    pub fn slope(&self) -> Mixture {
        self.mixture(|m| (self.k[m], self.c[m]))
    }

    /// Factor of the variances: noise over the first tick's noise.
    fn noise(&self, m: usize) -> f64 {
        self.squares[m] / self.degrees
    }

    /// Adds a squared innovation over its variance to the evidence and the noise.
    fn weigh_in(&mut self, m: usize, square: f64, S: f64) {
        let tail = ComplexField::ln_1p(square / self.squares[m]) * (self.degrees + 1.0);
        let spread = tail + ComplexField::ln(S * self.noise(m));
        self.evidence[m] = EVIDENCE_DECAY * self.evidence[m] - 0.5 * spread;
        self.squares[m] = EVIDENCE_DECAY * self.squares[m] + square;
    }

    fn weights(&self) -> Each {
        let best = self.evidence.iter().fold(f64::NEG_INFINITY, |best, e| best.max(*e));
        let weights: Each = core::array::from_fn(|m| {
            let ratio = RATIOS[m] / MEDIAN_RATIO;
            let prior = ratio.simd_sqrt() / (1.0 + ratio);
            prior * ComplexField::exp(self.evidence[m] - best)
        });
        let sum: f64 = weights.iter().sum();
        weights.map(|weight| weight / sum)
    }

    fn mixture(&self, member: impl Fn(usize) -> (f64, f64)) -> Mixture {
        let weights = self.weights();
        let mean: f64 = (0..WALKS).map(|m| weights[m] * member(m).0).sum();
        let variance = (0..WALKS).map(|m| {
            let (value, variance) = member(m);
            weights[m] * (variance * self.noise(m) + (value - mean) * (value - mean))
        });
        Mixture { mean, sigma: variance.sum::<f64>().simd_sqrt() }
    }

    /// True if ticks can have led to this state.
    pub fn is_valid(&self) -> bool {
        let every = |values: &Each, holds: &dyn Fn(f64) -> bool| values.iter().all(|x| holds(*x));
        let size = |bound: f64| move |x: f64| is_size(x, bound);
        let level = |x: f64| is_within(x, MAX_LEVEL);
        every(&self.x, &level)
            && every(&self.k, &level)
            // At most the distance of two readings.
            && every(&self.u, &|u| is_within(u, 3.0 * MAX_KELVIN))
            && every(&self.v, &size(MAX_VARIANCE))
            && every(&self.c, &size(MAX_SLOPE * MAX_SLOPE))
            && every(&self.evidence, &|evidence| is_within(evidence, 1e12))
            && self.degrees >= 1.0
            && self.degrees <= 4001.0
            && every(&self.squares, &|s| s >= MIN_NOISE * self.degrees && s <= 1e60)
    }
}
