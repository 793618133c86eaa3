//! Sums of products, one slice against several at once.

use pulp::{NullaryFnOnce, Simd};

/// As many sums as the registers hold beside their factors.
const TOGETHER: usize = 8;

/// Puts the sums of the products of `a` with each of `others` into `out`.
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
        for (others, out) in others.chunks(TOGETHER).zip(out.chunks_mut(TOGETHER)) {
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
