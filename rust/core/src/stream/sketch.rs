//! Median of a stream, and median distance from it, robust to a few samples.

use serde::{Deserialize, Serialize};

use crate::math::validity::is_within;
use crate::math::{Limits, Real};

/// Largest number of samples that are kept.
const CAPACITY: usize = 32;

/// Standard deviation of a normal variable over its median distance from the median.
const SIGMA_PER_MEDIAN_DISTANCE: f64 = 1.482_602_218_505_602;

/// Up to 32 samples of a stream: evenly spaced in time until there is no more room, then in rank.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sketch<T> {
    /// Samples in rising order.
    sorted: [T; CAPACITY],
    held: u32,
    /// One of this number of samples is kept.
    stride: u64,
    /// Number of samples to skip before the next kept sample.
    passing: u64,
}

impl<T: Limits + Real<Element = T, SimdBool = bool>> Sketch<T> {
    pub(crate) fn new() -> Self {
        Self { sorted: [T::zero(); CAPACITY], held: 0, stride: 1, passing: 0 }
    }

    /// Adds a finite sample.
    pub(crate) fn insert(&mut self, z: T) {
        if self.passing > 0 {
            self.passing -= 1;
            return;
        }
        if self.held() == CAPACITY {
            self.thin();
        }
        let mut index = self.held();
        while index > 0 && self.sorted[index - 1] > z {
            self.sorted[index] = self.sorted[index - 1];
            index -= 1;
        }
        self.sorted[index] = z;
        self.held += 1;
        self.passing = self.stride - 1;
    }

    /// Number of kept samples.
    pub(crate) fn held(&self) -> usize {
        (self.held as usize).min(CAPACITY)
    }

    /// Median, zero before the first sample.
    pub(crate) fn median(&self) -> T {
        match self.held() {
            0 => T::zero(),
            n => (self.sorted[(n - 1) / 2] + self.sorted[n / 2]) * T::of(0.5),
        }
    }

    /// Standard deviation of a normal variable with this median distance from its median. If most
    /// samples are equal, it is the smallest distance that is not zero: a step of the sensor.
    pub(crate) fn deviation(&self) -> T {
        let (centre, held) = (self.median(), self.held());
        let (mut below, mut above) = (held / 2, held / 2);
        let mut distance = T::zero();
        // From the median outwards.
        for nearest in 0..held {
            let is_above = below == 0
                || above < held && self.sorted[above] - centre <= centre - self.sorted[below - 1];
            let index = if is_above { above } else { below - 1 };
            (below, above) = if is_above { (below, above + 1) } else { (index, above) };
            distance = (self.sorted[index] - centre).simd_abs();
            if nearest >= held / 2 && distance > T::zero() {
                let is_median = nearest == held / 2;
                return if is_median {
                    distance * T::of(SIGMA_PER_MEDIAN_DISTANCE)
                } else {
                    distance
                };
            }
        }
        distance
    }

    /// True if samples can have led to this state.
    pub(crate) fn is_valid(&self) -> bool {
        let kept = &self.sorted[..self.held()];
        self.held as usize == self.held()
            && kept.iter().all(|z| is_within(*z, T::MAX_RAW))
            && kept.is_sorted()
            && self.stride.is_power_of_two()
            && self.passing < self.stride
    }

    /// Keeps every second sample in rank: of each pair the sample nearer to the median. A change of
    /// all signs has no effect.
    fn thin(&mut self) {
        const HALF: usize = CAPACITY / 2;
        for i in 0..HALF {
            self.sorted[i] = self.sorted[if i < HALF / 2 { 2 * i + 1 } else { 2 * i }];
        }
        self.held = HALF as u32;
        self.stride *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::Sketch;

    fn of(samples: impl IntoIterator<Item = f64>) -> Sketch<f64> {
        let mut sketch = Sketch::new();
        samples.into_iter().for_each(|z| sketch.insert(z));
        sketch
    }

    fn noise(n: usize) -> impl Iterator<Item = f64> {
        // Quantiles of the uniform distribution in a scattered order.
        (0..n).map(move |i| ((i as f64 * 0.618_033_988_75) % 1.0) - 0.5)
    }

    #[test]
    fn few_samples_are_exact() {
        let sketch = of([3.0, -1.0, 7.0, 4.0, 1e300]);
        assert_eq!(sketch.median(), 4.0);
        assert_eq!(sketch.deviation(), 3.0 * super::SIGMA_PER_MEDIAN_DISTANCE);
        assert_eq!(of([2.0, 4.0]).median(), 3.0);
        assert_eq!((of([]).median(), of([]).deviation(), of([5.0]).deviation()), (0.0, 0.0, 0.0));
    }

    #[test]
    fn where_most_are_equal_a_step_counts() {
        assert_eq!(of([0.0, 0.0, 0.25, 0.0, 9.0, 0.0]).deviation(), 0.25);
        assert_eq!(of([1.0; 40]).deviation(), 0.0);
    }

    #[test]
    fn many_samples_are_near_and_a_third_of_them_may_be_anything() {
        for n in [33, 100, 1000, 100_000] {
            let clean = of(noise(n));
            assert!(clean.median().abs() < 0.1, "{n}: {}", clean.median());
            assert!(
                (clean.deviation() / (0.25 * super::SIGMA_PER_MEDIAN_DISTANCE) - 1.0).abs() < 0.35
            );
            let spoilt = of(noise(n).enumerate().map(|(i, z)| if i % 4 == 1 { 1e200 } else { z }));
            assert!(spoilt.median().abs() < 0.5 && spoilt.deviation() < 1.0, "{n}");
        }
    }

    #[test]
    fn a_sign_changes_nothing() {
        let (plain, turned) = (of(noise(777)), of(noise(777).map(|z| -z)));
        assert_eq!(plain.median(), -turned.median());
        assert_eq!(plain.deviation(), turned.deviation());
    }
}
