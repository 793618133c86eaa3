//! Sums of the products of columns of which some are others, later.

use pulp::Simd;

use super::MAX_ORDER;
use super::products::against;
use super::recursion::{HISTORY, Line};

/// Derivatives by all coefficients and the constant, and the residual.
pub const COLUMNS: usize = 2 * MAX_ORDER + 2;

/// Sums of the products of any two columns.
pub type Products = [[f64; COLUMNS]; COLUMNS];

const EMPTY: Line = [0.0; HISTORY + super::recursion::BLOCK];

/// What a pass over a record sums up.
#[derive(Debug, Clone)]
pub struct Sums {
    /// Of any two columns, the lower triangle.
    pub products: Products,
    /// Of the residuals and their second derivatives by `φ_i` and `θ_j`, at i + j.
    pub phi_bends: [f64; HISTORY + 1],
    /// Half of those by `θ_i` and `θ_j`, at i + j.
    pub theta_bends: [f64; HISTORY + 1],
}

impl Default for Sums {
    fn default() -> Self {
        let bends = [0.0; HISTORY + 1];
        let products = [[0.0; COLUMNS]; COLUMNS];
        Self { products, phi_bends: bends, theta_bends: bends }
    }
}

/// Columns of a block of `n` samples: lines, late by 0 to [`HISTORY`] samples.
#[derive(Debug)]
pub struct Columns<'a> {
    lines: [(&'a Line, usize); COLUMNS],
    count: usize,
    n: usize,
}

impl<'a> Columns<'a> {
    #[inline(always)]
    pub fn new(n: usize) -> Self {
        Self { lines: [(&EMPTY, 0); COLUMNS], count: 0, n }
    }

    #[inline(always)]
    pub fn push(&mut self, line: &'a Line, lag: usize) {
        self.lines[self.count] = (line, lag);
        self.count += 1;
    }

    /// A product of two columns that are both one sample later than the columns before them is
    /// that of those but for its two ends; only the others are summed.
    #[inline(always)]
    pub fn add_products<S: Simd>(&self, simd: S, total: &mut Products) {
        let mut block = [[0.0; COLUMNS]; COLUMNS];
        let mut slices: [&[f64]; COLUMNS] = [&[]; COLUMNS];
        for i in 0..self.count {
            slices[i] = self.slice(i);
        }
        for i in 0..self.count {
            if self.is_shift(i) {
                for j in (1..=i).filter(|j| self.is_shift(*j)) {
                    block[i][j] = block[i - 1][j - 1] + self.ends(i, j);
                }
                continue;
            }
            // Shifts that stand behind need their products with this column, too.
            let reach = self.shifts_end().max(i + 1);
            let mut row = [0.0; COLUMNS];
            against(simd, slices[i], &slices[..reach], &mut row[..reach]);
            for j in 0..reach {
                block[i.max(j)][i.min(j)] = row[j];
            }
        }
        for i in 0..self.count {
            for j in 0..=i {
                total[i][j] += block[i][j];
            }
        }
    }

    #[inline(always)]
    fn slice(&self, i: usize) -> &'a [f64] {
        let (line, lag) = self.lines[i];
        &line[HISTORY - lag..][..self.n]
    }

    #[inline(always)]
    fn is_shift(&self, i: usize) -> bool {
        self.lines[i].1 > 1
    }

    #[inline(always)]
    fn shifts_end(&self) -> usize {
        (0..self.count).rfind(|i| self.is_shift(*i)).map_or(0, |i| i + 1)
    }

    /// First product of the shifted pair less the last one of the pair before.
    #[inline(always)]
    fn ends(&self, i: usize, j: usize) -> f64 {
        let ((a, late_a), (b, late_b)) = (self.lines[i], self.lines[j]);
        let end = HISTORY + self.n;
        a[HISTORY - late_a] * b[HISTORY - late_b] - a[end - late_a] * b[end - late_b]
    }
}
