//! Normal equations of an autoregression: sums of lagged products over a record, in one pass.

use nalgebra::DMatrix;
use pulp::{Arch, Simd};

use super::kernel::{AddProducts, Centring, TILE};
use crate::math::segments::segments;
use crate::work;

/// Number of samples that are centred together and then multiplied in the nearest cache.
const BLOCK: usize = 2048;

/// Sums over the samples y_t of each segment from t = `order` on, and terms at the segment's ends.
#[derive(Debug, Clone)]
pub struct NormalEquations {
    order: usize,
    /// Number of summed samples.
    n: usize,
    /// Number of present samples.
    present: usize,
    /// Sums of y_t y_(t-j); beyond the order, up to a multiple of a tile, they are not used.
    products: Vec<f64>,
    /// Sums of products of the samples before t = order.
    early: Vec<f64>,
    /// Sum of y_t.
    sum: f64,
    /// Terms that a sum of products y_(t-i) y_(t-j), and of y_(t-i), gains at the next lag.
    edges: DMatrix<f64>,
    edge_sums: Vec<f64>,
}

impl NormalEquations {
    /// Sums up to the lag `order`, after `centre` is subtracted from the samples.
    pub fn of(record: &[f64], order: usize, centre: Centre) -> Self {
        let mut pass = Pass::new(order, centre);
        let mut sums = Self::zero(order);
        // A record without gaps needs no search for them.
        if sums.add(&mut pass, record).is_none() {
            sums = Self::zero(order);
            segments(record).for_each(|segment| {
                let _overflown = sums.add(&mut pass, segment);
            });
        }
        sums
    }

    fn zero(order: usize) -> Self {
        Self {
            order,
            n: 0,
            present: 0,
            products: vec![0.0; (order + 1).next_multiple_of(TILE)],
            early: vec![0.0; order + 1],
            sum: 0.0,
            edges: DMatrix::zeros(order, order),
            edge_sums: vec![0.0; order],
        }
    }

    /// Number of samples with `order` earlier samples in their segment.
    pub fn n(&self) -> usize {
        self.n
    }

    /// The number of present samples.
    pub fn present(&self) -> usize {
        self.present
    }

    /// Sum of the squares of all samples.
    pub fn energy(&self) -> f64 {
        self.products[0] + self.early[0]
    }

    /// Sums of y_t y_(t-j) over all pairs in a segment, j = 0..=order.
    pub fn over_all_pairs(&self) -> Vec<f64> {
        self.products.iter().zip(&self.early).map(|(late, early)| late + early).collect()
    }

    /// Sums of the products of `[1, y_(t-1), ..., y_(t-order), y_t]`; the 1 only with a constant.
    pub fn gram(&self, constant: bool) -> DMatrix<f64> {
        let (lagged, sums) = self.lagged();
        let first = usize::from(constant);
        let size = self.order + 1 + first;
        let lag = |column: usize| if column + 1 == size { 0 } else { column + 1 - first };
        DMatrix::from_fn(size, size, |i, j| match (i.min(j), i.max(j)) {
            (0, 0) if constant => self.n as f64,
            (0, j) if constant => sums[lag(j)],
            (i, j) => lagged[(lag(i), lag(j))],
        })
    }

    /// Sums of y_(t-i) y_(t-j) and of y_(t-i): at the next lag only the ends differ.
    fn lagged(&self) -> (DMatrix<f64>, Vec<f64>) {
        let mut sums = vec![self.sum];
        let mut lagged = DMatrix::zeros(self.order + 1, self.order + 1);
        for i in 0..=self.order {
            (lagged[(0, i)], lagged[(i, 0)]) = (self.products[i], self.products[i]);
        }
        for i in 0..self.order {
            sums.push(sums[i] + self.edge_sums[i]);
            for j in 0..self.order {
                lagged[(i + 1, j + 1)] = lagged[(i, j)] + self.edges[(i, j)];
            }
        }
        (lagged, sums)
    }

    /// Adds a segment; `None` once a sum is not finite.
    fn add(&mut self, pass: &mut Pass, segment: &[f64]) -> Option<()> {
        self.present += segment.len();
        let late = segment.len().saturating_sub(self.order);
        for start in (0..late).step_by(BLOCK) {
            work::pause();
            let block = &segment[start..segment.len().min(start + BLOCK + self.order)];
            self.sum += pass.add_block(block, &mut self.products)?;
        }
        self.n += late;
        self.add_ends(pass.centre, segment)
    }

    fn add_ends(&mut self, centre: Centre, segment: &[f64]) -> Option<()> {
        let order = self.order;
        let value = |t: usize| centre.subtract_centre(segment[t]);
        let first: Vec<f64> = (0..order.min(segment.len())).map(value).collect();
        for t in 0..first.len() {
            for j in 0..=t {
                self.early[j] += first[t] * first[t - j];
            }
        }
        if segment.len() > order {
            let last: Vec<f64> = (segment.len() - order..segment.len()).map(value).collect();
            self.add_edges(&first, &last);
        }
        self.early[0].is_finite().then_some(())
    }

    fn add_edges(&mut self, first: &[f64], last: &[f64]) {
        let back = |values: &[f64], i: usize| values[self.order - 1 - i];
        for i in 0..self.order {
            self.edge_sums[i] += back(first, i) - back(last, i);
            for j in 0..self.order {
                self.edges[(i, j)] +=
                    back(first, i) * back(first, j) - back(last, i) * back(last, j);
            }
        }
    }
}

/// Working memory of a pass over a record.
struct Pass {
    centre: Centre,
    order: usize,
    arch: Arch,
    /// Zeros before the samples, for lags beyond the order.
    buffer: Vec<f64>,
    padding: usize,
}

impl Pass {
    fn new(order: usize, centre: Centre) -> Self {
        let start = (order + 1).next_multiple_of(TILE) - 1;
        let buffer = vec![0.0; start + BLOCK];
        Self { centre, order, arch: Arch::new(), buffer, padding: start - order }
    }

    /// Adds the products of all samples of a block except the first `order` with earlier samples.
    /// Returns the sum of these samples if all samples of the block are finite.
    fn add_block(&mut self, block: &[f64], products: &mut [f64]) -> Option<f64> {
        let (early, late) = block.split_at(self.order);
        let start = self.padding + self.order;
        let end = start + late.len();
        let (arch, centre) = (self.arch, self.centre);
        let to = &mut self.buffer[self.padding..start];
        let before = arch.dispatch(Centring { centre, from: early, to });
        let sum = arch.dispatch(Centring { centre, from: late, to: &mut self.buffer[start..end] });
        arch.dispatch(AddProducts { block: &self.buffer[..end], start, sums: products });
        (before + sum).is_finite().then_some(sum)
    }
}

/// Number of samples whose mean is close enough to the record's for precise products.
const MEAN_SAMPLES: usize = 256;

/// Offset subtracted from every sample, in two parts: for a large offset one number is too coarse.
#[derive(Debug, Clone, Copy, Default)]
pub struct Centre {
    origin: f64,
    rest: f64,
}

impl Centre {
    /// The level of the first present samples; for equal samples their exact value.
    pub fn provisional(record: &[f64]) -> Self {
        let mut present = record.iter().filter(|z| z.is_finite()).take(MEAN_SAMPLES);
        let first = *present.next().unwrap_or(&0.0);
        let (count, sum) =
            present.fold((1.0, 0.0), |(count, sum), z| (count + 1.0, sum + (z - first)));
        Self { origin: first + sum / count, rest: 0.0 }
    }

    /// Mean of all present samples.
    pub fn mean(record: &[f64]) -> Self {
        let near = Self::provisional(record);
        let present = || record.iter().filter(|z| z.is_finite());
        let sum: f64 = present().map(|z| near.subtract_centre(*z)).sum();
        Self { rest: sum / present().count().max(1) as f64, ..near }
    }

    /// The sample's distance from the level.
    #[inline(always)]
    pub fn subtract_centre(self, z: f64) -> f64 {
        (z - self.origin) - self.rest
    }

    /// Distances of many samples from the level.
    #[inline(always)]
    pub fn subtract_centre_all<S: Simd>(self, simd: S, z: S::f64s) -> S::f64s {
        let origin = simd.sub_f64s(z, simd.splat_f64s(self.origin));
        simd.sub_f64s(origin, simd.splat_f64s(self.rest))
    }

    /// The level, rounded.
    pub fn level(self) -> f64 {
        self.origin + self.rest
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::{BLOCK, Centre, NormalEquations};
    use crate::math::segments::segments;

    /// Small integers: every sum is exact in any order.
    fn record(n: usize) -> Vec<f64> {
        (0..n).map(|i| f64::from((i * i * i % 71) as u32)).collect()
    }

    fn gram(record: &[f64], order: usize) -> DMatrix<f64> {
        let mut sums = DMatrix::zeros(order + 2, order + 2);
        for segment in segments(record) {
            for t in order..segment.len() {
                let lagged = (1..=order).chain([0]).map(|lag| segment[t - lag]);
                let row = DMatrix::from_iterator(1, order + 2, [1.0].into_iter().chain(lagged));
                sums += row.transpose() * row;
            }
        }
        sums
    }

    #[test]
    fn all_products_follow_from_those_of_the_last_sample() {
        for order in [0, 1, 3, 4, 10, 11, 12, 20, 64] {
            for n in [0, 5, 90, BLOCK, BLOCK + order, BLOCK + order + 1, 2 * BLOCK + 77] {
                let mut z = record(n);
                assert_products(&z, order);
                z.iter_mut().skip(30).step_by(611).for_each(|z| *z = f64::NAN);
                assert_products(&z, order);
            }
        }
    }

    fn assert_products(z: &[f64], order: usize) {
        let products = NormalEquations::of(z, order, Centre::default());
        let expected = gram(z, order);
        assert_eq!(products.gram(true), expected);
        assert_eq!(products.gram(false), expected.remove_row(0).remove_column(0));
        let pairs = |lag: usize| -> f64 {
            segments(z)
                .flat_map(|y| y.iter().skip(lag).zip(y))
                .map(|(late, early)| late * early)
                .sum()
        };
        assert_eq!(products.over_all_pairs(), (0..=order).map(pairs).collect::<Vec<_>>());
        assert_eq!(products.present(), segments(z).map(<[f64]>::len).sum());
    }
}
