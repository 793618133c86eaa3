//! Sums of the products of columns; some columns are others shifted in time.

use pulp::{NullaryFnOnce, Simd};

use super::MAX_ORDER;

/// Number of samples in a block: with all lines at order 3 it stays in the first-level cache.
pub const BLOCK: usize = 512;
/// Number of values of the previous block, stored before a block.
pub const HISTORY: usize = 2 * MAX_ORDER;

/// A block of one sequence, after the end of the previous block.
pub type Line = [f64; HISTORY + BLOCK];

/// Number of columns: derivatives by all coefficients and the constant, and the residual.
pub const COLUMNS: usize = 2 * MAX_ORDER + 2;

/// Sums of the products of any two columns.
pub type Products = [[f64; COLUMNS]; COLUMNS];

const EMPTY: Line = [0.0; HISTORY + BLOCK];

/// Sums of a pass over a record.
#[derive(Debug, Clone)]
pub struct Sums {
    /// Products of any two columns, in the lower triangle.
    pub products: Products,
    /// Products of the residuals and their second derivatives by `φ_i` and `θ_j`, at i + j.
    pub phi_curvatures: [f64; HISTORY + 1],
    /// Half of the products with second derivatives by `θ_i` and `θ_j`, at i + j.
    pub theta_curvatures: [f64; HISTORY + 1],
}

impl Default for Sums {
    fn default() -> Self {
        let zero = [0.0; HISTORY + 1];
        let products = [[0.0; COLUMNS]; COLUMNS];
        Self { products, phi_curvatures: zero, theta_curvatures: zero }
    }
}

/// Columns of a block of `n` samples: lines, delayed by 0 to [`HISTORY`] samples.
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

    /// If two columns are each one sample later than two earlier columns, their product equals the
    /// earlier product except for its ends. Only other products are summed.
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
            // Later shifts need their products with this column, too.
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

    /// First product of the shifted pair minus last product of the earlier pair.
    #[inline(always)]
    fn ends(&self, i: usize, j: usize) -> f64 {
        let ((a, late_a), (b, late_b)) = (self.lines[i], self.lines[j]);
        let end = HISTORY + self.n;
        a[HISTORY - late_a] * b[HISTORY - late_b] - a[end - late_a] * b[end - late_b]
    }
}

/// Number of sums that registers hold in addition to the factors.
const REGISTER_SUMS: usize = 8;

/// Writes the sums of the products of `a` with each of `others` to `out`.
pub fn against<S: Simd>(simd: S, a: &[f64], others: &[&[f64]], out: &mut [f64]) {
    simd.vectorize(Against { simd, a, others, out });
}

struct Against<'a, S> {
    simd: S,
    a: &'a [f64],
    others: &'a [&'a [f64]],
    out: &'a mut [f64],
}

impl<S: Simd> NullaryFnOnce for Against<'_, S> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { simd, a, others, out } = self;
        for (others, out) in others.chunks(REGISTER_SUMS).zip(out.chunks_mut(REGISTER_SUMS)) {
            match others.len() {
                1 => put::<S, 1>(simd, a, others, out),
                2 => put::<S, 2>(simd, a, others, out),
                3 => put::<S, 3>(simd, a, others, out),
                4 => put::<S, 4>(simd, a, others, out),
                5 => put::<S, 5>(simd, a, others, out),
                6 => put::<S, 6>(simd, a, others, out),
                7 => put::<S, 7>(simd, a, others, out),
                _ => put::<S, 8>(simd, a, others, out),
            }
        }
    }
}

#[inline(always)]
fn put<S: Simd, const K: usize>(simd: S, a: &[f64], others: &[&[f64]], out: &mut [f64]) {
    let (a, a_tail) = S::as_simd_f64s(a);
    let parts: [_; K] = std::array::from_fn(|k| S::as_simd_f64s(others[k]));
    let vectors = parts.map(|(vectors, _)| &vectors[..a.len()]);
    let mut sums = [simd.splat_f64s(0.0); K];
    for i in 0..a.len() {
        for k in 0..K {
            sums[k] = simd.mul_add_e_f64s(a[i], vectors[k][i], sums[k]);
        }
    }
    for k in 0..K {
        let tail: f64 = a_tail.iter().zip(parts[k].1).map(|(a, b)| a * b).sum();
        out[k] = simd.reduce_sum_f64s(sums[k]) + tail;
    }
}

#[cfg(test)]
mod tests {
    use super::against;
    use pulp::{Arch, Simd, WithSimd};

    struct Loop<'a>(&'a [f64], &'a [&'a [f64]]);

    impl WithSimd for Loop<'_> {
        type Output = Vec<f64>;

        fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
            let mut out = vec![0.0; self.1.len()];
            against(simd, self.0, self.1, &mut out);
            out
        }
    }

    #[test]
    fn sums_of_every_length_are_those_of_a_loop() {
        let x: Vec<f64> = (0..80).map(|i| f64::from(i * i * i % 71)).collect();
        for n in 0..40 {
            let others: Vec<&[f64]> = (0..18).map(|k| &x[k..k + n]).collect();
            let dot = |b: &&[f64]| x[..n].iter().zip(*b).map(|(a, b)| a * b).sum::<f64>();
            // Small integers: every sum is exact in any order.
            let expected: Vec<f64> = others.iter().map(dot).collect();
            assert_eq!(Arch::new().dispatch(Loop(&x[..n], &others)), expected);
        }
    }
}
