//! Products of a block of samples with those before them, on the processor's widest registers.

use pulp::{Arch, Simd, WithSimd};

use super::centre::Centre;

/// Lags whose sums stay in registers together; numbers of lags are rounded up to a multiple.
pub const TILE: usize = 4;
const LARGEST_TILE: usize = 3 * TILE;

/// What the processor can do, found out once.
#[derive(Debug, Clone, Copy)]
pub struct Kernel(Arch);

impl Kernel {
    pub fn new() -> Self {
        Self(Arch::new())
    }

    /// Puts the samples' distances from `centre` into `to`, and answers their sum.
    pub fn centre(self, centre: Centre, from: &[f64], to: &mut [f64]) -> f64 {
        self.0.dispatch(Centring { centre, from, to })
    }

    /// Adds to `sums[j]` the products of each value from `start` on with that j places before it.
    /// A multiple of [`TILE`] lags, of which the longest is at most `start`.
    pub fn add_products(self, block: &[f64], start: usize, sums: &mut [f64]) {
        self.0.dispatch(Products { block, start, sums });
    }
}

struct Centring<'a> {
    centre: Centre,
    from: &'a [f64],
    to: &'a mut [f64],
}

impl WithSimd for Centring<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        const SUMS: usize = 16;
        let mut sums = [0.0; SUMS];
        let (from, from_rest) = self.from.as_chunks::<SUMS>();
        let (to, to_rest) = self.to[..self.from.len()].as_chunks_mut::<SUMS>();
        for (from, to) in from.iter().zip(to) {
            for k in 0..SUMS {
                to[k] = self.centre.taken_off(from[k]);
                sums[k] += to[k];
            }
        }
        for (k, (from, to)) in from_rest.iter().zip(to_rest).enumerate() {
            *to = self.centre.taken_off(*from);
            sums[k] += *to;
        }
        sums.iter().sum()
    }
}

struct Products<'a> {
    block: &'a [f64],
    start: usize,
    sums: &'a mut [f64],
}

impl WithSimd for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (tile, sums) in self.sums.chunks_mut(LARGEST_TILE).enumerate() {
            let (start, lag) = (self.start, tile * LARGEST_TILE);
            match sums.len() / TILE {
                1 => add_tile::<S, { TILE }>(simd, self.block, start, lag, sums),
                2 => add_tile::<S, { 2 * TILE }>(simd, self.block, start, lag, sums),
                _ => add_tile::<S, LARGEST_TILE>(simd, self.block, start, lag, sums),
            }
        }
    }
}

/// The products of K lags from `lag` on.
#[inline(always)]
fn add_tile<S: Simd, const K: usize>(
    simd: S,
    block: &[f64],
    start: usize,
    lag: usize,
    sums: &mut [f64],
) {
    let lanes = S::F64_LANES;
    let (targets, before) = (&block[start..], &block[start + 1 - lag - K..]);
    let mut totals = [simd.splat_f64s(0.0); K];
    let whole = targets.len() / lanes * lanes;
    for i in (0..whole).step_by(lanes) {
        let target = vector(simd, &targets[i..i + lanes]);
        // One slice and constant distances within it: K slices would need K registers for addresses.
        let window = &before[i..i + lanes + K - 1];
        for (k, total) in totals.iter_mut().enumerate() {
            let earlier = vector(simd, &window[K - 1 - k..K - 1 - k + lanes]);
            *total = simd.mul_add_e_f64s(target, earlier, *total);
        }
    }
    for (k, sum) in sums.iter_mut().enumerate() {
        let rest = targets[whole..].iter().zip(&before[whole + K - 1 - k..]);
        let rest: f64 = rest.map(|(target, earlier)| target * earlier).sum();
        *sum += simd.reduce_sum_f64s(totals[k]) + rest;
    }
}

#[inline(always)]
fn vector<S: Simd>(_: S, values: &[f64]) -> S::f64s {
    S::as_simd_f64s(values).0[0]
}

#[cfg(test)]
mod tests {
    use super::{Centre, Kernel, TILE};

    #[test]
    fn sums_of_every_length_are_those_of_a_loop() {
        let x: Vec<f64> = (0..120).map(|i| f64::from(i * i * i % 71)).collect();
        for lags in [1, 2, 3, 4, 6].map(|tiles| tiles * TILE) {
            for length in 0..40 {
                let (start, mut sums) = (lags - 1, vec![0.0; lags]);
                let block = &x[..start + length];
                Kernel::new().add_products(block, start, &mut sums);
                let product = |j: usize| (start..block.len()).map(|t| x[t] * x[t - j]).sum::<f64>();
                // Small integers: every sum is exact in any order.
                assert_eq!(sums, (0..lags).map(product).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn a_centred_copy_of_every_length() {
        let x: Vec<f64> = (0..40).map(f64::from).collect();
        for length in 0..40 {
            let mut copy = vec![0.0; length];
            let centre = Centre::provisional(&[3.0]);
            let sum = Kernel::new().centre(centre, &x[..length], &mut copy);
            let expected: Vec<f64> = x[..length].iter().map(|z| z - 3.0).collect();
            assert_eq!((sum, &copy), (expected.iter().sum(), &expected));
        }
    }
}
