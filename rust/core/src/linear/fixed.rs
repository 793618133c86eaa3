//! A filter of fixed size, also for Rust without `std`.
#![allow(non_snake_case)]

use super::step::{
    Advance, ChannelOutputs, Fixed, FixedRoom, advance_one, correct_covariance, is_known,
    predict_covariance,
};

/// A matrix, row after row.
type Matrix<const R: usize, const C: usize> = [[f64; C]; R];

/// State and covariance of `N` states with `M` measured combinations; the matrices of the model are
/// given at each step.
///
/// The matrices are not checked: they must be finite, their elements below
/// [`MAX_ELEMENT`](super::MAX_ELEMENT), covariances symmetric, positive semidefinite and below
/// [`MAX_VARIANCE`](super::MAX_VARIANCE).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearKalman<const N: usize, const M: usize> {
    /// State.
    pub x: [f64; N],
    /// Covariance of the state.
    pub P: Matrix<N, N>,
}

/// Result of a correction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correction<const M: usize> {
    /// Innovation z - H x before the correction, NaN for missing measurements.
    pub innovation: [f64; M],
    /// Normalised innovation squared; NaN if all measurements are missing.
    pub nis: f64,
    /// Log-likelihood of the measurements; 0 if all are missing.
    pub log_likelihood: f64,
}

impl<const N: usize, const M: usize> LinearKalman<N, M> {
    /// Predicts: x ← F x + B u, P ← F P Fᵀ + Q; `B` has the columns of the inputs in order.
    pub fn predict<const I: usize>(
        &mut self,
        F: &Matrix<N, N>,
        Q: &Matrix<N, N>,
        B: &Matrix<N, I>,
        u: &[f64; I],
    ) {
        let mut room = FixedRoom::<N, M>::new();
        let mut work = room.work();
        let (size, F) = (Fixed::<N, M>, F.as_flattened());
        predict_covariance(size, F, Q.as_flattened(), self.P.as_flattened_mut(), &mut work);
        let step = Advance { predict: Some((F, B.as_flattened(), u)), correct: None };
        let state = &mut self.x;
        let mut outputs =
            ChannelOutputs { state, innovation: &mut [], nis: &mut [], log_likelihood: &mut [] };
        advance_one(size, 0, &step, &mut outputs, &mut work);
    }

    /// Corrects: x ← x + K (z - H x), P ← (I - K H) P (I - K H)ᵀ + K R Kᵀ.
    pub fn update(&mut self, z: &[f64; M], H: &Matrix<M, N>, R: &Matrix<M, M>) -> Correction<M> {
        let mut room = FixedRoom::<N, M>::new();
        let mut work = room.work();
        let (size, H) = (Fixed::<N, M>, H.as_flattened());
        for (counts, z) in work.counts.iter_mut().zip(z) {
            *counts = is_known(*z);
        }
        let seen = work.counts.iter().any(|counts| *counts);
        let P = self.P.as_flattened_mut();
        let weighed = seen.then(|| correct_covariance(size, H, R.as_flattened(), P, &mut work));
        let (mut innovation, mut nis, mut log_likelihood) = ([0.0; M], [0.0], [0.0]);
        let mut outputs = ChannelOutputs {
            state: &mut self.x,
            innovation: &mut innovation,
            nis: &mut nis,
            log_likelihood: &mut log_likelihood,
        };
        let step = Advance { predict: None, correct: Some((H, z, weighed)) };
        advance_one(size, 0, &step, &mut outputs, &mut work);
        Correction { innovation, nis: nis[0], log_likelihood: log_likelihood[0] }
    }
}
