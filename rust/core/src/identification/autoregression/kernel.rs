//! Products of a block of samples with earlier samples, on the processor's widest registers.

use pulp::{Simd, WithSimd};

use super::normal_equations::Centre;

/// Number of lags whose sums stay in registers together; numbers of lags are rounded up to a
/// multiple.
pub const TILE: usize = 4;
const MAX_TILE: usize = 3 * TILE;

/// Number of target vectors that share loaded values: with the sums they fill the registers.
const TARGETS: usize = 2;

/// Number of independent sums, which hide the time of an addition.
const SUMS: usize = 4;

/// Writes the distances of the samples from `centre` to `to`, and returns their sum.
pub struct Centring<'a> {
    pub centre: Centre,
    pub from: &'a [f64],
    pub to: &'a mut [f64],
}

impl WithSimd for Centring<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let (from, from_rest) = S::as_simd_f64s(self.from);
        let (to, to_rest) = S::as_mut_simd_f64s(&mut self.to[..self.from.len()]);
        let (from, from_last) = pulp::as_arrays::<SUMS, _>(from);
        let (to, to_last) = pulp::as_arrays_mut::<SUMS, _>(to);
        let mut sums = [simd.splat_f64s(0.0); SUMS];
        for (from, to) in from.iter().zip(to) {
            for k in 0..SUMS {
                to[k] = self.centre.subtract_centre_all(simd, from[k]);
                sums[k] = simd.add_f64s(sums[k], to[k]);
            }
        }
        for (from, to) in from_last.iter().zip(to_last) {
            *to = self.centre.subtract_centre_all(simd, *from);
            sums[0] = simd.add_f64s(sums[0], *to);
        }
        let mut sum = sums.into_iter().map(|sum| simd.reduce_sum_f64s(sum)).sum();
        for (from, to) in from_rest.iter().zip(to_rest) {
            *to = self.centre.subtract_centre(*from);
            sum += *to;
        }
        sum
    }
}

/// Adds to `sums[j]` the products of each value from `start` on with the value j places earlier.
/// The number of lags is a multiple of [`TILE`]; the longest lag is at most `start`.
pub struct AddProducts<'a> {
    pub block: &'a [f64],
    pub start: usize,
    pub sums: &'a mut [f64],
}

impl WithSimd for AddProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (tile, sums) in self.sums.chunks_mut(MAX_TILE).enumerate() {
            let (start, lag) = (self.start, tile * MAX_TILE);
            match sums.len() / TILE {
                1 => add_tile::<S, { TILE }>(simd, self.block, start, lag, sums),
                2 => add_tile::<S, { 2 * TILE }>(simd, self.block, start, lag, sums),
                _ => add_tile::<S, MAX_TILE>(simd, self.block, start, lag, sums),
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
    let (targets, before) = (&block[start..], &block[start + 1 - lag - K..]);
    let mut totals = [simd.splat_f64s(0.0); K];
    let step = TARGETS * S::F64_LANES;
    let whole = targets.len() / step * step;
    for i in (0..whole).step_by(step) {
        // One slice with constant distances: K slices would need K registers for addresses.
        add_vectors(simd, &targets[i..i + step], &before[i..i + step + K - 1], &mut totals);
    }
    for (k, sum) in sums.iter_mut().enumerate() {
        let rest = targets[whole..].iter().zip(&before[whole + K - 1 - k..]);
        let rest: f64 = rest.map(|(target, earlier)| target * earlier).sum();
        *sum += simd.reduce_sum_f64s(totals[k]) + rest;
    }
}

/// Products of a few target vectors with vectors up to K - 1 places earlier: each is loaded once.
#[inline(always)]
fn add_vectors<S: Simd, const K: usize>(
    simd: S,
    targets: &[f64],
    window: &[f64],
    totals: &mut [S::f64s; K],
) {
    let lanes = S::F64_LANES;
    let target: [S::f64s; TARGETS] =
        std::array::from_fn(|u| vector(simd, &targets[u * lanes..(u + 1) * lanes]));
    // Two loops: the compiler unrolls only short loops, and only then the sums stay in registers.
    let offsets = K + (TARGETS - 1) * lanes;
    for offset in 0..offsets / 2 {
        add_vector(simd, &target, window, offset, totals);
    }
    for offset in offsets / 2..offsets {
        add_vector(simd, &target, window, offset, totals);
    }
}

/// Products of the targets with the vector at one place. Not a closure: a function that is called
/// without inlining has no vector instructions.
#[inline(always)]
fn add_vector<S: Simd, const K: usize>(
    simd: S,
    target: &[S::f64s; TARGETS],
    window: &[f64],
    offset: usize,
    totals: &mut [S::f64s; K],
) {
    let earlier = vector(simd, &window[offset..offset + S::F64_LANES]);
    for u in 0..TARGETS {
        let lag = (K - 1 + u * S::F64_LANES).wrapping_sub(offset);
        if lag < K {
            totals[lag] = simd.mul_add_e_f64s(target[u], earlier, totals[lag]);
        }
    }
}

#[inline(always)]
fn vector<S: Simd>(_: S, values: &[f64]) -> S::f64s {
    S::as_simd_f64s(values).0[0]
}

#[cfg(test)]
mod tests {
    use pulp::Arch;

    use super::{AddProducts, Centre, Centring, TILE};

    #[test]
    fn sums_of_every_length_are_those_of_a_loop() {
        let x: Vec<f64> = (0..120).map(|i| f64::from(i * i * i % 71)).collect();
        for lags in [1, 2, 3, 4, 6].map(|tiles| tiles * TILE) {
            for length in 0..40 {
                let (start, mut sums) = (lags - 1, vec![0.0; lags]);
                let block = &x[..start + length];
                Arch::new().dispatch(AddProducts { block, start, sums: &mut sums });
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
            let (from, to) = (&x[..length], &mut copy[..]);
            let sum = Arch::new().dispatch(Centring { centre, from, to });
            let expected: Vec<f64> = x[..length].iter().map(|z| z - 3.0).collect();
            assert_eq!((sum, &copy), (expected.iter().sum(), &expected));
        }
    }
}
