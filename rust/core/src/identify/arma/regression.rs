//! Hannan and Rissanen's regression on past samples and on residuals of a long autoregression.

use nalgebra::{Cholesky, DMatrix, DVector};
use pulp::{Arch, Simd, WithSimd};

use super::products::against;
use super::recursion::BLOCK;
use super::series::Series;

/// Order of the long autoregression.
const LONG: usize = 20;

/// Products of everything that may explain a sample, up to the highest orders.
#[derive(Debug, Clone)]
pub struct Regression {
    /// Of past samples, past residuals, one, and the sample itself.
    products: DMatrix<f64>,
    p: usize,
    q: usize,
}

impl Regression {
    /// For orders up to (p, q).
    pub fn new(series: &Series, p: usize, q: usize) -> Self {
        let arch = Arch::new();
        let phi = levinson(&arch.dispatch(Autocovariances(series)));
        let residuals = arch.dispatch(LongResiduals { series, phi: &phi });
        let products = arch.dispatch(Products { series, residuals: &residuals, p, q });
        Self { products, p, q }
    }

    /// `[φ, θ]` and the constant, if one belongs to the model.
    pub fn coefficients(&self, p: usize, q: usize, has_constant: bool) -> Option<Vec<f64>> {
        let one = self.p + self.q;
        let mut chosen: Vec<usize> = (0..p).chain(self.p..self.p + q).collect();
        chosen.extend(has_constant.then_some(one));
        let gram = DMatrix::from_fn(chosen.len(), chosen.len(), |i, j| {
            self.products[(chosen[i], chosen[j])]
        });
        let right = DVector::from_fn(chosen.len(), |i, _| self.products[(chosen[i], one + 1)]);
        Some(Cholesky::new(gram)?.solve(&right).as_slice().to_vec())
    }
}

struct Autocovariances<'a>(&'a Series);

impl WithSimd for Autocovariances<'_> {
    type Output = [f64; LONG + 1];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut total = [0.0; LONG + 1];
        for stretch in &self.0.stretches {
            let y = &self.0.values[stretch.clone()];
            for start in (0..y.len()).step_by(BLOCK) {
                let end = y.len().min(start + BLOCK);
                for lag in 0..=LONG.min(end - 1) {
                    let later = &y[start.max(lag)..end];
                    let mut sum = [0.0];
                    against(simd, later, &[&y[start.max(lag) - lag..][..later.len()]], &mut sum);
                    total[lag] += sum[0];
                }
            }
        }
        total
    }
}

/// Solution of the Yule-Walker equations, of no more orders than make it better.
fn levinson(autocovariances: &[f64; LONG + 1]) -> Vec<f64> {
    let mut phi: Vec<f64> = Vec::new();
    let mut variance = autocovariances[0];
    for k in 0..LONG {
        let explained: f64 =
            phi.iter().zip(autocovariances[..=k].iter().rev()).map(|(phi, c)| phi * c).sum();
        let r = (autocovariances[k + 1] - explained) / variance;
        if r.is_nan() || r.abs() >= 1.0 {
            break;
        }
        let before = phi.clone();
        phi.iter_mut().zip(before.iter().rev()).for_each(|(phi, mirrored)| *phi -= r * mirrored);
        phi.push(r);
        variance *= 1.0 - r * r;
    }
    phi
}

/// Residuals of the long autoregression, zero near the start of a stretch.
struct LongResiduals<'a> {
    series: &'a Series,
    phi: &'a [f64],
}

impl WithSimd for LongResiduals<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<f64> {
        let mut residuals = self.series.values.clone();
        for stretch in &self.series.stretches {
            let y = &self.series.values[stretch.clone()];
            let out = &mut residuals[stretch.clone()];
            let skip = self.phi.len().min(y.len());
            out[..skip].fill(0.0);
            for start in (skip..y.len()).step_by(BLOCK) {
                let block = &mut out[start..y.len().min(start + BLOCK)];
                for (i, phi) in self.phi.iter().enumerate() {
                    block.iter_mut().zip(&y[start - 1 - i..]).for_each(|(e, y)| *e -= phi * y);
                }
            }
        }
        residuals
    }
}

struct Products<'a> {
    series: &'a Series,
    residuals: &'a [f64],
    p: usize,
    q: usize,
}

impl WithSimd for Products<'_> {
    type Output = DMatrix<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> DMatrix<f64> {
        let size = self.p + self.q + 2;
        let mut total = DMatrix::zeros(size, size);
        let mut row = vec![0.0; size];
        let skip = self.p.max(self.q);
        for stretch in &self.series.stretches {
            for start in (stretch.start + skip..stretch.end).step_by(BLOCK) {
                let n = BLOCK.min(stretch.end - start);
                let columns = self.columns(start, n);
                for (i, column) in columns.iter().enumerate() {
                    against(simd, column, &columns, &mut row);
                    (0..size).for_each(|j| total[(i, j)] += row[j]);
                }
            }
        }
        total
    }
}

impl Products<'_> {
    #[inline(always)]
    fn columns(&self, start: usize, n: usize) -> Vec<&[f64]> {
        let samples = (1..=self.p).map(|i| &self.series.values[start - i..][..n]);
        let residuals = (1..=self.q).map(|j| &self.residuals[start - j..][..n]);
        let ends = [&ONES[..n], &self.series.values[start..][..n]];
        samples.chain(residuals).chain(ends).collect()
    }
}

static ONES: [f64; BLOCK] = [1.0; BLOCK];
