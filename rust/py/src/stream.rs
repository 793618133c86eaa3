//! What every streaming filter does, whatever its order: several channels behind one interface.

use std::any::Any;

use serde::Serialize;
use zerorate_core::checkpoint::{self, Label};
use zerorate_core::{Bank, Error, SideBySide};

/// One filter a channel.
pub trait Stream: Any + Send + Sync {
    /// One sample of the only channel.
    fn update(&mut self, z: f64) -> f64;
    /// One sample a channel, replaced by the answers.
    fn update_row(&mut self, row: &mut [f64]);
    /// Rows of samples, replaced by the answers.
    fn process(&mut self, rows: &mut [f64], threads: usize);
    /// Back to before the first sample.
    fn reset(&mut self);
    /// Parameters and state.
    fn to_bytes(&self, channels: Option<usize>) -> Result<Vec<u8>, Error>;
}

/// A [`Bank`] and what it is called in a checkpoint.
#[derive(Debug, Clone)]
pub struct Labelled<F> {
    pub label: Label,
    pub bank: Bank<F>,
}

impl<F: SideBySide<f64> + Clone + Send + Sync + Serialize + 'static> Stream for Labelled<F> {
    #[inline]
    fn update(&mut self, z: f64) -> f64 {
        self.bank.filters_mut().first_mut().map_or(f64::NAN, |filter| filter.update(z))
    }

    fn update_row(&mut self, row: &mut [f64]) {
        self.bank.update(row);
    }

    fn process(&mut self, rows: &mut [f64], threads: usize) {
        self.bank.process_on_threads(rows, threads);
    }

    fn reset(&mut self) {
        self.bank.reset();
    }

    fn to_bytes(&self, channels: Option<usize>) -> Result<Vec<u8>, Error> {
        checkpoint::to_vec(self.label, &(channels, &self.bank))
    }
}
