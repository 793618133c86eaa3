//! Published filters after their start-up in SIMD lanes, one filter per lane.

use core::array::from_fn;

use nalgebra::{SimdBool, SimdValue};
use pulp::{Simd, WithSimd};

use super::{DriftFilter, DriftLoop};
use crate::allan::AllanKind;
use crate::drift::Method;
use crate::math::{Lane, Laned, MAX_LANES, Mask, Real, laned};
use crate::stream::{Block, Scaling, Watch};

/// Number of filters in one register.
pub struct Width;

impl WithSimd for Width {
    type Output = usize;

    fn with_simd<S: Simd>(self, _: S) -> usize {
        S::F64_LANES
    }
}

laned!(DriftLoop [N, M]
    { model, measurement_noise, process_noise, state, last, count, peak, guards }
    common { adapts_measurement_noise, adapts_process_noise, learning_left });

/// Common properties of filters that take the same branches for a number of samples: method, noise,
/// samples to learn, and times of scale checks. `None` during the start-up.
type Phase = Option<(Method, AllanKind, u64, u64)>;

impl<const N: usize, const M: usize> DriftFilter<f64, N, M> {
    fn phase(&self, samples: u64) -> Phase {
        let learning = self.inner.learning_left.min(samples);
        let turn = Watch::<f64>::turn(self.samples_seen);
        self.scaling.map(|_| (self.params.method, self.params.noise, learning, turn))
    }
}

/// A block of rows and its filters.
pub struct Together<'a, 'b, const N: usize, const M: usize> {
    pub filters: &'a mut [DriftFilter<f64, N, M>],
    pub block: &'a mut Block<'b>,
}

impl<const N: usize, const M: usize> WithSimd for Together<'_, '_, N, M> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        if const { S::F64_LANES == 1 } {
            let indices: Vec<usize> = (0..self.filters.len()).collect();
            return one_by_one(self.filters, &indices, self.block);
        }
        for equal in self.sorted().chunk_by(|(a, _), (b, _)| a == b) {
            let indices: Vec<usize> = equal.iter().map(|(_, c)| *c).collect();
            for members in indices.chunks(S::F64_LANES) {
                let rows = match Lanes::<S, N, M>::of(self.filters, members) {
                    Some(lanes) => lanes.process(self.filters, members, self.block),
                    None => 0,
                };
                if rows < self.block.n_rows::<DriftFilter<f64, N, M>>() {
                    one_by_one(self.filters, members, &mut self.block.after(rows));
                }
            }
        }
    }
}

impl<const N: usize, const M: usize> Together<'_, '_, N, M> {
    /// Phases and indices of the filters, sorted by phase.
    fn sorted(&self) -> Vec<(Phase, usize)> {
        let samples = self.block.n_rows::<DriftFilter<f64, N, M>>() as u64;
        let phases = self.filters.iter().map(|filter| filter.phase(samples));
        let mut sorted: Vec<_> = phases.zip(0..).collect();
        sorted.sort_unstable();
        sorted
    }
}

/// Filters that do not share a register; compiled once, not once per kind of processor.
#[inline(never)]
fn one_by_one<const N: usize, const M: usize>(
    filters: &mut [DriftFilter<f64, N, M>],
    members: &[usize],
    block: &mut Block<'_>,
) {
    for c in members {
        block.run(*c, &mut filters[*c]);
    }
}

/// True if a row proves the scale of a filter wrong.
#[inline(never)]
fn disproves<const N: usize, const M: usize>(
    filters: &mut [DriftFilter<f64, N, M>],
    members: &[usize],
    row: &[f64],
) -> bool {
    let mut any = false;
    for c in members {
        any |= filters[*c].disproves(row[*c]);
    }
    any
}

/// Filters in one phase, one per lane; unused lanes repeat the first filter.
struct Lanes<S: Simd, const N: usize, const M: usize> {
    inner: DriftLoop<Lane<S>, N, M>,
    scaling: Scaling<Lane<S>>,
    estimate: Lane<S>,
    seen: Mask<S>,
    guarded: Mask<S>,
}

impl<S: Simd, const N: usize, const M: usize> Lanes<S, N, M> {
    /// The filters at these indices, if there are several and their start-up is over.
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

    /// Processes rows until a row proves a scale wrong; returns the number of rows.
    #[inline(always)]
    fn process(
        mut self,
        filters: &mut [DriftFilter<f64, N, M>],
        members: &[usize],
        block: &mut Block<'_>,
    ) -> usize {
        let indices: [usize; MAX_LANES] = from_fn(|i| *members.get(i).unwrap_or(&members[0]));
        let seen_before = filters[indices[0]].samples_seen;
        let mut rows = 0;
        for (input, output) in block.rows() {
            let numbers = from_fn(|i| if i < S::F64_LANES { input[indices[i]] } else { 0.0 });
            let estimates = self.step(Lane::load(&numbers)).store();
            for (estimate, c) in estimates.iter().zip(indices).take(S::F64_LANES) {
                output[c] = *estimate;
            }
            rows += 1;
            if Watch::<f64>::is_due(seen_before + rows) && disproves(filters, members, input) {
                break;
            }
        }
        for (i, c) in members.iter().enumerate() {
            self.leave(i, rows, &mut filters[*c]);
            filters[*c].restart_if_disproved();
        }
        rows as usize
    }

    #[inline(always)]
    fn step(&mut self, z: Lane<S>) -> Lane<S> {
        self.seen = z.finite();
        let y = self.scaling.normalise(z);
        // The step is written twice: the compiler drops the masks from the first.
        let (y, guarded) = match self.seen.all() {
            true => self.inner.step(y, Mask::every()),
            false => self.inner.step(y, self.seen),
        };
        self.estimate = self.scaling.raw(y);
        self.guarded = guarded;
        self.estimate
    }

    /// Copies a lane's state back to its filter, after this number of samples.
    #[inline(always)]
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

    use super::Together;
    use crate::stream::Block;
    use crate::{DriftFilter, Params, Stream};

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
        let (mut filters, rows) = (filters(), rows());
        let mut outputs = vec![0.0; rows.len()];
        let length = 100 * CHANNELS;
        for (rows, outputs) in rows.chunks(length).zip(outputs.chunks_mut(length)) {
            let mut block = Block::new(CHANNELS, rows, outputs, &mut []);
            simd.vectorize(Together { filters: &mut filters, block: &mut block });
        }
        outputs
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
