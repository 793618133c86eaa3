//! Drift filters of every method and order behind one trait: a type in the core, a value here.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use zerorate_core::checkpoint::{self, Kind, Label};
use zerorate_core::{AutoFilter, Bank, Conduct, DriftFilter, Error, MotionSafe, Params, Start};

use super::channel::Channel;
use super::settings::Settings;
use super::start::Known;
use super::trace::{Readings, Record};
use crate::errors::NativeError;
use crate::stream::{Labelled, Stream};

/// A bank of drift filters whose kind only the box knows.
pub trait AnyDrift: Stream + std::fmt::Debug {
    fn clone_box(&self) -> Box<dyn AnyDrift>;
    fn settings(&self) -> Settings;
    fn samples_seen(&self) -> u64;
    fn guard_counts(&self) -> Vec<u64>;
    fn ready(&self) -> Vec<bool>;
    fn status(&self) -> Vec<&'static str>;
    fn readings(&self) -> Vec<Readings>;
    /// Densities of the white noise and of the drift's walk.
    fn densities(&self) -> Vec<[f64; 2]>;
    /// One a channel, none for filters that learned their start themselves.
    fn starts(&self) -> Vec<Known>;
    fn trace(&mut self, rows: &[f64]) -> Record;
    /// Forgets the drift but not the noise; false if it can't.
    fn power_on(&mut self) -> bool;
}

impl<F: Channel> AnyDrift for Labelled<F> {
    fn clone_box(&self) -> Box<dyn AnyDrift> {
        Box::new(self.clone())
    }

    fn settings(&self) -> Settings {
        self.bank.filters()[0].settings()
    }

    fn samples_seen(&self) -> u64 {
        self.bank.filters()[0].samples_seen()
    }

    fn guard_counts(&self) -> Vec<u64> {
        self.bank.filters().iter().map(Channel::guard_count).collect()
    }

    fn ready(&self) -> Vec<bool> {
        self.bank.filters().iter().map(Channel::ready).collect()
    }

    fn status(&self) -> Vec<&'static str> {
        self.bank.filters().iter().map(Channel::status).collect()
    }

    fn readings(&self) -> Vec<Readings> {
        self.bank.filters().iter().map(Channel::readings).collect()
    }

    fn densities(&self) -> Vec<[f64; 2]> {
        self.bank.filters().iter().map(Channel::densities).collect()
    }

    fn starts(&self) -> Vec<Known> {
        self.bank.filters().iter().filter_map(Channel::start).collect()
    }

    fn trace(&mut self, rows: &[f64]) -> Record {
        let (n, m) = self.settings().sizes();
        let filters = self.bank.filters_mut();
        let mut record = Record::with_capacity(rows.len(), n, m);
        for row in rows.chunks_exact(filters.len()) {
            for (filter, z) in filters.iter_mut().zip(row) {
                filter.update(*z);
                filter.record(&mut record);
            }
        }
        record
    }

    fn power_on(&mut self) -> bool {
        self.bank.filters_mut().iter_mut().all(Channel::power_on)
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
pub fn new(settings: Settings, channels: usize) -> PyResult<Box<dyn AnyDrift>> {
    match settings {
        Settings::Auto(params) => {
            let filter = AutoFilter::<f64>::new(params).map_err(NativeError::from)?;
            Ok(boxed(Bank::new(&filter, channels)))
        }
        Settings::Published { order, params, conduct } => {
            for_order!(order, new_sized(params, conduct, channels), Err(not_supported(order)))
        }
    }
}

/// What a filter of these sizes is called in a checkpoint.
pub fn label(kind: Kind, n: usize, m: usize) -> Label {
    Label { kind, p: (n - 1) as u8, q: (m - n) as u8 }
}

fn boxed<F: Channel>(bank: Bank<F>) -> Box<dyn AnyDrift> {
    Box::new(Labelled { label: F::label(), bank })
}

fn not_supported((p, q): (usize, usize)) -> PyErr {
    order_error((p as i64, q as i64))
}

fn new_sized<const N: usize, const M: usize>(
    params: Params,
    conduct: Conduct,
    channels: usize,
) -> PyResult<Box<dyn AnyDrift>> {
    let filter = DriftFilter::<f64, N, M>::new(params).map_err(NativeError::from)?;
    behaved(vec![filter; channels], conduct)
}

/// The filters as they are, or, where something is asked of them, made safe for motion.
fn behaved<const N: usize, const M: usize>(
    filters: Vec<DriftFilter<f64, N, M>>,
    conduct: Conduct,
) -> PyResult<Box<dyn AnyDrift>> {
    if !conduct.hold && !conduct.compensated {
        return Ok(boxed(Bank::of(filters)));
    }
    let safe = filters.into_iter().map(|filter| MotionSafe::new(filter, conduct));
    Ok(boxed(Bank::of(safe.collect::<Result<_, _>>().map_err(NativeError::from)?)))
}

/// The error for a start that is given to the filter that tunes itself.
pub fn start_error() -> PyErr {
    PyValueError::new_err(
        "method 'auto' learns its own start: start 'kf', 'akf' or 'fading', or use power_on()",
    )
}

/// A bank of filters that are ready, one for each start.
pub fn started(settings: Settings, starts: &[Known]) -> PyResult<Box<dyn AnyDrift>> {
    let Settings::Published { order, params, conduct } = settings else {
        return Err(start_error());
    };
    for_order!(order, started_sized(params, conduct, starts), Err(not_supported(order)))
}

fn started_sized<const N: usize, const M: usize>(
    params: Params,
    conduct: Conduct,
    starts: &[Known],
) -> PyResult<Box<dyn AnyDrift>> {
    let started = |known| DriftFilter::<f64, N, M>::started(params, Start::from(known));
    let filters = starts.iter().map(started).collect::<Result<_, _>>();
    behaved(filters.map_err(NativeError::from)?, conduct)
}

type Saved = (Option<usize>, Box<dyn AnyDrift>);

/// The bank that a checkpoint holds.
pub fn from_bytes(bytes: &[u8]) -> Result<Saved, Error> {
    let found = checkpoint::label(bytes)?;
    let order = (found.p, found.q);
    match found.kind {
        Kind::AutoFilter => saved::<AutoFilter<f64>>(bytes),
        Kind::MotionSafe => for_order!(order, saved_safe(bytes), Err(Error::Content)),
        Kind::DriftFilter => for_order!(order, saved_plain(bytes), Err(Error::Content)),
        _ => Err(Error::Kind { found, expected: Label { kind: Kind::DriftFilter, p: 0, q: 0 } }),
    }
}

fn saved_plain<const N: usize, const M: usize>(bytes: &[u8]) -> Result<Saved, Error> {
    saved::<DriftFilter<f64, N, M>>(bytes)
}

fn saved_safe<const N: usize, const M: usize>(bytes: &[u8]) -> Result<Saved, Error> {
    saved::<MotionSafe<f64, N, M>>(bytes)
}

fn saved<F: Channel>(bytes: &[u8]) -> Result<Saved, Error> {
    let (channels, bank): (Option<usize>, Bank<F>) = checkpoint::read(F::label(), bytes)?;
    if bank.filters().len() != channels.unwrap_or(1) || bank.filters().is_empty() {
        return Err(Error::Content);
    }
    Ok((channels, boxed(bank)))
}
