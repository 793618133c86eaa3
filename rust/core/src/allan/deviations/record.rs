//! A record of rates, converted to phase.

use std::ops::Range;

use pulp::Arch;

use super::kernels::Extent;
use crate::math::parallel;
use crate::math::segments::segment_ranges;
use crate::work;

/// Largest sample that is squared without scaling; records below its reciprocal are scaled, too.
const MAX_UNSCALED_SAMPLE: f64 = 1e100;

/// Phase of a rate record, in segments between its gaps: the sums of its samples minus their mean,
/// at a sampling interval of one.
#[derive(Debug, Clone)]
pub struct Record {
    phase: Vec<f64>,
    segments: Vec<Range<usize>>,
    /// Power of two by which the samples were divided.
    unit: f64,
    arch: Arch,
}

impl Record {
    /// Creates a record from rate samples; samples that are not finite are missing. Gaps of at most
    /// `bridged` samples are closed by a straight line.
    ///
    /// The phase replaces the samples; with capacity for one more value, nothing is copied.
    pub fn new(mut samples: Vec<f64>, bridged: usize) -> Self {
        let arch = Arch::new();
        let mut present: Vec<_> = std::iter::once(0..samples.len()).collect();
        let mut summary = Summary::of(&samples, &present, arch);
        if !summary.sum.is_finite() {
            bridge(&mut samples, bridged);
            present = work::collect(segment_ranges(&samples).filter(|range| range.len() > 1));
            summary = Summary::of(&samples, &present, arch);
        }
        let unit = unit(summary.largest);
        if unit != 1.0 {
            samples.iter_mut().for_each(|z| *z /= unit);
            summary = Summary::of(&samples, &present, arch);
        }
        integrate(&mut samples, &present, &summary);
        Self { phase: samples, segments: present, unit, arch }
    }

    /// The records of several columns of samples, with `parallel` on the current thread pool.
    pub fn of_columns(columns: Vec<Vec<f64>>, bridged: usize, parallel: bool) -> Vec<Self> {
        parallel::map(columns, parallel, |column| Self::new(column, bridged))
    }

    /// Phase points, segment by segment.
    pub(super) fn segments(&self) -> impl Iterator<Item = &[f64]> {
        self.segments.iter().map(|samples| &self.phase[samples.start..=samples.end])
    }

    /// Phase points of the longest segment.
    pub(super) fn longest_segment(&self) -> &[f64] {
        self.segments().max_by_key(|x| x.len()).unwrap_or_default()
    }

    /// Factor from a deviation of the phase to the unit of the samples.
    pub(super) fn unit(&self) -> f64 {
        self.unit
    }

    pub(super) fn arch(&self) -> Arch {
        self.arch
    }
}

/// Distances of the samples from one sample, whose mean is precise even with a large offset.
struct Summary {
    origin: f64,
    sum: f64,
    largest: f64,
    count: usize,
}

impl Summary {
    fn of(samples: &[f64], present: &[Range<usize>], arch: Arch) -> Self {
        let origin = present.first().and_then(|first| samples.get(first.start)).copied();
        let none = Self { origin: origin.unwrap_or(0.0), sum: 0.0, largest: 0.0, count: 0 };
        present.iter().fold(none, |so_far, range| {
            work::pause();
            let (sum, largest) =
                arch.dispatch(Extent { samples: &samples[range.clone()], origin: so_far.origin });
            Self {
                origin: so_far.origin,
                sum: so_far.sum + sum,
                largest: so_far.largest.max(largest),
                count: so_far.count + range.len(),
            }
        })
    }

    fn mean_distance(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }
}

/// A power of two near `largest`, or one if no square can overflow or underflow.
fn unit(largest: f64) -> f64 {
    if largest == 0.0 || (MAX_UNSCALED_SAMPLE.recip()..MAX_UNSCALED_SAMPLE).contains(&largest) {
        return 1.0;
    }
    largest.log2().floor().clamp(-1000.0, 1000.0).exp2()
}

/// Replaces each sample by the sum of the earlier samples in its segment, and adds the whole sum
/// after them.
fn integrate(samples: &mut Vec<f64>, present: &[Range<usize>], summary: &Summary) {
    work::push(samples, 0.0);
    let mean = summary.mean_distance();
    for range in present {
        let mut sum = 0.0;
        for z in &mut samples[range.clone()] {
            let step = (*z - summary.origin) - mean;
            *z = sum;
            sum += step;
        }
        samples[range.end] = sum;
    }
}

/// Draws a line across every gap of at most `longest` samples between two finite samples.
pub fn bridge(samples: &mut [f64], longest: usize) {
    let mut last = None;
    for i in 0..samples.len() {
        if !samples[i].is_finite() {
            continue;
        }
        if let Some(before) =
            last.filter(|before| (2..=longest.saturating_add(1)).contains(&(i - before)))
        {
            draw_line(&mut samples[before..=i]);
        }
        last = Some(i);
    }
}

fn draw_line(samples: &mut [f64]) {
    let last = samples.len() - 1;
    let (from, to) = (samples[0], samples[last]);
    for (k, z) in samples.iter_mut().enumerate().take(last).skip(1) {
        let fraction = k as f64 / last as f64;
        *z = from * (1.0 - fraction) + to * fraction;
    }
}

#[cfg(test)]
mod tests {
    use super::{Record, bridge};

    const N: f64 = f64::NAN;

    #[test]
    fn single_samples_are_no_segment() {
        let record = Record::new(vec![N, 1.0, N, 1.0, 2.0, N, N, 1.0, 1.0, 1.0], 0);
        assert_eq!(record.segments, [3..5, 7..10]);
        assert_eq!(Record::new(vec![f64::INFINITY, 1.0], 0).segments, []);
        assert_eq!(Record::new(vec![N; 2], 0).segments, []);
    }

    #[test]
    fn a_line_closes_gaps_up_to_the_longest() {
        let mut z = [N, 0.0, N, N, N, 4.0, N, N, N, N, 9.0, N];
        bridge(&mut z, 3);
        assert_eq!(z[1..6], [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert!(z[0].is_nan() && z[6..10].iter().all(|z| z.is_nan()) && z[11].is_nan());
        bridge(&mut z, usize::MAX);
        assert_eq!(z[5..11], [4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    }
}
