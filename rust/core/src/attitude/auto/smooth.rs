//! Smoothing of a whole record. Rests before, during and after a sample determine the bias. Then
//! the filter runs forward and backward on rates without bias.

use nalgebra::{ComplexField, Matrix3, Quaternion, Vector3};

use super::errors::BIAS;
use super::strapdown::small_rotation;
use super::{Auto, AutoOptions};
use crate::attitude::events::Events;
use crate::attitude::stream::Tagged;
use crate::attitude::{
    Attitude, AttitudeParams, Estimator, Knowledge, Sample, Snapshot, frame, sample,
};
use crate::error::Error;
use crate::math::parallel;
use crate::stream::{Block, Stream};
use crate::{memory, work};

/// Number of samples between two checks for a stop.
const SAMPLES_PER_CHECK: usize = 1 << 12;

/// Largest standard deviation of the headings of the two passes, rad, for an equal mean.
const MAX_JOINED_SIGMA_RAD: f64 = core::f64::consts::PI / 6.0;

/// A filter around this one that corrects the magnetometer's samples.
pub trait Around: Tagged + Clone + Send + Sync {
    /// The filter inside.
    fn auto(&self) -> &Auto;
    /// The corrected field of the next sample, NaN without a field.
    fn field(&self, mag: [f64; 3]) -> [f64; 3];
}

impl Around for Auto {
    fn auto(&self) -> &Auto {
        self
    }

    fn field(&self, mag: [f64; 3]) -> [f64; 3] {
        mag
    }
}

/// Bias after a sample, rad/s, its variance in the filter, and the reported standard deviation.
#[derive(Debug, Clone, Copy)]
struct Bias {
    value: Vector3<f64>,
    variance: Vector3<f64>,
    sigma: Vector3<f64>,
}

/// Matrix of the gyro, and standard deviations of its elements.
#[derive(Debug, Clone, Copy)]
struct Gyro {
    matrix: Matrix3<f64>,
    sigma: Matrix3<f64>,
}

/// State after a sample in a pass over rates without bias, in the frame east, north, up.
#[derive(Debug, Clone, Copy)]
struct Known {
    orientation: Quaternion<f64>,
    /// Variance of the two tilts together, and of the heading, in the filter.
    tilt: f64,
    heading: f64,
    /// Reported standard deviations.
    tilt_sigma: f64,
    heading_sigma: f64,
    gravity: f64,
    at_rest: bool,
    disturbed: bool,
    started: bool,
}

/// Result of a pass over uncorrected rates for a sample.
#[derive(Debug, Clone, Copy)]
struct First {
    bias: Bias,
    /// Corrected field.
    field: [f64; 3],
    events: Events,
}

impl First {
    fn of<E: Around>(filter: &Attitude<E>, field: [f64; 3]) -> Self {
        let auto = filter.estimator().auto();
        Self { bias: Bias::of(auto), field, events: filter.events(auto.all_events()) }
    }
}

/// Results of a pass for each sample, in the order of the pass, and for the gyro.
#[derive(Debug)]
struct Passed<T> {
    found: Vec<T>,
    gyro: Gyro,
}

/// A record for a gyro without bias and matrix errors, and the subtracted bias and matrix.
#[derive(Debug)]
struct Record {
    params: AttitudeParams,
    samples: Vec<Sample>,
    biases: Vec<Bias>,
    /// Events of each sample.
    events: Vec<Events>,
    gyro: Gyro,
}

/// Smoothed samples of a record, one after the other.
#[derive(Debug)]
pub struct Smoothed {
    record: Record,
    mag: bool,
    forward: Vec<Known>,
    /// States of the backward pass, from the last sample to the first.
    backward: Vec<Known>,
    drift: Drift,
    next: usize,
}

impl<E: Around> Attitude<E> {
    /// Smooths each sample of a record with the whole record; the filter's own state is not used.
    ///
    /// The record is filtered forward and backward in time. The biases of the two passes are
    /// combined at each sample, axis by axis, and subtracted from the rates; the mean of their
    /// matrices is applied. Then the two passes run again, on corrected rates. Their tilts and,
    /// with a magnetometer, headings are combined by their variances. Without a magnetometer the
    /// heading is the forward pass's heading.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory for the passes, [`Error::Stopped`] after a request
    /// to stop.
    pub fn smooth(&self, samples: Vec<Sample>) -> Result<Smoothed, Error> {
        let options =
            AutoOptions { mag: self.estimator().auto().options.mag, ..Default::default() };
        let record = self.without_bias(samples)?;
        let (n, rate) = (record.samples.len(), record.params.rate);
        let knowing = Attitude::new(record.params, Auto::knowing(options))?;
        let pass = |at: &At<'_>| pass(knowing, n, at, |filter, _| Known::of(filter.estimator()));
        let [forward, backward] =
            both(|| pass(&|k| record.samples[k]), || pass(&|k| turned(&record.samples, k, rate)))?;
        let (forward, backward) = (forward.found, backward.found);
        Ok(Smoothed {
            record,
            mag: options.mag,
            forward,
            backward,
            drift: Drift::default(),
            next: 0,
        })
    }

    /// The record without the bias that all samples determine, and with the corrected fields.
    fn without_bias(&self, mut samples: Vec<Sample>) -> Result<Record, Error> {
        let (params, n) = (*self.params(), samples.len());
        let options = *self.estimator().auto().options();
        // A field gives no information on a bias.
        let reversed = AutoOptions { bias: options.bias.map(|x| -x), mag: false, ..options };
        let (mut own, reversed) = (self.clone(), Attitude::new(params, Auto::with(reversed))?);
        own.reset();
        let back = |k| Sample { mag: [f64::NAN; 3], ..turned(&samples, k, params.rate) };
        let [forward, backward] = both(
            || pass(own.clone(), n, &|k| samples[k], First::of),
            || pass(reversed, n, &back, First::of),
        )?;
        // Each pass knows the matrix best at its end.
        let (gyro, unit) = (forward.gyro.mean(&backward.gyro), params.gyro_unit);
        let (mut biases, mut events) = (memory::room(n)?, memory::room(n)?);
        let ahead = forward.found.iter().zip(&mut samples);
        for ((first, sample), other) in ahead.zip(backward.found.iter().rev()) {
            let bias = first.bias.joined(&other.bias);
            let rate = match params.measured(sample.gyro) {
                Some(rate) => gyro.matrix * (rate - bias.value),
                None => Vector3::repeat(f64::NAN),
            };
            (sample.gyro, sample.mag) = ((rate / unit).into(), first.field);
            biases.push(bias);
            events.push(first.events);
        }
        // A corrected rate may exceed the range.
        let params = AttitudeParams { gyro_range: None, ..params };
        Ok(Record { params, samples, biases, events, gyro })
    }
}

/// The k-th sample of a pass.
type At<'a> = dyn Fn(usize) -> Sample + Sync + 'a;

/// Runs two passes, in parallel if there is a thread.
fn both<T: Send>(
    ahead: impl Fn() -> Result<Passed<T>, Error> + Sync,
    back: impl Fn() -> Result<Passed<T>, Error> + Sync,
) -> Result<[Passed<T>; 2], Error> {
    let mut found =
        parallel::map(vec![true, false], true, |is_ahead| if is_ahead { ahead() } else { back() });
    match (found.pop(), found.pop()) {
        (Some(back), Some(ahead)) => Ok([ahead?, back?]),
        _ => Err(Error::Stopped),
    }
}

/// State after each of n samples, of the filter and of its field.
fn pass<E: Around, T>(
    mut filter: Attitude<E>,
    n: usize,
    at: &At<'_>,
    known: impl Fn(&Attitude<E>, [f64; 3]) -> T,
) -> Result<Passed<T>, Error> {
    let mut found = memory::room(n)?;
    for k in 0..n {
        pause(k);
        let sample = at(k);
        let field = filter.estimator().field(sample.mag);
        take(&mut filter, &sample);
        found.push(known(&filter, field));
    }
    Ok(Passed { found, gyro: Gyro::of(filter.estimator().auto()) })
}

/// Processes one sample, by the loop for batches: the work at a tick is large and is not compiled
/// again here.
fn take<E: Around>(filter: &mut Attitude<E>, sample: &Sample) {
    let ([gx, gy, gz], [ax, ay, az], [mx, my, mz]) = (sample.gyro, sample.accel, sample.mag);
    let row = [gx, gy, gz, ax, ay, az, mx, my, mz, sample.dt];
    filter.process_column(0, &mut Block::new(1, &row, &mut [0.0; 4], &mut []));
}

/// The k-th sample of a record backward in time. The rate from a sample to the previous one is the
/// sample's own rate with the opposite sign.
fn turned(samples: &[Sample], k: usize, rate: f64) -> Sample {
    let index = samples.len() - 1 - k;
    let sample = samples[index];
    let (gyro, dt) = match samples.get(index + 1) {
        Some(next) => (next.gyro, next.dt),
        None => (sample.gyro, 1.0 / rate),
    };
    Sample { gyro: gyro.map(|x| -x), dt, ..sample }
}

impl Iterator for Smoothed {
    type Item = Snapshot;

    fn next(&mut self) -> Option<Snapshot> {
        let (k, record) = (self.next, &self.record);
        let (forward, backward) =
            (self.forward.get(k)?, &self.backward[self.forward.len() - 1 - k]);
        pause(k);
        self.next += 1;
        let (params, sample, bias) = (&record.params, &record.samples[k], &record.biases[k]);
        let (orientation, mut knowledge) = joined(forward, backward, self.mag);
        (knowledge.bias, knowledge.bias_sigma) = (bias.value, bias.sigma);
        (knowledge.gyro_matrix, knowledge.gyro_matrix_sigma) =
            (record.gyro.matrix, record.gyro.sigma);
        knowledge.events = record.events[k];
        if !self.mag {
            let rate = params.measured(sample.gyro).unwrap_or_default();
            self.drift.turn(&orientation, &rate, seconds(sample, params.rate));
            knowledge.heading_sigma = self.drift.sigma(forward.heading, bias, &record.gyro);
        }
        let force = sample::force(sample.accel, params.accel_unit);
        Some(params.shown(&orientation, &knowledge, &force.unwrap_or(Vector3::repeat(f64::NAN))))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.forward.len() - self.next;
        (left, Some(left))
    }
}

impl ExactSizeIterator for Smoothed {}

/// Time of a sample for which its rate is used, s.
fn seconds(sample: &Sample, rate: f64) -> f64 {
    let dt = if sample.dt >= 0.0 { sample.dt } else { 1.0 / rate };
    dt.min(1.0)
}

impl Bias {
    fn of(auto: &Auto) -> Self {
        let variance = Vector3::from_fn(|i, _| auto.errors.variance(BIAS + i).max(0.0));
        let doubt = auto.doubt();
        Self { value: auto.bias, variance, sigma: variance.map(|x| ComplexField::sqrt(doubt * x)) }
    }

    /// Combines axis by axis; the other bias is from a pass backward in time.
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
    fn of(auto: &Auto) -> Self {
        let Knowledge { gyro_matrix, gyro_matrix_sigma, .. } = auto.knowledge();
        Self { matrix: gyro_matrix, sigma: gyro_matrix_sigma }
    }

    fn mean(&self, other: &Self) -> Self {
        let (matrix, sigma) = (self.matrix + other.matrix, self.sigma + other.sigma);
        Self { matrix: matrix * 0.5, sigma: sigma * 0.5 }
    }
}

impl Known {
    fn of(auto: &Auto) -> Self {
        Self {
            orientation: auto.orientation(),
            tilt: (auto.errors.variance(0) + auto.errors.variance(1)).max(0.0),
            heading: auto.errors.heading().max(0.0),
            tilt_sigma: ComplexField::sqrt(auto.tilt_variance()),
            heading_sigma: auto.heading_sigma(),
            gravity: auto.mean_gravity(),
            at_rest: auto.at_rest,
            disturbed: auto.magnet.is_disturbed() || auto.held.is_stuck(),
            started: auto.start.over,
        }
    }
}

/// Combines the two passes. Without a magnetometer the heading is relative to the start, which the
/// backward pass does not know.
fn joined(forward: &Known, backward: &Known, mag: bool) -> (Quaternion<f64>, Knowledge) {
    let apart = backward.orientation * forward.orientation.conjugate();
    let about_up = 2.0 * f64::atan2(apart.k, apart.w);
    let level = angle(&(small_rotation(&(Vector3::z() * -about_up)) * apart));
    let tilt = share(forward.tilt, backward.tilt);
    let variances = |sigma: fn(&Known) -> f64| [forward, backward].map(|x| sigma(x) * sigma(x));
    let [a, b] = variances(|known| known.heading_sigma);
    let leaned = small_rotation(&Vector3::new(level.x * tilt, level.y * tilt, 0.0));
    let (orientation, heading_sigma) = if mag {
        // The two passes follow the same field: one lags behind a drift, the other leads.
        let sure = a.max(b) < MAX_JOINED_SIGMA_RAD * MAX_JOINED_SIGMA_RAD;
        let heading = if sure { 0.5 } else { share(a, b) };
        let about_up = f64::atan2(about_up.sin(), about_up.cos()) * heading;
        let turned = small_rotation(&(Vector3::z() * about_up)) * leaned;
        (turned * forward.orientation, (b * share(a, b)).sqrt())
    } else {
        (leaned * forward.orientation, forward.heading_sigma)
    };
    let [own, others] = variances(|known| known.tilt_sigma);
    let knowledge = Knowledge {
        bias: Vector3::zeros(),
        bias_sigma: Vector3::zeros(),
        gyro_matrix: Matrix3::identity(),
        gyro_matrix_sigma: Matrix3::zeros(),
        tilt_sigma: backward.tilt_sigma * share(own, others).sqrt(),
        heading_sigma,
        gravity: forward.gravity,
        at_rest: forward.at_rest || backward.at_rest,
        unclear: false,
        wrong_unit: false,
        disturbed: forward.disturbed,
        stuck: false,
        started: forward.started,
        events: Events::default(),
    };
    (orientation.normalize(), knowledge)
}

/// Weight of the second value in a mean by variances: its variance times the remaining share is the
/// mean's variance.
fn share(one: f64, other: f64) -> f64 {
    if one + other > 0.0 { one / (one + other) } else { 0.5 }
}

/// Rotation vector of a rotation by at most half a turn.
fn angle(q: &Quaternion<f64>) -> Vector3<f64> {
    let q = if q.w < 0.0 { -q } else { *q };
    let length = q.imag().norm();
    let scale = if length > 1e-12 { 2.0 * length.atan2(q.w) / length } else { 2.0 };
    q.imag() * scale
}

/// Heading error from gyro errors since the start, if no magnetometer corrects the heading.
/// Constant errors add up with their sign, and cancel in rotations there and back.
#[derive(Debug, Clone, Copy, Default)]
struct Drift {
    /// Derivatives by an error of the bias, s, and of each element of the matrix, rad.
    bias: Vector3<f64>,
    matrix: Matrix3<f64>,
}

impl Drift {
    fn turn(&mut self, orientation: &Quaternion<f64>, rate: &Vector3<f64>, seconds: f64) {
        let up = frame::up(orientation) * seconds;
        self.bias += up;
        self.matrix += up * rate.transpose();
    }

    /// Standard deviation of the heading: the filter's variance and these errors.
    fn sigma(&self, own: f64, bias: &Bias, gyro: &Gyro) -> f64 {
        let of_bias = self.bias.component_mul(&bias.sigma).norm_squared();
        let of_matrix = self.matrix.component_mul(&gyro.sigma).norm_squared();
        (own + of_bias + of_matrix).sqrt()
    }
}

fn pause(k: usize) {
    if k % SAMPLES_PER_CHECK == SAMPLES_PER_CHECK - 1 {
        work::pause();
    }
}
