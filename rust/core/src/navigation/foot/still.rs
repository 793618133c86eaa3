//! Live static intervals: the part of a still interval with the most precise mean rate to date.

use nalgebra::{ComplexField, Vector3};
use serde::{Deserialize, Serialize};

use super::DEGREE;
use crate::math::validity::{are_within, is_count, is_size};
use crate::navigation::filter::MAX_SAMPLE;

/// Largest speed bound of a still interval, m/s.
pub(super) const MAX_STILL_SPEED_M_S: f64 = 0.01;
/// Duration of a block, s, and smallest number of blocks.
pub(super) const BLOCK_S: f64 = 0.1;
pub(super) const MIN_BLOCKS: usize = 5;
/// Smallest and largest error of a mean over a second, rad/s; with a larger error it is no rest.
pub(super) const MIN_SECOND_SIGMA_RAD_S: f64 = 0.02 * DEGREE;
pub(super) const MIN_SIGMA_RAD_S: f64 = 0.01 * DEGREE;
pub(super) const MAX_SIGMA_RAD_S: f64 = 0.2 * DEGREE;
/// Largest correlation of neighbouring blocks.
pub(super) const MAX_CORRELATION: f64 = 0.9;
/// Largest number of blocks in a rest; with more the smallest standard deviation is reached.
const MAX_BLOCKS: usize = 32;
/// Bounds of a valid state.
const MAX_RATE: f64 = 2.0 * MAX_SAMPLE;

/// A part of a still interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct RestMean {
    pub rate: Vector3<f64>,
    pub force: Vector3<f64>,
    /// Standard deviation of the rate, rad/s.
    pub sigma: f64,
}

/// Means of a block.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Means {
    rate: Vector3<f64>,
    force: Vector3<f64>,
}

impl Means {
    const ZERO: Self =
        Self { rate: Vector3::new(0.0, 0.0, 0.0), force: Vector3::new(0.0, 0.0, 0.0) };
}

/// Change of the static intervals by a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum News {
    None,
    /// A better part of the present interval.
    Better(RestMean),
    /// An interval has ended, with its best part.
    Ended(RestMean),
}

/// The present still interval, if there is one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Still {
    /// First sample of the interval.
    since: Option<u64>,
    /// Sums of the present block, and its number of samples.
    sum: Means,
    samples: u32,
    /// The last blocks, and their number to date.
    blocks: [Means; MAX_BLOCKS],
    count: u64,
    best: Option<RestMean>,
}

impl Still {
    pub fn new() -> Self {
        let (sum, blocks) = (Means::ZERO, [Means::ZERO; MAX_BLOCKS]);
        Self { since: None, sum, samples: 0, blocks, count: 0, best: None }
    }

    /// First sample of the present interval.
    pub fn since(&self) -> Option<u64> {
        self.since
    }

    /// True if a part of the interval is a rest.
    pub fn is_resting(&self) -> bool {
        self.best.is_some()
    }

    /// Adds a sample with its bound; a block has `size` samples, `dt` seconds apart.
    pub fn look(
        &mut self,
        k: u64,
        bound: f64,
        [rate, force]: [Vector3<f64>; 2],
        (size, dt): (u32, f64),
    ) -> News {
        if bound >= MAX_STILL_SPEED_M_S {
            if self.since.is_none() {
                return News::None;
            }
            let best = self.best;
            *self = Self { blocks: self.blocks, ..Self::new() };
            return best.map_or(News::None, News::Ended);
        }
        self.since.get_or_insert(k);
        self.sum.rate += rate;
        self.sum.force += force;
        self.samples += 1;
        if self.samples < size {
            return News::None;
        }
        let each = 1.0 / f64::from(size);
        let block = Means { rate: self.sum.rate * each, force: self.sum.force * each };
        (self.sum, self.samples) = (Means::ZERO, 0);
        self.blocks[(self.count % MAX_BLOCKS as u64) as usize] = block;
        self.count += 1;
        self.test(f64::from(size) * dt)
    }

    /// Tests the parts that end with this block; returns a part if it is better than all earlier
    /// parts.
    fn test(&mut self, seconds: f64) -> News {
        let most = if self.count < MAX_BLOCKS as u64 { self.count as usize } else { MAX_BLOCKS };
        let block = |back: usize| {
            let index = (self.count - 1).saturating_sub(back as u64) % MAX_BLOCKS as u64;
            &self.blocks[index as usize]
        };
        let newest = block(0).rate;
        let zero = Vector3::<f64>::zeros();
        let (mut sum, mut squares, mut products, mut force) = (zero, zero, zero, zero);
        let mut after = zero;
        let mut better = None;
        for back in 0..most {
            let rate = block(back).rate - newest;
            sum += rate;
            squares += rate.component_mul(&rate);
            products += rate.component_mul(&after);
            force += block(back).force;
            after = rate;
            let count = back + 1;
            if count < MIN_BLOCKS {
                continue;
            }
            let n = count as f64;
            let mean = sum / n;
            // Relative to the mean; the last of them is zero here.
            let squares = squares - mean.component_mul(&mean) * n;
            let products = products - mean.component_mul(&(sum * 2.0 - rate))
                + mean.component_mul(&mean) * (n - 1.0);
            let sigma = sigma_of(&squares, &products, n, seconds);
            let least = better
                .or(self.best)
                .map_or(MAX_SIGMA_RAD_S, |found_rest: RestMean| found_rest.sigma);
            if sigma < least {
                better = Some(RestMean { rate: newest + mean, force: force / n, sigma });
            }
        }
        let Some(found_rest) = better else { return News::None };
        self.best = better;
        News::Better(found_rest)
    }

    pub fn is_valid(&self, size: u32) -> bool {
        let means = |of: &Means, most: f64| {
            are_within(&of.rate, MAX_RATE * most) && are_within(&of.force, MAX_RATE * most)
        };
        let found_rest = |of: &RestMean| {
            are_within(&of.rate, 10.0)
                && are_within(&of.force, MAX_RATE)
                && is_size(of.sigma, MAX_SIGMA_RAD_S)
        };
        self.since.is_none_or(is_count)
            && self.samples < size
            && means(&self.sum, f64::from(size))
            && self.blocks.iter().all(|block| means(block, 1.0))
            && is_count(self.count)
            && self.best.as_ref().is_none_or(found_rest)
    }
}

impl RestMean {
    pub fn is_valid(&self) -> bool {
        are_within(&self.rate, 10.0)
            && are_within(&self.force, MAX_RATE)
            && is_size(self.sigma, MAX_SIGMA_RAD_S)
            && self.sigma > 0.0
    }
}

/// Standard deviation of a mean of `n` blocks, from sums of squares and of neighbours' products
/// about it.
pub(super) fn sigma_of(
    squares: &Vector3<f64>,
    products: &Vector3<f64>,
    n: f64,
    seconds: f64,
) -> f64 {
    let mut square = MIN_SECOND_SIGMA_RAD_S * MIN_SECOND_SIGMA_RAD_S / (n * seconds)
        + MIN_SIGMA_RAD_S * MIN_SIGMA_RAD_S;
    for i in 0..3 {
        let size = if squares[i] > 1e-30 { squares[i] } else { 1e-30 };
        let rho = (products[i] / size).clamp(0.0, MAX_CORRELATION);
        let positive = if squares[i] > 0.0 { squares[i] } else { 0.0 };
        square += positive / (n - 1.0) / n * (1.0 + rho) / (1.0 - rho) / 3.0;
    }
    ComplexField::sqrt(square)
}
