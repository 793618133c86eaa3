//! Filters side by side: those past their start-up share the lanes of SIMD registers.

use core::array::from_fn;

use nalgebra::{SimdBool, SimdValue};
use pulp::{Arch, Simd, WithSimd};

use super::{DriftFilter, DriftLoop};
use crate::allan::AllanKind;
use crate::filter::{BLOCK, SideBySide};
use crate::lanes::{Lane, Laned, Mask, WIDEST, laned};
use crate::params::Method;
use crate::real::Real;
use crate::startup::Scaling;

laned!(DriftLoop [N, M]
    { model, measurement_noise, process_noise, belief, last, count, peak, guards }
    common { adapts_measurement_noise, adapts_process_noise, learning_left });

impl<const N: usize, const M: usize> SideBySide<f32> for DriftFilter<f32, N, M> {}

impl<const N: usize, const M: usize> SideBySide<f64> for DriftFilter<f64, N, M> {
    fn abreast() -> usize {
        Arch::new().dispatch(Lanes)
    }

    fn process_rows(filters: &mut [Self], rows: &mut [f64]) {
        let arch = Arch::new();
        for rows in rows.chunks_mut(BLOCK * filters.len().max(1)) {
            arch.dispatch(Block { filters, rows });
        }
    }
}

struct Lanes;

impl WithSimd for Lanes {
    type Output = usize;

    fn with_simd<S: Simd>(self, _: S) -> usize {
        S::F64_LANES
    }
}

/// What filters must have in common to take the same branches for a number of samples: method,
/// noise, and for how many of these they learn. None before the start-up is over.
type Phase = Option<(Method, AllanKind, u64)>;

impl<const N: usize, const M: usize> DriftFilter<f64, N, M> {
    fn phase(&self, samples: u64) -> Phase {
        let learning = self.inner.learning_left.min(samples);
        self.scaling.map(|_| (self.params.method, self.params.noise, learning))
    }
}

/// Rows of one sample a filter.
struct Block<'a, const N: usize, const M: usize> {
    filters: &'a mut [DriftFilter<f64, N, M>],
    rows: &'a mut [f64],
}

impl<const N: usize, const M: usize> WithSimd for Block<'_, N, M> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let channels = self.filters.len();
        for alike in self.sorted().chunk_by(|(a, _), (b, _)| a == b) {
            let places: Vec<usize> = alike.iter().map(|(_, c)| *c).collect();
            for members in places.chunks(S::F64_LANES) {
                match Together::<S, N, M>::of(self.filters, members) {
                    Some(together) => together.process(self.filters, members, self.rows),
                    None => members.iter().for_each(|c| {
                        self.filters[*c].process_column(*c, channels, self.rows);
                    }),
                }
            }
        }
    }
}

impl<const N: usize, const M: usize> Block<'_, N, M> {
    /// Phases and places of the filters, those of one phase side by side.
    fn sorted(&self) -> Vec<(Phase, usize)> {
        let samples = (self.rows.len() / self.filters.len()) as u64;
        let phases = self.filters.iter().map(|filter| filter.phase(samples));
        let mut sorted: Vec<_> = phases.zip(0..).collect();
        sorted.sort_unstable();
        sorted
    }
}

/// Filters in one phase, one a lane; lanes without a filter do what the first one does.
struct Together<S: Simd, const N: usize, const M: usize> {
    inner: DriftLoop<Lane<S>, N, M>,
    scaling: Scaling<Lane<S>>,
    estimate: Lane<S>,
    seen: Mask<S>,
    guarded: Mask<S>,
}

impl<S: Simd, const N: usize, const M: usize> Together<S, N, M> {
    /// The filters at these places, if they are several and their start-up is over.
    #[inline(always)]
    fn of(filters: &[DriftFilter<f64, N, M>], members: &[usize]) -> Option<Self> {
        let [first, _, ..] = members else { return None };
        let mut inner = DriftLoop::splat(&filters[*first].inner);
        let mut scaling = Scaling::splat(filters[*first].scaling.as_ref()?);
        for (i, c) in members.iter().enumerate() {
            inner.set_lane(i, &filters[*c].inner);
            scaling.set_lane(i, filters[*c].scaling.as_ref()?);
        }
        let (estimate, seen) = (Lane::of(0.0), Mask::every());
        Some(Self { inner, scaling, estimate, seen, guarded: !seen })
    }

    #[inline(always)]
    fn process(
        mut self,
        filters: &mut [DriftFilter<f64, N, M>],
        members: &[usize],
        rows: &mut [f64],
    ) {
        let channels = filters.len();
        let places: [usize; WIDEST] = from_fn(|i| *members.get(i).unwrap_or(&members[0]));
        for row in rows.chunks_exact_mut(channels) {
            let numbers = from_fn(|i| if i < S::F64_LANES { row[places[i]] } else { 0.0 });
            let answers = self.step(Lane::load(&numbers)).store();
            for (answer, c) in answers.iter().zip(places).take(S::F64_LANES) {
                row[c] = *answer;
            }
        }
        let samples = (rows.len() / channels) as u64;
        for (i, c) in members.iter().enumerate() {
            self.leave(i, samples, &mut filters[*c]);
        }
    }

    #[inline(always)]
    fn step(&mut self, z: Lane<S>) -> Lane<S> {
        self.seen = z.finite();
        let y = self.scaling.normalise(z);
        // The same step twice, so that the compiler drops the masks from the first.
        let (y, guarded) = match self.seen.all() {
            true => self.inner.step(y, Mask::every()),
            false => self.inner.step(y, self.seen),
        };
        self.estimate = self.scaling.raw(y);
        self.guarded = guarded;
        self.estimate
    }

    /// Gives a filter back what is its own, after so many samples.
    fn leave(&self, lane: usize, samples: u64, filter: &mut DriftFilter<f64, N, M>) {
        let learning_left = filter.inner.learning_left.saturating_sub(samples);
        filter.inner = DriftLoop { learning_left, ..self.inner.lane(lane) };
        filter.estimate = self.estimate.extract(lane);
        filter.missing = !self.seen.holds(lane);
        filter.guarded = self.guarded.holds(lane);
        filter.samples_seen += samples;
    }
}

#[cfg(test)]
mod tests {
    use pulp::{Scalar128b, Scalar256b, Scalar512b, Simd};

    use super::Block;
    use crate::{DriftFilter, Filter, Params};

    const CHANNELS: usize = 11;

    fn rows() -> Vec<f64> {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64
        };
        (0..CHANNELS * 900).map(|i| if i % 97 == 5 { f64::NAN } else { random() }).collect()
    }

    fn filters() -> Vec<DriftFilter<f64, 3, 4>> {
        let params = Params { adapt_for: Some(5.0), ..Params::default() };
        vec![DriftFilter::new(params).expect("valid parameters"); CHANNELS]
    }

    fn in_lanes<S: Simd>(simd: S) -> Vec<f64> {
        let (mut filters, mut rows) = (filters(), rows());
        for rows in rows.chunks_mut(100 * CHANNELS) {
            simd.vectorize(Block { filters: &mut filters, rows });
        }
        rows
    }

    #[test]
    fn any_number_of_lanes_gives_the_same() {
        let (mut filters, mut expected) = (filters(), rows());
        for (i, z) in expected.iter_mut().enumerate() {
            *z = filters[i % CHANNELS].update(*z);
        }
        assert_eq!(in_lanes(Scalar128b), expected);
        assert_eq!(in_lanes(Scalar256b), expected);
        assert_eq!(in_lanes(Scalar512b), expected);
    }
}
