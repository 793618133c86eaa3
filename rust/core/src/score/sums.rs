//! Sums, means and standard deviations with rounding errors that do not grow with their length.

/// Sum of many numbers, with the rounding errors of its additions (Neumaier 1974).
#[derive(Debug, Clone, Copy, Default)]
pub struct Sum {
    total: f64,
    lost: f64,
}

impl Sum {
    #[inline(always)]
    pub fn add(&mut self, x: f64) {
        let total = self.total + x;
        self.lost += match self.total.abs() >= x.abs() {
            true => (self.total - total) + x,
            false => (x - total) + self.total,
        };
        self.total = total;
    }

    pub fn value(&self) -> f64 {
        // The rounding error of an infinite sum is not a number.
        if self.total.is_finite() { self.total + self.lost } else { self.total }
    }
}

const LANES: usize = 8;

/// Sum of `term` over a block, several terms at a time.
#[inline(always)]
pub fn summed(values: &[f64], term: impl Fn(f64) -> f64) -> f64 {
    let (eights, rest) = values.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    for eight in eights {
        for (lane, x) in lanes.iter_mut().zip(eight) {
            *lane += term(*x);
        }
    }
    let rest: f64 = rest.iter().map(|x| term(*x)).sum();
    lanes.iter().sum::<f64>() + rest
}

/// Smallest and largest number of a block and of earlier values; NaN is ignored.
#[inline(always)]
pub fn widened(known: [f64; 2], values: &[f64]) -> [f64; 2] {
    let (eights, rest) = values.as_chunks::<LANES>();
    let (mut least, mut most) = ([known[0]; LANES], [known[1]; LANES]);
    for eight in eights {
        for ((least, most), x) in least.iter_mut().zip(&mut most).zip(eight) {
            *least = if x < least { *x } else { *least };
            *most = if x > most { *x } else { *most };
        }
    }
    let lowest = least.iter().chain(rest).copied().fold(known[0], f64::min);
    [lowest, most.iter().chain(rest).copied().fold(known[1], f64::max)]
}

/// Mean and standard deviation to date, merged block by block (Chan, Golub & LeVeque 1979, equation
/// 2.1).
#[derive(Debug, Clone)]
pub struct Moments {
    count: f64,
    mean: Sum,
    squares: Sum,
    ends: [f64; 2],
}

impl Moments {
    pub fn new() -> Self {
        let (none, ends) = (Sum::default(), [f64::INFINITY, -f64::INFINITY]);
        Self { count: 0.0, mean: none, squares: none, ends }
    }

    /// Adds the samples of one block.
    #[inline(always)]
    pub fn take(&mut self, values: &[f64]) {
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

    /// Number of samples.
    pub fn count(&self) -> f64 {
        self.count
    }

    /// Mean; NaN without a sample.
    pub fn mean(&self) -> f64 {
        if self.count > 0.0 { self.mean.value() } else { f64::NAN }
    }

    /// Standard deviation; NaN without a sample, exactly zero for equal samples.
    pub fn deviation(&self) -> f64 {
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
    fn nothing_small_is_lost_next_to_something_large() {
        let mut sum = Sum::default();
        [1.0, 1e100, 1.0, -1e100].into_iter().for_each(|x| sum.add(x));
        assert_eq!(sum.value(), 2.0);
    }

    #[test]
    fn too_much_is_infinite() {
        let mut sum = Sum::default();
        [f64::MAX, f64::MAX].into_iter().for_each(|x| sum.add(x));
        assert_eq!(sum.value(), f64::INFINITY);
    }

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
