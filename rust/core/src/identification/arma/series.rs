//! A record prepared for the estimators: centred and scaled, with its segments.

use std::ops::Range;

use crate::math::segments::segment_ranges;
use crate::work;

/// One axis, relative to its mean and in units of its standard deviation, with its segments.
#[derive(Debug, Clone)]
pub struct Series {
    /// Values; NaN is missing.
    pub(super) values: Vec<f64>,
    pub(super) segments: Vec<Range<usize>>,
    /// Offset subtracted from the samples, zero if they are not centred.
    pub(super) origin: f64,
    /// Divisor of the centred samples.
    pub(super) unit: f64,
    pub(super) present: usize,
}

impl Series {
    /// Creates a series; samples that are not finite are missing.
    pub fn new(mut values: Vec<f64>, centred: bool) -> Self {
        let segments = work::collect(segment_ranges(&values));
        let present = segments.iter().map(Range::len).sum();
        let origin = if centred { mean(&values, &segments) } else { 0.0 };
        values.iter_mut().for_each(|z| *z = if z.is_finite() { *z - origin } else { f64::NAN });
        let unit = deviation(&values);
        values.iter_mut().for_each(|z| *z /= unit);
        Self { values, segments, origin, unit, present }
    }

    /// Number of residuals if each segment omits its first `skip` samples.
    pub fn residuals(&self, skip: usize) -> usize {
        self.segments.iter().map(|segment| segment.len().saturating_sub(skip)).sum()
    }

    /// `[φ, θ, c]` in the record's units, from scaled values; `c`, if present, is at `constant`.
    pub(super) fn with_units(&self, scaled: Vec<f64>, p: usize, constant: usize) -> Vec<f64> {
        let shift = self.origin * phi_of_one(&scaled[..p]);
        changed(scaled, constant, |c| shift + self.unit * c)
    }

    /// Inverse of [`with_units`](Self::with_units).
    pub(super) fn without_units(&self, raw: Vec<f64>, p: usize, constant: usize) -> Vec<f64> {
        let shift = self.origin * phi_of_one(&raw[..p]);
        changed(raw, constant, |c| (c - shift) / self.unit)
    }
}

/// `φ(1) = 1 - φ_1 - … - φ_p`: the mean is the constant divided by it.
pub(super) fn phi_of_one(phi: &[f64]) -> f64 {
    1.0 - phi.iter().sum::<f64>()
}

fn changed(mut values: Vec<f64>, index: usize, change: impl Fn(f64) -> f64) -> Vec<f64> {
    if let Some(value) = values.get_mut(index) {
        *value = change(*value);
    }
    values
}

/// Mean from the distances to the first sample, which are precise even with a large offset.
fn mean(values: &[f64], segments: &[Range<usize>]) -> f64 {
    let Some(first) = segments.first().map(|segment| values[segment.start]) else {
        return 0.0;
    };
    let finite = values.iter().filter(|z| z.is_finite());
    let (sum, count) = finite.fold((0.0, 0.0), |(sum, n), z| (sum + (z - first), n + 1.0));
    first + sum / count
}

/// Root mean square, scaled by the largest value: no square overflows.
fn deviation(values: &[f64]) -> f64 {
    let finite = || values.iter().filter(|z| z.is_finite());
    let largest = finite().fold(0.0, |largest: f64, z| largest.max(z.abs()));
    if largest == 0.0 {
        return 1.0;
    }
    let sum: f64 = finite().map(|z| (z / largest) * (z / largest)).sum();
    largest * (sum / finite().count() as f64).sqrt()
}
