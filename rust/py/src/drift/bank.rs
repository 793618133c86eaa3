//! Drift filters of every method and order behind one trait: each type of the core becomes a value.

use std::ops::Range;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use zerorate_core::checkpoint::{self, Label};
use zerorate_core::drift::options::Options;
use zerorate_core::stream::{Field, Output, Parts, sizes};
use zerorate_core::{
    AutoFilter, Bank, Behaviour, DriftFilter, DriftStream, Error, PublishedFilter, RestGated,
    RobustFilter, Tally, memory,
};

use crate::common::errors::{NativeError, about};
use crate::common::streaming::MotionBank;

/// Number of samples of one channel that are processed before the next channel.
const ROWS: usize = 512;

/// A drift filter; its method and order are known only inside the box.
pub trait AnyDrift {
    fn options(&self) -> Options;
    fn samples_seen(&self) -> u64;
    fn guard_count(&self) -> u64;
    fn exit_count(&self) -> u64;
    fn restarts(&self) -> u64;
    fn tally(&self) -> Tally;
    fn ready(&self) -> bool;
    fn status(&self) -> &'static str;
    /// Densities of the white noise and of the drift's random walk.
    fn densities(&self) -> [f64; 2];
    /// Learned bias instability.
    fn bias_instability(&self) -> f64;
    /// Standard deviation of the mean drift over the next seconds; None if it is unknown.
    fn bias_sigma_over(&self, seconds: f64) -> Option<Result<f64, Error>>;
    /// The parts of a snapshot.
    fn readings(&self) -> &'static [Field];
    /// Writes the numbers and flags of a snapshot.
    fn write(&self, numbers: &mut [f64], flags: &mut [bool]);
    /// The parts of a start.
    fn start(&self) -> &'static [Field];
    /// Writes the numbers of a stated start; false if the filter learned its start.
    fn write_start(&self, numbers: &mut [f64]) -> bool;
    /// Forgets the drift but not the noise; false if the filter cannot.
    fn power_on(&mut self) -> bool;
    /// Processes a sample. Afterwards the body is known to move, or its motion is unknown.
    fn take(&mut self, z: f64, moving: bool);
    /// [`take`](Self::take) for each sample, then notes the state; `moving` is empty if unknown.
    fn follow(&mut self, z: &[f64], moving: &[bool], noted: NotedRow<'_>);
}

impl<F: DriftStream<f64>> AnyDrift for F {
    fn options(&self) -> Options {
        F::options(self)
    }

    fn samples_seen(&self) -> u64 {
        F::samples_seen(self)
    }

    fn guard_count(&self) -> u64 {
        F::guard_count(self)
    }

    fn exit_count(&self) -> u64 {
        F::exit_count(self)
    }

    fn restarts(&self) -> u64 {
        F::restarts(self)
    }

    fn tally(&self) -> Tally {
        F::tally(self)
    }

    fn ready(&self) -> bool {
        F::ready(self)
    }

    fn status(&self) -> &'static str {
        F::status(self).name()
    }

    fn densities(&self) -> [f64; 2] {
        F::densities(self)
    }

    fn bias_instability(&self) -> f64 {
        F::bias_instability(self)
    }

    fn bias_sigma_over(&self, seconds: f64) -> Option<Result<f64, Error>> {
        F::bias_sigma_over(self, seconds)
    }

    fn readings(&self) -> &'static [Field] {
        F::Snapshot::FIELDS
    }

    fn write(&self, numbers: &mut [f64], flags: &mut [bool]) {
        self.snapshot().write(numbers, flags);
    }

    fn start(&self) -> &'static [Field] {
        F::START
    }

    fn write_start(&self, numbers: &mut [f64]) -> bool {
        F::write_start(self, numbers)
    }

    fn power_on(&mut self) -> bool {
        F::power_on(self)
    }

    fn take(&mut self, z: f64, moving: bool) {
        self.update_while(z, moving);
    }

    fn follow(&mut self, z: &[f64], moving: &[bool], noted: NotedRow<'_>) {
        let moving = moving.iter().copied().chain(std::iter::repeat(false));
        let NotedRow { bias, sigma, at_rest, stuck } = noted;
        let flags = at_rest.iter_mut().zip(stuck);
        let mut places = bias.iter_mut().zip(sigma).zip(flags);
        F::follow(self, z.iter().copied().zip(moving), |drift, is_stuck| {
            if let Some(((bias, sigma), (at_rest, stuck))) = places.next() {
                (*bias, *sigma) = (drift.bias, drift.sigma);
                (*at_rest, *stuck) = (drift.at_rest, is_stuck);
            }
        });
    }
}

/// A bank of drift filters of one method and order.
pub trait DriftBank: MotionBank {
    /// The filter of a channel.
    fn filter(&self, channel: usize) -> &dyn AnyDrift;
    /// The filter of a channel, for changes.
    fn filter_mut(&mut self, channel: usize) -> &mut dyn AnyDrift;
}

impl<F> DriftBank for Bank<F>
where
    F: DriftStream<f64> + Clone + Send + Sync + 'static,
{
    fn filter(&self, channel: usize) -> &dyn AnyDrift {
        &self.streams()[channel]
    }

    fn filter_mut(&mut self, channel: usize) -> &mut dyn AnyDrift {
        &mut self.streams_mut()[channel]
    }
}

impl dyn DriftBank {
    /// One value per channel.
    pub fn each<T>(&self, of: impl Fn(&dyn AnyDrift) -> T) -> Vec<T> {
        (0..self.channels()).map(|channel| of(self.filter(channel))).collect()
    }

    /// Numbers and flags of a snapshot of each channel.
    pub fn snapshots(&self) -> Result<(Vec<f64>, Vec<bool>), Error> {
        let (n, f) = sizes(self.filter(0).readings());
        let mut numbers = memory::filled(0.0, n * self.channels())?;
        let mut flags = memory::filled(false, f * self.channels())?;
        for c in 0..self.channels() {
            self.filter(c).write(&mut numbers[c * n..][..n], &mut flags[c * f..][..f]);
        }
        Ok((numbers, flags))
    }

    /// Writes the snapshot after each sample. `moving` is empty, or a flag of known motion for each
    /// row.
    pub fn trace(&mut self, rows: &[f64], moving: &[bool], parts: &mut Parts) -> Result<(), Error> {
        let (channels, (n, f)) = (self.channels(), sizes(self.filter(0).readings()));
        let known = moving.iter().copied().chain(std::iter::repeat(false));
        let mut moving = known.flat_map(|one| std::iter::repeat_n(one, channels));
        parts.add_rows(channels, rows, channels, |rows, numbers, flags| {
            for (i, (z, moving)) in rows.iter().zip(&mut moving).enumerate() {
                let filter = self.filter_mut(i % channels);
                filter.take(*z, moving);
                filter.write(&mut numbers[i * n..][..n], &mut flags[i * f..][..f]);
            }
        })
    }

    /// The parts of a start, and each channel's numbers, for filters with a stated start.
    pub fn starts(&self) -> Option<(&'static [Field], Vec<f64>)> {
        let fields = self.filter(0).start();
        let (n, _) = sizes(fields);
        let mut numbers = vec![0.0; n * self.channels()];
        let mut started = |c: usize| self.filter(c).write_start(&mut numbers[c * n..][..n]);
        (0..self.channels()).all(&mut started).then_some((fields, numbers))
    }

    /// Forgets the drift but not the noise; false if the filter cannot.
    pub fn power_on(&mut self) -> bool {
        (0..self.channels()).all(|channel| self.filter_mut(channel).power_on())
    }

    /// Writes the drift of each axis, and the noted values, for these rows.
    pub fn drift_rows(
        &mut self,
        rows: Range<usize>,
        z: &[&[f64]],
        moving: &[bool],
        bias: &mut [&mut [f64]],
        noted: &mut Noted<'_>,
    ) {
        for c in 0..self.channels() {
            let own = NotedRow {
                bias: &mut bias[c][rows.clone()],
                sigma: &mut noted.sigma[c][rows.clone()],
                at_rest: &mut noted.at_rest[c][rows.clone()],
                stuck: &mut noted.stuck[c][rows.clone()],
            };
            let moving = if moving.is_empty() { moving } else { &moving[rows.clone()] };
            self.filter_mut(c).follow(&z[c][rows.clone()], moving, own);
        }
    }
}

/// Records of a replay for each axis at every sample: the drift's standard deviation, the flag of
/// learning, and the flag of a stuck sensor.
#[derive(Debug)]
pub struct Noted<'a> {
    pub sigma: Vec<&'a mut [f64]>,
    pub at_rest: Vec<&'a mut [bool]>,
    pub stuck: Vec<&'a mut [bool]>,
}

/// Records of a replay for one axis, and its drift.
#[derive(Debug)]
pub struct NotedRow<'a> {
    pub bias: &'a mut [f64],
    pub sigma: &'a mut [f64],
    pub at_rest: &'a mut [bool],
    pub stuck: &'a mut [bool],
}

/// Filters the samples of one row per axis into another row.
pub fn process_rows(
    bank: &mut dyn DriftBank,
    samples: Range<usize>,
    z: &[&[f64]],
    out: &mut [&mut [f64]],
) -> Result<(), Error> {
    let most = ROWS.min(samples.len()) * z.len();
    let (mut rows, mut filtered) = (memory::filled(0.0, most)?, memory::filled(0.0, most)?);
    for first in samples.clone().step_by(ROWS) {
        let length = ROWS.min(samples.end - first);
        for (c, z) in z.iter().enumerate() {
            let column = rows.iter_mut().skip(c).step_by(out.len());
            column.zip(&z[first..first + length]).for_each(|(row, z)| *row = *z);
        }
        let size = length * z.len();
        bank.process(&rows[..size], &mut filtered[..size], &mut [], 1)?;
        for (c, out) in out.iter_mut().enumerate() {
            let column = filtered.iter().skip(c).step_by(z.len());
            out[first..first + length].iter_mut().zip(column).for_each(|(out, y)| *out = *y);
        }
    }
    Ok(())
}

/// Calls `$function::<N, M>` for the order `$order`, and `$other` for an unsupported order.
macro_rules! for_order {
    ($order:expr, $function:ident($($argument:expr),*), $other:expr) => {
        match $order {
            (1, 0) => $function::<2, 2>($($argument),*),
            (1, 1) => $function::<2, 3>($($argument),*),
            (1, 2) => $function::<2, 4>($($argument),*),
            (1, 3) => $function::<2, 5>($($argument),*),
            (2, 0) => $function::<3, 3>($($argument),*),
            (2, 1) => $function::<3, 4>($($argument),*),
            (2, 2) => $function::<3, 5>($($argument),*),
            (2, 3) => $function::<3, 6>($($argument),*),
            (3, 0) => $function::<4, 4>($($argument),*),
            (3, 1) => $function::<4, 5>($($argument),*),
            (3, 2) => $function::<4, 6>($($argument),*),
            (3, 3) => $function::<4, 7>($($argument),*),
            _ => $other,
        }
    };
}
pub(crate) use for_order;

/// The order (p, q) from Python: any sequence of two whole numbers.
#[derive(Debug)]
pub struct Order(pub (i64, i64));

impl Default for Order {
    fn default() -> Self {
        Self((2, 1))
    }
}

impl<'py> FromPyObject<'_, 'py> for Order {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        match object.extract::<Vec<i64>>() {
            Ok(pair) if pair.len() == 2 => Ok(Self((pair[0], pair[1]))),
            _ => Err(PyTypeError::new_err(format!(
                "order must be two whole numbers (p, q), got {}",
                object.repr()?
            ))),
        }
    }
}

/// The error for an order that is not supported.
pub fn order_error((p, q): (i64, i64)) -> PyErr {
    let message =
        format!("order must be (p, q) with p from 1 to 3 and q from 0 to 3, got ({p}, {q})");
    about("order", message)
}

/// A bank of new filters.
pub fn new(options: &Options, channels: usize) -> PyResult<Box<dyn DriftBank>> {
    let (p, q) = options.order;
    match options.method {
        None => {
            let filter = AutoFilter::<f64>::new(options.auto()).map_err(NativeError::from)?;
            Ok(Box::new(Bank::new(&filter, channels).map_err(NativeError::from)?))
        }
        Some(_) => {
            for_order!((p, q), new_sized(options, channels), Err(order_error((p as i64, q as i64))))
        }
    }
}

fn new_sized<const N: usize, const M: usize>(
    options: &Options,
    channels: usize,
) -> PyResult<Box<dyn DriftBank>> {
    if let Some(robust) = options.robust {
        return copies(RobustFilter::<f64, N, M>::new(options.params, robust), options, channels);
    }
    copies(DriftFilter::<f64, N, M>::new(options.params), options, channels)
}

fn copies<F, const N: usize, const M: usize>(
    filter: Result<F, Error>,
    options: &Options,
    channels: usize,
) -> PyResult<Box<dyn DriftBank>>
where
    F: PublishedFilter<f64, N, M> + Send + Sync + 'static,
{
    let bank = filter.and_then(|filter| Bank::new(&filter, channels));
    gated(bank.map_err(NativeError::from)?, options.behaviour)
}

/// The filters unchanged or, if an option requires it, gated by rest.
pub fn gated<F, const N: usize, const M: usize>(
    bank: Bank<F>,
    behaviour: Behaviour,
) -> PyResult<Box<dyn DriftBank>>
where
    F: PublishedFilter<f64, N, M> + Send + Sync + 'static,
{
    if behaviour == Behaviour::PUBLISHED {
        return Ok(Box::new(bank));
    }
    let mut gated = memory::room(bank.streams().len()).map_err(NativeError::from)?;
    for filter in bank.streams() {
        let filter = RestGated::<f64, N, M, F>::new(*filter, behaviour);
        gated.push(filter.map_err(NativeError::from)?);
    }
    Ok(Box::new(Bank::of(gated)))
}

type Restored = (Option<usize>, Box<dyn DriftBank>);

/// The bank in a checkpoint.
pub fn restored(bytes: &[u8]) -> Result<Restored, Error> {
    let found = checkpoint::label(bytes)?;
    let plain = Label::of::<DriftFilter<f64, 3, 4>>();
    let gated = Label::of::<RestGated<f64, 3, 4>>();
    let robust_gated = Label::of::<RestGated<f64, 3, 4, RobustFilter<f64, 3, 4>>>();
    let robust = Label::of::<RobustFilter<f64, 3, 4>>();
    let order = (found.sizes[0], found.sizes[1]);
    match found.tag() {
        tag if tag == plain.tag() => for_order!(order, plain_bank(bytes), Err(Error::Content)),
        tag if tag == gated.tag() => for_order!(order, gated_bank(bytes), Err(Error::Content)),
        tag if tag == robust.tag() => {
            for_order!(order, restored_robust(bytes), Err(Error::Content))
        }
        tag if tag == robust_gated.tag() => {
            for_order!(order, restored_robust_gated(bytes), Err(Error::Content))
        }
        // Refuses any other type.
        _ => bank::<AutoFilter<f64>>(bytes),
    }
}

fn plain_bank<const N: usize, const M: usize>(bytes: &[u8]) -> Result<Restored, Error> {
    bank::<DriftFilter<f64, N, M>>(bytes)
}

fn gated_bank<const N: usize, const M: usize>(bytes: &[u8]) -> Result<Restored, Error> {
    bank::<RestGated<f64, N, M>>(bytes)
}

fn restored_robust<const N: usize, const M: usize>(bytes: &[u8]) -> Result<Restored, Error> {
    bank::<RobustFilter<f64, N, M>>(bytes)
}

fn restored_robust_gated<const N: usize, const M: usize>(bytes: &[u8]) -> Result<Restored, Error> {
    bank::<RestGated<f64, N, M, RobustFilter<f64, N, M>>>(bytes)
}

fn bank<F>(bytes: &[u8]) -> Result<Restored, Error>
where
    F: DriftStream<f64> + Clone + Send + Sync + 'static,
{
    let (channels, bank) = checkpoint::restore::<F>(bytes)?;
    Ok((channels, Box::new(bank)))
}
