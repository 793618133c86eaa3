//! MTOTDEV, TTOTDEV, HTOTDEV: every window of 3 m points without its slope, reflected at both ends.
//!
//! The reflected window repeats after 6 m points and is symmetric about both ends of the window, so
//! half of the positions tell all, and its running sum is odd about both ends.

use pulp::{Simd, WithSimd};

use super::differences;
use super::lanes::{Lanes, squared_differences};
use super::record::Record;

/// Mean squares of windows of phase, added up at each factor.
pub fn of_phase(record: &Record, factors: &[usize]) -> Vec<f64> {
    let sum_at = |m: &usize| record.stretches().map(|x| sum(x, *m, record.lanes())).sum();
    factors.iter().map(sum_at).collect()
}

/// Mean squares of windows of rate, added up at each factor; at 1, those of OHDEV.
pub fn of_rate(record: &Record, factors: &[usize]) -> Vec<f64> {
    let sum_at = |m: &usize| match m {
        1 => differences::overlapping::<4>(record, &[1])[0],
        _ => record.stretches().map(|x| sum(&rates(x), *m, record.lanes())).sum(),
    };
    factors.iter().map(sum_at).collect()
}

fn rates(x: &[f64]) -> Vec<f64> {
    x.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// Sum over all windows of 3 m values.
fn sum(values: &[f64], m: usize, lanes: Lanes) -> f64 {
    let Some(last) = values.len().checked_sub(m.saturating_mul(3)) else { return 0.0 };
    let mut windows = Windows::new(m);
    // One running sum serves as many windows as a window has values, and stays short: precise.
    let share = (3 * m).max(64);
    let starts = (0..=last).step_by(share);
    starts
        .map(|start| {
            let count = share.min(last + 1 - start);
            lanes.run(windows.over(&values[start..start + count - 1 + 3 * m]))
        })
        .sum()
}

/// Buffers for the windows of one factor.
struct Windows {
    m: usize,
    /// 0, 1, … 3 m.
    index: Vec<f64>,
    /// Sums of the first k values.
    running: Vec<f64>,
    /// Running sum of the window and of half a reflection on either side.
    odd: Vec<f64>,
}

impl Windows {
    fn new(m: usize) -> Self {
        let index = (0..=3 * m).map(|k| k as f64).collect();
        Self { m, index, running: Vec::new(), odd: vec![0.0; 3 * m + 3 * m / 2 * 2 + 1] }
    }

    /// The windows of `values`, which begin at all but its last 3 m - 1.
    fn over(&mut self, values: &[f64]) -> Over<'_> {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        self.running.clear();
        self.running.push(0.0);
        self.running.extend(values.iter().scan(0.0, |sum, value| {
            *sum += value - mean;
            Some(*sum)
        }));
        Over(self)
    }

    /// Puts down the running sum of the window at `start`, without mean and slope.
    #[inline(always)]
    fn reflect(&mut self, start: usize) {
        let length = 3 * self.m;
        let sums = &self.running[start..=start + length];
        let half = length / 2;
        let (first, last) = (sums[half] - sums[0], sums[length] - sums[length - half]);
        let slope = (last - first) / (half as f64 * (length - half) as f64);
        let mean = (sums[length] - sums[0]) / length as f64;
        let (offset, bend) = (mean - 0.5 * slope * length as f64, 0.5 * slope);
        let (before, rest) = self.odd.split_at_mut(half);
        let (window, after) = rest.split_at_mut(length + 1);
        for ((q, sum), k) in window.iter_mut().zip(sums).zip(&self.index) {
            *q = (sum - sums[0]) - k * (offset + bend * k);
        }
        before.iter_mut().rev().zip(&window[1..]).for_each(|(mirror, q)| *mirror = -q);
        after.iter_mut().zip(window[..length].iter().rev()).for_each(|(mirror, q)| *mirror = -q);
    }

    /// Mean square over all 6 m positions.
    #[inline(always)]
    fn mean_square<S: Simd>(&self, simd: S) -> f64 {
        let (m, last) = (self.m, 3 * self.m / 2 * 2);
        let slices = [0, m, 2 * m, 3 * m].map(|from| &self.odd[from..=from + last]);
        let squared = |p: usize| squared_differences(simd, slices.map(|slice| &slice[p..=p]));
        let half = squared_differences(simd, slices);
        // An even number of points has its first and last position only once in a period.
        let ends = if m.is_multiple_of(2) { squared(0) + squared(last) } else { 0.0 };
        (2.0 * half - ends) / (6.0 * (m as f64).powi(3))
    }
}

struct Over<'a>(&'a mut Windows);

impl WithSimd for Over<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let windows = self.0;
        (0..windows.running.len() - 3 * windows.m)
            .map(|start| {
                windows.reflect(start);
                windows.mean_square(simd)
            })
            .sum()
    }
}
