//! Theo1: weighted second differences of the phase about the middle of every window of m.

use super::differences::BLOCK;
use super::record::Record;

/// Sums over all windows and all distances from the middle, at each factor.
pub fn sums(record: &Record, factors: &[usize]) -> Vec<f64> {
    factors.iter().map(|m| sum_at(record, *m)).collect()
}

fn sum_at(record: &Record, m: usize) -> f64 {
    let mut sum = 0.0;
    let mut middles = [0.0; BLOCK];
    for x in record.stretches() {
        let terms = x.len().saturating_sub(m);
        for start in (0..terms).step_by(BLOCK) {
            let end = terms.min(start + BLOCK);
            let middles = &mut middles[..end - start];
            let ends = x[start..end].iter().zip(&x[start + m..end + m]);
            middles.iter_mut().zip(ends).for_each(|(middle, (a, b))| *middle = 0.5 * a + 0.5 * b);
            sum += (1..=m / 2)
                .map(|k| {
                    let slices = [&x[start + k..end + k], middles, &x[start + m - k..end + m - k]];
                    record.lanes().squared_differences(slices) / k as f64
                })
                .sum::<f64>();
        }
    }
    sum
}
