//! Standard deviation of noise from the share of values within it: an outlier has no more effect
//! than any other sample.

use serde::{Deserialize, Serialize};

use super::NORMAL_MEDIAN;
use crate::math::validity::{is_count, is_size};

/// Share of normal noise within its standard deviation.
const WITHIN_ONE_SIGMA: f64 = 0.682_689;

/// Number of values whose median is the start.
const INITIAL_SIZES: usize = 16;

/// Weight of a value in the start, divided by their number, for the fastest convergence.
const INITIAL_WEIGHT: f64 = 2.0;

/// A standard deviation that follows slowly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Counting {
    sigma: f64,
    count: u64,
    /// The first values, in rising order.
    first: [f64; INITIAL_SIZES],
}

impl Counting {
    pub(super) fn new() -> Self {
        Self { sigma: 0.0, count: 0, first: [0.0; INITIAL_SIZES] }
    }

    /// Standard deviation; zero before the start is over.
    pub(super) fn sigma(&self) -> f64 {
        self.sigma
    }

    /// Adds a value that is not zero, with a weight of at least `gain`.
    #[inline(always)]
    pub(super) fn take(&mut self, size: f64, gain: f64) {
        self.count += 1;
        if self.count <= INITIAL_SIZES as u64 {
            return self.begin(size);
        }
        let gain = gain.max(INITIAL_WEIGHT / self.count as f64);
        let within = if size < self.sigma { 1.0 } else { 0.0 };
        let sigma = self.sigma * (gain * (WITHIN_ONE_SIGMA - within)).exp();
        self.sigma = sigma.clamp(f64::MIN_POSITIVE, MAX_SIZE);
    }

    #[cold]
    fn begin(&mut self, size: f64) {
        let mut index = self.count as usize - 1;
        while index > 0 && self.first[index - 1] > size {
            self.first[index] = self.first[index - 1];
            index -= 1;
        }
        self.first[index] = size;
        if self.count == INITIAL_SIZES as u64 {
            self.sigma = (self.first[INITIAL_SIZES / 2] / NORMAL_MEDIAN).max(f64::MIN_POSITIVE);
        }
    }

    /// True if at most `samples` samples can have led to this state.
    pub(super) fn is_valid(&self, samples: u64) -> bool {
        let held = self.count.min(INITIAL_SIZES as u64) as usize;
        is_count(self.count)
            && self.count <= samples
            && self.first[..held].iter().all(|size| is_size(*size, MAX_SIZE) && *size > 0.0)
            && self.first[..held].is_sorted()
            && self.first[held..].iter().all(|size| *size == 0.0)
            && is_size(self.sigma, 2.0 * MAX_SIZE)
            && (self.sigma > 0.0) == (held == INITIAL_SIZES)
    }
}

/// Upper limit of all values.
pub(super) const MAX_SIZE: f64 = 1e170;
