//! A record of rates, turned into phase.

use std::ops::Range;

use super::lanes::Lanes;
use super::stretches::{bridge, stretches};

/// Samples beyond this magnitude, or all below its reciprocal, are scaled before they are squared.
const LARGEST: f64 = 1e100;

/// The phase of a rate record (the sums of its samples less their mean), at a sampling interval of
/// one, piece by piece between its gaps.
#[derive(Debug, Clone)]
pub struct Record {
    phase: Vec<f64>,
    stretches: Vec<Range<usize>>,
    /// Power of two that the samples were divided by.
    unit: f64,
    lanes: Lanes,
}

impl Record {
    /// Takes rate samples, of which those not finite are missing, and closes gaps of at most
    /// `bridge` samples by a straight line.
    ///
    /// The phase takes the place of the samples; with room for one more, nothing is copied.
    pub fn new(mut samples: Vec<f64>, bridged: usize) -> Self {
        let lanes = Lanes::new();
        let mut present: Vec<_> = std::iter::once(0..samples.len()).collect();
        let mut survey = Survey::of(&samples, &present, lanes);
        if !survey.sum.is_finite() {
            bridge(&mut samples, bridged);
            present = stretches(&samples);
            survey = Survey::of(&samples, &present, lanes);
        }
        let unit = unit(survey.largest);
        if unit != 1.0 {
            samples.iter_mut().for_each(|z| *z /= unit);
            survey = Survey::of(&samples, &present, lanes);
        }
        integrate(&mut samples, &present, &survey);
        Self { phase: samples, stretches: present, unit, lanes }
    }

    /// Phase points, stretch by stretch.
    pub(super) fn stretches(&self) -> impl Iterator<Item = &[f64]> {
        self.stretches.iter().map(|samples| &self.phase[samples.start..=samples.end])
    }

    /// Phase points of the longest stretch.
    pub(super) fn longest_stretch(&self) -> &[f64] {
        self.stretches().max_by_key(|x| x.len()).unwrap_or_default()
    }

    /// What a deviation of the phase is to be multiplied by.
    pub(super) fn unit(&self) -> f64 {
        self.unit
    }

    pub(super) fn lanes(&self) -> Lanes {
        self.lanes
    }
}

/// The samples' distances from one of them, whose mean is precise also on a large offset.
struct Survey {
    origin: f64,
    sum: f64,
    largest: f64,
    count: usize,
}

impl Survey {
    fn of(samples: &[f64], present: &[Range<usize>], lanes: Lanes) -> Self {
        let origin = present.first().and_then(|first| samples.get(first.start)).copied();
        let none = Self { origin: origin.unwrap_or(0.0), sum: 0.0, largest: 0.0, count: 0 };
        present.iter().fold(none, |so_far, range| {
            let (sum, largest) = lanes.survey(&samples[range.clone()], so_far.origin);
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

/// A power of two near `largest`, or one where no square can overflow or vanish.
fn unit(largest: f64) -> f64 {
    if largest == 0.0 || (LARGEST.recip()..LARGEST).contains(&largest) {
        return 1.0;
    }
    largest.log2().floor().clamp(-1000.0, 1000.0).exp2()
}

/// Puts before each sample the sum of those before it in its stretch, and the whole sum after.
fn integrate(samples: &mut Vec<f64>, present: &[Range<usize>], survey: &Survey) {
    samples.reserve_exact(1);
    samples.push(0.0);
    let mean = survey.mean_distance();
    for range in present {
        let mut sum = 0.0;
        for z in &mut samples[range.clone()] {
            let step = (*z - survey.origin) - mean;
            *z = sum;
            sum += step;
        }
        samples[range.end] = sum;
    }
}
