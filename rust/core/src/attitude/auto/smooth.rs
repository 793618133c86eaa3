//! Smoothing of a whole record: rests before, between and after say what the bias was all along, and
//! then the filter runs forward and backward on rates that have none.

use nalgebra::{Matrix3, Quaternion, Vector3};

use super::errors::BIAS;
use super::strapdown::small_rotation;
use super::{Auto, AutoOptions};
use crate::attitude::{Attitude, Estimator, Knowledge, Sample, Snapshot, frame, sample};
use crate::error::Error;
use crate::stream::Stream;
use crate::{memory, work};

/// Samples between two looks at whether to go on.
const PIECE: usize = 1 << 12;

/// The bias after a sample, rad/s, with the filter's variance of it and the deviation to be told.
#[derive(Debug, Clone, Copy)]
struct Bias {
    value: Vector3<f64>,
    variance: Vector3<f64>,
    sigma: Vector3<f64>,
}

/// Matrix of the gyro, and the deviations of its elements.
#[derive(Debug, Clone, Copy)]
struct Gyro {
    matrix: Matrix3<f64>,
    sigma: Matrix3<f64>,
}

/// What a pass over rates without bias knows after a sample, in the frame east, north, up.
#[derive(Debug, Clone, Copy)]
struct Known {
    orientation: Quaternion<f64>,
    knowledge: Knowledge,
    /// The filter's variances of both tilts together, and of the heading.
    tilt: f64,
    heading: f64,
}

impl Attitude<Auto> {
    /// What is known of each sample of a record by all of it, whatever this filter has seen.
    ///
    /// The record is filtered forward and backward in time. The bias of both passes is joined at each
    /// sample, axis by axis, and taken off the rates together with the mean of their matrices; then
    /// both run again, on rates that need neither. Tilt and, with a magnetometer, heading of both are
    /// joined by their variances; without one the heading is that of the forward pass.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is none for the passes, [`Error::Stopped`] if asked to stop.
    pub fn smooth(&self, samples: &[Sample]) -> Result<Vec<Snapshot>, Error> {
        let options = *self.estimator().options();
        let (biases, gyro) = self.biases(samples)?;
        let rates = self.without_errors(samples, &biases, &gyro)?;
        let (forward, backward) = self.passes(&rates, [Auto::knowing(options); 2], Known::of)?;
        let mut drift = Drift::default();
        let mut smoothed = memory::room(samples.len())?;
        for (k, (forward, backward)) in forward.iter().zip(&backward).enumerate() {
            pause(k);
            let (orientation, mut knowledge) = joined(forward, backward, options.mag);
            (knowledge.bias, knowledge.bias_sigma) = (biases[k].value, biases[k].sigma);
            (knowledge.gyro_matrix, knowledge.gyro_matrix_sigma) = (gyro.matrix, gyro.sigma);
            if !options.mag {
                drift.turn(&orientation, &self.rate_of(&rates[k]), self.seconds(&rates[k]));
                knowledge.heading_sigma = drift.sigma(forward.heading, &biases[k], &gyro);
            }
            let force = sample::force(samples[k].accel, self.params().accel_unit);
            let force = force.unwrap_or(Vector3::repeat(f64::NAN));
            smoothed.push(self.shown(&orientation, &knowledge, &force));
        }
        Ok(smoothed)
    }

    /// The bias at each sample by all of the record, and what the gyro is like.
    fn biases(&self, samples: &[Sample]) -> Result<(Vec<Bias>, Gyro), Error> {
        let options = *self.estimator().options();
        let reversed = AutoOptions { bias: options.bias.map(|x| -x), ..options };
        let filters = [Auto::with(options), Auto::with(reversed)];
        let (forward, backward) = self.passes(samples, filters, |auto| (bias(auto), gyro(auto)))?;
        let mut biases = memory::room(samples.len())?;
        for (k, ((one, _), (other, _))) in forward.iter().zip(&backward).enumerate() {
            pause(k);
            biases.push(one.joined(other));
        }
        // Each pass knows most of the matrix at its end.
        let ends = (forward.last().map(|(_, gyro)| *gyro), backward.first().map(|(_, gyro)| *gyro));
        let gyro = match ends {
            (Some(one), Some(other)) => one.mean(&other),
            _ => gyro(&filters[0]),
        };
        Ok((biases, gyro))
    }

    /// The samples as a gyro without bias and with the matrix one gives them.
    fn without_errors(
        &self,
        samples: &[Sample],
        biases: &[Bias],
        gyro: &Gyro,
    ) -> Result<Vec<Sample>, Error> {
        let unit = self.params().gyro_unit;
        let mut rates = memory::room(samples.len())?;
        for (sample, bias) in samples.iter().zip(biases) {
            let rate = gyro.matrix * (Vector3::from(sample.gyro) * unit - bias.value);
            rates.push(Sample { gyro: (rate / unit).into(), ..*sample });
        }
        Ok(rates)
    }

    /// What filters know after each sample, forward and backward in time; both in the order of the
    /// samples.
    fn passes<T>(
        &self,
        samples: &[Sample],
        [ahead, back]: [Auto; 2],
        known: impl Fn(&Auto) -> T + Copy,
    ) -> Result<(Vec<T>, Vec<T>), Error> {
        let n = samples.len();
        let forward = self.pass(ahead, samples.iter().copied(), n, known)?;
        let mut backward = self.pass(back, turned(samples, self.params().rate), n, known)?;
        backward.reverse();
        Ok((forward, backward))
    }

    fn pass<T>(
        &self,
        auto: Auto,
        samples: impl Iterator<Item = Sample>,
        n: usize,
        known: impl Fn(&Auto) -> T,
    ) -> Result<Vec<T>, Error> {
        let mut filter = Self::new(*self.params(), auto)?;
        let mut all = memory::room(n)?;
        for (k, sample) in samples.enumerate() {
            pause(k);
            take(&mut filter, sample);
            all.push(known(filter.estimator()));
        }
        Ok(all)
    }

    /// Rate of a sample, rad/s, zero where it is missing.
    fn rate_of(&self, sample: &Sample) -> Vector3<f64> {
        sample::rate(sample.gyro, self.params().gyro_unit).unwrap_or_default()
    }

    /// Seconds of a sample in which its rate counts.
    fn seconds(&self, sample: &Sample) -> f64 {
        let dt = if sample.dt >= 0.0 { sample.dt } else { 1.0 / self.params().rate };
        dt.min(1.0)
    }
}

/// One for all passes: what is done at a tick is large.
#[inline(never)]
fn take(filter: &mut Attitude<Auto>, sample: Sample) {
    filter.update(sample);
}

impl Bias {
    /// Axis by axis; the other is of a pass backward in time.
    fn joined(&self, other: &Self) -> Self {
        let share = self.variance.zip_map(&other.variance, share);
        Self {
            value: self.value - (other.value + self.value).component_mul(&share),
            variance: other.variance.component_mul(&share),
            sigma: Vector3::from_fn(|i, _| {
                let (a, b) = (self.sigma[i] * self.sigma[i], other.sigma[i] * other.sigma[i]);
                (b * self::share(a, b)).sqrt()
            }),
        }
    }
}

impl Gyro {
    fn mean(&self, other: &Self) -> Self {
        let (matrix, sigma) = (self.matrix + other.matrix, self.sigma + other.sigma);
        Self { matrix: matrix * 0.5, sigma: sigma * 0.5 }
    }
}

fn bias(auto: &Auto) -> Bias {
    let knowledge = auto.knowledge();
    let variance = Vector3::from_fn(|i, _| auto.errors.variance(BIAS + i).max(0.0));
    Bias { value: knowledge.bias, variance, sigma: knowledge.bias_sigma }
}

fn gyro(auto: &Auto) -> Gyro {
    let Knowledge { gyro_matrix, gyro_matrix_sigma, .. } = auto.knowledge();
    Gyro { matrix: gyro_matrix, sigma: gyro_matrix_sigma }
}

impl Known {
    fn of(auto: &Auto) -> Self {
        let tilt = (auto.errors.variance(0) + auto.errors.variance(1)).max(0.0);
        let heading = auto.errors.heading().max(0.0);
        Self { orientation: auto.orientation(), knowledge: auto.knowledge(), tilt, heading }
    }
}

/// What both passes know together. Without a magnetometer the heading is one against the start, which
/// the second knows nothing of.
fn joined(forward: &Known, backward: &Known, mag: bool) -> (Quaternion<f64>, Knowledge) {
    let (one, other) = (&forward.knowledge, &backward.knowledge);
    let apart = backward.orientation * forward.orientation.conjugate();
    let about_up = 2.0 * f64::atan2(apart.k, apart.w);
    let level = angle(&(small_rotation(&(Vector3::z() * -about_up)) * apart));
    let tilt = share(forward.tilt, backward.tilt);
    let (a, b) = (one.heading_sigma * one.heading_sigma, other.heading_sigma * other.heading_sigma);
    let heading = if mag { share(a, b) } else { 0.0 };
    let about_up = f64::atan2(about_up.sin(), about_up.cos()) * heading;
    let leaned = small_rotation(&Vector3::new(level.x * tilt, level.y * tilt, 0.0));
    let orientation = small_rotation(&(Vector3::z() * about_up)) * leaned * forward.orientation;
    let of_tilt = share(one.tilt_sigma * one.tilt_sigma, other.tilt_sigma * other.tilt_sigma);
    let knowledge = Knowledge {
        tilt_sigma: other.tilt_sigma * of_tilt.sqrt(),
        heading_sigma: if mag { (b * heading).sqrt() } else { one.heading_sigma },
        at_rest: one.at_rest || other.at_rest,
        ..*one
    };
    (orientation.normalize(), knowledge)
}

/// The share of the second in a mean by variances: what is left of its own is the mean's variance.
fn share(one: f64, other: f64) -> f64 {
    if one + other > 0.0 { one / (one + other) } else { 0.5 }
}

/// The rotation vector of a rotation, at most half a turn.
fn angle(q: &Quaternion<f64>) -> Vector3<f64> {
    let q = if q.w < 0.0 { -q } else { *q };
    let length = q.imag().norm();
    let scale = if length > 1e-12 { 2.0 * length.atan2(q.w) / length } else { 2.0 };
    q.imag() * scale
}

/// How far errors of the gyro have turned a heading that nothing corrects since the start: those that
/// last add up with their sign, so that turns there and back leave nothing.
#[derive(Debug, Clone, Copy, Default)]
struct Drift {
    /// By an error of the bias, s, and of each element of the matrix, rad.
    bias: Vector3<f64>,
    matrix: Matrix3<f64>,
}

impl Drift {
    fn turn(&mut self, orientation: &Quaternion<f64>, rate: &Vector3<f64>, seconds: f64) {
        let up = frame::up(orientation) * seconds;
        self.bias += up;
        self.matrix += up * rate.transpose();
    }

    /// The deviation of the heading, of which the filter knows the variance but for these errors.
    fn sigma(&self, own: f64, bias: &Bias, gyro: &Gyro) -> f64 {
        let of_bias = self.bias.component_mul(&bias.sigma).norm_squared();
        let of_matrix = self.matrix.component_mul(&gyro.sigma).norm_squared();
        (own + of_bias + of_matrix).sqrt()
    }
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

fn pause(k: usize) {
    if k % PIECE == PIECE - 1 {
        work::pause();
    }
}
