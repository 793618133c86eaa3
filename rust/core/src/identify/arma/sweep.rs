//! One pass over a record: conditional residuals, their derivatives, and all products of these.

use pulp::{Simd, WithSimd};

use super::columns::{Columns, Sums};
use super::products::against;
use super::recursion::{BLOCK, HISTORY, Line, Recursion};
use super::series::Series;

/// What is left of an impulse once it no longer counts beside noise of unit size.
const GONE: f64 = 1e-18;

/// A model and the residuals that are asked of it.
#[derive(Debug, Clone, Copy)]
pub struct Sweep<'a, const Q: usize> {
    pub series: &'a Series,
    pub phi: &'a [f64],
    pub theta: &'a [f64],
    pub constant: f64,
    pub has_constant: bool,
    pub skip: usize,
}

/// Blocks of the residuals `e`, of `u = y/θ(B)`, `v = e/θ(B)`, `w = v/θ(B)`, `x = u/θ(B)`,
/// `g = 1/θ(B)` and the impulse response `h`, each from zero at the first sample of a stretch.
#[derive(Debug)]
struct Lines {
    e: Line,
    u: Line,
    v: Line,
    w: Line,
    x: Line,
    g: Line,
    h: Line,
}

impl Lines {
    fn new() -> Self {
        let zero = [0.0; HISTORY + BLOCK];
        Self { e: zero, u: zero, v: zero, w: zero, x: zero, g: zero, h: zero }
    }

    /// Keeps the end of a block of `n` samples as the history of the next.
    #[inline(always)]
    fn carry(&mut self, n: usize) {
        for line in self.all() {
            line.copy_within(n..n + HISTORY, 0);
        }
    }

    #[inline(always)]
    fn all(&mut self) -> [&mut Line; 7] {
        let Self { e, u, v, w, x, g, h } = self;
        [e, u, v, w, x, g, h]
    }
}

impl<const Q: usize> WithSimd for Sweep<'_, Q> {
    type Output = Sums;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Sums {
        let mut total = Sums::default();
        let mut lines = Lines::new();
        for stretch in &self.series.stretches {
            lines.all().into_iter().for_each(|line| line[..HISTORY].fill(0.0));
            self.stretch(simd, &self.series.values[stretch.clone()], &mut lines, &mut total);
        }
        total
    }
}

impl<const Q: usize> Sweep<'_, Q> {
    /// What is before a stretch is taken as zero: its samples at the mean of the record, and no
    /// innovations. Were a single sample taken for the level, its noise would stay as long as the
    /// drift's, and no faint drift would be worth it.
    #[inline(always)]
    fn stretch<S: Simd>(&self, simd: S, y: &[f64], lines: &mut Lines, total: &mut Sums) {
        let recursion = Recursion::<S, Q>::new(simd, self.theta);
        let mut is_young = true;
        let skip = self.skip.min(y.len());
        let summed =
            (skip..y.len()).step_by(BLOCK).map(|start| (start, BLOCK.min(y.len() - start)));
        for (start, n) in std::iter::once((0, skip)).chain(summed) {
            self.put_inputs(y, start, n, lines);
            let Lines { e, u, v, w, x, g, h } = lines;
            recursion.run_repeatedly([e, v, w], [u, x], n);
            if is_young {
                g[HISTORY..].fill(1.0);
                h[HISTORY..].fill(0.0);
                h[HISTORY] = f64::from(u8::from(start == 0));
                recursion.run([g, h], n);
            }
            if start >= self.skip {
                self.columns(lines, n).add_products(simd, &mut total.products);
                self.add_bends(simd, lines, n, total);
            }
            lines.carry(n);
            if is_young && start > 0 && lines.h[..HISTORY].iter().all(|h| h.abs() < GONE) {
                is_young = false;
                let settled = lines.g[HISTORY - 1];
                lines.g.fill(settled);
            }
        }
    }

    /// `y_t` for `u`, and what the residual would be without moving average for `e`.
    #[inline(always)]
    fn put_inputs(&self, y: &[f64], start: usize, n: usize, lines: &mut Lines) {
        lines.u[HISTORY..HISTORY + n].copy_from_slice(&y[start..start + n]);
        let e = &mut lines.e[HISTORY..HISTORY + n];
        for (e, y) in e.iter_mut().zip(&y[start..]) {
            *e = y - self.constant;
        }
        for (i, phi) in self.phi.iter().enumerate() {
            let absent = (i + 1).saturating_sub(start).min(n);
            for (e, y) in e[absent..].iter_mut().zip(&y[(start + absent).saturating_sub(i + 1)..]) {
                *e -= phi * y;
            }
        }
    }

    #[inline(always)]
    fn columns<'a>(&self, lines: &'a Lines, n: usize) -> Columns<'a> {
        let mut columns = Columns::new(n);
        (0..self.phi.len()).for_each(|i| columns.push(&lines.u, i + 1));
        (0..self.theta.len()).for_each(|j| columns.push(&lines.v, j + 1));
        if self.has_constant {
            columns.push(&lines.g, 0);
        }
        columns.push(&lines.e, 0);
        columns
    }

    /// The second derivatives by `φ_i` and `θ_j` are `x_{t-i-j}`, those by `θ_i` and `θ_j` are
    /// `2 w_{t-i-j}`.
    #[inline(always)]
    fn add_bends<S: Simd>(&self, simd: S, lines: &Lines, n: usize, total: &mut Sums) {
        let (p, q) = (self.phi.len(), self.theta.len());
        let e = &lines.e[HISTORY..][..n];
        if q > 0 {
            add_lagged(simd, e, &lines.w, 2 * q, &mut total.theta_bends);
        }
        if p > 0 && q > 0 {
            add_lagged(simd, e, &lines.x, p + q, &mut total.phi_bends);
        }
    }
}

/// Adds the sums of the products of `e` and a line that is late by 2 to `highest` samples.
#[inline(always)]
fn add_lagged<S: Simd>(
    simd: S,
    e: &[f64],
    line: &Line,
    highest: usize,
    sums: &mut [f64; HISTORY + 1],
) {
    let mut slices = [e; HISTORY + 1];
    let mut row = [0.0; HISTORY + 1];
    for lag in 2..=highest {
        slices[lag] = &line[HISTORY - lag..][..e.len()];
    }
    against(simd, e, &slices[2..=highest], &mut row[2..=highest]);
    for lag in 2..=highest {
        sums[lag] += row[lag];
    }
}
