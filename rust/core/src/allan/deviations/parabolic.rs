//! PDEV: slopes of least-squares lines through the phase of neighbouring clusters.

use super::differences;
use super::record::Record;

/// Sums of the squared differences of slopes, at each factor.
pub fn sums(record: &Record, factors: &[usize]) -> Vec<f64> {
    factors.iter().map(|m| sum_at(record, *m)).collect()
}

fn sum_at(record: &Record, m: usize) -> f64 {
    if m == 1 {
        return differences::overlapping::<3>(record, &[1])[0];
    }
    // Two sliding sums gather rounding errors faster than one: they are made anew often.
    let renewal = (4 * m).max(256);
    let mut sum = 0.0;
    for x in record.stretches() {
        let terms = x.len().saturating_sub(m.saturating_mul(2));
        for start in (0..terms).step_by(renewal) {
            sum += sum_of_block(&x[start..], m, renewal.min(terms - start));
        }
    }
    sum
}

/// The first `terms` terms of `x`, the first one by its definition.
fn sum_of_block(x: &[f64], m: usize, terms: usize) -> f64 {
    let drop = |i: usize| x[i] - x[i + m];
    let lever = (m - 1) as f64 / 2.0;
    let mut level: f64 = (0..m).map(drop).sum();
    let mut slope: f64 = (0..m).map(|k| (lever - k as f64) * drop(k)).sum();
    let mut sum = slope * slope;
    for i in 0..terms - 1 {
        let (leaving, entering) = (drop(i), drop(i + m));
        slope += level - (lever + 1.0) * leaving - lever * entering;
        level += entering - leaving;
        sum += slope * slope;
    }
    sum
}
