//! MDEV, TDEV: second differences of the phase, averaged over m neighbours.

use std::array::from_fn;

use super::lanes::Lanes;
use super::record::Record;

/// Terms of a block.
const BLOCK: usize = 512;

/// Factors that one loop adds up side by side, since each addition waits for the one before.
pub const GROUP: usize = 8;

type Steps = [[f64; BLOCK]; GROUP];

/// Sums over all j of the squared sum of the second differences j to j + m, at each factor.
pub fn sums(record: &Record, factors: &[usize]) -> Vec<f64> {
    let mut squares = [0.0; GROUP];
    let mut steps: Steps = [[0.0; BLOCK]; GROUP];
    for x in record.stretches() {
        let mut windows = [0.0; GROUP];
        let terms = |m: usize| (x.len() + 1).saturating_sub(m.saturating_mul(3));
        let most = factors.iter().map(|m| terms(*m)).max().unwrap_or(0);
        for start in (0..most).step_by(BLOCK) {
            for (g, m) in factors.iter().enumerate() {
                let window = Window { x, m: *m, terms: terms(*m), lanes: record.lanes() };
                squares[g] += window.advance(start, &mut windows[g], &mut steps[g]);
            }
            scan(&steps, &mut windows, &mut squares);
        }
    }
    squares[..factors.len()].to_vec()
}

/// Adds up the squares of all windows that slide along a block.
fn scan(steps: &Steps, windows: &mut [f64; GROUP], squares: &mut [f64; GROUP]) {
    // More at a time than four would not stay in registers.
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

/// The sum of m second differences, which slides along a stretch.
struct Window<'a> {
    x: &'a [f64],
    m: usize,
    terms: usize,
    lanes: Lanes,
}

impl Window<'_> {
    /// Puts the steps of a block that is all terms into `steps`; of a block that is not, adds up
    /// what there is itself and leaves a window that stays zero.
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

    /// Terms after which the sum is made anew: rounding errors gather on the way, and a new sum
    /// costs m additions.
    fn renewal(&self) -> usize {
        (16 * self.m).max(1 << 16).next_multiple_of(BLOCK)
    }

    fn at(&self, j: usize) -> f64 {
        let slices = [0, 1, 2].map(|k| &self.x[j + k * self.m..j + (k + 1) * self.m]);
        self.lanes.sum_of_second_differences(slices)
    }

    fn put_steps(&self, start: usize, steps: &mut [f64]) {
        let slices = [0, 1, 2, 3].map(|k| &self.x[start + k * self.m..][..steps.len()]);
        self.lanes.put_third_differences(slices, steps);
    }
}
