//! Mean and deviation of samples that come in blocks.

use super::sum::{Sum, summed, widened};

/// Mean and deviation so far, merged block by block (Chan, Golub & LeVeque 1979, equation 2.1).
#[derive(Debug, Clone)]
pub(super) struct Moments {
    count: f64,
    mean: Sum,
    squares: Sum,
    ends: [f64; 2],
}

impl Moments {
    pub(super) fn new() -> Self {
        let (none, ends) = (Sum::default(), [f64::INFINITY, -f64::INFINITY]);
        Self { count: 0.0, mean: none, squares: none, ends }
    }

    /// Takes the samples of one block.
    #[inline(always)]
    pub(super) fn take(&mut self, values: &[f64]) {
        if values.is_empty() {
            return;
        }
        let n = values.len() as f64;
        let mean = summed(values, |x| x) / n;
        let apart = mean - self.mean.value();
        let share = n / (self.count + n);
        self.mean.add(apart * share);
        self.squares.add(summed(values, |x| (x - mean) * (x - mean)));
        self.squares.add(apart * apart * self.count * share);
        self.count += n;
        self.ends = widened(self.ends, values);
    }

    /// How many samples.
    pub(super) fn count(&self) -> f64 {
        self.count
    }

    /// NaN without a sample.
    pub(super) fn mean(&self) -> f64 {
        if self.count > 0.0 { self.mean.value() } else { f64::NAN }
    }

    /// NaN without a sample, zero for equal ones whatever rounding says.
    pub(super) fn deviation(&self) -> f64 {
        match self.ends[0] == self.ends[1] && self.mean.value().is_finite() {
            true => 0.0,
            false => (self.squares.value() / self.count).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offset_costs_no_digits() {
        let mut moments = Moments::new();
        for block in 0..1000 {
            let values: Vec<f64> = (0..256).map(|i| 1e9 + f64::from((block + i) % 2)).collect();
            moments.take(&values);
        }
        assert_eq!((moments.mean(), moments.deviation()), (1e9 + 0.5, 0.5));
    }

    #[test]
    fn equal_samples_do_not_deviate() {
        let mut moments = Moments::new();
        assert!(moments.deviation().is_nan());
        (0..3).for_each(|_| moments.take(&[0.1; 77]));
        assert_eq!(moments.deviation(), 0.0);
    }
}
