//! Filters after their start-up in SIMD lanes, one per lane, from tick to tick.

use core::array::from_fn;

use nalgebra::{SimdBool, SimdPartialOrd};
use num_traits::Zero;
use pulp::{Simd, WithSimd};

use super::{AutoFilter, begins};
use crate::math::{Lane, Laned, Limits, MAX_LANES, Mask, Real, choose};
use crate::rest::side_by_side::Tickers;
use crate::stream::Block;

/// Smallest number of rows for which lanes are faster than single filters.
const ROWS: usize = 8;
const FILTERS: usize = 4;

impl AutoFilter<f64> {
    /// True if its samples can be processed in lanes with another filter's samples.
    fn runs_with(&self, other: &Self) -> bool {
        !begins(self.status)
            && self.detector.is_settled()
            && self.detector.left() == other.detector.left()
            && self.params == other.params
    }
}

/// A block of rows and its filters.
pub struct Together<'a, 'b> {
    pub filters: &'a mut [AutoFilter<f64>],
    pub block: &'a mut Block<'b>,
}

impl WithSimd for Together<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { filters, block } = self;
        let first = filters.iter().find(|filter| filter.runs_with(filter)).copied();
        let indices = 0..filters.len();
        let (running, others): (Vec<usize>, Vec<usize>) =
            indices.partition(|c| first.as_ref().is_some_and(|first| filters[*c].runs_with(first)));
        one_by_one(filters, &others, block);
        for members in running.chunks(S::F64_LANES) {
            match members.len() >= FILTERS {
                false => one_by_one(filters, members, block),
                true => side_by_side::<S>(filters, members, block),
            }
        }
    }
}

/// Filters that do not share a register; compiled once, not once per kind of processor.
#[inline(never)]
fn one_by_one(filters: &mut [AutoFilter<f64>], members: &[usize], block: &mut Block<'_>) {
    for c in members {
        block.run(*c, &mut filters[*c]);
    }
}

/// Processes tick by tick: in lanes until a rare sample, then one by one to the tick's end.
#[inline(always)]
fn side_by_side<S: Simd>(
    filters: &mut [AutoFilter<f64>],
    members: &[usize],
    block: &mut Block<'_>,
) {
    let mut rows = block.n_rows::<AutoFilter<f64>>();
    let mut rest = block.after(0);
    while rows > 0 {
        let together = rows.min(rows_together(filters, members));
        let (mut taken, mut alone) = (0, rows_left(filters, members));
        if together >= ROWS {
            let lanes = Lanes::<S>::of(filters, members);
            taken = lanes.process(filters, members, &mut rest, together);
            alone -= taken;
        }
        if taken > 0 && alone == 0 {
            end_ticks(filters, members, &mut rest.part(taken - 1, 1));
        }
        let alone = alone.min(rows - taken);
        one_by_one(filters, members, &mut rest.part(taken, alone));
        rows -= taken + alone;
        rest = rest.skip(taken + alone);
    }
}

/// Number of rows to the end of the tick.
fn rows_left(filters: &[AutoFilter<f64>], members: &[usize]) -> usize {
    filters[members[0]].detector.left() as usize
}

/// Number of rows to the end of the tick, zero if not all filters run.
#[inline(never)]
fn rows_together(filters: &[AutoFilter<f64>], members: &[usize]) -> usize {
    let first = &filters[members[0]];
    let all = members.iter().all(|c| filters[*c].runs_with(first));
    if all { rows_left(filters, members) } else { 0 }
}

/// Ends the tick with its last row, for each filter that processes it.
#[inline(never)]
fn end_ticks(filters: &mut [AutoFilter<f64>], members: &[usize], row: &mut Block<'_>) {
    for (input, output) in row.rows() {
        for c in members {
            let filter = &mut filters[*c];
            if let Some(tick) = filter.detector.finished() {
                filter.take(&tick);
            }
            output[*c] = filter.params.behaviour.output(input[*c], filter.estimate);
        }
    }
}

/// Filters, one per lane; unused lanes repeat the first filter.
struct Lanes<S: Simd> {
    tickers: Tickers<S>,
    learns: Mask<S>,
    estimate: Lane<S>,
    gain: Lane<S>,
    most: Lane<S>,
    reach: Lane<S>,
    innovation: Lane<S>,
    /// Saturation level of a sample.
    limit: Lane<S>,
    compensated: bool,
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    fn of(filters: &[AutoFilter<f64>], members: &[usize]) -> Self {
        let own: [&AutoFilter<f64>; MAX_LANES] =
            from_fn(|i| &filters[*members.get(i).unwrap_or(&members[0])]);
        let behaviour = own[0].params.behaviour;
        let learns = Lane::load(&from_fn(|i| f64::from(u8::from(own[i].learns()))));
        Self {
            tickers: Tickers::of(from_fn(|i| &own[i].detector)),
            learns: learns.simd_gt(Lane::zero()),
            estimate: Lane::load(&from_fn(|i| own[i].estimate)),
            gain: Lane::load(&from_fn(|i| own[i].interim.gain)),
            most: Lane::load(&from_fn(|i| own[i].interim.most)),
            reach: Lane::load(&from_fn(|i| own[i].reach)),
            innovation: Lane::zero(),
            limit: Lane::of(behaviour.limit.unwrap_or(f64::INFINITY)),
            compensated: behaviour.compensated,
        }
    }

    /// Processes up to this number of rows, until a rare row; returns the number of rows.
    #[inline(always)]
    fn process(
        mut self,
        filters: &mut [AutoFilter<f64>],
        members: &[usize],
        block: &mut Block<'_>,
        rows: usize,
    ) -> usize {
        let indices: [usize; MAX_LANES] = from_fn(|i| *members.get(i).unwrap_or(&members[0]));
        let mut taken = 0;
        for (input, output) in block.rows().take(rows) {
            let numbers = from_fn(|i| if i < S::F64_LANES { input[indices[i]] } else { 0.0 });
            let z = Lane::load(&numbers);
            if !self.takes(z) {
                break;
            }
            let outputs = self.step(z.within(Lane::of(f64::MAX_RAW))).store();
            for (number, c) in outputs.iter().zip(indices).take(S::F64_LANES) {
                output[c] = *number;
            }
            taken += 1;
        }
        for (i, c) in members.iter().enumerate() {
            self.leave(i, taken, &mut filters[*c]);
        }
        taken
    }

    /// Gives the samples to the tickers, if no sample is rare.
    #[inline(always)]
    fn takes(&mut self, z: Lane<S>) -> bool {
        let usual = z.finite() & z.simd_abs().simd_lt(self.limit);
        usual.all() && self.tickers.take(z.within(Lane::of(f64::MAX_RAW)))
    }

    #[inline(always)]
    fn step(&mut self, z: Lane<S>) -> Lane<S> {
        let most = Lane::of(f64::MAX_RAW);
        self.reach = self.reach.at_least(z.simd_abs());
        let surprise = z - self.estimate;
        self.innovation = choose(self.learns, surprise.within(most), Lane::zero());
        let counts = surprise.simd_abs().simd_le(self.most);
        let followed = self.estimate + self.gain * choose(counts, surprise, Lane::zero());
        self.estimate = choose(self.learns, followed, self.estimate);
        if self.compensated { (z - self.estimate).within(most) } else { self.estimate }
    }

    /// Copies a lane's state back to its filter, after this number of samples.
    #[inline(always)]
    fn leave(&self, lane: usize, samples: usize, filter: &mut AutoFilter<f64>) {
        if samples == 0 {
            return;
        }
        self.tickers.leave(lane, &mut filter.detector);
        filter.estimate = self.estimate.lane(lane);
        filter.innovation = self.innovation.lane(lane);
        filter.reach = self.reach.lane(lane);
        (filter.missing, filter.saturated) = (false, false);
        filter.samples_seen += samples as u64;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use pulp::{Scalar128b, Scalar256b, Scalar512b, Simd};

    use super::{AutoFilter, Together};
    use crate::stream::Block;
    use crate::{AutoParams, Behaviour, Stream};

    const CHANNELS: usize = 11;

    /// Channels of noise, each with one rare event: coarse steps, lost samples, outliers, motion, a
    /// stuck sensor, a saturated sensor, a sensor that is off.
    fn rows(count: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1u64 << 24) as f64 - 0.5
        };
        let mut all = Vec::new();
        for k in 0..count {
            for c in 0..CHANNELS {
                let z = random() + random() + random();
                all.push(match c {
                    1 => (z * 3.0).round(),
                    2 if k % 131 == 7 => f64::NAN,
                    3 if k % 97 == 11 => 40.0 * z,
                    4 if k % 900 > 600 => z + 30.0 * (0.05 * k as f64).sin(),
                    5 if k % 700 > 350 => 0.25,
                    6 if k % 211 == 3 => 1e3,
                    7 => 0.0,
                    8 if k % 50 == 3 => -0.0,
                    _ => z + 1e-3 * k as f64 / (c + 1) as f64,
                });
            }
        }
        all
    }

    fn filters(compensated: bool, rate: f64) -> Vec<AutoFilter<f64>> {
        let behaviour = Behaviour { limit: Some(500.0), compensated, ..Behaviour::default() };
        let params = AutoParams { rate, behaviour, ..AutoParams::default() };
        vec![AutoFilter::new(params).expect("valid parameters"); CHANNELS]
    }

    fn bits(numbers: &[f64]) -> Vec<u64> {
        numbers.iter().map(|x| x.to_bits()).collect()
    }

    fn in_lanes<S: Simd>(simd: S, filters: &mut [AutoFilter<f64>], rows: &[f64]) -> Vec<u64> {
        let mut outputs = vec![0.0; rows.len()];
        let length = 300 * CHANNELS;
        for (rows, outputs) in rows.chunks(length).zip(outputs.chunks_mut(length)) {
            let mut block = Block::new(CHANNELS, rows, outputs, &mut []);
            simd.vectorize(Together { filters, block: &mut block });
        }
        bits(&outputs)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn any_number_of_lanes_gives_the_same(
            seed in any::<u64>(), compensated in any::<bool>(), rate in 30.0..300.0_f64,
        ) {
            let (rows, mut alone) = (rows(2500, seed), filters(compensated, rate));
            let mut expected = rows.clone();
            for (i, z) in expected.iter_mut().enumerate() {
                *z = alone[i % CHANNELS].update(*z);
            }
            let expected = bits(&expected);
            prop_assert!(alone.iter().filter(|filter| filter.model.is_some()).count() > 5);
            let check = |outputs: Vec<u64>, filters: &[AutoFilter<f64>]| {
                prop_assert_eq!(outputs, &expected[..]);
                let state = |filters: &[AutoFilter<f64>]| format!("{filters:?}");
                prop_assert_eq!(state(filters), state(&alone));
                Ok(())
            };
            let mut one = filters(compensated, rate);
            check(in_lanes(Scalar128b, &mut one, &rows), &one)?;
            let mut one = filters(compensated, rate);
            check(in_lanes(Scalar256b, &mut one, &rows), &one)?;
            let mut one = filters(compensated, rate);
            check(in_lanes(Scalar512b, &mut one, &rows), &one)?;
        }
    }
}
