//! Sum of the squares of the conditional residuals, with its derivatives.

use std::ops::SubAssign;

use nalgebra::{DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};

use super::MAX_ORDER;
use super::columns::{BLOCK, Columns, HISTORY, Line, Sums, against};
use super::descent::{Normal, Problem};
use super::partial::{self, MAX_COORDINATE, from_free, negated, to_nearest_free};
use super::series::Series;
use crate::work;

/// ARMA(p, q) on one record; a point has `φ`, the free coordinates of `θ`, and the constant.
#[derive(Debug, Clone)]
pub struct Conditional<'a> {
    series: &'a Series,
    pub p: usize,
    pub q: usize,
    has_constant: bool,
    skip: usize,
    bounds: Vec<f64>,
    arch: Arch,
}

impl<'a> Conditional<'a> {
    /// Each segment omits its first `skip` samples, at least `p`.
    pub fn new(series: &'a Series, p: usize, q: usize, has_constant: bool, skip: usize) -> Self {
        let mut bounds = vec![f64::INFINITY; p + q + usize::from(has_constant)];
        bounds[p..p + q].fill(MAX_COORDINATE);
        Self { series, p, q, has_constant, skip, bounds, arch: Arch::new() }
    }

    /// The same residuals for another order.
    pub fn of_order(&self, p: usize, q: usize) -> Self {
        Self::new(self.series, p, q, self.has_constant, self.skip)
    }

    /// `[φ, θ, c]` at a point.
    pub fn coefficients(&self, point: &[f64]) -> Vec<f64> {
        let free = &point[self.p..self.p + self.q];
        let mut coefficients = point.to_vec();
        coefficients[self.p..self.p + self.q].copy_from_slice(&negated(&from_free(free)));
        coefficients
    }

    /// The point of `[φ, θ, c]`; `θ` is moved inside the unit circle if necessary.
    pub fn point(&self, coefficients: &[f64]) -> Vec<f64> {
        let free = to_nearest_free(&negated(&coefficients[self.p..self.p + self.q]));
        let mut point = coefficients.to_vec();
        point[self.p..self.p + self.q].copy_from_slice(&free);
        point
    }

    /// Normal equations in `[φ, θ, c]`.
    pub fn natural(&self, coefficients: &[f64]) -> Normal {
        let sums = match self.q {
            0 => self.sums::<0>(coefficients),
            1 => self.sums::<1>(coefficients),
            2 => self.sums::<2>(coefficients),
            3 => self.sums::<3>(coefficients),
            _ => self.sums::<MAX_ORDER>(coefficients),
        };
        self.of_sums(&sums)
    }

    /// Normal equations in `[φ, θ, c]` from the sums of a pass.
    fn of_sums(&self, sums: &Sums) -> Normal {
        let (m, products) = (self.bounds.len(), &sums.products);
        Normal {
            gram: DMatrix::from_fn(m, m, |i, j| products[i.max(j)][i.min(j)]),
            curvature: DMatrix::from_fn(m, m, |i, j| self.curvature(sums, i.max(j), i.min(j))),
            descent: DVector::from_fn(m, |i, _| products[m][i]),
            sum_of_squares: products[m][m],
        }
    }

    /// Normal equations at a point from the sums of a pass at this point.
    pub fn at_point(&self, point: &[f64], sums: &Sums) -> Normal {
        self.in_free(point, self.of_sums(sums))
    }

    /// Normal equations in `[φ, θ, c]`, converted to the coordinates of a point.
    fn in_free(&self, point: &[f64], natural: Normal) -> Normal {
        let (corner, size) = ((self.p, self.p), (self.q, self.q));
        let free = &point[self.p..self.p + self.q];
        let mut slopes = DMatrix::identity(point.len(), point.len());
        slopes.view_mut(corner, size).copy_from(&-partial::jacobian(free));
        let weights = -natural.descent.rows(self.p, self.q);
        let mut normal = natural.transform(&slopes);
        normal.curvature.view_mut(corner, size).sub_assign(&partial::hessian(free, &weights));
        normal
    }

    /// Sum of the residuals times their second derivatives by coefficients `i >= j`.
    fn curvature(&self, sums: &Sums, i: usize, j: usize) -> f64 {
        let (p, end) = (self.p, self.p + self.q);
        match (i, j) {
            _ if i < p || i >= end => 0.0,
            _ if j < p => sums.phi_curvatures[(i - p + 1) + (j + 1)],
            _ => 2.0 * sums.theta_curvatures[(i - p + 1) + (j - p + 1)],
        }
    }

    /// Sums of squares only, at points of an order with a moving average, many in one pass.
    pub fn sums_of_squares(&self, points: &[Vec<f64>]) -> Vec<f64> {
        let all: Vec<_> = points.iter().map(|point| self.coefficients(point)).collect();
        match self.q {
            0 | 1 => self.arch.dispatch(Trials::<1> { problem: self, all: &all }),
            2 => self.arch.dispatch(Trials::<2> { problem: self, all: &all }),
            3 => self.arch.dispatch(Trials::<3> { problem: self, all: &all }),
            _ => self.arch.dispatch(Trials::<MAX_ORDER> { problem: self, all: &all }),
        }
    }

    fn sums<const Q: usize>(&self, coefficients: &[f64]) -> Sums {
        let (phi, rest) = coefficients.split_at(self.p);
        let (theta, constant) = rest.split_at(self.q);
        self.arch.dispatch(Sweep::<Q> {
            series: self.series,
            phi,
            theta,
            constant: constant.first().copied().unwrap_or(0.0),
            has_constant: self.has_constant,
            skip: self.skip,
        })
    }
}

impl Problem for Conditional<'_> {
    fn normal(&self, point: &[f64]) -> Normal {
        self.in_free(point, self.natural(&self.coefficients(point)))
    }

    fn bounds(&self) -> &[f64] {
        &self.bounds
    }

    fn count(&self) -> usize {
        self.series.residuals(self.skip)
    }
}

/// Residuals of several models of one order at once, one model per lane.
#[derive(Debug, Clone, Copy)]
struct Trials<'a, const Q: usize> {
    problem: &'a Conditional<'a>,
    all: &'a [Vec<f64>],
}

/// Number of vectors that advance together: a single one would wait for its own additions.
const PACKS: usize = 2;

/// Largest number of lanes in all vectors together.
const LANES: usize = 8 * PACKS;

impl<const Q: usize> WithSimd for Trials<'_, Q> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
        let mut sums = Vec::with_capacity(self.all.len());
        for models in self.all.chunks(PACKS * S::F64_LANES) {
            sums.extend_from_slice(&self.together(simd, models)[..models.len()]);
        }
        sums
    }
}

impl<const Q: usize> Trials<'_, Q> {
    #[inline(always)]
    fn together<S: Simd>(&self, simd: S, models: &[Vec<f64>]) -> [f64; LANES] {
        let (p, q) = (self.problem.p, self.problem.q);
        let zero = [simd.splat_f64s(0.0); PACKS];
        let (mut phi, mut theta) = ([zero; MAX_ORDER], [zero; Q]);
        for i in 0..p {
            phi[i] = negated_lanes(simd, models, i);
        }
        for j in 0..q {
            theta[j] = negated_lanes(simd, models, p + j);
        }
        let constant = negated_lanes(simd, models, p + q);
        let mut total = [0.0; LANES];
        for segment in &self.problem.series.segments {
            let y = &self.problem.series.values[segment.clone()];
            let skip = self.problem.skip.min(y.len());
            let mut past = [zero; Q];
            let mut start = 0;
            while start < y.len() {
                work::pause();
                let end = if start < skip { skip } else { y.len().min(start + BLOCK) };
                let mut sums = zero;
                for t in start..end {
                    let mut e = constant;
                    for k in 0..PACKS {
                        e[k] = simd.add_f64s(e[k], simd.splat_f64s(y[t]));
                        for i in 0..p.min(t) {
                            let before = simd.splat_f64s(y[t - 1 - i]);
                            e[k] = simd.mul_add_e_f64s(phi[i][k], before, e[k]);
                        }
                        for j in (0..Q).rev() {
                            e[k] = simd.mul_add_e_f64s(theta[j][k], past[j][k], e[k]);
                        }
                        sums[k] = simd.mul_add_e_f64s(e[k], e[k], sums[k]);
                    }
                    for j in (1..Q).rev() {
                        past[j] = past[j - 1];
                    }
                    past[0] = e;
                }
                if start >= skip {
                    add_lanes(simd, &sums, &mut total);
                }
                start = end;
            }
        }
        total
    }
}

/// Minus the coefficients with one index, one model per lane; zero for unused lanes.
#[inline(always)]
fn negated_lanes<S: Simd>(simd: S, models: &[Vec<f64>], index: usize) -> [S::f64s; PACKS] {
    let mut lanes = [0.0; LANES];
    for (lane, model) in lanes.iter_mut().zip(models) {
        *lane = -model.get(index).copied().unwrap_or(0.0);
    }
    let mut packs = [simd.splat_f64s(0.0); PACKS];
    for k in 0..PACKS {
        packs[k] = simd.partial_load_f64s(&lanes[k * S::F64_LANES..][..S::F64_LANES]);
    }
    packs
}

/// Adds the sums of a block: a million squares are then summed precisely.
#[inline(always)]
fn add_lanes<S: Simd>(simd: S, sums: &[S::f64s; PACKS], total: &mut [f64; LANES]) {
    let mut lanes = [0.0; LANES];
    for k in 0..PACKS {
        simd.partial_store_f64s(&mut lanes[k * S::F64_LANES..][..S::F64_LANES], sums[k]);
    }
    for (total, sum) in total.iter_mut().zip(lanes) {
        *total += sum;
    }
}

/// Size below which an impulse has no effect next to noise of unit size.
const MIN_IMPULSE: f64 = 1e-18;

/// One pass over a record: residuals, their derivatives, and all products of these.
#[derive(Debug, Clone, Copy)]
struct Sweep<'a, const Q: usize> {
    series: &'a Series,
    phi: &'a [f64],
    theta: &'a [f64],
    constant: f64,
    has_constant: bool,
    skip: usize,
}

/// Blocks of the residuals `e`, of `u = y/θ(B)`, `v = e/θ(B)`, `w = v/θ(B)`, `x = u/θ(B)`,
/// `g = 1/θ(B)` and the impulse response `h`, each from zero at the first sample of a segment.
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

    /// Stores the end of a block of `n` samples as the history of the next block.
    #[inline(always)]
    fn shift_history(&mut self, n: usize) {
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
        for segment in &self.series.segments {
            lines.all().into_iter().for_each(|line| line[..HISTORY].fill(0.0));
            self.add_segment(simd, &self.series.values[segment.clone()], &mut lines, &mut total);
        }
        total
    }
}

impl<const Q: usize> Sweep<'_, Q> {
    /// Samples before a segment are zero: at the mean of the record, and without innovations. With
    /// a single sample as level, its noise would last as long as the drift's noise, and a faint
    /// drift would never be accepted.
    #[inline(always)]
    fn add_segment<S: Simd>(&self, simd: S, y: &[f64], lines: &mut Lines, total: &mut Sums) {
        let recursion = Recursion::<S, Q>::new(simd, self.theta);
        let mut is_transient = true;
        let skip = self.skip.min(y.len());
        let summed =
            (skip..y.len()).step_by(BLOCK).map(|start| (start, BLOCK.min(y.len() - start)));
        for (start, n) in std::iter::once((0, skip)).chain(summed) {
            work::pause();
            self.put_inputs(y, start, n, lines);
            let Lines { e, u, v, w, x, g, h } = lines;
            recursion.run_repeatedly([e, v, w], [u, x], n);
            if is_transient {
                g[HISTORY..].fill(1.0);
                h[HISTORY..].fill(0.0);
                h[HISTORY] = f64::from(u8::from(start == 0));
                recursion.run([g, h], n);
            }
            if start >= self.skip {
                self.columns(lines, n).add_products(simd, &mut total.products);
                self.add_curvatures(simd, lines, n, total);
            }
            lines.shift_history(n);
            if is_transient && start > 0 && lines.h[..HISTORY].iter().all(|h| h.abs() < MIN_IMPULSE)
            {
                is_transient = false;
                let settled = lines.g[HISTORY - 1];
                lines.g.fill(settled);
            }
        }
    }

    /// `y_t` for `u`, and for `e` the residual without the moving average.
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
    fn add_curvatures<S: Simd>(&self, simd: S, lines: &Lines, n: usize, total: &mut Sums) {
        let (p, q) = (self.phi.len(), self.theta.len());
        let e = &lines.e[HISTORY..][..n];
        if q > 0 {
            add_lagged(simd, e, &lines.w, 2 * q, &mut total.theta_curvatures);
        }
        if p > 0 && q > 0 {
            add_lagged(simd, e, &lines.x, p + q, &mut total.phi_curvatures);
        }
    }
}

/// Adds the sums of the products of `e` and a line delayed by 2 to `highest` samples.
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

/// `1/θ(B)`, for `Q` of at least the order of `θ`.
#[derive(Debug, Clone, Copy)]
struct Recursion<S, const Q: usize> {
    simd: S,
    minus_theta: [f64; Q],
}

impl<S: Simd, const Q: usize> Recursion<S, Q> {
    fn new(simd: S, theta: &[f64]) -> Self {
        let minus_theta = std::array::from_fn(|j| -theta.get(j).copied().unwrap_or(0.0));
        Self { simd, minus_theta }
    }

    /// Filters lines in place, all together: a single line would wait for its own additions.
    #[inline(always)]
    fn run<const K: usize>(&self, lines: [&mut Line; K], n: usize) {
        let mut past: [_; K] = std::array::from_fn(|k| last(lines[k]));
        for t in HISTORY..HISTORY + n {
            for k in 0..K {
                lines[k][t] = self.step(lines[k][t], &mut past[k]);
            }
        }
    }

    /// Filters `e` into `e`, the result into `v` and this into `w`; `u` into `u`, and the result
    /// into `x`.
    #[inline(always)]
    fn run_repeatedly(&self, [e, v, w]: [&mut Line; 3], [u, x]: [&mut Line; 2], n: usize) {
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

    /// The newest value is multiplied last: the next step waits only for it.
    #[inline(always)]
    fn step(&self, input: f64, past: &mut [f64; Q]) -> f64 {
        let mut output = input;
        for j in (0..Q).rev() {
            output = self.fuse(self.minus_theta[j], past[j], output);
        }
        for j in (1..Q).rev() {
            past[j] = past[j - 1];
        }
        if let Some(newest) = past.first_mut() {
            *newest = output;
        }
        output
    }

    /// `a b + c`, rounded once if the processor can, as its wide registers do.
    #[inline(always)]
    fn fuse(&self, a: f64, b: f64, c: f64) -> f64 {
        let _ = self.simd;
        if size_of::<S::f64s>() > size_of::<f64>() { a.mul_add(b, c) } else { a * b + c }
    }
}

/// The newest values before the block, the newest first.
#[inline(always)]
fn last<const Q: usize>(line: &Line) -> [f64; Q] {
    std::array::from_fn(|j| line[HISTORY - 1 - j])
}

#[cfg(test)]
mod tests {
    use super::Conditional;
    use crate::identification::arma::descent::Problem;
    use crate::identification::arma::series::Series;

    #[test]
    fn sums_side_by_side_are_those_of_one_point_each() {
        let mut values: Vec<f64> = (0..1500).map(|i| f64::from(i * i % 71)).collect();
        values[700] = f64::NAN;
        let series = Series::new(values, true);
        for (p, q) in [(0, 1), (1, 2), (3, 3), (2, 5)] {
            let problem = Conditional::new(&series, p, q, true, 3);
            let point = |k: usize| (0..=p + q).map(|i| 0.02 * ((k * i) % 17) as f64).collect();
            let points: Vec<Vec<f64>> = (0..21).map(point).collect();
            let sums = problem.sums_of_squares(&points);
            for (point, sum) in points.iter().zip(&sums) {
                let alone = problem.normal(point).sum_of_squares;
                // Of some thousand terms in another order.
                assert!((sum / alone - 1.0).abs() < 1e-12, "{sum} {alone}");
            }
            assert_eq!(sums.len(), points.len());
        }
    }
}
