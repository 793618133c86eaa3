//! How long rest and motion last at least.

use serde::{Deserialize, Serialize};

/// Times in ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Times {
    /// Near the level known, until rest begins.
    pub dwell: u32,
    /// Until a rest is believed in, and until one at a level not known begins.
    pub short: u32,
    /// The same, however far the level.
    pub long: u32,
}

impl Times {
    pub(super) fn new(rate: f64, length: u32) -> Self {
        let ticks = |seconds: f64| (seconds * rate / f64::from(length) + 0.5) as u32;
        // At low rates ticks are long, and few say little.
        Self { dwell: ticks(1.5).max(6), short: ticks(10.0).max(10), long: ticks(60.0).max(30) }
    }
}
