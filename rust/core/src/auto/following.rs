//! The drift from one tick to the next.

use serde::{Deserialize, Serialize};

use crate::real::Real;

/// The drift after a tick, in the unit of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Drift<T> {
    /// Mean.
    pub mean: T,
    /// Standard deviation.
    pub sigma: T,
    /// How it goes on until the next tick.
    pub following: Following<T>,
}

/// What a sample does to the drift before its tick is complete and judged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Following<T> {
    /// Weight of a sample.
    pub gain: T,
    /// The largest difference that counts, in the unit of the samples.
    pub most: T,
}

impl<T: Real> Following<T> {
    /// Stands still.
    pub fn held() -> Self {
        Self { gain: T::zero(), most: T::zero() }
    }

    /// The drift after a sample.
    #[inline(always)]
    pub fn step(&self, drift: T, z: T) -> T {
        drift + self.gain * (z - drift).within(self.most)
    }
}
