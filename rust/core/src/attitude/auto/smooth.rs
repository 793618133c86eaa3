//! Smoothing of a whole record: the filter forward and backward in time, joined.

use nalgebra::{Quaternion, Vector3};

use super::strapdown::small_rotation;
use super::{Auto, AutoOptions};
use crate::attitude::{Attitude, Estimator, Knowledge, Sample, Snapshot, sample};
use crate::error::Error;
use crate::stream::Stream;
use crate::{memory, work};

/// Samples between two looks at whether to go on.
const PIECE: usize = 1 << 12;

/// What one pass knows after a sample, in the frame east, north, up.
#[derive(Debug, Clone, Copy)]
struct Known {
    orientation: Quaternion<f64>,
    knowledge: Knowledge,
}

impl Attitude<Auto> {
    /// What is known of each sample of a record by all of it, whatever this filter has seen.
    ///
    /// The record is filtered forward and backward in time, twice: the second time each pass begins
    /// with what the other has found of bias and matrix. Tilt and heading of both are joined by
    /// their variances. Without a magnetometer the heading of the first sample is that of the filter.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is none for the passes, [`Error::Stopped`] if asked to stop.
    pub fn smooth(&self, samples: &[Sample]) -> Result<Vec<Snapshot>, Error> {
        let options = *self.estimator().options();
        let (mut ahead, mut back) = (options, reversed(&options));
        let mut forward = memory::room(samples.len())?;
        let mut backward = memory::room(samples.len())?;
        for _ in 0..2 {
            let first = self.pass(ahead, samples.iter().copied(), &mut forward)?;
            let second = self.pass(back, turned(samples, self.params().rate), &mut backward)?;
            ahead = found(&options, &second, &first);
            back = found(&options, &first, &second);
        }
        backward.reverse();
        let offset = if options.mag { 0.0 } else { mean_turn(&forward, &backward) };
        let mut smoothed = memory::room(samples.len())?;
        for (k, (forward, backward)) in forward.iter().zip(&backward).enumerate() {
            pause(k);
            let (orientation, knowledge) = joined(forward, backward, offset, options.mag);
            let force = sample::force(samples[k].accel, self.params().accel_unit);
            let force = force.unwrap_or(Vector3::repeat(f64::NAN));
            smoothed.push(self.shown(&orientation, &knowledge, &force));
        }
        Ok(smoothed)
    }

    /// Filters with these options; returns what is known at the end.
    fn pass(
        &self,
        options: AutoOptions,
        samples: impl Iterator<Item = Sample>,
        known: &mut Vec<Known>,
    ) -> Result<Known, Error> {
        let mut filter = Self::new(*self.params(), Auto::with(options))?;
        known.clear();
        for (k, sample) in samples.enumerate() {
            pause(k);
            filter.update(sample);
            known.push(filter.known());
        }
        Ok(filter.known())
    }

    fn known(&self) -> Known {
        let estimator = self.estimator();
        Known { orientation: estimator.orientation(), knowledge: estimator.knowledge() }
    }
}

/// What both passes know together; the second is turned by an angle about up. Without a
/// magnetometer the heading is one against the start, which the second knows nothing of.
fn joined(forward: &Known, backward: &Known, turn: f64, mag: bool) -> (Quaternion<f64>, Knowledge) {
    let (one, other) = (&forward.knowledge, &backward.knowledge);
    let turn = small_rotation(&Vector3::new(0.0, 0.0, turn));
    let apart = angle(&(turn * backward.orientation * forward.orientation.conjugate()));
    let tilt = join(one.tilt_sigma, other.tilt_sigma);
    let heading = join(one.heading_sigma, other.heading_sigma);
    let bias = [0, 1, 2].map(|i| join(one.bias_sigma[i], other.bias_sigma[i]));
    let step = Vector3::new(apart.x * tilt.0, apart.y * tilt.0, apart.z * heading.0);
    let knowledge = Knowledge {
        bias: Vector3::from_fn(|i, _| one.bias[i] - (other.bias[i] + one.bias[i]) * bias[i].0),
        bias_sigma: Vector3::from_fn(|i, _| bias[i].1),
        gyro_matrix: (one.gyro_matrix + other.gyro_matrix) * 0.5,
        tilt_sigma: tilt.1,
        heading_sigma: if mag { heading.1 } else { one.heading_sigma },
        at_rest: one.at_rest || other.at_rest,
        ..*one
    };
    ((small_rotation(&step) * forward.orientation).normalize(), knowledge)
}

/// The share of the second in a mean by their variances, and the deviation of it.
fn join(one: f64, other: f64) -> (f64, f64) {
    let (a, b) = (one * one, other * other);
    let share = if a + b > 0.0 { a / (a + b) } else { 0.5 };
    (share, (b * share).sqrt())
}

/// The rotation vector of a rotation, at most half a turn.
fn angle(q: &Quaternion<f64>) -> Vector3<f64> {
    let q = if q.w < 0.0 { -q } else { *q };
    let length = q.imag().norm();
    let scale = if length > 1e-12 { 2.0 * length.atan2(q.w) / length } else { 2.0 };
    q.imag() * scale
}

/// By how much the second passes are turned about up against the first, in the mean.
fn mean_turn(forward: &[Known], backward: &[Known]) -> f64 {
    let apart = |(f, b): (&Known, &Known)| angle(&(f.orientation * b.orientation.conjugate())).z;
    let (sine, cosine) = forward.iter().zip(backward).map(apart).fold((0.0, 0.0), |sum, turn| {
        let (sine, cosine): (f64, f64) = turn.sin_cos();
        (sum.0 + sine, sum.1 + cosine)
    });
    f64::atan2(sine, cosine)
}

/// The record backward in time: the rate that leads from a sample to the one before it is the
/// sample's own, the other way round.
fn turned(samples: &[Sample], rate: f64) -> impl Iterator<Item = Sample> {
    let next = |k: usize| samples.get(k + 1).unwrap_or(&samples[k]);
    let period = 1.0 / rate;
    (0..samples.len()).rev().map(move |k| Sample {
        gyro: next(k).gyro.map(|x| -x),
        dt: if k + 1 < samples.len() { next(k).dt } else { period },
        ..samples[k]
    })
}

fn reversed(options: &AutoOptions) -> AutoOptions {
    AutoOptions { bias: options.bias.map(|x| -x), ..*options }
}

/// Options of a pass that begins where the `other` ended; `own` is what it found itself.
fn found(options: &AutoOptions, other: &Known, own: &Known) -> AutoOptions {
    let (other, own) = (&other.knowledge, &own.knowledge);
    let matrix = (other.gyro_matrix + own.gyro_matrix) * 0.5;
    AutoOptions {
        bias: [0, 1, 2].map(|i| -other.bias[i]),
        bias_sigma: [0, 1, 2].map(|i| other.bias_sigma[i]),
        matrix: matrix.transpose().into(),
        matrix_sigma: own.gyro_matrix_sigma.transpose().into(),
        ..*options
    }
}

fn pause(k: usize) {
    if k % PIECE == PIECE - 1 {
        work::pause();
    }
}
