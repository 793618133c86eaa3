//! The power law of the rate's noise, S(f) ~ f^α, at one averaging time.
//!
//! It follows from the correlation of neighbouring averages (Riley & Greenhall 2004; NIST SP 1065,
//! 5.5.6). For few averages it follows from the ratio of their variances (5.5.3). Averages hardly
//! distinguish white and flicker phase noise; the ratio of modified and plain Allan variance does
//! (5.5.5).

use std::f64::consts::{LN_2, PI};

use super::record::Record;

/// Largest number of averages: the standard error of their correlation is then 0.02.
const MAX_AVERAGES: usize = 1 << 11;

/// Smallest number of averages for a correlation, and for any estimate.
const MIN_CORRELATION_AVERAGES: usize = 30;
const MIN_AVERAGES: usize = 4;

/// Exponent α of averages over `m` samples, at least `lowest`; `None` if there are too few.
pub fn exponent(record: &Record, m: usize, lowest: i32) -> Option<i32> {
    let x = record.longest_segment();
    let count = (x.len().saturating_sub(1) / m).min(MAX_AVERAGES);
    if count < MIN_AVERAGES {
        return None;
    }
    let x = middle(x, count * m + 1);
    let points: Vec<f64> = x.iter().step_by(m).copied().collect();
    let averages = differences(&points);
    let alpha = match count < MIN_CORRELATION_AVERAGES {
        true => from_variances(&averages, lowest)?,
        false => from_correlation(averages, m, lowest)?,
    };
    // Averages of two or three samples cannot distinguish the phase noises.
    Some(if alpha >= 1 && m > 3 { phase_noise(x, m) } else { alpha })
}

fn middle(x: &[f64], length: usize) -> &[f64] {
    let start = (x.len() - length) / 2;
    &x[start..start + length]
}

fn differences(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

fn without_mean(mut values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter_mut().for_each(|value| *value -= mean);
    values
}

fn sum_of_squares(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

/// Smallest correlation r at lag one, as δ = r / (1 + r), from which differences are taken. δ is 0
/// for white noise, 0.2 for the differences of an averaged walk, and at least 0.4 for redder noise.
const RED_NOISE_DELTA: [f64; 3] = [0.25, 0.33, f64::INFINITY];

/// Middle between the expected values for flicker noise and a walk, after one difference and after
/// two: for single samples, and for averages, which are correlated.
const WALK_BOUNDARY: [[f64; 2]; 2] = [[-0.18, -0.18], [-0.03, 0.12]];

/// Takes differences until the rest is nearly white; its correlation at lag one gives the remaining
/// exponent.
fn from_correlation(mut averages: Vec<f64>, m: usize, lowest: i32) -> Option<i32> {
    let most = (-lowest / 2) as usize;
    let mut taken = 0;
    let delta = loop {
        let rest = without_mean(averages);
        let delta = correlation(&rest)?;
        if taken == most || delta < RED_NOISE_DELTA[taken] {
            break delta;
        }
        averages = differences(&rest);
        taken += 1;
    };
    Some(match taken {
        0 => (-2.0 * delta).round().clamp(0.0, 2.0) as i32,
        _ => -2 * taken as i32 + i32::from(delta < WALK_BOUNDARY[usize::from(m > 1)][taken - 1]),
    })
}

fn correlation(values: &[f64]) -> Option<f64> {
    let products: f64 = values.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let r = products / sum_of_squares(values);
    (!r.is_nan()).then_some(r / (1.0 + r))
}

/// Exponent from the ratio of sample variance and Allan variance, which grows with the redness of
/// the noise.
fn from_variances(averages: &[f64], lowest: i32) -> Option<i32> {
    let n = averages.len() as f64;
    let allan = sum_of_squares(&differences(averages)) / (2.0 * (n - 1.0));
    let ratio = sum_of_squares(&without_mean(averages.to_vec())) / (n - 1.0) / allan;
    if ratio.is_nan() {
        return None;
    }
    // Expected values for α = 1, 0, -1, -2, -3.
    let expected = [
        2.0 * (n + 1.0) / (3.0 * n),
        1.0,
        n * n.ln() / (2.0 * (n - 1.0) * LN_2),
        n / 2.0,
        n * (n + 1.0) / 6.0,
    ];
    let passed = expected.windows(2).take_while(|pair| ratio > (pair[0] * pair[1]).sqrt()).count();
    Some((1 - passed as i32).max(lowest))
}

/// 2 for white and 1 for flicker phase noise.
fn phase_noise(x: &[f64], m: usize) -> i32 {
    let white = 1.0 / m as f64;
    let flicker = 3.374 / (1.038 + 3.0 * (PI * m as f64).ln());
    if modified_ratio(x, m) < (white * flicker).sqrt() { 2 } else { 1 }
}

/// Modified over plain Allan variance.
fn modified_ratio(x: &[f64], m: usize) -> f64 {
    let difference = |i: usize| x[i + 2 * m] - 2.0 * x[i + m] + x[i];
    let mut window: f64 = (0..m).map(difference).sum();
    let (mut plain, mut modified) = (0.0, 0.0);
    for j in 0..x.len() - 3 * m {
        let leaving = difference(j);
        plain += leaving * leaving;
        modified += window * window;
        window += difference(j + m) - leaving;
    }
    modified / (plain * (m as f64).powi(2))
}
