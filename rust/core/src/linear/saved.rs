//! The state of a bank as bytes.
#![allow(non_snake_case)]

use serde::{Deserialize, Serialize};

use super::bank::{LinearBank, MAX_SIZE, Model};
use super::check::{check_state, settle_covariance};
use super::step::{MAX_VARIANCE, is_settled};
use crate::error::Error;
use crate::math::validity::is_within;
use crate::memory;
use crate::stream::checkpoint::{self, Checkpoint};

/// Largest innovation, and largest sum of squares and log-likelihood.
const MAX_INNOVATION: f64 = 1e190;
const MAX_NIS: f64 = 1e303;
/// Bytes of a number, and of the other parts.
const NUMBER_BYTES: usize = 8;
const OTHER_BYTES: usize = 256;

/// Saved form: one covariance if the covariances of all channels are equal.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Saved {
    channels: Option<usize>,
    sizes: [usize; 3],
    /// Stated matrices: F, H, Q, R, B, x0 and P0.
    chosen: [Vec<f64>; 7],
    x: Vec<f64>,
    P: Vec<f64>,
    /// Innovation, NIS and log-likelihood.
    last: [Vec<f64>; 3],
}

impl LinearBank {
    /// Returns the complete state as bytes.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory.
    pub fn save(&self) -> Result<Vec<u8>, Error> {
        let Model { sizes, F, H, Q, R, B } = &self.model;
        let one = self.shared || self.are_equal();
        let P = if one { &self.P[..self.P0.len()] } else { &self.P };
        let chosen = [F, H, Q, R, B, &self.x0, &self.P0];
        let last = [&self.innovation, &self.nis, &self.log_likelihood];
        let numbers = chosen.iter().chain(&last).map(|part| part.len()).sum::<usize>();
        let length = NUMBER_BYTES * (numbers + self.x.len() + P.len()) + OTHER_BYTES;
        let copied = |part: &Vec<f64>| memory::copied(part);
        let [f, h, q, r, b, x, p] = chosen.map(copied);
        let [innovation, nis, density] = last.map(copied);
        let saved = Saved {
            channels: self.channels,
            sizes: *sizes,
            chosen: [f?, h?, q?, r?, b?, x?, p?],
            x: memory::copied(&self.x)?,
            P: memory::copied(P)?,
            last: [innovation?, nis?, density?],
        };
        let mut bytes = memory::filled(0, length)?;
        let used = checkpoint::write(&saved, &mut bytes)?.len();
        bytes.truncate(used);
        Ok(bytes)
    }

    /// Restores the state of [`save`](Self::save).
    ///
    /// # Errors
    /// Every variant of [`Error`] on checkpoints, or [`Error::Memory`].
    pub fn restore(bytes: &[u8]) -> Result<Self, Error> {
        let Saved { channels, sizes, chosen, x, P, last } = checkpoint::read(bytes)?;
        let [F, H, Q, R, B, x0, P0] = chosen;
        let [innovation, nis, log_likelihood] = last;
        let model = Model { sizes, F, H, Q, R, B };
        let shared = P.len() == P0.len();
        let mut full = memory::room(P0.len().saturating_mul(nis.len()))?;
        full.extend(P.iter().cycle().take(P0.len() * nis.len()));
        let room = Self::room(sizes[0], sizes[1])?;
        let P = full;
        Ok(Self { channels, model, x0, P0, x, P, shared, innovation, nis, log_likelihood, room })
    }
}

impl Checkpoint for Saved {
    const TAG: &'static str = "linear-kalman";
    const VERSION: u16 = 1;

    fn is_valid(&self) -> bool {
        let [n, m, p] = self.sizes;
        let count = self.channels.unwrap_or(1);
        let [F, H, Q, R, B, x0, P0] = &self.chosen;
        let [innovation, nis, density] = &self.last;
        let sizes = [n, m, p].iter().all(|size| *size <= MAX_SIZE);
        // Products of the sizes must not overflow before they are compared.
        let fits = |part: &[f64], each: usize| {
            part.len().checked_div(each) == Some(count) && part.len().is_multiple_of(each)
        };
        let mut whole = [n * n, m * n, n * n, m * m, n * p].into_iter().zip(&self.chosen);
        let shaped = (sizes && n > 0 && m > 0 && count > 0)
            && whole.all(|(size, part)| part.len() == size)
            && (fits(x0, n) && fits(&self.x, n) && P0.len() == n * n)
            && (self.P.len() == n * n || fits(&self.P, n * n))
            && (fits(innovation, m) && fits(nis, 1) && fits(density, 1));
        if !shaped {
            return false;
        }
        let model = Model {
            sizes: self.sizes,
            F: F.clone(),
            H: H.clone(),
            Q: Q.clone(),
            R: R.clone(),
            B: B.clone(),
        };
        let mut initial = P0.clone();
        let unchanged = model.clone().check().is_ok_and(|()| model.is_settled())
            && settle_covariance("P0", None, n, &mut initial).is_ok()
            && initial == *P0;
        let states = check_state("x", &self.x).is_ok() && check_state("x0", x0).is_ok();
        unchanged
            && states
            && self.P.chunks_exact(n * n).all(|P| is_covariance(n, P))
            && innovation.iter().all(|y| y.is_nan() || is_within(*y, MAX_INNOVATION))
            && nis.iter().all(|nis| nis.is_nan() || (0.0..=MAX_NIS).contains(nis))
            && density.iter().all(|density| is_within(*density, MAX_NIS))
    }
}

/// True if a filter can reach this covariance.
fn is_covariance(n: usize, P: &[f64]) -> bool {
    let mut room = vec![0.0; n * n];
    let symmetric = (0..n).all(|i| (0..i).all(|j| P[i * n + j] == P[j * n + i]));
    let bound = 2.0 * n as f64 * MAX_VARIANCE;
    symmetric && P.iter().all(|p| is_within(*p, bound)) && is_settled(n, P, &mut room)
}
