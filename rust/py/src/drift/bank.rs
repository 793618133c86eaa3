//! Drift filters of every method and order behind one trait: a type in the core, a value here.

use std::ops::Range;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use zerorate_core::checkpoint::{self, Label};
use zerorate_core::drift::options::Options;
use zerorate_core::stream::{Field, Output, Parts, sizes};
use zerorate_core::{
    AutoFilter, Bank, Behaviour, DriftFilter, DriftStream, Error, PublishedFilter, RestGated,
    RobustFilter, Status, Tally, memory,
};

use crate::common::errors::{NativeError, about};
use crate::common::streaming::MotionBank;

/// Samples of a channel that are worked on before the next channel's.
const ROWS: usize = 512;

/// What a replay notes of each axis at every sample: the drift's deviation, whether the filter
/// learned, and whether the sensor was stuck.
#[derive(Debug)]
pub struct Noted<'a> {
    pub sigma: Vec<&'a mut [f64]>,
    pub at_rest: Vec<&'a mut [bool]>,
    pub stuck: Vec<&'a mut [bool]>,
}

/// A bank of drift filters of one method and order.
pub trait DriftBank: MotionBank {
    fn options(&self) -> Options;
    fn samples_seen(&self) -> u64;
    fn guard_counts(&self) -> Vec<u64>;
    fn exit_counts(&self) -> Vec<u64>;
    fn restarts(&self) -> Vec<u64>;
    fn tallies(&self) -> Vec<Tally>;
    fn ready(&self) -> Vec<bool>;
    fn status(&self) -> Vec<&'static str>;
    /// Densities of the white noise and of the drift's walk.
    fn densities(&self) -> Vec<[f64; 2]>;
    /// The parts of a snapshot.
    fn readings(&self) -> &'static [Field];
    /// Numbers and flags of a snapshot of each channel.
    fn snapshots(&self) -> Result<(Vec<f64>, Vec<bool>), Error>;
    /// Puts down those after each sample; `moving` is empty, or says of each row whether the body is
    /// known to move.
    fn trace(&mut self, rows: &[f64], moving: &[bool], parts: &mut Parts) -> Result<(), Error>;
    /// The parts of a start, and the numbers of each channel's, for filters that were started.
    fn starts(&self) -> Option<(&'static [Field], Vec<f64>)>;
    /// Forgets the drift but not the noise; false if it can't.
    fn power_on(&mut self) -> bool;
    /// Fills the drift of each axis, and what is noted of it, in these rows.
    fn drift_rows(
        &mut self,
        rows: Range<usize>,
        z: &[&[f64]],
        moving: &[bool],
        bias: &mut [&mut [f64]],
        noted: &mut Noted<'_>,
    );
}

impl<F> DriftBank for Bank<F>
where
    F: DriftStream<f64> + Clone + Send + Sync + 'static,
{
    fn options(&self) -> Options {
        self.streams()[0].options()
    }

    fn samples_seen(&self) -> u64 {
        self.streams()[0].samples_seen()
    }

    fn guard_counts(&self) -> Vec<u64> {
        self.streams().iter().map(F::guard_count).collect()
    }

    fn exit_counts(&self) -> Vec<u64> {
        self.streams().iter().map(F::exit_count).collect()
    }

    fn restarts(&self) -> Vec<u64> {
        self.streams().iter().map(F::restarts).collect()
    }

    fn tallies(&self) -> Vec<Tally> {
        self.streams().iter().map(F::tally).collect()
    }

    fn ready(&self) -> Vec<bool> {
        self.streams().iter().map(F::ready).collect()
    }

    fn status(&self) -> Vec<&'static str> {
        self.streams().iter().map(|filter| filter.status().name()).collect()
    }

    fn densities(&self) -> Vec<[f64; 2]> {
        self.streams().iter().map(F::densities).collect()
    }

    fn readings(&self) -> &'static [Field] {
        F::Snapshot::FIELDS
    }

    fn snapshots(&self) -> Result<(Vec<f64>, Vec<bool>), Error> {
        let (n, f) = sizes(F::Snapshot::FIELDS);
        let mut numbers = memory::filled(0.0, n * self.streams().len())?;
        let mut flags = memory::filled(false, f * self.streams().len())?;
        for (c, filter) in self.streams().iter().enumerate() {
            filter.snapshot().write(&mut numbers[c * n..][..n], &mut flags[c * f..][..f]);
        }
        Ok((numbers, flags))
    }

    fn trace(&mut self, rows: &[f64], moving: &[bool], parts: &mut Parts) -> Result<(), Error> {
        let channels = self.streams().len();
        if moving.is_empty() {
            return parts.add_rows(channels, rows, channels, |rows, numbers, flags| {
                Bank::trace(self, rows, numbers, flags);
            });
        }
        let (n, f) = sizes(F::Snapshot::FIELDS);
        let mut moving = moving.iter().flat_map(|one| std::iter::repeat_n(*one, channels));
        parts.add_rows(channels, rows, channels, |rows, numbers, flags| {
            for (i, (z, moving)) in rows.iter().zip(&mut moving).enumerate() {
                let filter = &mut self.streams_mut()[i % channels];
                filter.update_while(*z, moving);
                filter.snapshot().write(&mut numbers[i * n..][..n], &mut flags[i * f..][..f]);
            }
        })
    }

    fn starts(&self) -> Option<(&'static [Field], Vec<f64>)> {
        let (n, _) = sizes(F::START);
        let mut numbers = vec![0.0; n * self.streams().len()];
        let mut places = numbers.chunks_exact_mut(n.max(1));
        let mut started = |filter: &F| places.next().is_some_and(|place| filter.write_start(place));
        self.streams().iter().all(&mut started).then_some((F::START, numbers))
    }

    fn power_on(&mut self) -> bool {
        self.streams_mut().iter_mut().all(F::power_on)
    }

    fn drift_rows(
        &mut self,
        rows: Range<usize>,
        z: &[&[f64]],
        moving: &[bool],
        bias: &mut [&mut [f64]],
        noted: &mut Noted<'_>,
    ) {
        for (c, filter) in self.streams_mut().iter_mut().enumerate() {
            for i in rows.clone() {
                filter.update_while(z[c][i], moving.get(i).copied().unwrap_or(false));
                let drift = filter.drift();
                (bias[c][i], noted.sigma[c][i]) = (drift.bias, drift.sigma);
                noted.at_rest[c][i] = drift.at_rest;
                noted.stuck[c][i] = filter.status() == Status::Stuck;
            }
        }
    }
}

/// Filters these samples of a row an axis into another.
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

/// Calls `$function::<N, M>` for the order `$order`, `$other` for one that is not supported.
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

/// The order (p, q) as Python gives it: any sequence of two whole numbers.
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
    let told = format!("order must be (p, q) with p from 1 to 3 and q from 0 to 3, got ({p}, {q})");
    about("order", told)
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
        let filter = RobustFilter::<f64, N, M>::new(options.params, robust);
        return gated(std::iter::repeat_n(filter, channels), options.behaviour);
    }
    let filter = DriftFilter::<f64, N, M>::new(options.params).map_err(NativeError::from)?;
    gated(std::iter::repeat_n(Ok(filter), channels), options.behaviour)
}

/// The filters as they are, or, where something is asked of them, gated by rest.
pub fn gated<F, const N: usize, const M: usize>(
    filters: impl ExactSizeIterator<Item = Result<F, Error>>,
    behaviour: Behaviour,
) -> PyResult<Box<dyn DriftBank>>
where
    F: PublishedFilter<f64, N, M> + Send + Sync + 'static,
{
    if behaviour == Behaviour::PUBLISHED {
        return Ok(Box::new(of(filters)?));
    }
    let gated = |filter| RestGated::<f64, N, M, F>::new(filter?, behaviour);
    Ok(Box::new(of(filters.map(gated))?))
}

fn of<F>(filters: impl ExactSizeIterator<Item = Result<F, Error>>) -> PyResult<Bank<F>> {
    let mut streams = memory::room(filters.len()).map_err(NativeError::from)?;
    for filter in filters {
        streams.push(filter.map_err(NativeError::from)?);
    }
    Ok(Bank::of(streams))
}

type Restored = (Option<usize>, Box<dyn DriftBank>);

/// The bank that a checkpoint holds.
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
