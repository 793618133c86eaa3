//! ADEV, OADEV, HDEV, OHDEV: differences of the phase, K = 3 points for Allan, 4 for Hadamard.

use std::array::from_fn;

use super::record::Record;

/// Terms of one factor before the next has its turn: its points stay in the nearest cache.
pub const BLOCK: usize = 1024;

/// Factors that take turns on a block.
pub const GROUP: usize = 4;

/// Sums of all squared differences at each factor.
pub fn overlapping<const K: usize>(record: &Record, factors: &[usize]) -> Vec<f64> {
    let mut sums = vec![0.0; factors.len()];
    for x in record.stretches() {
        let terms = |m: usize| x.len().saturating_sub(m.saturating_mul(K - 1));
        let most = factors.iter().map(|m| terms(*m)).max().unwrap_or(0);
        for start in (0..most).step_by(BLOCK) {
            for (m, sum) in factors.iter().zip(&mut sums) {
                let end = terms(*m).min(start + BLOCK);
                if start < end {
                    let slices = from_fn::<_, K, _>(|k| &x[start + k * m..end + k * m]);
                    *sum += record.lanes().squared_differences(slices);
                }
            }
        }
    }
    sums
}

/// Sums of the squared differences of clusters side by side, at each factor.
pub fn separate<const K: usize>(record: &Record, factors: &[usize]) -> Vec<f64> {
    factors.iter().map(|m| separate_at::<K>(record, *m)).collect()
}

fn separate_at<const K: usize>(record: &Record, m: usize) -> f64 {
    let mut block = Vec::with_capacity(BLOCK);
    let mut sum = 0.0;
    for x in record.stretches() {
        let mut points = x.iter().step_by(m).copied();
        block.clear();
        loop {
            block.extend(points.by_ref().take(BLOCK - block.len()));
            let Some(terms) = block.len().checked_sub(K - 1).filter(|terms| *terms > 0) else {
                break;
            };
            sum += record.lanes().squared_differences(from_fn::<_, K, _>(|k| &block[k..k + terms]));
            block.drain(..terms);
        }
    }
    sum
}
