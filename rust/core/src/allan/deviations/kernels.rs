//! Sums on the widest registers that the processor has.

use pulp::{Simd, WithSimd};

/// Number of independent sums, which hide the time of an addition.
const SUMS: usize = 4;

/// Sum of the squared differences of order K - 1, from K slices of equal length, term by term.
pub struct SquaredDifferences<'a, const K: usize>(pub [&'a [f64]; K]);

impl<const K: usize> WithSimd for SquaredDifferences<'_, K> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        squared_differences(simd, self.0)
    }
}

/// [`SquaredDifferences`] inside another operation.
#[inline(always)]
pub fn squared_differences<S: Simd, const K: usize>(simd: S, slices: [&[f64]; K]) -> f64 {
    accumulate(simd, slices, |sum, difference| simd.mul_add_e_f64s(difference, difference, sum))
}

/// Sum of `a - 2 b + c`.
pub struct SecondDifferences<'a>(pub [&'a [f64]; 3]);

impl WithSimd for SecondDifferences<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        accumulate(simd, self.0, |sum, difference| simd.add_f64s(sum, difference))
    }
}

/// The last of K values minus its forecast from the others by differences, K = 3 or 4.
///
/// The values are read one by one. An array of them, made by `map`, may remain a call in memory,
/// which is four times as slow.
#[inline(always)]
fn difference<S: Simd, const K: usize>(simd: S, x: impl Fn(usize) -> S::f64s) -> S::f64s {
    let ends = match K {
        3 => simd.add_f64s(x(0), x(2)),
        _ => simd.sub_f64s(x(K - 1), x(0)),
    };
    let (inner, weight) = match K {
        3 => (x(1), 2.0),
        _ => (simd.sub_f64s(x(2), x(1)), 3.0),
    };
    simd.negate_mul_add_e_f64s(simd.splat_f64s(weight), inner, ends)
}

/// Sums `add(sum, difference)` over slices of equal length, with zeros after their end.
#[inline(always)]
fn accumulate<S: Simd, const K: usize>(
    simd: S,
    slices: [&[f64]; K],
    add: impl Fn(S::f64s, S::f64s) -> S::f64s,
) -> f64 {
    let parts = slices.map(|slice| S::as_simd_f64s(&slice[..slices[0].len()]));
    let vectors = parts.map(|(vectors, _)| pulp::as_arrays::<SUMS, _>(vectors));
    let (blocks, rest) = (vectors.map(|(blocks, _)| blocks), vectors.map(|(_, rest)| rest));
    let mut sums = [simd.splat_f64s(0.0); SUMS];
    let blocks = blocks.map(|block| &block[..blocks[0].len()]);
    for i in 0..blocks[0].len() {
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum = add(*sum, difference::<S, K>(simd, |slice| blocks[slice][i][k]));
        }
    }
    for i in 0..rest[0].len() {
        sums[i % SUMS] = add(sums[i % SUMS], difference::<S, K>(simd, |slice| rest[slice][i]));
    }
    let tail = difference::<S, K>(simd, |slice| simd.partial_load_f64s(parts[slice].1));
    sums[0] = add(sums[0], tail);
    let total = sums.into_iter().reduce(|a, b| simd.add_f64s(a, b));
    total.map_or(0.0, |total| simd.reduce_sum_f64s(total))
}

/// Writes third differences of four slices, term by term, to `out`.
pub struct PutThirdDifferences<'a> {
    pub slices: [&'a [f64]; 4],
    pub out: &'a mut [f64],
}

impl WithSimd for PutThirdDifferences<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let [a, b, c, d] = self.slices.map(|slice| &slice[..self.out.len()]);
        for (i, out) in self.out.iter_mut().enumerate() {
            *out = (d[i] - a[i]) - 3.0 * (c[i] - b[i]);
        }
    }
}

/// Sum of the distances from `origin`, and the largest magnitude.
pub struct Extent<'a> {
    pub samples: &'a [f64],
    pub origin: f64,
}

impl WithSimd for Extent<'_> {
    type Output = (f64, f64);

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> (f64, f64) {
        let (vectors, tail) = S::as_simd_f64s(self.samples);
        let (blocks, rest) = pulp::as_arrays::<SUMS, _>(vectors);
        let origin = simd.splat_f64s(self.origin);
        let mut sums = [simd.splat_f64s(0.0); SUMS];
        let mut largest = sums;
        let mut take = |k: usize, z: S::f64s| {
            sums[k] = simd.add_f64s(sums[k], simd.sub_f64s(z, origin));
            largest[k] = simd.max_f64s(largest[k], simd.abs_f64s(z));
        };
        for block in blocks {
            for (k, z) in block.iter().enumerate() {
                take(k, *z);
            }
        }
        rest.iter().enumerate().for_each(|(k, z)| take(k % SUMS, *z));
        let sum = sums.into_iter().map(|sum| simd.reduce_sum_f64s(sum)).sum::<f64>();
        let largest = largest.into_iter().map(|z| simd.reduce_max_f64s(z)).fold(0.0, f64::max);
        tail.iter().fold((sum, largest), |(sum, largest), z| {
            (sum + (z - self.origin), largest.max(z.abs()))
        })
    }
}

#[cfg(test)]
mod tests {
    use pulp::Arch;

    use super::{Extent, SecondDifferences, SquaredDifferences};

    #[test]
    fn sums_of_every_length_are_those_of_a_loop() {
        let x: Vec<f64> = (0..80).map(|i| f64::from(i * i * i % 71)).collect();
        for n in 0..60 {
            let [a, b, c, d] = [0, 3, 7, 12].map(|k| &x[k..k + n]);
            let second = |i: usize| c[i] - 2.0 * b[i] + a[i];
            let third = |i: usize| d[i] - 3.0 * c[i] + 3.0 * b[i] - a[i];
            // Small integers: every sum is exact in any order.
            let arch = Arch::new();
            let expected: f64 = (0..n).map(|i| second(i) * second(i)).sum();
            assert_eq!(arch.dispatch(SquaredDifferences([a, b, c])), expected);
            let expected: f64 = (0..n).map(|i| third(i) * third(i)).sum();
            assert_eq!(arch.dispatch(SquaredDifferences([a, b, c, d])), expected);
            let expected: f64 = (0..n).map(second).sum();
            assert_eq!(arch.dispatch(SecondDifferences([a, b, c])), expected);
            let expected = (a.iter().map(|z| z - 5.0).sum(), a.iter().copied().fold(0.0, f64::max));
            assert_eq!(arch.dispatch(Extent { samples: a, origin: 5.0 }), expected);
        }
    }
}
