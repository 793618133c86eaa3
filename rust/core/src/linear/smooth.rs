//! The smoother of Rauch, Tung and Striebel (*AIAA Journal* 3(8), 1965).
#![allow(non_snake_case)]

use super::bank::{Free, FreeRoom, Varying};
use super::step::{Advance, ChannelOutputs, advance_one, correct_covariance, product, transpose};
use crate::error::Error;
use crate::math::Pairs;
use crate::memory;
use crate::work;

/// Output of a filter for a record of `channels` channels: states after each step, and covariances,
/// one per channel or one for all channels.
#[derive(Debug, Clone, Copy)]
pub struct Filtered<'a> {
    /// Number of states.
    pub n: usize,
    /// Number of channels.
    pub channels: usize,
    /// States, n per channel and step.
    pub state: &'a [f64],
    /// Covariances, n × n per channel and step, or per step.
    pub covariance: &'a [f64],
    /// F, Q and B of each step, from the previous one.
    pub predict: [Varying<'a>; 3],
    /// Inputs, p for each channel and step; empty for none.
    pub u: &'a [f64],
}

/// Smoothed states and covariances, with the same shapes.
#[derive(Debug, Clone, PartialEq)]
pub struct Smoothed {
    /// States, as in [`Filtered`].
    pub state: Vec<f64>,
    /// Covariances, as in [`Filtered`].
    pub covariance: Vec<f64>,
}

impl Filtered<'_> {
    /// Smooths backwards from the last step, with G = P Fᵀ (F P Fᵀ + Q)⁻¹ of the next step: x ← x +
    /// G (xₙₑₓₜ - F x - B u), P ← (I - G F) P (I - G F)ᵀ + G (Q + Pₙₑₓₜ) Gᵀ.
    ///
    /// G is the gain of a measurement F x with a noise of covariance Q. The first terms of P are
    /// Joseph's form for it.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory.
    pub fn smooth(&self) -> Result<Smoothed, Error> {
        let (n, channels) = (self.n, self.channels);
        let (row, square) = (channels * n, n * n);
        let (mut x, mut P) = (memory::copied(self.state)?, memory::copied(self.covariance)?);
        let steps = x.len() / row;
        let groups = (P.len() / square).checked_div(steps).unwrap_or(0);
        let inputs = self.u.len() / steps.max(1);
        let mut room = FreeRoom::of(n, n)?;
        let mut expected = memory::filled(0.0, row)?;
        let mut nothing = memory::filled(0.0, channels.max(n))?;
        let size = Free { n, m: n };
        for next in (1..steps).rev() {
            work::pause();
            let [F, Q, B] = self.predict.map(|matrix| matrix.at(next));
            let u = &self.u[next * inputs..][..inputs];
            let (these, those) = x.split_at_mut(next * row);
            let these = &mut these[(next - 1) * row..];
            let mut work = room.work(n, n);
            // Predicted state of the next step.
            expected.copy_from_slice(these);
            let step = Advance {
                predict: Some((F, if u.is_empty() { &[] } else { B }, u)),
                correct: None,
            };
            let mut outputs = ChannelOutputs {
                state: &mut expected,
                innovation: &mut [],
                nis: &mut [],
                log_likelihood: &mut nothing,
            };
            for channel in 0..channels {
                advance_one(size, channel, &step, &mut outputs, &mut work);
            }
            let (before, after) = P.split_at_mut(next * groups * square);
            let before = &mut before[(next - 1) * groups * square..];
            for group in 0..groups {
                let P = &mut before[group * square..][..square];
                let after = &after[group * square..][..square];
                work.counts.fill(true);
                correct_covariance(size, F, Q, P, &mut work);
                // G Pₙₑₓₜ Gᵀ, `k` being Gᵀ.
                transpose(n, n, work.k, work.a);
                product(Pairs, false, [n; 3], work.a, after, work.b);
                product(Pairs, true, [n; 3], work.b, work.k, work.c);
                for i in 0..n {
                    for j in i..n {
                        P[i * n + j] += work.c[i * n + j];
                        P[j * n + i] = P[i * n + j];
                    }
                }
                let members = if groups == 1 { 0..channels } else { group..group + 1 };
                for channel in members {
                    for j in 0..n {
                        let index = channel * n + j;
                        let news = those[index] - expected[index];
                        for i in 0..n {
                            these[channel * n + i] += work.k[j * n + i] * news;
                        }
                    }
                }
            }
        }
        Ok(Smoothed { state: x, covariance: P })
    }
}
