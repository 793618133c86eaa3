//! Validity of a restored array.

use super::centralised::{Centralised, Walk};
use super::noise::{Halves, Noise, Sums};
use super::octaves::{OCTAVES, Octave, Octaves};
use super::vote::{Standing, Vote};
use super::{GyroArray, MAX_SAMPLE, MIN_WEIGHT_SUM};
use crate::math::validity::{is_count, is_sample, is_size, is_within};
use crate::stream::checkpoint::Checkpoint;

/// Largest mean of samples in the axes of the body: three of them, each times at most one and a
/// half.
const MAX_ROTATED_MEAN: f64 = 8.0 * MAX_SAMPLE;

/// Square of the largest difference.
const MAX_SQUARED_DIFFERENCE: f64 = 4.0 * MAX_ROTATED_MEAN * MAX_ROTATED_MEAN;

/// Largest weight of a sensor, if others are negative.
const MAX_WEIGHT: f64 = 1.0 / MIN_WEIGHT_SUM + 1e-9;

impl<const A: usize> Checkpoint for GyroArray<A> {
    const TAG: &'static str = "gyro-array";
    const VERSION: u16 = 3;
    const SIZES: [u8; 2] = [A as u8, 0];

    fn is_valid(&self) -> bool {
        let (n, params) = (self.params.sensors, &self.params);
        if params.check(A).is_err() {
            return false;
        }
        let sizes = [
            (self.filters.len(), n * A),
            (self.at_rest.len(), A),
            (self.weights.len(), n * A),
            (self.used.len(), n * A),
            (self.seen.len(), n),
            (self.rates.len(), n * A),
            (self.near.len(), n * A),
            (self.sorted.len(), n * A),
        ];
        sizes.iter().all(|(found, expected)| found == expected)
            && params
                .body_rotations::<A>()
                .is_ok_and(|body_rotations| body_rotations == self.body_rotations)
            && is_count(self.samples)
            && self.filters.iter().all(|filter| {
                filter.params() == &params.of_filter()
                    && self.length == filter.tick_length()
                    && filter.is_valid()
            })
            && self.position < self.length
            && self.weights.iter().all(|w| w.abs() <= MAX_WEIGHT)
            && self.centralised.is_valid(n, A)
            && self.noise.is_valid(n, A, self.position)
            && self.vote.is_valid(n, A, self.position)
    }
}

impl Centralised {
    fn is_valid(&self, sensors: usize, axes: usize) -> bool {
        let is_walk = |walk: &Walk| {
            is_sample(walk.level, MAX_SAMPLE) && 0.0 < walk.variance && walk.variance <= 1e6
        };
        (self.first.len(), self.second.len(), self.took.len())
            == (sensors * axes, axes, sensors * axes)
            && self.first.iter().chain(&self.second).all(is_walk)
    }
}

impl Noise {
    fn is_valid(&self, sensors: usize, axes: usize, position: u32) -> bool {
        let all = sensors * axes;
        let sizes = [
            self.sums.len(),
            self.ticks.len(),
            self.halves.len(),
            self.ratios.len(),
            self.white.len(),
        ];
        self.axes == axes
            && sizes.iter().all(|size| *size == all)
            && (self.octaves.len(), self.second.len()) == (axes, axes)
            && self.sums.iter().all(|sums| sums.is_valid(position))
            && self.ticks.iter().all(Halves::is_valid)
            && self
                .halves
                .iter()
                .all(|one| is_size(one.sum, MAX_SQUARED_DIFFERENCE * f64::from(one.count)))
            && self.octaves.iter().all(|octaves| octaves.is_valid(sensors))
            && self.ratios.iter().chain(&self.white).all(|x| (1e-2..=1e4).contains(x))
            && self.second.iter().all(|x| x.is_nan() || is_size(*x, MAX_SQUARED_DIFFERENCE))
    }
}

impl Sums {
    fn is_valid(&self, position: u32) -> bool {
        let counts = self.counts.iter().map(|count| u64::from(*count)).sum::<u64>();
        counts <= u64::from(position)
            && (0..2).all(|k| is_within(self.sums[k], MAX_SAMPLE * f64::from(self.counts[k])))
    }
}

impl Halves {
    fn is_valid(&self) -> bool {
        // The two halves of a tick, or neither.
        [self.waiting, self.followed].iter().all(|tick| {
            tick.iter().all(|x| is_sample(*x, MAX_ROTATED_MEAN))
                && tick[0].is_nan() == tick[1].is_nan()
        })
    }
}

impl Octaves {
    fn is_valid(&self, sensors: usize) -> bool {
        self.sensors == sensors
            && self.all.len() == OCTAVES
            && self.mean.len() == sensors
            && self.mean.iter().all(|x| is_sample(*x, MAX_ROTATED_MEAN))
            && self.all.iter().all(|octave| octave.is_valid(sensors))
    }
}

impl Octave {
    fn is_valid(&self, sensors: usize) -> bool {
        let most = 4.0 * MAX_SQUARED_DIFFERENCE;
        (self.last.len(), self.half.len()) == (sensors, sensors)
            && (self.products.len(), self.counts.len()) == (sensors * sensors, sensors * sensors)
            && self.last.iter().chain(&self.half).all(|x| is_sample(*x, MAX_ROTATED_MEAN))
            && self.products.iter().zip(&self.counts).enumerate().all(|(index, (x, count))| {
                let least = if index % (sensors + 1) == 0 { 0.0 } else { -most };
                let count = f64::from(*count);
                least * count <= *x && *x <= most * count
            })
    }
}

impl Vote {
    fn is_valid(&self, sensors: usize, axes: usize, position: u32) -> bool {
        let (all, samples) = (sensors * axes, f64::from(position));
        (self.sums.len(), self.sigmas.len(), self.standings.len()) == (all, all, sensors)
            && (self.squares.len(), self.voters.len(), self.known.len()) == (axes, axes, axes)
            && self.sums.iter().all(|sums| {
                sums.far <= sums.count
                    && sums.count <= position
                    && is_within(sums.difference, MAX_SAMPLE * samples)
                    && is_within(sums.product, MAX_SQUARED_DIFFERENCE * samples)
                    && is_within(sums.largest[0], MAX_ROTATED_MEAN)
                    && is_within(sums.largest[1], MAX_SQUARED_DIFFERENCE)
            })
            && self.sigmas.iter().all(|x| x.is_nan() || is_size(*x, MAX_ROTATED_MEAN))
            && self.sorted.len() == sensors
            && self.squares.iter().all(|x| is_size(*x, MAX_SQUARED_DIFFERENCE * samples))
            && self.voters.iter().all(|count| *count as usize <= sensors)
            && is_size(self.speeds, MAX_SQUARED_DIFFERENCE * samples)
            && self.samples <= position
            && self.standings.iter().all(Standing::is_valid)
    }
}

impl Standing {
    fn is_valid(&self) -> bool {
        is_size(self.exposed, MAX_ROTATED_MEAN) && self.agreed < 1 << 20
    }
}
