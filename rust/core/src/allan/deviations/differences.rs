//! ADEV, OADEV, HDEV, OHDEV, TOTDEV and Theo1: sums of squared differences of the phase.

use std::array::from_fn;

use super::kernels::SquaredDifferences;
use super::record::Record;
use crate::work;

/// Number of terms of one factor before the next factor: the points stay in the nearest cache.
const BLOCK: usize = 1024;

/// Number of factors processed alternately on a block.
pub const GROUP: usize = 4;

/// Sums of all squared differences of K points, 3 for Allan and 4 for Hadamard, at each factor.
pub fn overlapping<const K: usize>(record: &Record, factors: &[usize]) -> Vec<f64> {
    let mut sums = vec![0.0; factors.len()];
    for x in record.segments() {
        let terms = |m: usize| x.len().saturating_sub(m.saturating_mul(K - 1));
        let most = factors.iter().map(|m| terms(*m)).max().unwrap_or(0);
        for start in (0..most).step_by(BLOCK) {
            work::pause();
            for (m, sum) in factors.iter().zip(&mut sums) {
                let end = terms(*m).min(start + BLOCK);
                if start < end {
                    let slices = from_fn::<_, K, _>(|k| &x[start + k * m..end + k * m]);
                    *sum += record.arch().dispatch(SquaredDifferences(slices));
                }
            }
        }
    }
    sums
}

/// Sums of the squared differences of adjacent clusters, at each factor.
pub fn separate<const K: usize>(record: &Record, factors: &[usize]) -> Vec<f64> {
    factors.iter().map(|m| separate_at::<K>(record, *m)).collect()
}

fn separate_at<const K: usize>(record: &Record, m: usize) -> f64 {
    let mut block = Vec::with_capacity(BLOCK);
    let mut sum = 0.0;
    for x in record.segments() {
        let mut points = x.iter().step_by(m).copied();
        block.clear();
        loop {
            work::pause();
            block.extend(points.by_ref().take(BLOCK - block.len()));
            let Some(terms) = block.len().checked_sub(K - 1).filter(|terms| *terms > 0) else {
                break;
            };
            sum += record
                .arch()
                .dispatch(SquaredDifferences(from_fn::<_, K, _>(|k| &block[k..k + terms])));
            block.drain(..terms);
        }
    }
    sum
}

/// TOTDEV: sums of the squared second differences about all points of each segment except its ends,
/// at each factor. The segment is reflected about its ends.
pub fn total(record: &Record, factors: &[usize]) -> Vec<f64> {
    let mut sums = vec![0.0; factors.len()];
    let (mut before, mut after) = ([0.0; BLOCK], [0.0; BLOCK]);
    for x in record.segments() {
        let last = x.len() - 1;
        for start in (1..last).step_by(BLOCK) {
            work::pause();
            let end = last.min(start + BLOCK);
            for (m, sum) in factors.iter().zip(&mut sums).filter(|(m, _)| **m <= last) {
                let before = points_before(x, start, end, *m, &mut before);
                let after = points_after(x, start, end, *m, &mut after);
                *sum += record.arch().dispatch(SquaredDifferences([before, &x[start..end], after]));
            }
        }
    }
    sums
}

/// The points m before those from `start` to `end`: a slice of `x`, or reflected at its start.
fn points_before<'a>(
    x: &'a [f64],
    start: usize,
    end: usize,
    m: usize,
    block: &'a mut [f64; BLOCK],
) -> &'a [f64] {
    if m <= start {
        return &x[start - m..end - m];
    }
    let block = &mut block[..end - start];
    let (reflected, inside) = block.split_at_mut((m - start).min(end - start));
    let mirror = &x[m + 1 - start - reflected.len()..m + 1 - start];
    reflected.iter_mut().zip(mirror.iter().rev()).for_each(|(b, z)| *b = 2.0 * x[0] - z);
    inside.copy_from_slice(&x[..inside.len()]);
    block
}

/// The points m after those from `start` to `end`: a slice of `x`, or reflected at its end.
fn points_after<'a>(
    x: &'a [f64],
    start: usize,
    end: usize,
    m: usize,
    block: &'a mut [f64; BLOCK],
) -> &'a [f64] {
    let last = x.len() - 1;
    if end + m <= x.len() {
        return &x[start + m..end + m];
    }
    let block = &mut block[..end - start];
    let (inside, reflected) = block.split_at_mut(x.len().saturating_sub(start + m));
    inside.copy_from_slice(&x[x.len() - inside.len()..]);
    let first = start + m + inside.len() - last;
    let mirror = &x[last + 1 - first - reflected.len()..last + 1 - first];
    reflected.iter_mut().zip(mirror.iter().rev()).for_each(|(b, z)| *b = 2.0 * x[last] - z);
    block
}

/// Theo1: sums of the weighted second differences about the middle of every window of m points,
/// over all distances from the middle, at each factor.
pub fn theo1(record: &Record, factors: &[usize]) -> Vec<f64> {
    factors.iter().map(|m| theo1_at(record, *m)).collect()
}

fn theo1_at(record: &Record, m: usize) -> f64 {
    let mut sum = 0.0;
    let mut middles = [0.0; BLOCK];
    for x in record.segments() {
        let terms = x.len().saturating_sub(m);
        for start in (0..terms).step_by(BLOCK) {
            work::pause();
            let end = terms.min(start + BLOCK);
            let middles = &mut middles[..end - start];
            let ends = x[start..end].iter().zip(&x[start + m..end + m]);
            middles.iter_mut().zip(ends).for_each(|(middle, (a, b))| *middle = 0.5 * a + 0.5 * b);
            sum += (1..=m / 2)
                .map(|k| {
                    let slices = [&x[start + k..end + k], middles, &x[start + m - k..end + m - k]];
                    record.arch().dispatch(SquaredDifferences(slices)) / k as f64
                })
                .sum::<f64>();
        }
    }
    sum
}
