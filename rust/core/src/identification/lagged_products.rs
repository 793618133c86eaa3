//! Lagged products of a record, for its correlations.

use pulp::{Arch, Simd, WithSimd};

use crate::math::segments::segments;
use crate::work;

/// Number of samples that stay in the cache for all lags.
const BLOCK: usize = 2048;

/// Number of lags between two checks for a stop.
const LAGS_PER_CHECK: usize = 256;

/// Number of independent sums, which hide the time of an addition.
const SUMS: usize = 4;

/// Sums of products of samples at each lag, within segments.
#[derive(Debug, Clone, PartialEq)]
pub struct LaggedProducts {
    /// Sum of z_k z_(k+l) for l = 0, 1, ...
    pub sums: Vec<f64>,
    /// Number of products summed.
    pub pairs: Vec<u64>,
}

/// Products at lags 0 to `lags` of a record, without products across a missing sample.
pub fn lagged_products(record: &[f64], lags: usize) -> LaggedProducts {
    let count = lags.saturating_add(1);
    let mut products =
        LaggedProducts { sums: work::filled(0.0, count), pairs: work::filled(0, count) };
    let arch = Arch::new();
    for segment in segments(record) {
        let lags = lags.min(segment.len() - 1);
        for (lag, pairs) in products.pairs[..=lags].iter_mut().enumerate() {
            *pairs += (segment.len() - lag) as u64;
        }
        arch.dispatch(AddProducts { segment, sums: &mut products.sums[..=lags] });
    }
    products
}

struct AddProducts<'a> {
    segment: &'a [f64],
    sums: &'a mut [f64],
}

impl WithSimd for AddProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for start in (0..self.segment.len()).step_by(BLOCK) {
            for (lag, sum) in self.sums.iter_mut().enumerate() {
                if lag.is_multiple_of(LAGS_PER_CHECK) {
                    work::pause();
                }
                let later = self.segment.get(start + lag..).unwrap_or_default();
                let length = later.len().min(BLOCK);
                *sum += product(simd, &self.segment[start..][..length], &later[..length]);
            }
        }
    }
}

#[inline(always)]
fn product<S: Simd>(simd: S, a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_tail), (b, b_tail)) = (S::as_simd_f64s(a), S::as_simd_f64s(b));
    let ((a, a_rest), (b, b_rest)) = (pulp::as_arrays::<SUMS, _>(a), pulp::as_arrays::<SUMS, _>(b));
    let mut sums = [simd.splat_f64s(0.0); SUMS];
    for (a, b) in a.iter().zip(b) {
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum = simd.mul_add_e_f64s(a[k], b[k], *sum);
        }
    }
    for (a, b) in a_rest.iter().zip(b_rest) {
        sums[0] = simd.mul_add_e_f64s(*a, *b, sums[0]);
    }
    let (a, b) = (simd.partial_load_f64s(a_tail), simd.partial_load_f64s(b_tail));
    sums[1] = simd.mul_add_e_f64s(a, b, sums[1]);
    simd.reduce_sum_f64s(sums.into_iter().fold(simd.splat_f64s(0.0), |a, b| simd.add_f64s(a, b)))
}

#[cfg(test)]
mod tests {
    use super::{BLOCK, LaggedProducts, lagged_products};

    /// Small integers: every sum is exact in any order.
    fn record(n: usize) -> Vec<f64> {
        (0..n as u64).map(|k| (k * k * k % 71) as f64 - 35.0).collect()
    }

    fn by_loops(record: &[f64], lags: usize) -> LaggedProducts {
        let reach = |k: usize, lag: usize| record.get(k..=k + lag);
        let products = |lag: usize| {
            (0..record.len())
                .filter_map(move |k| reach(k, lag))
                .filter(|part| part.iter().all(|z| z.is_finite()))
                .map(move |part| part[0] * part[lag])
        };
        LaggedProducts {
            sums: (0..=lags).map(|lag| products(lag).sum()).collect(),
            pairs: (0..=lags).map(|lag| products(lag).count() as u64).collect(),
        }
    }

    #[test]
    fn sums_of_every_length_are_those_of_loops() {
        for n in (0..70).chain(BLOCK - 3..BLOCK + 4).chain([2 * BLOCK + 1]) {
            let record = record(n);
            assert_eq!(lagged_products(&record, 12), by_loops(&record, 12));
        }
    }

    #[test]
    fn no_product_reaches_across_a_gap() {
        let mut record = record(300);
        for k in [0, 7, 8, 150, 299] {
            record[k] = f64::NAN;
        }
        assert_eq!(lagged_products(&record, 200), by_loops(&record, 200));
        assert_eq!(lagged_products(&[f64::NAN; 3], 1), by_loops(&[], 1));
    }
}
