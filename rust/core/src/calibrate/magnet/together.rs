//! Several spans in SIMD lanes.

#[cfg(feature = "std")]
use pulp::{Arch, Simd, WithSimd};

#[cfg(feature = "std")]
use super::span::NUMBERS;
use super::span::{Cost, Seen, Span};
#[cfg(feature = "std")]
use crate::math::{Lane, MAX_LANES, Real};

/// Processes a tick in every span; returns the cost of each.
#[cfg(feature = "std")]
pub fn step_all<const N: usize>(spans: &mut [Span<f64>; N], seen: &Seen<f64>) -> [Cost<f64>; N] {
    Arch::new().dispatch(All { spans, seen })
}

/// Processes a tick in every span; returns the cost of each.
#[cfg(not(feature = "std"))]
pub fn step_all<const N: usize>(spans: &mut [Span<f64>; N], seen: &Seen<f64>) -> [Cost<f64>; N] {
    spans.each_mut().map(|span| span.step(seen))
}

#[cfg(feature = "std")]
struct All<'a, const N: usize> {
    spans: &'a mut [Span<f64>; N],
    seen: &'a Seen<f64>,
}

#[cfg(feature = "std")]
impl<const N: usize> WithSimd for All<'_, N> {
    type Output = [Cost<f64>; N];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let Seen { turned, rotation, walked, noise } = self.seen;
        let mut rows = [0.0; 9];
        rows.copy_from_slice(rotation.as_flattened());
        let seen = Seen::<Lane<S>>::of(turned, &rows, *walked, *noise);
        let mut costs = [Cost { determinant: 1.0, misfit: 0.0 }; N];
        for (spans, costs) in
            self.spans.chunks_mut(S::F64_LANES).zip(costs.chunks_mut(S::F64_LANES))
        {
            let mut span = gather::<S>(spans);
            let Cost { determinant, misfit } = span.step(&seen);
            scatter(&span, spans);
            let (determinant, misfit) = (determinant.store(), misfit.store());
            for (k, cost) in costs.iter_mut().enumerate() {
                *cost = Cost { determinant: determinant[k], misfit: misfit[k] };
            }
        }
        costs
    }
}

/// The spans, one per lane; the last span is repeated in unused lanes.
#[cfg(feature = "std")]
#[inline(always)]
pub fn gather<S: Simd>(spans: &[impl AsRef<Span<f64>>]) -> Span<Lane<S>> {
    let mut rows = [[0.0; MAX_LANES]; NUMBERS];
    for k in 0..S::F64_LANES {
        let row = spans[k.min(spans.len() - 1)].as_ref().row();
        for i in 0..NUMBERS {
            rows[i][k] = row[i];
        }
    }
    let mut lanes = [Lane::<S>::of(0.0); NUMBERS];
    for i in 0..NUMBERS {
        lanes[i] = Lane::load(&rows[i]);
    }
    Span::of(&lanes)
}

/// Copies each lane back to its span.
#[cfg(feature = "std")]
#[inline(always)]
pub fn scatter<S: Simd>(lanes: &Span<Lane<S>>, spans: &mut [impl AsMut<Span<f64>>]) {
    let (lanes, mut rows) = (lanes.row(), [[0.0; MAX_LANES]; NUMBERS]);
    for i in 0..NUMBERS {
        rows[i] = lanes[i].store();
    }
    for (k, span) in spans.iter_mut().enumerate() {
        let mut row = [0.0; NUMBERS];
        for i in 0..NUMBERS {
            row[i] = rows[i][k];
        }
        *span.as_mut() = Span::of(&row);
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::{Seen, Span, step_all};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn together_is_each_alone_to_the_bit(
            ticks in prop::collection::vec(
                (prop::array::uniform3(-9.0..9.0_f64), prop::array::uniform9(-1.0..1.0_f64)), 1..40,
            ),
        ) {
            let mut together = [0.1, -0.7, 1.3].map(|x| Span::new([x, 0.5, x * x]));
            let mut alone = together;
            for (turned, rotation) in &ticks {
                let seen = Seen::of(turned, rotation, 1e-4, 4e-4);
                let costs = step_all(&mut together, &seen);
                for (span, cost) in alone.iter_mut().zip(costs) {
                    let own = span.step(&seen);
                    prop_assert_eq!((own.determinant, own.misfit), (cost.determinant, cost.misfit));
                }
                prop_assert_eq!(together, alone);
            }
        }
    }
}
