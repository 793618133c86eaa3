//! Sums over the samples of a tick.

use serde::{Deserialize, Serialize};

use super::MIN_SAMPLES;
use crate::math::validity::{is_size, is_within};
use crate::math::{Limits, Real, choose};

/// Sums over distances from a centre.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Sums<T> {
    pub count: u32,
    pub(super) sum: T,
    pub(super) squares: T,
    /// Largest distances below and above.
    pub(super) lowest: T,
    pub(super) highest: T,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Sums<T> {
    pub(super) fn none() -> Self {
        let zero = T::zero();
        Self { count: 0, sum: zero, squares: zero, lowest: zero, highest: zero }
    }

    /// Adds equal distances.
    #[inline(always)]
    pub(super) fn add(&mut self, distance: T, times: u32) {
        let weighted = distance * T::of(f64::from(times));
        self.count += times;
        self.sum += weighted;
        self.squares += weighted * distance;
        self.lowest = distance.at_most(self.lowest);
        self.highest = distance.at_least(self.highest);
    }

    /// Mean distance, zero without a distance.
    pub(super) fn mean(&self) -> T {
        self.sum / T::of(f64::from(self.count.max(1)))
    }

    pub(super) fn variance_about_mean(&self) -> T {
        let squares = self.squares - self.sum * self.mean();
        squares.at_least(T::zero()) / T::of(f64::from(self.count.max(2) - 1))
    }

    /// Mean, and variance about it, without the farthest distance: one outlier is no motion. A
    /// value below `rounding` is zero.
    pub(super) fn without_farthest(&self, rounding: T) -> (T, T) {
        if self.count < MIN_SAMPLES {
            return (T::zero(), T::zero());
        }
        let n = T::of(f64::from(self.count - 1));
        let sum = self.sum - self.farthest(rounding);
        let farthest = self.highest.at_least(-self.lowest);
        let squares = self.squares - farthest * farthest;
        let variance = (squares - sum * sum / n) / (n - T::one());
        (sum / n, variance.at_least(T::zero()))
    }

    /// Range from the lowest to the highest distance, including the centre.
    pub(super) fn range(&self) -> T {
        self.highest - self.lowest
    }

    /// The farthest distance; zero if two are equally far, one below and one above. Neither a sign
    /// nor rounding may change the statistics of a coarse sensor.
    fn farthest(&self, rounding: T) -> T {
        let further = self.highest + self.lowest;
        let lower = choose(further < -rounding, self.lowest, T::zero());
        choose(further > rounding, self.highest, lower)
    }

    /// True if at most `count` distances within `most` can have led to these sums.
    pub(super) fn is_valid(&self, count: u32, most: T) -> bool {
        let own = T::of(f64::from(self.count));
        self.count <= count
            && is_within(self.sum, most * own)
            && is_size(self.squares, most * most * own)
            && is_size(-self.lowest, most)
            && is_size(self.highest, most)
    }
}

#[cfg(test)]
mod tests {
    use super::Sums;

    #[test]
    fn rounding_does_not_decide_which_step_is_the_farthest() {
        let level = |lowest: f64| {
            let mut sums = Sums::none();
            for (distance, times) in [(0.0, 8), (1.0, 1), (lowest, 1)] {
                sums.add(distance, times);
            }
            sums.without_farthest(1e-13)
        };
        let (mean, variance) = level(-1.0);
        assert_eq!(mean, 0.0);
        for lowest in [-1.0 - 1e-15, -1.0 + 1e-15] {
            let (same, spread) = level(lowest);
            assert!(same.abs() < 1e-14 && (spread - variance).abs() < 1e-14, "{lowest}: {same}");
        }
        assert!((level(-1.1).0 - 1.0 / 9.0).abs() < 1e-15);
    }
}
