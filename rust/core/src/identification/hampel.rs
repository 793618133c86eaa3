//! Outliers by the median of a running window, after Hampel.

use std::ops::Range;

use crate::work;

/// Standard deviation of Gaussian samples over their median absolute deviation.
const DEVIATION_OF_MAD: f64 = 1.482_602_218_505_602;

/// Number of samples between two checks for a stop.
const SAMPLES_PER_CHECK: usize = 64;

/// Window and threshold of the outlier test.
#[derive(Debug, Clone, Copy)]
pub struct Hampel {
    /// Number of samples in a window: as many before its sample as after it, one more before if
    /// even.
    pub width: usize,
    /// Distance from the median, in standard deviations, beyond which a sample is an outlier.
    pub threshold: f64,
    /// Smallest standard deviation: a coarse record's own may be 0.
    pub least_deviation: f64,
}

impl Hampel {
    /// Replaces outliers of `record` by the median of their window, and returns their indices.
    ///
    /// Windows end at the ends of the record, and values that are not finite are not in them.
    pub fn clean(&self, record: &mut [f64]) -> Vec<usize> {
        let mut window = Window::with_capacity(self.width.min(record.len()));
        let (mut within, mut found) = (0..0, Vec::new());
        for k in 0..record.len() {
            if k.is_multiple_of(SAMPLES_PER_CHECK) {
                work::pause();
            }
            let wanted = reach(k, self.width, record.len());
            window.slide(record, &within, &wanted);
            within = wanted;
            if let Some(median) = self.outlier(record[k], &window) {
                work::push(&mut found, (k, median));
            }
        }
        found.iter().for_each(|(k, median)| record[*k] = *median);
        work::collect(found.into_iter().map(|(k, _)| k))
    }

    /// The median, if `z` is too far from it.
    fn outlier(&self, z: f64, window: &Window) -> Option<f64> {
        if !z.is_finite() {
            return None;
        }
        let median = window.median();
        let far = |mad: f64| {
            let deviation = (DEVIATION_OF_MAD * mad).max(self.least_deviation);
            (z - median).abs() > self.threshold * deviation
        };
        // Few samples exceed the lower limit, which is found without a search.
        let found =
            far(window.least_median_distance(median)) && far(window.median_distance(median));
        found.then_some(median)
    }
}

/// The samples of the window of width `width` round `k`.
fn reach(k: usize, width: usize, n: usize) -> Range<usize> {
    let start = k.saturating_sub(width / 2);
    start..k.saturating_add(width - width / 2).min(n)
}

/// The finite samples of a window in order.
#[derive(Debug)]
struct Window(Vec<f64>);

impl Window {
    fn with_capacity(width: usize) -> Self {
        Self(work::room(width + 1))
    }

    fn slide(&mut self, record: &[f64], from: &Range<usize>, to: &Range<usize>) {
        match (&record[from.start..to.start], &record[from.end..to.end]) {
            ([old], [new]) if old.is_finite() && new.is_finite() => self.replace(*old, *new),
            (leaving, entering) => {
                leaving.iter().filter(|z| z.is_finite()).for_each(|z| self.remove(*z));
                entering.iter().filter(|z| z.is_finite()).for_each(|z| self.insert(*z));
            }
        }
    }

    fn insert(&mut self, z: f64) {
        self.0.insert(self.rank(z), z);
    }

    fn remove(&mut self, z: f64) {
        self.0.remove(self.rank(z));
    }

    /// Removes one value and inserts another; only the values between them move.
    fn replace(&mut self, old: f64, new: f64) {
        let (hole, index) = (self.rank(old), self.rank(new));
        if hole < index {
            self.0.copy_within(hole + 1..index, hole);
            self.0[index - 1] = new;
        } else {
            self.0.copy_within(index..hole, index + 1);
            self.0[index] = new;
        }
    }

    /// The number of smaller values.
    fn rank(&self, z: f64) -> usize {
        self.0.partition_point(|other| *other < z)
    }

    fn median(&self) -> f64 {
        let (lower, upper) = (self.0[(self.0.len() - 1) / 2], self.0[self.0.len() / 2]);
        midpoint(lower, upper)
    }

    /// Lower limit of the median distance: among the nearer half of all values, half of them lie on
    /// one side.
    fn least_median_distance(&self, median: f64) -> f64 {
        let (half, quarter) = (self.0.len() / 2, (self.0.len() / 2).div_ceil(2));
        match quarter {
            0 => 0.0,
            _ => (median - self.0[half - quarter]).min(self.0[half + quarter - 1] - median),
        }
    }

    /// Median of the distances from the median; they increase on its two sides.
    fn median_distance(&self, median: f64) -> f64 {
        let n = self.0.len();
        let (mut below, mut above) = (n / 2, n / 2);
        let (mut last, mut nearest) = (0.0, 0.0);
        for _ in 0..=n / 2 {
            last = nearest;
            let down = below.checked_sub(1).map_or(f64::INFINITY, |i| median - self.0[i]);
            let up = self.0.get(above).map_or(f64::INFINITY, |z| z - median);
            nearest = down.min(up);
            below -= usize::from(down < up);
            above += usize::from(down >= up);
        }
        if n % 2 == 1 { nearest } else { midpoint(last, nearest) }
    }
}

/// Mean of two values whose sum may overflow.
fn midpoint(a: f64, b: f64) -> f64 {
    0.5 * a + 0.5 * b
}

#[cfg(test)]
mod tests {
    use super::{DEVIATION_OF_MAD, Hampel, midpoint, reach};
    use proptest::prelude::*;

    fn median(mut values: Vec<f64>) -> f64 {
        values.sort_by(f64::total_cmp);
        midpoint(values[(values.len() - 1) / 2], values[values.len() / 2])
    }

    fn by_sorting(hampel: Hampel, record: &[f64]) -> Vec<f64> {
        let cleaned = |(k, z): (usize, &f64)| {
            let window = &record[reach(k, hampel.width, record.len())];
            let there: Vec<f64> = window.iter().copied().filter(|z| z.is_finite()).collect();
            if !z.is_finite() {
                return *z;
            }
            let centre = median(there.clone());
            let mad = median(there.iter().map(|z| (z - centre).abs()).collect());
            let deviation = (DEVIATION_OF_MAD * mad).max(hampel.least_deviation);
            if (z - centre).abs() > hampel.threshold * deviation { centre } else { *z }
        };
        record.iter().enumerate().map(cleaned).collect()
    }

    proptest! {
        #[test]
        fn equals_medians_of_sorted_windows(
            record in prop::collection::vec(
                prop_oneof![6 => -9.0..9.0, 1 => Just(f64::NAN), 2 => Just(1.0), 1 => Just(50.0)],
                1..60,
            ),
            width in 1_usize..80,
            threshold in 0.5..5.0,
        ) {
            let hampel = Hampel { width, threshold, least_deviation: 0.1 };
            let mut cleaned = record.clone();
            let found = hampel.clean(&mut cleaned);
            let expected = by_sorting(hampel, &record);
            for k in 0..record.len() {
                prop_assert!(cleaned[k].to_bits() == expected[k].to_bits());
                prop_assert!(found.contains(&k) || cleaned[k].to_bits() == record[k].to_bits());
            }
        }
    }

    #[test]
    fn the_greatest_values_do_not_overflow() {
        let mut record = [f64::MAX; 4];
        let hampel = Hampel { width: 4, threshold: 1.0, least_deviation: 0.0 };
        assert_eq!(hampel.clean(&mut record), []);
    }
}
