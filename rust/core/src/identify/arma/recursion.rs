//! The filter `1/θ(B)` over blocks of samples.

use pulp::Simd;

use super::MAX_ORDER;

/// Samples in a block: with all lines at order 3 it stays in the first cache.
pub const BLOCK: usize = 512;
/// Values of the block before, in front of a block.
pub const HISTORY: usize = 2 * MAX_ORDER;

/// A block of one sequence and the end of the block before.
pub type Line = [f64; HISTORY + BLOCK];

/// `1/θ(B)`, for `Q` of at least the order of `θ`.
#[derive(Debug, Clone, Copy)]
pub struct Recursion<S, const Q: usize> {
    simd: S,
    minus_theta: [f64; Q],
}

impl<S: Simd, const Q: usize> Recursion<S, Q> {
    pub fn new(simd: S, theta: &[f64]) -> Self {
        let minus_theta = std::array::from_fn(|j| -theta.get(j).copied().unwrap_or(0.0));
        Self { simd, minus_theta }
    }

    /// Filters lines in place, all in step: each alone would wait for its own additions.
    #[inline(always)]
    pub fn run<const K: usize>(&self, lines: [&mut Line; K], n: usize) {
        let mut past: [_; K] = std::array::from_fn(|k| last(lines[k]));
        for t in HISTORY..HISTORY + n {
            for k in 0..K {
                lines[k][t] = self.step(lines[k][t], &mut past[k]);
            }
        }
    }

    /// Filters `e` into `e`, that into `v` and that into `w`; `u` into `u` and that into `x`.
    #[inline(always)]
    pub fn run_repeatedly(&self, [e, v, w]: [&mut Line; 3], [u, x]: [&mut Line; 2], n: usize) {
        let (mut past_e, mut past_v, mut past_w) = (last(e), last(v), last(w));
        let (mut past_u, mut past_x) = (last(u), last(x));
        for t in HISTORY..HISTORY + n {
            e[t] = self.step(e[t], &mut past_e);
            u[t] = self.step(u[t], &mut past_u);
            v[t] = self.step(e[t], &mut past_v);
            x[t] = self.step(u[t], &mut past_x);
            w[t] = self.step(v[t], &mut past_w);
        }
    }

    /// The newest value is multiplied last: the next step waits for nothing else.
    #[inline(always)]
    fn step(&self, input: f64, past: &mut [f64; Q]) -> f64 {
        let mut output = input;
        for j in (0..Q).rev() {
            output = self.fused(self.minus_theta[j], past[j], output);
        }
        for j in (1..Q).rev() {
            past[j] = past[j - 1];
        }
        if let Some(newest) = past.first_mut() {
            *newest = output;
        }
        output
    }

    /// `a b + c`, rounded once where the processor can, as it does on its wide registers.
    #[inline(always)]
    fn fused(&self, a: f64, b: f64, c: f64) -> f64 {
        let _ = self.simd;
        if size_of::<S::f64s>() > size_of::<f64>() { a.mul_add(b, c) } else { a * b + c }
    }
}

/// The newest values before the block, the newest first.
#[inline(always)]
fn last<const Q: usize>(line: &Line) -> [f64; Q] {
    std::array::from_fn(|j| line[HISTORY - 1 - j])
}
