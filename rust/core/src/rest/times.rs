//! How long a tick is, and how long rest and motion last at least.

use serde::{Deserialize, Serialize};

use super::LEAST;

/// Samples in a tick, and times in ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Times {
    pub tick: u32,
    /// Near the level known, until rest begins.
    pub dwell: u32,
    /// Until a rest is believed in, and until one at a level not known begins.
    pub short: u32,
    /// The same, however far the level.
    pub long: u32,
}

impl Times {
    pub(super) fn new(rate: f64) -> Self {
        let tick = ((rate * 0.25 + 0.5) as u32).max(LEAST);
        let ticks = |seconds: f64| (seconds * rate / f64::from(tick) + 0.5) as u32;
        // At low rates ticks are long, and few say little.
        let [dwell, short, long] = [ticks(1.5).max(6), ticks(10.0).max(10), ticks(60.0).max(30)];
        Self { tick, dwell, short, long }
    }
}
