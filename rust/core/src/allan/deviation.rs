//! Allan deviation of a record (IEEE Std 952-1997, annex C).

/// A rate record, summed up once for any number of averaging times.
#[derive(Debug, Clone)]
pub struct OverlappingAllan {
    /// Sums of the first k samples less their mean, missing ones left out.
    sums: Vec<f64>,
    /// Missing samples among the first k; empty if there is none.
    gaps: Vec<usize>,
}

impl OverlappingAllan {
    /// Takes a record whose samples that are not finite are missing.
    pub fn new(rate: &[f64]) -> Self {
        let present = rate.iter().filter(|z| z.is_finite());
        let count = present.clone().count();
        // The mean of distances from one sample: precise also on a large offset.
        let origin = present.clone().next().copied().unwrap_or(0.0);
        let mean = origin + present.map(|z| z - origin).sum::<f64>() / count.max(1) as f64;
        let distance = |z: &f64| if z.is_finite() { z - mean } else { 0.0 };
        let gap = |z: &f64| usize::from(!z.is_finite());
        Self {
            sums: running_sum(rate.iter().map(distance)),
            gaps: if count < rate.len() { running_sum(rate.iter().map(gap)) } else { Vec::new() },
        }
    }

    /// The deviation at an averaging time of `m` samples, or `None` if no two neighbouring clusters
    /// are whole.
    pub fn deviation(&self, m: usize) -> Option<f64> {
        if m == 0 || self.sums.len() <= 2 * m {
            return None;
        }
        let (sum, terms) = match self.gaps.is_empty() {
            true => (self.sum_of_squares(m), self.sums.len() - 2 * m),
            false => self.sum_without_gaps(m),
        };
        (terms > 0).then(|| (sum / (2.0 * terms as f64)).sqrt() / m as f64)
    }

    /// Four sums at a time, which the processor adds side by side.
    fn sum_of_squares(&self, m: usize) -> f64 {
        let (first, middle, last) = (&self.sums, &self.sums[m..], &self.sums[2 * m..]);
        let square = |(a, (b, c)): (&f64, (&f64, &f64))| {
            let difference = (c - b) - (b - a);
            difference * difference
        };
        let mut sums = [0.0; 4];
        let blocks = first.chunks_exact(4).zip(middle.chunks_exact(4).zip(last.chunks_exact(4)));
        for (a, (b, c)) in blocks {
            for k in 0..4 {
                sums[k] += square((&a[k], (&b[k], &c[k])));
            }
        }
        let done = last.len() / 4 * 4;
        let rest = first[done..].iter().zip(middle[done..].iter().zip(&last[done..]));
        sums.iter().sum::<f64>() + rest.map(square).sum::<f64>()
    }

    /// Leaves out every term that needs a missing sample.
    fn sum_without_gaps(&self, m: usize) -> (f64, usize) {
        let (mut sum, mut terms) = (0.0, 0);
        for i in 0..self.sums.len() - 2 * m {
            if self.gaps[i] == self.gaps[i + 2 * m] {
                let [a, b, c] = [0, m, 2 * m].map(|k| self.sums[i + k]);
                let difference = (c - b) - (b - a);
                sum += difference * difference;
                terms += 1;
            }
        }
        (sum, terms)
    }
}

fn running_sum<T: Copy + Default + std::ops::Add<Output = T>>(
    values: impl Iterator<Item = T>,
) -> Vec<T> {
    let start = std::iter::once(T::default());
    start
        .chain(values.scan(T::default(), |sum, value| {
            *sum = *sum + value;
            Some(*sum)
        }))
        .collect()
}

/// [`OverlappingAllan::deviation`] at one averaging time.
pub fn overlapping_allan_deviation(rate: &[f64], m: usize) -> Option<f64> {
    OverlappingAllan::new(rate).deviation(m)
}
