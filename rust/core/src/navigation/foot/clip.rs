//! Rates that a gyro clipped at its range: found in the recording, restored from their flanks.

use super::{DEGREE, runs};
use crate::error::Error;
use crate::memory;

/// A gyro that never turned so fast, rad/s, is not looked at.
const FAST: f64 = 100.0 * DEGREE;
/// Parts of the largest rate: of samples at the limit, of those below it, and of those restored.
const AT: f64 = 0.96;
const NEAR: f64 = 0.88;
const RUN: f64 = 0.965;
/// Seconds at the limit, and how many there must be of those below it.
const SECONDS: f64 = 0.1;
const SHARE: f64 = 0.5;
/// What flanks must promise beyond the limit, on average, as a part of it.
const EXCESS: f64 = 0.015;
/// A restored rate is at most so many limits, and wrong by these parts: of what was added, and of the
/// limit.
const MOST: f64 = 2.0;
const WRONG: [f64; 2] = [0.5, 0.05];
/// Samples that a run needs on either side.
const FLANK: usize = 3;

/// One axis and sign that was clipped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clipped {
    /// Of the gyro.
    pub axis: usize,
    /// 1 or -1.
    pub sign: f64,
    /// The range, rad/s.
    pub limit: f64,
    /// Samples that were restored.
    pub samples: usize,
}

/// What the flanks of a run promise: a cubic through the samples beside it, with their slopes.
#[derive(Debug, Clone, Copy)]
struct Cubic {
    first: usize,
    steps: f64,
    ends: [f64; 2],
    slopes: [f64; 2],
}

impl Cubic {
    fn over(x: impl Fn(usize) -> f64, (first, end): (usize, usize)) -> Self {
        Self {
            first,
            steps: (end - first + 1) as f64,
            ends: [x(first - 1), x(end)],
            slopes: [(x(first - 1) - x(first - 2)).max(0.0), (x(end + 1) - x(end)).min(0.0)],
        }
    }

    fn at(&self, k: usize) -> f64 {
        let s = (k - self.first + 1) as f64 / self.steps;
        let (s2, s3) = (s * s, s * s * s);
        let [from, to] = self.ends;
        let [rise, fall] = self.slopes.map(|slope| slope * self.steps);
        (2.0 * s3 - 3.0 * s2 + 1.0) * from
            + (s3 - 2.0 * s2 + s) * rise
            + (3.0 * s2 - 2.0 * s3) * to
            + (s3 - s2) * fall
    }
}

/// Restores, in place, rates (rad/s, finite) that a gyro clipped, of samples `dt` seconds apart; adds
/// to `variance`, one a sample, what a restored rate is wrong by: density of a white noise, rad²/s.
///
/// # Errors
/// [`Error::Memory`] if there is none.
pub fn restore_clipped(
    gyro: &mut [[f64; 3]],
    dt: f64,
    variance: &mut [f64],
) -> Result<Vec<Clipped>, Error> {
    let mut found = Vec::new();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            if let Some(clipped) = restore_side(gyro, dt, variance, axis, sign)? {
                found.push(clipped);
            }
        }
    }
    Ok(found)
}

fn restore_side(
    gyro: &mut [[f64; 3]],
    dt: f64,
    variance: &mut [f64],
    axis: usize,
    sign: f64,
) -> Result<Option<Clipped>, Error> {
    let n = gyro.len();
    let side = |k: usize| sign * gyro[k][axis];
    let limit = (0..n).map(side).fold(0.0, f64::max);
    if limit < FAST {
        return Ok(None);
    }
    let count = |holds: &dyn Fn(f64) -> bool| (0..n).filter(|k| holds(side(*k))).count() as f64;
    let at = count(&|x| x > AT * limit);
    let near = count(&|x| x > NEAR * limit && x <= AT * limit);
    if at * dt < SECONDS || at < SHARE * near {
        return Ok(None);
    }
    let inside =
        |&(first, end): &(usize, usize)| end - first >= 2 && first >= FLANK && end + FLANK <= n;
    let mut peaks = memory::room(0)?;
    for run in runs(n, |k| side(k) > RUN * limit).filter(inside) {
        memory::reserve(&mut peaks, 1)?;
        peaks.push((run, Cubic::over(side, run)));
    }
    let excess = |&((first, end), cubic): &((usize, usize), Cubic)| -> f64 {
        (first..end).map(|k| cubic.at(k) - side(k)).sum()
    };
    let samples: usize = peaks.iter().map(|((first, end), _)| end - first).sum();
    let all: f64 = peaks.iter().map(excess).sum();
    if samples == 0 || all < EXCESS * limit * samples as f64 {
        return Ok(None);
    }
    for ((first, end), cubic) in peaks {
        let count = (end - first) as f64;
        let added = (first..end).map(|k| cubic.at(k) - sign * gyro[k][axis]).sum::<f64>() / count;
        let wrong = WRONG[0] * added + WRONG[1] * limit;
        for k in first..end {
            // One constant rate over the run: its variance by its duration.
            variance[k] += wrong * wrong * (count * dt);
            let given = sign * gyro[k][axis];
            gyro[k][axis] = sign * cubic.at(k).max(given).min(MOST * limit);
        }
    }
    Ok(Some(Clipped { axis, sign, limit, samples }))
}

#[cfg(test)]
mod tests {
    use super::{DEGREE, restore_clipped};

    /// Swings of 700 deg/s, half a second each, of which a gyro shows no more than its range.
    fn swings(range: f64) -> Vec<[f64; 3]> {
        let rate = |k: usize| 700.0 * DEGREE * (k as f64 * 0.005 * core::f64::consts::TAU).sin();
        (0..2000).map(|k| [0.0, rate(k).min(range * DEGREE), 0.0]).collect()
    }

    #[test]
    fn clipped_swings_come_back() {
        let (whole, mut gyro) = (swings(1e9), swings(500.0));
        let mut variance = [0.0; 2000];
        let found = restore_clipped(&mut gyro, 0.005, &mut variance).unwrap();
        assert_eq!((found.len(), found[0].axis, found[0].sign), (1, 1, 1.0));
        assert!((found[0].limit - 500.0 * DEGREE).abs() < 1e-9);
        let off = whole.iter().zip(&gyro).map(|(a, b)| (a[1] - b[1]).abs()).fold(0.0, f64::max);
        assert!(off < 60.0 * DEGREE, "{}", off / DEGREE);
        assert!(variance.iter().filter(|x| **x > 0.0).count() == found[0].samples);
    }

    #[test]
    fn round_peaks_stay() {
        let mut gyro = swings(1e9);
        let before = gyro.clone();
        assert!(restore_clipped(&mut gyro, 0.005, &mut [0.0; 2000]).unwrap().is_empty());
        assert_eq!(gyro, before);
    }
}
