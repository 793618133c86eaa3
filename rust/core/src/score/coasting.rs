//! Coasting errors: the error in angle if an estimate is held over a horizon.

use std::ops::Range;

use super::BLOCK;
use super::sums::{Sum, summed};
use crate::error::Error;
use crate::memory;

/// The samples of one block, and their sums.
#[derive(Debug)]
pub struct Block<'a> {
    z: &'a [f64],
    whole: bool,
    level: f64,
    /// Sums of the distances from the level, from the block's first sample to each sample.
    sums: [f64; BLOCK],
}

impl<'a> Block<'a> {
    /// Sums of a block; `whole` if no sample is missing. The `level` is subtracted to keep the
    /// digits with a large offset.
    #[inline(always)]
    pub fn new(z: &'a [f64], whole: bool, level: f64) -> Self {
        let (mut sums, mut sum) = ([0.0; BLOCK], 0.0);
        for (z, so_far) in z.iter().zip(&mut sums) {
            sum += if z.is_finite() { z - level } else { 0.0 };
            *so_far = sum;
        }
        Self { z, whole, level, sums }
    }
}

/// Coasting errors of several series at one horizon: the error in angle if each estimate is held
/// through the next `length` samples.
#[derive(Debug, Clone)]
pub struct Coasting {
    windows: Windows,
    held: Vec<Held>,
}

impl Coasting {
    pub fn new(length: usize, series: usize) -> Result<Self, Error> {
        let held = (0..series).map(|_| Held::new(length)).collect::<Result<_, _>>()?;
        Ok(Self { windows: Windows::new(length)?, held })
    }

    /// Processes one block, and the estimates at the same times.
    #[inline(always)]
    pub fn take(&mut self, block: &Block<'_>, series: &[&[f64]]) {
        let (mut angles, mut done) = ([0.0; BLOCK], 0);
        while done < block.z.len() {
            let at = self.windows.at;
            let end = block.z.len().min(done + self.windows.sums.len() - at);
            let angles = &mut angles[..end - done];
            self.windows.take(block, done..end, angles);
            for (held, x) in self.held.iter_mut().zip(series) {
                held.take(at, angles, &x[done..end], block.level);
            }
            done = end;
        }
    }

    /// RMS of one series' angles, unit times samples; NaN if no window was complete.
    pub fn error(&self, series: usize) -> f64 {
        let held = &self.held[series];
        (held.squares.value() / held.count as f64).sqrt()
    }
}

/// Sums over the last samples, each made of two parts of fixed spans. No sum is the small
/// difference of two sums over the whole record.
#[derive(Debug, Clone)]
struct Windows {
    /// Index in the span.
    at: usize,
    /// Sums up to each index: of this span below `at`, of the previous span from there on.
    sums: Vec<f64>,
    before: f64,
    now: f64,
    /// Number of samples since the last missing one, limited to the length.
    present: usize,
}

impl Windows {
    fn new(length: usize) -> Result<Self, Error> {
        let sums = memory::filled(0.0, length)?;
        Ok(Self { at: 0, sums, before: 0.0, now: 0.0, present: 0 })
    }

    /// Writes to `angles` the sum that ends at each sample, relative to the level; NaN if one of
    /// its samples is missing. The samples lie in one span.
    #[inline(always)]
    fn take(&mut self, block: &Block<'_>, part: Range<usize>, angles: &mut [f64]) {
        let start = if part.start == 0 { 0.0 } else { block.sums[part.start - 1] };
        let (before, now) = (self.before, self.now);
        let sums = &mut self.sums[self.at..self.at + part.len()];
        for ((so_far, sum), angle) in block.sums[part.clone()].iter().zip(sums).zip(&mut *angles) {
            let up_to_here = now + (so_far - start);
            *angle = (before - *sum) + up_to_here;
            *sum = up_to_here;
        }
        self.now += block.sums[part.end - 1] - start;
        if !block.whole || self.present < self.sums.len() {
            self.leave_out(&block.z[part.clone()], angles);
        }
        self.at += part.len();
        if self.at == self.sums.len() {
            (self.at, self.before, self.now) = (0, self.now, 0.0);
        }
    }

    fn leave_out(&mut self, z: &[f64], angles: &mut [f64]) {
        let length = self.sums.len();
        for (z, angle) in z.iter().zip(angles) {
            self.present = if z.is_finite() { length.min(self.present + 1) } else { 0 };
            if self.present < length {
                *angle = f64::NAN;
            }
        }
    }
}

/// Estimates of the last samples, and errors of the estimates held to date.
#[derive(Debug, Clone)]
struct Held {
    estimates: Vec<f64>,
    squares: Sum,
    count: usize,
}

impl Held {
    fn new(length: usize) -> Result<Self, Error> {
        let estimates = memory::filled(f64::NAN, length)?;
        Ok(Self { estimates, squares: Sum::default(), count: 0 })
    }

    #[inline(always)]
    fn take(&mut self, at: usize, angles: &[f64], x: &[f64], level: f64) {
        let length = self.estimates.len() as f64;
        let estimates = &mut self.estimates[at..at + x.len()];
        let mut errors = [0.0; BLOCK];
        let errors = &mut errors[..x.len()];
        for (((error, angle), estimate), x) in errors.iter_mut().zip(angles).zip(estimates).zip(x) {
            *error = angle - length * (*estimate - level);
            *estimate = *x;
        }
        let squares = summed(errors, |error| error * error);
        if squares.is_finite() {
            self.squares.add(squares);
            self.count += errors.len();
            return;
        }
        for error in errors.iter().filter(|error| error.is_finite()) {
            self.squares.add(error * error);
            self.count += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(length: usize, z: &[f64], x: &[f64]) -> f64 {
        let mut coasting = Coasting::new(length, 1).expect("memory");
        let whole = z.iter().all(|z| z.is_finite());
        coasting.take(&Block::new(z, whole, 1.0), &[x]);
        coasting.error(0)
    }

    #[test]
    fn a_bias_costs_its_angle() {
        assert_eq!(error(2, &[1.0; 5], &[1.5; 5]), 1.0);
    }

    #[test]
    fn no_window_spans_a_missing_sample() {
        // Only the estimate at the missing sample is held through two present samples.
        assert_eq!(error(2, &[1.0, 1.0, f64::NAN, 1.0, 1.0], &[7.0, 1.0, 2.0, 9.0, 9.0]), 2.0);
        assert!(error(2, &[1.0; 2], &[1.0; 2]).is_nan());
    }
}
