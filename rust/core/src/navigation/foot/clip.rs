//! Rates that a gyro clipped at its range, restored from the flanks of each peak.

use super::cubic::{Cubic, MAX_RATE_RATIO, density};
use super::ranges::{
    LIMIT_SHARE, MAX_RUN_S, MIN_EXCESS, MIN_FAST_RATE_RAD_S, MIN_LIMIT_RATIO, MIN_LIMIT_S,
    NEAR_SHARE, RUN_SHARE,
};
use super::runs;
use crate::error::Error;
use crate::memory;

/// Number of samples that a run needs on each side.
const FLANK_SAMPLES: usize = 3;

/// One axis and sign that was clipped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clipped {
    /// Axis of the gyro.
    pub axis: usize,
    /// Sign, 1 or -1.
    pub sign: f64,
    /// Range of the gyro, rad/s.
    pub limit: f64,
    /// Number of restored samples.
    pub samples: usize,
}

/// Restores clipped rates (rad/s, finite) in place; samples are `dt` seconds apart. Adds the error
/// of each restored rate to `variance`: density of a white noise, rad²/s.
///
/// # Errors
/// [`Error::Memory`] if there is no memory.
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
    if limit < MIN_FAST_RATE_RAD_S {
        return Ok(None);
    }
    let count = |holds: &dyn Fn(f64) -> bool| (0..n).filter(|k| holds(side(*k))).count() as f64;
    let at = count(&|x| x > LIMIT_SHARE * limit);
    let near = count(&|x| x > NEAR_SHARE * limit && x <= LIMIT_SHARE * limit);
    if at * dt < MIN_LIMIT_S || at < MIN_LIMIT_RATIO * near {
        return Ok(None);
    }
    let inside = |&(first, end): &(usize, usize)| {
        let seconds = (end - first) as f64 * dt;
        end - first >= 2
            && seconds <= MAX_RUN_S
            && first >= FLANK_SAMPLES
            && end + FLANK_SAMPLES <= n
    };
    let mut peaks = memory::room(0)?;
    for run in runs(n, |k| side(k) > RUN_SHARE * limit).filter(inside) {
        memory::reserve(&mut peaks, 1)?;
        let (first, end) = run;
        let flanks = [[side(first - 2), side(first - 1)], [side(end), side(end + 1)]];
        peaks.push((run, Cubic::over(end - first, flanks[0], flanks[1])));
    }
    let excess = |&((first, end), cubic): &((usize, usize), Cubic)| -> f64 {
        (first..end).map(|k| cubic.at(k - first) - side(k)).sum()
    };
    let samples: usize = peaks.iter().map(|((first, end), _)| end - first).sum();
    let all: f64 = peaks.iter().map(excess).sum();
    if samples == 0 || all < MIN_EXCESS * limit * samples as f64 {
        return Ok(None);
    }
    for ((first, end), cubic) in peaks {
        let count = (end - first) as f64;
        let beyond = |k: usize| cubic.at(k - first) - sign * gyro[k][axis];
        let added = (first..end).map(beyond).sum::<f64>() / count;
        let density = density(added, limit, count * dt);
        for k in first..end {
            variance[k] += density;
            let given = sign * gyro[k][axis];
            gyro[k][axis] = sign * cubic.at(k - first).max(given).min(MAX_RATE_RATIO * limit);
        }
    }
    Ok(Some(Clipped { axis, sign, limit, samples }))
}

#[cfg(test)]
mod tests {
    use super::restore_clipped;
    use crate::navigation::foot::DEGREE;

    /// Oscillations of 700 deg/s, half a second each, limited to the gyro's range.
    fn oscillations(range: f64) -> Vec<[f64; 3]> {
        let rate = |k: usize| 700.0 * DEGREE * (k as f64 * 0.005 * core::f64::consts::TAU).sin();
        (0..2000).map(|k| [0.0, rate(k).min(range * DEGREE), 0.0]).collect()
    }

    #[test]
    fn clipped_oscillations_come_back() {
        let (whole, mut gyro) = (oscillations(1e9), oscillations(500.0));
        let mut variance = [0.0; 2000];
        let found = restore_clipped(&mut gyro, 0.005, &mut variance).unwrap();
        assert_eq!((found.len(), found[0].axis, found[0].sign), (1, 1, 1.0));
        assert!((found[0].limit - 500.0 * DEGREE).abs() < 1e-9);
        let off = whole.iter().zip(&gyro).map(|(a, b)| (a[1] - b[1]).abs()).fold(0.0, f64::max);
        assert!(off < 60.0 * DEGREE, "{}", off / DEGREE);
        assert!(variance.iter().filter(|x| **x > 0.0).count() == found[0].samples);
    }

    #[test]
    fn a_table_that_turns_at_one_rate_stays() {
        let ramp = |k: usize| (k.min(2000 - k) as f64 * 0.02).min(4.0);
        let mut gyro: Vec<[f64; 3]> = (0..2000).map(|k| [0.0, 0.0, ramp(k)]).collect();
        let before = gyro.clone();
        assert!(restore_clipped(&mut gyro, 0.005, &mut [0.0; 2000]).unwrap().is_empty());
        assert_eq!(gyro, before);
    }

    #[test]
    fn round_peaks_stay() {
        let mut gyro = oscillations(1e9);
        let before = gyro.clone();
        assert!(restore_clipped(&mut gyro, 0.005, &mut [0.0; 2000]).unwrap().is_empty());
        assert_eq!(gyro, before);
    }
}
