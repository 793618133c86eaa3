//! What holding an estimate costs over a horizon.

use super::BLOCK;
use super::sum::{Sum, summed};

/// Coasting errors of several series at one horizon: the angle that is lost when each estimate is
/// held through the next `length` samples.
#[derive(Debug, Clone)]
pub(super) struct Coasting {
    windows: Windows,
    held: Vec<Held>,
}

impl Coasting {
    pub(super) fn new(length: usize, series: usize) -> Self {
        Self { windows: Windows::new(length), held: vec![Held::new(length); series] }
    }

    /// Takes one block: samples, NaN for a missing one, and the estimates at the same times.
    pub(super) fn take(&mut self, z: &[f64], series: &[&[f64]]) {
        let mut angles = [0.0; BLOCK];
        let mut done = 0;
        while done < z.len() {
            let at = self.windows.at;
            let end = z.len().min(done + self.windows.sums.len() - at);
            let angles = &mut angles[..end - done];
            let level = self.windows.take(&z[done..end], angles);
            for (held, x) in self.held.iter_mut().zip(series) {
                held.take(at, angles, &x[done..end], level);
            }
            done = end;
        }
    }

    /// RMS of one series' angles, unit times samples; NaN if no window was complete.
    pub(super) fn error(&self, series: usize) -> f64 {
        let held = &self.held[series];
        (held.squares.value() / held.count as f64).sqrt()
    }
}

/// Sums of the last samples, each made of two parts of fixed blocks: none is the small difference
/// of two sums over the whole record.
#[derive(Debug, Clone)]
struct Windows {
    /// Taken off every sample, so that an offset costs no digits; the first one present.
    level: Option<f64>,
    /// Place in the block.
    at: usize,
    /// Up to and with each place: of this block before `at`, of the one before from there on.
    sums: Vec<f64>,
    before: f64,
    now: f64,
    present: usize,
}

impl Windows {
    fn new(length: usize) -> Self {
        Self { level: None, at: 0, sums: vec![0.0; length], before: 0.0, now: 0.0, present: 0 }
    }

    /// Answers the level, and puts into `angles` the sum that ends at each sample, above the level;
    /// NaN where one of its samples is missing.
    fn take(&mut self, z: &[f64], angles: &mut [f64]) -> f64 {
        if self.level.is_none() {
            self.level = z.iter().copied().find(|z| z.is_finite());
        }
        let (level, length) = (self.level.unwrap_or(0.0), self.sums.len());
        let sums = &mut self.sums[self.at..self.at + z.len()];
        match self.present >= length && z.iter().all(|z| z.is_finite()) {
            true => whole(z, level, self.before, &mut self.now, sums, angles),
            false => self.with_gaps(z, level, angles),
        }
        self.at += z.len();
        if self.at == length {
            (self.at, self.before, self.now) = (0, self.now, 0.0);
        }
        level
    }

    fn with_gaps(&mut self, z: &[f64], level: f64, angles: &mut [f64]) {
        let length = self.sums.len();
        let sums = &mut self.sums[self.at..self.at + z.len()];
        for ((z, sum), angle) in z.iter().zip(sums).zip(angles) {
            let there = z.is_finite();
            self.present = if there { self.present + 1 } else { 0 };
            self.now += if there { z - level } else { 0.0 };
            let window = (self.before - *sum) + self.now;
            *angle = if self.present < length { f64::NAN } else { window };
            *sum = self.now;
        }
    }
}

/// The same where no sample was missing for a horizon, in two loops: only sums wait for each other.
fn whole(z: &[f64], level: f64, before: f64, now: &mut f64, sums: &mut [f64], angles: &mut [f64]) {
    for (z, angle) in z.iter().zip(angles.iter_mut()) {
        *now += z - level;
        *angle = *now;
    }
    for (sum, angle) in sums.iter_mut().zip(angles) {
        let up_to_here = *angle;
        *angle = (before - *sum) + up_to_here;
        *sum = up_to_here;
    }
}

/// The estimates of the last samples, and the errors of those held so far.
#[derive(Debug, Clone)]
struct Held {
    estimates: Vec<f64>,
    squares: Sum,
    count: u64,
}

impl Held {
    fn new(length: usize) -> Self {
        Self { estimates: vec![f64::NAN; length], squares: Sum::default(), count: 0 }
    }

    fn take(&mut self, at: usize, angles: &[f64], x: &[f64], level: f64) {
        let length = self.estimates.len() as f64;
        let estimates = &mut self.estimates[at..at + x.len()];
        let mut errors = [0.0; BLOCK];
        let errors = &mut errors[..x.len()];
        for ((error, angle), estimate) in errors.iter_mut().zip(angles).zip(estimates.iter()) {
            *error = angle - length * (estimate - level);
        }
        estimates.copy_from_slice(x);
        let known = |x: f64| if x.is_finite() { x } else { 0.0 };
        self.squares.add(summed(errors, |x| known(x) * known(x)));
        self.count += errors.iter().map(|x| u64::from(x.is_finite())).sum::<u64>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bias_costs_its_angle() {
        let mut coasting = Coasting::new(2, 1);
        coasting.take(&[1.0; 5], &[&[1.5; 5]]);
        assert_eq!(coasting.error(0), 1.0);
    }

    #[test]
    fn no_window_spans_a_missing_sample() {
        let mut coasting = Coasting::new(2, 1);
        coasting.take(&[1.0, 1.0, f64::NAN, 1.0, 1.0], &[&[7.0, 1.0, 2.0, 9.0, 9.0]]);
        assert_eq!(coasting.error(0), 2.0, "the estimate of the missing sample alone is held");
        let mut short = Coasting::new(2, 1);
        short.take(&[1.0, 1.0], &[&[1.0, 1.0]]);
        assert!(short.error(0).is_nan());
    }
}
