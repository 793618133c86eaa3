//! A Kalman filter of two states for the two axes of a plane; the first state is measured.
#![allow(non_snake_case)]

use serde::{Deserialize, Serialize};

use crate::math::validity::is_within;
use crate::math::{Real, Symmetric};

/// East and north.
pub(super) type Plane = [f64; 2];

/// Largest state and variance, far above real values.
const MAX_STATE: f64 = 1e170;
const MAX_VARIANCE: f64 = 1e100;
/// Largest loss of a difference's variance by rounding, relative to the terms.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Transition of the states: x ← Fx + (shift, 0) with F = [1, a; 0, f], and the upper triangle of
/// Q.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub a: f64,
    pub f: f64,
    pub shift: Plane,
    pub Q: [f64; 3],
}

/// Two states for each axis. The two axes share one covariance, since they are measured together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Pair {
    /// The measured state, then the other state.
    x: [Plane; 2],
    P: Symmetric<f64, 2>,
}

impl Pair {
    /// State after one measurement of variance `R`; the other state is zero with variance
    /// `variance`.
    pub fn measured(z: Plane, R: f64, variance: f64) -> Self {
        let mut P = Symmetric::diagonal(R);
        P.set(1, 1, variance);
        Self { x: [z, [0.0; 2]], P }
    }

    /// Zero states with an unknown value.
    pub fn unknown() -> Self {
        Self::measured([0.0; 2], 0.0, 0.0)
    }

    pub fn first(&self) -> Plane {
        self.x[0]
    }

    pub fn second(&self) -> Plane {
        self.x[1]
    }

    /// Variance of the first state.
    pub fn variance(&self) -> f64 {
        self.P.at(0, 0)
    }

    /// Variance of the first state minus the second.
    pub fn variance_of_difference(&self) -> f64 {
        self.P.at(0, 0) - 2.0 * self.P.at(0, 1) + self.P.at(1, 1)
    }

    pub fn predict(&mut self, step: &Step) {
        let Step { a, f, shift, Q } = *step;
        for (axis, shift) in shift.into_iter().enumerate() {
            self.x[0][axis] = bounded(self.x[0][axis] + a * self.x[1][axis] + shift);
            self.x[1][axis] *= f;
        }
        let (p, q, r) = (self.P.at(0, 0), self.P.at(0, 1), self.P.at(1, 1));
        let grown = a * a * r;
        self.P.set(0, 0, size(p + (grown + 2.0 * a * q) + Q[0] + ROUNDING * (p + grown)));
        self.P.set(0, 1, f * (q + a * r) + Q[1]);
        self.P.set(1, 1, f * f * r + Q[2] + ROUNDING * r);
        self.limit();
    }

    pub fn correct(&mut self, z: Plane, R: f64) {
        let (p, q, r) = (self.P.at(0, 0), self.P.at(0, 1), self.P.at(1, 1));
        let S = p + R;
        let (k, b, left) = (p / S, q / S, R / S);
        for (axis, z) in z.into_iter().enumerate() {
            let e = z - self.x[0][axis];
            self.x[0][axis] = bounded(self.x[0][axis] + k * e);
            self.x[1][axis] = bounded(self.x[1][axis] + b * e);
        }
        // (I - K H) P, computed without a difference to keep the digits.
        self.P.set(0, 0, left * p);
        self.P.set(0, 1, left * q);
        self.P.set(1, 1, size(r - b * q + ROUNDING * r));
        self.limit();
    }

    /// Limits the variances without a change of the correlation, and the covariance to the value
    /// that the variances allow.
    fn limit(&mut self) {
        for i in 0..2 {
            let variance = self.P.at(i, i);
            if variance > MAX_VARIANCE {
                self.P.set(0, 1, self.P.at(0, 1) * (MAX_VARIANCE / variance).simd_sqrt());
                self.P.set(i, i, MAX_VARIANCE);
            }
        }
        let [first, second] = [0, 1].map(|i| self.P.at(i, i).simd_sqrt());
        let most = first * second;
        self.P.set(0, 1, self.P.at(0, 1).clamp(-most, most));
    }

    pub fn is_valid(&self) -> bool {
        self.x.iter().flatten().all(|x| is_within(*x, MAX_STATE))
            && self.P.is_covariance(2.0 * MAX_VARIANCE)
    }
}

/// The variance, or zero if it is negative: for the smallest numbers rounding removes more than
/// `ROUNDING` adds.
fn size(variance: f64) -> f64 {
    if variance < 0.0 { 0.0 } else { variance }
}

fn bounded(x: f64) -> f64 {
    x.clamp(-MAX_STATE, MAX_STATE)
}
