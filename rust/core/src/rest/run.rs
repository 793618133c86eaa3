//! Ticks in a row near a level.

use serde::{Deserialize, Serialize};

use super::known::Known;
use crate::real::{Limits, Real};

/// Successive ticks that look like a rest known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Run<T> {
    pub ticks: u32,
    /// Their mean level.
    pub level: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Run<T> {
    pub(super) fn none() -> Self {
        Self { ticks: 0, level: T::zero() }
    }

    pub(super) fn take(&mut self, near: bool, level: T) {
        if !near {
            *self = Self::none();
            return;
        }
        self.ticks = self.ticks.saturating_add(1);
        self.level += (level - self.level) / T::of(f64::from(self.ticks));
    }

    /// Whether it is long enough, and at the level known.
    pub(super) fn has_arrived(&self, ticks: u32, known: &Known<T>, step: T) -> bool {
        self.ticks >= ticks && known.is_level(self.level, step)
    }
}
