//! Measures of one axis, raw and after each of several filters, while its samples arrive.

use pulp::Arch;

use super::BLOCK;
use super::coasting::{Block, Coasting};
use super::sums::{Moments, Sum, widened};
use crate::error::Error;
use crate::memory;

/// Measures of one series, NaN if undefined.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// RMS angle at each horizon, unit times samples.
    pub coasting: Vec<f64>,
    /// RMS difference from the truth.
    pub error: f64,
}

/// Counts and range of all samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Totals {
    /// Number of samples that are NaN.
    pub missing: u64,
    /// Number of finite samples.
    pub present: u64,
    /// Number of samples at which the filter learned.
    pub at_rest: u64,
    /// Smallest and largest finite sample.
    pub range: [f64; 2],
}

impl Default for Totals {
    fn default() -> Self {
        let range = [f64::INFINITY, -f64::INFINITY];
        Self { missing: 0, present: 0, at_rest: 0, range }
    }
}

/// Measures of one axis, for the raw samples and each estimate of their drift, while samples
/// arrive.
///
/// They use samples that are present and, if rest is known, at rest. A motion is detected late:
/// samples are held back for the delay, and the samples just before a motion are left out.
#[derive(Debug, Clone)]
pub struct AxisScores {
    totals: Totals,
    resting: bool,
    delay: usize,
    pending: Vec<Vec<f64>>,
    truth: Vec<f64>,
    moments: Vec<Moments>,
    errors: Vec<Sum>,
    /// First sample that was measured.
    level: Option<f64>,
    coasting: Vec<Coasting>,
}

impl AxisScores {
    /// Measures for a number of estimates, horizons in samples, and samples to leave out before a
    /// motion.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory for these horizons.
    pub fn new(estimates: usize, horizons: &[usize], delay: usize) -> Result<Self, Error> {
        let series = estimates.saturating_add(1);
        Ok(Self {
            totals: Totals::default(),
            resting: false,
            delay,
            pending: memory::filled(Vec::new(), series)?,
            truth: Vec::new(),
            moments: memory::filled(Moments::new(), series)?,
            errors: memory::filled(Sum::default(), series)?,
            level: None,
            coasting: horizons
                .iter()
                .map(|m| Coasting::new(*m, series))
                .collect::<Result<_, _>>()?,
        })
    }

    /// Processes samples, flags of rest if motion is left out, each estimate, and the truth if it
    /// is known; all have equal length.
    pub fn take(
        &mut self,
        raw: &[f64],
        at_rest: Option<&[bool]>,
        estimates: &[&[f64]],
        truth: Option<&[f64]>,
    ) {
        self.count(raw);
        match at_rest {
            Some(at_rest) => self.hold_back(raw, at_rest),
            None => self.pending[0].extend_from_slice(raw),
        }
        for (pending, x) in self.pending[1..].iter_mut().zip(estimates) {
            match at_rest {
                Some(at_rest) => pending.extend(at_rest.iter().zip(*x).map(known)),
                None => pending.extend_from_slice(x),
            }
        }
        self.truth.extend_from_slice(truth.unwrap_or_default());
        let sure = self.pending[0].len().saturating_sub(self.delay);
        self.measure(sure - sure % BLOCK);
    }

    /// Counts samples at rest, without an effect on the measures.
    pub fn count_rest(&mut self, at_rest: &[bool]) {
        self.totals.at_rest += at_rest.iter().map(|rest| u64::from(*rest)).sum::<u64>();
    }

    /// Counts and range to date.
    pub fn totals(&self) -> Totals {
        self.totals
    }

    /// Returns the measures of the raw samples and of each estimate; no more samples may follow.
    pub fn finish(&mut self) -> Vec<Score> {
        self.measure(self.pending[0].len());
        let score = |i: usize| Score {
            mean: self.moments[i].mean(),
            deviation: self.moments[i].deviation(),
            coasting: self.coasting.iter().map(|coasting| coasting.error(i)).collect(),
            error: (self.errors[i].value() / self.moments[i].count()).sqrt(),
        };
        (0..self.moments.len()).map(score).collect()
    }

    fn count(&mut self, raw: &[f64]) {
        let finite: u64 = raw.iter().map(|z| u64::from(z.is_finite())).sum();
        self.totals.present += finite;
        if finite == raw.len() as u64 {
            self.totals.range = widened(self.totals.range, raw);
            return;
        }
        self.totals.missing += raw.iter().map(|z| u64::from(z.is_nan())).sum::<u64>();
        for z in raw.iter().filter(|z| z.is_finite()) {
            self.totals.range = widened(self.totals.range, &[*z]);
        }
    }

    fn hold_back(&mut self, raw: &[f64], at_rest: &[bool]) {
        let pending = &mut self.pending[0];
        for (z, resting) in raw.iter().zip(at_rest) {
            if self.resting && !resting {
                let first = pending.len().saturating_sub(self.delay);
                pending[first..].fill(f64::NAN);
            }
            self.resting = *resting;
            pending.push(if *resting { *z } else { f64::NAN });
        }
    }

    /// Measures the first `count` of the samples held back.
    fn measure(&mut self, count: usize) {
        // On the processor's widest registers; the order of each sum stays the same.
        Arch::new().dispatch(|| {
            for first in (0..count).step_by(BLOCK) {
                self.measure_block(first, count.min(first + BLOCK));
            }
        });
        for pending in &mut self.pending {
            pending.drain(..count);
        }
        self.truth.drain(..count.min(self.truth.len()));
    }

    #[inline(always)]
    fn measure_block(&mut self, first: usize, end: usize) {
        let series: Vec<&[f64]> = self.pending.iter().map(|x| &x[first..end]).collect();
        let raw = series[0];
        let whole = raw.iter().all(|z| z.is_finite());
        let mut used = [0.0; BLOCK];
        for (x, moments) in series.iter().zip(&mut self.moments) {
            moments.take(if whole { x } else { present(raw, x.iter().copied(), &mut used) });
        }
        if let Some(truth) = self.truth.get(first..end) {
            for (x, error) in series.iter().zip(&mut self.errors) {
                let wrong = x.iter().zip(truth).map(|(x, truth)| x - truth);
                error.add(present(raw, wrong, &mut used).iter().map(|x| x * x).sum());
            }
        }
        let level = self.level.or_else(|| raw.iter().copied().find(|z| z.is_finite()));
        self.level = level;
        let block = Block::new(raw, whole, level.unwrap_or_default());
        for coasting in &mut self.coasting {
            coasting.take(&block, &series);
        }
    }
}

/// The estimate at rest, else NaN. An estimate in motion is not held through the next rest: before
/// the first rest it has no meaning.
fn known((resting, x): (&bool, &f64)) -> f64 {
    if *resting { *x } else { f64::NAN }
}

/// Values at samples that are present.
fn present<'a>(
    raw: &[f64],
    values: impl Iterator<Item = f64>,
    used: &'a mut [f64; BLOCK],
) -> &'a [f64] {
    let mut count = 0;
    for (_, x) in raw.iter().zip(values).filter(|(z, _)| z.is_finite()) {
        used[count] = x;
        count += 1;
    }
    &used[..count]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(n: u32) -> Vec<f64> {
        (0..n).map(|i| f64::from(i.wrapping_mul(2_654_435_761) >> 8) / 1e7).collect()
    }

    fn scored(pieces: usize) -> Vec<Score> {
        let (raw, estimate) = (noise(3000), noise(3100).split_off(100));
        let rest: Vec<bool> = (0..3000).map(|i| i % 700 < 600).collect();
        let mut axis = AxisScores::new(1, &[50, 300], 30).expect("memory");
        for first in (0..raw.len()).step_by(pieces) {
            let piece = first..raw.len().min(first + pieces);
            let estimate = &estimate[piece.clone()];
            let truth = &raw[piece.clone()];
            axis.take(&raw[piece.clone()], Some(&rest[piece]), &[estimate], Some(truth));
        }
        axis.finish()
    }

    #[test]
    fn pieces_do_not_change_a_digit() {
        let whole = scored(3000);
        for pieces in [1, 7, 256, 1000] {
            assert_eq!(scored(pieces), whole);
        }
        assert_eq!(whole[0].error, 0.0);
    }

    #[test]
    fn what_is_not_known_in_motion_is_not_held_through_the_rest() {
        let rest: Vec<bool> = (0..100).map(|i| i >= 50).collect();
        let estimate: Vec<f64> = (0..100).map(|i| if i < 50 { 1e6 } else { 3.0 }).collect();
        let mut axis = AxisScores::new(1, &[10], 0).expect("memory");
        axis.take(&[3.0; 100], Some(&rest), &[&estimate], None);
        assert_eq!(axis.finish()[1].coasting, [0.0]);
    }

    #[test]
    fn samples_before_a_motion_are_left_out() {
        let mut axis = AxisScores::new(0, &[], 2).expect("memory");
        axis.take(&[1.0, 1.0, 1.0, 5.0], Some(&[true; 4]), &[], None);
        axis.take(&[5.0, 9.0, 1.0], Some(&[true, false, true]), &[], None);
        let score = &axis.finish()[0];
        assert_eq!((score.mean, score.deviation), (1.0, 0.0));
        assert_eq!((axis.totals().present, axis.totals().range[1]), (7, 9.0));
    }
}
