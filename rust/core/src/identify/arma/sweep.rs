//! One pass over a record: conditional residuals, their derivatives, and all products of these.

use pulp::{Simd, WithSimd};

use super::MAX_ORDER;
use super::columns::{COLUMNS, Columns, Products};
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

/// Blocks of the residuals `e`, of `u = y/θ(B)`, `v = e/θ(B)`, `g = 1/θ(B)` and the impulse
/// response `h`, each from zero at the first residual, and of `y_{t-i}/θ(B)`, which is
/// `u_{t-i}` once the start is forgotten.
#[derive(Debug)]
struct Lines {
    e: Line,
    u: Line,
    v: Line,
    g: Line,
    h: Line,
    lagged: [Line; MAX_ORDER],
}

impl Lines {
    fn new() -> Self {
        let zero = [0.0; HISTORY + BLOCK];
        Self { e: zero, u: zero, v: zero, g: zero, h: zero, lagged: [zero; MAX_ORDER] }
    }

    fn all(&mut self) -> impl Iterator<Item = &mut Line> {
        let Self { e, u, v, g, h, lagged } = self;
        [e, u, v, g, h].into_iter().chain(lagged)
    }
}

impl<const Q: usize> WithSimd for Sweep<'_, Q> {
    type Output = Products;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Products {
        let mut total = [[0.0; COLUMNS]; COLUMNS];
        let mut lines = Lines::new();
        for stretch in &self.series.stretches {
            lines.all().for_each(|line| line[..HISTORY].fill(0.0));
            self.stretch(simd, &self.series.values[stretch.clone()], &mut lines, &mut total);
        }
        total
    }
}

impl<const Q: usize> Sweep<'_, Q> {
    #[inline(always)]
    fn stretch<S: Simd>(&self, simd: S, y: &[f64], lines: &mut Lines, total: &mut Products) {
        let recursion = Recursion::<S, Q>::new(simd, self.theta);
        let mut is_young = true;
        for start in (self.skip..y.len()).step_by(BLOCK) {
            let n = BLOCK.min(y.len() - start);
            self.put_inputs(y, start, n, lines);
            recursion.run_twice(&mut lines.e, &mut lines.u, &mut lines.v, n);
            if is_young {
                self.run_young(&recursion, y, start, n, lines);
            }
            self.columns(lines, n, is_young).add_products(simd, total);
            lines.all().for_each(|line| line.copy_within(n..n + HISTORY, 0));
            if is_young && lines.h[..HISTORY].iter().all(|h| h.abs() < GONE) {
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
        e.iter_mut().zip(&y[start..]).for_each(|(e, y)| *e = y - self.constant);
        for (i, phi) in self.phi.iter().enumerate() {
            e.iter_mut().zip(&y[start - 1 - i..]).for_each(|(e, y)| *e -= phi * y);
        }
    }

    /// The lines that differ from others only near a start.
    #[inline(always)]
    fn run_young<S: Simd>(
        &self,
        recursion: &Recursion<S, Q>,
        y: &[f64],
        start: usize,
        n: usize,
        lines: &mut Lines,
    ) {
        let Lines { g, h, lagged, .. } = lines;
        g[HISTORY..].fill(1.0);
        h[HISTORY..].fill(0.0);
        h[HISTORY] = f64::from(u8::from(start == self.skip));
        recursion.run([g, h], n);
        let p = self.phi.len();
        for (i, line) in lagged.iter_mut().enumerate().take(p) {
            line[HISTORY..HISTORY + n].copy_from_slice(&y[start - 1 - i..][..n]);
        }
        let (pairs, rest) = lagged[..p].as_chunks_mut::<2>();
        pairs.iter_mut().for_each(|[a, b]| recursion.run([a, b], n));
        rest.iter_mut().for_each(|line| recursion.run([line], n));
    }

    #[inline(always)]
    fn columns<'a>(&self, lines: &'a Lines, n: usize, is_young: bool) -> Columns<'a> {
        let mut columns = Columns::new(n);
        for i in 0..self.phi.len() {
            match is_young {
                true => columns.push(&lines.lagged[i], 0),
                false => columns.push(&lines.u, i + 1),
            }
        }
        (0..self.theta.len()).for_each(|j| columns.push(&lines.v, j + 1));
        if self.has_constant {
            columns.push(&lines.g, 0);
        }
        columns.push(&lines.e, 0);
        columns
    }
}
