//! Static intervals: the part of each still interval with the most precise mean rate.

use nalgebra::Vector3;

use super::still::{BLOCK_S, MAX_SIGMA_RAD_S, MAX_STILL_SPEED_M_S, MIN_BLOCKS, sigma_of};
use super::{runs, samples_in};
use crate::error::Error;
use crate::memory;

/// Shortest still interval, s.
const MIN_INTERVAL_S: f64 = 0.5;
/// Number of steps in a long interval at which parts begin and end.
const INTERVAL_STEPS: usize = 40;

/// Static interval of the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StaticInterval {
    /// First sample and end (exclusive).
    pub samples: (usize, usize),
    /// End (exclusive) of the whole still interval.
    pub until: usize,
    /// Mean rate, rad/s.
    pub rate: Vector3<f64>,
    /// Standard deviation of the rate, rad/s.
    pub sigma: f64,
}

/// All static intervals from a sample on.
pub(super) fn find(
    bound: &[f64],
    gyro: &[[f64; 3]],
    dt: f64,
    from: usize,
) -> Result<Vec<StaticInterval>, Error> {
    let mut found = Vec::new();
    for (first, end) in runs(bound.len(), |k| bound[k] < MAX_STILL_SPEED_M_S) {
        if (end - first) as f64 * dt < MIN_INTERVAL_S {
            continue;
        }
        if let Some(mut rest) = best(&gyro[first..end], dt)? {
            rest.samples = (rest.samples.0 + first, rest.samples.1 + first);
            rest.until = end;
            if rest.samples.0 >= from {
                memory::reserve(&mut found, 1)?;
                found.push(rest);
            }
        }
    }
    Ok(found)
}

/// The part with the most precise mean rate, if any part is precise enough.
fn best(gyro: &[[f64; 3]], dt: f64) -> Result<Option<StaticInterval>, Error> {
    let size = samples_in(BLOCK_S, dt);
    let n = gyro.len() / size;
    let mut means: Vec<Vector3<f64>> = memory::room(n)?;
    for block in gyro.chunks_exact(size) {
        let sum: Vector3<f64> = block.iter().map(|rate| Vector3::from(*rate)).sum();
        means.push(sum / size as f64);
    }
    let mut best: Option<StaticInterval> = None;
    for count in (MIN_BLOCKS..=n).step_by((n / INTERVAL_STEPS).max(1)) {
        for first in (0..=n - count).step_by((count / INTERVAL_STEPS).max(1)) {
            let (rate, sigma) = mean_of(&means[first..first + count], size as f64 * dt);
            if best.is_none_or(|best| sigma < best.sigma) {
                let samples = (first * size, (first + count) * size);
                best = Some(StaticInterval { samples, until: 0, rate, sigma });
            }
        }
    }
    Ok(best.filter(|rest| rest.sigma <= MAX_SIGMA_RAD_S))
}

/// Mean of blocks and its standard deviation.
fn mean_of(blocks: &[Vector3<f64>], seconds: f64) -> (Vector3<f64>, f64) {
    let count = blocks.len() as f64;
    let mean = blocks.iter().sum::<Vector3<f64>>() / count;
    let (mut squares, mut products) = (Vector3::zeros(), Vector3::<f64>::zeros());
    for block in blocks {
        squares += (block - mean).component_mul(&(block - mean));
    }
    for pair in blocks.windows(2) {
        products += (pair[0] - mean).component_mul(&(pair[1] - mean));
    }
    (mean, sigma_of(&squares, &products, count, seconds))
}
