//! What is taken off every sample before it is multiplied.

use pulp::Simd;

/// Samples whose mean is near enough to the record for its products to keep their digits.
const GLANCE: usize = 256;

/// A level in two parts: beside a large offset, one number is too coarse for it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Centre {
    origin: f64,
    rest: f64,
}

impl Centre {
    /// The level of the first samples that are there; that of equal samples, exactly.
    pub fn provisional(record: &[f64]) -> Self {
        let mut present = record.iter().filter(|z| z.is_finite()).take(GLANCE);
        let first = *present.next().unwrap_or(&0.0);
        let (count, sum) =
            present.fold((1.0, 0.0), |(count, sum), z| (count + 1.0, sum + (z - first)));
        Self { origin: first + sum / count, rest: 0.0 }
    }

    /// The mean of all samples that are there.
    pub fn mean(record: &[f64]) -> Self {
        let near = Self::provisional(record);
        let present = || record.iter().filter(|z| z.is_finite());
        let sum: f64 = present().map(|z| near.taken_off(*z)).sum();
        Self { rest: sum / present().count().max(1) as f64, ..near }
    }

    /// The sample's distance from the level.
    #[inline(always)]
    pub fn taken_off(self, z: f64) -> f64 {
        (z - self.origin) - self.rest
    }

    /// The same of many samples.
    #[inline(always)]
    pub fn taken_off_all<S: Simd>(self, simd: S, z: S::f64s) -> S::f64s {
        let origin = simd.sub_f64s(z, simd.splat_f64s(self.origin));
        simd.sub_f64s(origin, simd.splat_f64s(self.rest))
    }

    /// The level itself, rounded.
    pub fn level(self) -> f64 {
        self.origin + self.rest
    }
}
