//! Smoothing of a whole record: rests before, between and after say what the bias was all along, and
//! then the filter runs forward and backward on rates that have none.

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

/// Samples between two looks at whether to go on.
const SAMPLES_PER_CHECK: usize = 1 << 12;

/// Deviations of the headings of both passes, rad, below which they are joined half and half.
const MAX_JOINED_SIGMA_RAD: f64 = core::f64::consts::PI / 6.0;

/// A filter around this one that sees fields of its own making.
pub trait Around: Tagged + Clone + Send + Sync {
    /// The filter inside.
    fn auto(&self) -> &Auto;
    /// The field that it sees of the next sample's, NaN for none.
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

/// The bias after a sample, rad/s, with the filter's variance of it and the standard deviation to report.
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

/// State of a pass over rates without bias after a sample, in the frame east, north, up.
#[derive(Debug, Clone, Copy)]
struct Known {
    orientation: Quaternion<f64>,
    /// The filter's variances of both tilts together, and of the heading.
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
    /// The field that it saw.
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

/// A record as a gyro without bias and with the matrix one gives it, and what was taken off.
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
    /// From the last sample to the first.
    backward: Vec<Known>,
    drift: Drift,
    next: usize,
}

impl<E: Around> Attitude<E> {
    /// Smooths each sample of a record with the whole record; the filter's own state is not used.
    ///
    /// The record is filtered forward and backward in time. The bias of both passes is joined at each
    /// sample, axis by axis, and taken off the rates together with the mean of their matrices; then
    /// both run again, on rates that need neither. Tilt and, with a magnetometer, heading of both are
    /// joined by their variances; without one the heading is that of the forward pass.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is none for the passes, [`Error::Stopped`] if asked to stop.
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

    /// The record without the bias that all of it tells of each sample, and with the fields that the
    /// filter inside has seen.
    fn without_bias(&self, mut samples: Vec<Sample>) -> Result<Record, Error> {
        let (params, n) = (*self.params(), samples.len());
        let options = *self.estimator().auto().options();
        // No field says anything of a bias.
        let reversed = AutoOptions { bias: options.bias.map(|x| -x), mag: false, ..options };
        let (mut own, reversed) = (self.clone(), Attitude::new(params, Auto::with(reversed))?);
        own.reset();
        let back = |k| Sample { mag: [f64::NAN; 3], ..turned(&samples, k, params.rate) };
        let [forward, backward] = both(
            || pass(own.clone(), n, &|k| samples[k], First::of),
            || pass(reversed, n, &back, First::of),
        )?;
        // Each pass knows most of the matrix at its end.
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
        // What is left of a rate within the range may lie beyond it.
        let params = AttitudeParams { gyro_range: None, ..params };
        Ok(Record { params, samples, biases, events, gyro })
    }
}

/// The k-th sample of a pass.
type At<'a> = dyn Fn(usize) -> Sample + Sync + 'a;

/// Both at once, each on a thread of its own if there is one.
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

/// The state after each of n samples, of the filter and of its field.
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

/// One sample, by the loop that fills batches: what is done at a tick is large, and is compiled no
/// second time here.
fn take<E: Around>(filter: &mut Attitude<E>, sample: &Sample) {
    let ([gx, gy, gz], [ax, ay, az], [mx, my, mz]) = (sample.gyro, sample.accel, sample.mag);
    let row = [gx, gy, gz, ax, ay, az, mx, my, mz, sample.dt];
    filter.process_column(0, &mut Block::new(1, &row, &mut [0.0; 4], &mut []));
}

/// The k-th sample of a record backward in time: the rate that leads from a sample to the one before
/// it is the sample's own, the other way round.
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

/// Seconds of a sample in which its rate counts.
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

/// The combination of both passes. Without a magnetometer the heading is one against the start,
/// which the second knows nothing of.
fn joined(forward: &Known, backward: &Known, mag: bool) -> (Quaternion<f64>, Knowledge) {
    let apart = backward.orientation * forward.orientation.conjugate();
    let about_up = 2.0 * f64::atan2(apart.k, apart.w);
    let level = angle(&(small_rotation(&(Vector3::z() * -about_up)) * apart));
    let tilt = share(forward.tilt, backward.tilt);
    let variances = |sigma: fn(&Known) -> f64| [forward, backward].map(|x| sigma(x) * sigma(x));
    let [a, b] = variances(|known| known.heading_sigma);
    let leaned = small_rotation(&Vector3::new(level.x * tilt, level.y * tilt, 0.0));
    let (orientation, heading_sigma) = if mag {
        // Both follow the same field: what the forward pass lags behind a drift, the backward one leads.
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

/// Heading error by gyro errors since the start, where nothing corrects the heading: lasting errors
/// add up with their sign, so that rotations there and back leave nothing.
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

fn pause(k: usize) {
    if k % SAMPLES_PER_CHECK == SAMPLES_PER_CHECK - 1 {
        work::pause();
    }
}
