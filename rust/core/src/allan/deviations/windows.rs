//! MDEV, TDEV, PDEV, MTOTDEV, TTOTDEV and HTOTDEV: sums over sliding windows of the phase.

use std::array::from_fn;

use pulp::{Arch, Simd, WithSimd};

use super::differences;
use super::kernels::{PutThirdDifferences, SecondDifferences, squared_differences};
use super::record::Record;
use crate::work;

/// Number of terms in a block.
const BLOCK: usize = 512;

/// Number of factors that one loop sums together, since each addition waits for the previous one.
pub const GROUP: usize = 8;

type Steps = [[f64; BLOCK]; GROUP];

/// MDEV, TDEV: sums over all j of the squared sum of the second differences from j to j + m, at
/// each factor.
pub fn modified(record: &Record, factors: &[usize]) -> Vec<f64> {
    let mut squares = [0.0; GROUP];
    let mut steps: Steps = [[0.0; BLOCK]; GROUP];
    for x in record.segments() {
        let mut windows = [0.0; GROUP];
        let terms = |m: usize| (x.len() + 1).saturating_sub(m.saturating_mul(3));
        let most = factors.iter().map(|m| terms(*m)).max().unwrap_or(0);
        for start in (0..most).step_by(BLOCK) {
            work::pause();
            for (g, m) in factors.iter().enumerate() {
                let window = Window { x, m: *m, terms: terms(*m), arch: record.arch() };
                squares[g] += window.advance(start, &mut windows[g], &mut steps[g]);
            }
            scan(&steps, &mut windows, &mut squares);
        }
    }
    squares[..factors.len()].to_vec()
}

/// Adds the squares of all windows that slide along a block.
fn scan(steps: &Steps, windows: &mut [f64; GROUP], squares: &mut [f64; GROUP]) {
    // More than four at a time would not fit in registers.
    for first in (0..GROUP).step_by(4) {
        let steps: [&[f64; BLOCK]; 4] = from_fn(|g| &steps[first + g]);
        let (mut sums, mut block) = (from_fn::<_, 4, _>(|g| windows[first + g]), [0.0; 4]);
        for k in 0..BLOCK {
            for g in 0..4 {
                block[g] += sums[g] * sums[g];
                sums[g] += steps[g][k];
            }
        }
        windows[first..first + 4].copy_from_slice(&sums);
        squares[first..first + 4].iter_mut().zip(block).for_each(|(square, sum)| *square += sum);
    }
}

/// Sum of m second differences, which slides along a segment.
struct Window<'a> {
    x: &'a [f64],
    m: usize,
    terms: usize,
    arch: Arch,
}

impl Window<'_> {
    /// Writes the steps of a block to `steps` if all of it are terms. Otherwise it adds the terms
    /// itself and leaves a window that stays zero.
    fn advance(&self, start: usize, sum: &mut f64, steps: &mut [f64; BLOCK]) -> f64 {
        if start >= self.terms {
            return 0.0;
        }
        if start.is_multiple_of(self.renewal()) {
            *sum = self.at(start);
        }
        let full = start + BLOCK <= self.terms;
        let count = BLOCK.min(self.terms - 1 - start);
        self.put_steps(start, &mut steps[..count]);
        steps[count..].fill(0.0);
        if full {
            return 0.0;
        }
        let squares = steps[..=count].iter().map(|step| {
            let square = *sum * *sum;
            *sum += step;
            square
        });
        let squares = squares.sum();
        *sum = 0.0;
        steps.fill(0.0);
        squares
    }

    /// Number of terms after which the sum is computed again. Rounding errors accumulate, and a new
    /// sum takes m additions.
    fn renewal(&self) -> usize {
        (16 * self.m).max(1 << 16).next_multiple_of(BLOCK)
    }

    fn at(&self, j: usize) -> f64 {
        let slices = [0, 1, 2].map(|k| &self.x[j + k * self.m..j + (k + 1) * self.m]);
        self.arch.dispatch(SecondDifferences(slices))
    }

    fn put_steps(&self, start: usize, steps: &mut [f64]) {
        let slices = [0, 1, 2, 3].map(|k| &self.x[start + k * self.m..][..steps.len()]);
        self.arch.dispatch(PutThirdDifferences { slices, out: steps });
    }
}

/// PDEV: sums of the squared differences between the slopes of least-squares lines through adjacent
/// clusters of the phase, at each factor.
pub fn parabolic(record: &Record, factors: &[usize]) -> Vec<f64> {
    factors.iter().map(|m| parabolic_at(record, *m)).collect()
}

fn parabolic_at(record: &Record, m: usize) -> f64 {
    if m == 1 {
        return differences::overlapping::<3>(record, &[1])[0];
    }
    // Two sliding sums accumulate rounding errors faster than one and are computed again more
    // often.
    let renewal = (4 * m).max(256);
    let mut sum = 0.0;
    for x in record.segments() {
        let terms = x.len().saturating_sub(m.saturating_mul(2));
        for start in (0..terms).step_by(renewal) {
            work::pause();
            sum += parabolic_block(&x[start..], m, renewal.min(terms - start));
        }
    }
    sum
}

/// The first `terms` terms of `x`, the first one by its definition.
fn parabolic_block(x: &[f64], m: usize, terms: usize) -> f64 {
    let drop = |i: usize| x[i] - x[i + m];
    let lever = (m - 1) as f64 / 2.0;
    let mut level: f64 = (0..m).map(drop).sum();
    let mut slope: f64 = (0..m).map(|k| (lever - k as f64) * drop(k)).sum();
    let mut sum = slope * slope;
    for i in 0..terms - 1 {
        let (leaving, entering) = (drop(i), drop(i + m));
        slope += level - (lever + 1.0) * leaving - lever * entering;
        level += entering - leaving;
        sum += slope * slope;
    }
    sum
}

/// MTOTDEV, TTOTDEV: mean squares of reflected windows of phase, added up at each factor.
pub fn modified_total(record: &Record, factors: &[usize]) -> Vec<f64> {
    let sum_at = |m: &usize| record.segments().map(|x| reflected_sum(x, *m, record.arch())).sum();
    factors.iter().map(sum_at).collect()
}

/// HTOTDEV: mean squares of reflected windows of rate, added at each factor; at factor 1, the
/// squares of OHDEV.
pub fn hadamard_total(record: &Record, factors: &[usize]) -> Vec<f64> {
    let sum_at = |m: &usize| match m {
        1 => differences::overlapping::<4>(record, &[1])[0],
        _ => record.segments().map(|x| reflected_sum(&rates(x), *m, record.arch())).sum(),
    };
    factors.iter().map(sum_at).collect()
}

fn rates(x: &[f64]) -> Vec<f64> {
    work::collect(x.windows(2).map(|pair| pair[1] - pair[0]))
}

/// Sum over all windows of 3 m values, each without its slope and reflected at its ends.
///
/// A reflected window repeats after 6 m points and is symmetric about its ends. Half of the
/// positions are therefore enough, and its running sum is odd about its ends.
fn reflected_sum(values: &[f64], m: usize, arch: Arch) -> f64 {
    let Some(last) = values.len().checked_sub(m.saturating_mul(3)) else { return 0.0 };
    let mut windows = Reflected::new(m);
    // One running sum serves as many windows as a window has values, and stays short and precise.
    let share = share(m);
    let starts = (0..=last).step_by(share);
    starts
        .map(|start| {
            let count = share.min(last + 1 - start);
            arch.dispatch(windows.over(&values[start..start + count - 1 + 3 * m]))
        })
        .sum()
}

/// Number of windows that one running sum serves.
fn share(m: usize) -> usize {
    (3 * m).max(64)
}

/// Buffers for the windows of one factor.
struct Reflected {
    m: usize,
    /// 0, 1, … 3 m.
    index: Vec<f64>,
    /// Sums of the first k values.
    running: Vec<f64>,
    /// Running sum of the window and of half a reflection on each side.
    odd: Vec<f64>,
}

impl Reflected {
    fn new(m: usize) -> Self {
        let index = work::collect((0..=3 * m).map(|k| k as f64));
        let odd = work::filled(0.0, 3 * m + 3 * m / 2 * 2 + 1);
        Self { m, index, running: work::room(2 * share(m)), odd }
    }

    /// The windows of `values`; they begin at all values except the last 3 m - 1.
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

    /// Stores the running sum of the window at `start`, without mean and slope.
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
        // With an even number of points, the first and last positions occur only once in a period.
        let ends = if m.is_multiple_of(2) { squared(0) + squared(last) } else { 0.0 };
        (2.0 * half - ends) / (6.0 * (m as f64).powi(3))
    }
}

/// Number of samples of reflected windows between two checks for a stop.
const SAMPLES_PER_CHECK: usize = 1 << 16;

struct Over<'a>(&'a mut Reflected);

impl WithSimd for Over<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let windows = self.0;
        let often = (SAMPLES_PER_CHECK / windows.m).max(1);
        (0..windows.running.len() - 3 * windows.m)
            .map(|start| {
                if start.is_multiple_of(often) {
                    work::pause();
                }
                windows.reflect(start);
                windows.mean_square(simd)
            })
            .sum()
    }
}
