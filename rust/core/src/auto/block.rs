//! Ticks gathered to the mean of a block.

use serde::{Deserialize, Serialize};

use super::walks::BlockMean;
use crate::real::Real;

/// Samples of a block so far, centred and scaled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Block<T> {
    /// Samples of a full block.
    length: T,
    /// Samples so far, missing ones included.
    elapsed: T,
    /// Samples that were there.
    present: T,
    sum: T,
}

impl<T: Real + PartialOrd> Block<T> {
    /// An empty block that is full at `length` samples.
    pub fn new(length: T) -> Self {
        Self { length, elapsed: T::zero(), present: T::zero(), sum: T::zero() }
    }

    /// An empty one in its place; answers the time that is given up, in blocks.
    pub fn restart(&mut self) -> T {
        let time = self.elapsed / self.length;
        *self = Self::new(self.length);
        time
    }

    /// Adds `present` samples of mean `mean`, gathered over `elapsed` samples.
    pub fn add(&mut self, elapsed: T, present: T, mean: T) {
        self.elapsed += elapsed;
        if present > T::zero() {
            self.present += present;
            self.sum += present * mean;
        }
    }

    /// All its samples have passed.
    pub fn is_full(&self) -> bool {
        self.elapsed >= self.length
    }

    /// The mean so far, if a sample was there, given the noise of a single one.
    pub fn mean(&self, noise: T) -> Option<BlockMean<T>> {
        (self.present > T::zero()).then(|| BlockMean {
            mean: self.sum / self.present,
            noise: noise / self.present,
            time: self.elapsed / self.length,
        })
    }
}
