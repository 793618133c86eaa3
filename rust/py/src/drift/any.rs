//! Drift filters of every order behind one trait: the order is a type in the core, a value here.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use zerorate_core::checkpoint::{self, Kind, Label};
use zerorate_core::{Bank, DriftFilter, Error, Filter, Params, Start};

use super::start::Known;
use super::trace::Record;
use crate::errors::NativeError;
use crate::stream::{Labelled, Stream};

/// A bank of drift filters whose order only the box knows.
pub trait AnyDrift: Stream + std::fmt::Debug {
    fn clone_box(&self) -> Box<dyn AnyDrift>;
    fn params(&self) -> Params;
    fn order(&self) -> (usize, usize);
    fn samples_seen(&self) -> u64;
    fn guard_counts(&self) -> Vec<u64>;
    fn ready(&self) -> Vec<bool>;
    fn readings(&self) -> Vec<Readings>;
    /// One a channel, none for filters that learned their start themselves.
    fn starts(&self) -> Vec<Known>;
    fn trace(&mut self, rows: &[f64]) -> Record;
}

/// What one channel's filter knows; matrices row after row.
#[derive(Debug)]
pub struct Readings {
    pub estimate: f64,
    pub innovation: f64,
    pub innovation_variance: f64,
    pub measurement_noise: f64,
    pub gain: Vec<f64>,
    pub process_noise: Vec<f64>,
    pub coefficients: Vec<f64>,
    pub covariance: Vec<f64>,
}

impl<const N: usize, const M: usize> AnyDrift for Labelled<DriftFilter<f64, N, M>> {
    fn clone_box(&self) -> Box<dyn AnyDrift> {
        Box::new(self.clone())
    }

    fn params(&self) -> Params {
        *self.bank.filters()[0].params()
    }

    fn order(&self) -> (usize, usize) {
        (N - 1, M - N)
    }

    fn samples_seen(&self) -> u64 {
        self.bank.filters()[0].samples_seen()
    }

    fn guard_counts(&self) -> Vec<u64> {
        self.bank.filters().iter().map(DriftFilter::guard_count).collect()
    }

    fn ready(&self) -> Vec<bool> {
        self.bank.filters().iter().map(DriftFilter::ready).collect()
    }

    fn readings(&self) -> Vec<Readings> {
        self.bank.filters().iter().map(readings).collect()
    }

    fn starts(&self) -> Vec<Known> {
        self.bank.filters().iter().filter_map(DriftFilter::start).map(Known::from).collect()
    }

    fn trace(&mut self, rows: &[f64]) -> Record {
        let filters = self.bank.filters_mut();
        let mut record = Record::with_capacity(rows.len(), N, M);
        for row in rows.chunks_exact(filters.len()) {
            for (filter, z) in filters.iter_mut().zip(row) {
                filter.update(*z);
                record.push(&filter.snapshot());
            }
        }
        record
    }
}

fn readings<const N: usize, const M: usize>(filter: &DriftFilter<f64, N, M>) -> Readings {
    let now = filter.snapshot();
    // Column after column equals row after row: the matrices are symmetric.
    Readings {
        estimate: now.estimate,
        innovation: now.innovation,
        innovation_variance: now.innovation_variance,
        measurement_noise: now.measurement_noise,
        gain: now.gain.as_slice().to_vec(),
        process_noise: now.process_noise.as_slice().to_vec(),
        coefficients: now.coefficients.as_slice().to_vec(),
        covariance: now.covariance.as_slice().to_vec(),
    }
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
    PyValueError::new_err(format!(
        "order must be (p, q) with p from 1 to 3 and q from 0 to 3, got ({p}, {q})"
    ))
}

/// A bank of new filters.
pub fn new(order: (i64, i64), params: Params, channels: usize) -> PyResult<Box<dyn AnyDrift>> {
    for_order!(order, new_sized(params, channels), Err(order_error(order)))
}

/// What a filter of these sizes is called in a checkpoint.
pub fn label(kind: Kind, n: usize, m: usize) -> Label {
    Label { kind, p: (n - 1) as u8, q: (m - n) as u8 }
}

fn new_sized<const N: usize, const M: usize>(
    params: Params,
    channels: usize,
) -> PyResult<Box<dyn AnyDrift>> {
    let filter = DriftFilter::<f64, N, M>::new(params).map_err(NativeError::from)?;
    let bank = Bank::new(&filter, channels);
    Ok(Box::new(Labelled { label: label(Kind::DriftFilter, N, M), bank }))
}

/// A bank of filters that are ready, one for each start.
pub fn started(
    order: (usize, usize),
    params: Params,
    starts: &[Known],
) -> PyResult<Box<dyn AnyDrift>> {
    let (p, q) = (order.0 as i64, order.1 as i64);
    for_order!(order, started_sized(params, starts), Err(order_error((p, q))))
}

fn started_sized<const N: usize, const M: usize>(
    params: Params,
    starts: &[Known],
) -> PyResult<Box<dyn AnyDrift>> {
    let started = |known| DriftFilter::<f64, N, M>::started(params, Start::from(known));
    let filters = starts.iter().map(started).collect::<Result<_, _>>();
    let bank = Bank::of(filters.map_err(NativeError::from)?);
    Ok(Box::new(Labelled { label: label(Kind::DriftFilter, N, M), bank }))
}

type Saved = (Option<usize>, Box<dyn AnyDrift>);

/// The bank that a checkpoint holds.
pub fn from_bytes(bytes: &[u8]) -> Result<Saved, Error> {
    let found = checkpoint::label_of(Kind::DriftFilter, bytes)?;
    for_order!((found.p, found.q), from_bytes_sized(bytes), Err(Error::Content))
}

fn from_bytes_sized<const N: usize, const M: usize>(bytes: &[u8]) -> Result<Saved, Error> {
    let label = label(Kind::DriftFilter, N, M);
    let (channels, bank): (Option<usize>, Bank<DriftFilter<f64, N, M>>) =
        checkpoint::read::<(_, Bank<DriftFilter<f64, N, M>>)>(label, bytes)?;
    if bank.filters().len() != channels.unwrap_or(1) || bank.filters().is_empty() {
        return Err(Error::Content);
    }
    Ok((channels, Box::new(Labelled { label, bank })))
}
