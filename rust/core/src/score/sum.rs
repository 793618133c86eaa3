//! Sums whose rounding errors do not grow with their length.

/// Sum of many numbers, with what rounding took off it (Neumaier 1974).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sum {
    total: f64,
    lost: f64,
}

impl Sum {
    #[inline(always)]
    pub(super) fn add(&mut self, x: f64) {
        let total = self.total + x;
        self.lost += match self.total.abs() >= x.abs() {
            true => (self.total - total) + x,
            false => (x - total) + self.total,
        };
        self.total = total;
    }

    pub(super) fn value(&self) -> f64 {
        // What an infinite sum lost is no number.
        if self.total.is_finite() { self.total + self.lost } else { self.total }
    }
}

const LANES: usize = 8;

/// The sum of `term` over a block, several at a time.
#[inline(always)]
pub(super) fn summed(values: &[f64], term: impl Fn(f64) -> f64) -> f64 {
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

/// Least and largest of a block and of what was known before; NaN is neither.
#[inline(always)]
pub(super) fn widened(known: [f64; 2], values: &[f64]) -> [f64; 2] {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_small_is_lost_beside_something_large() {
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
}
