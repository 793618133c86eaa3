//! Stated start of a filter, between Python and the core.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use zerorate_core::drift::options::{METHOD, Options};
use zerorate_core::stream::{Field, Input, Output};
use zerorate_core::{Bank, DriftFilter, Error, RobustFilter, Start, memory};

use super::bank::{DriftBank, for_order, gated, order_error};
use crate::common::arrays;
use crate::common::errors::NativeError;
use crate::common::streaming::{Shared, axes_of};

/// A bank of filters that are ready, one for each start. With channels, each array of `start` has a
/// first axis for them.
pub fn started(
    options: &Options,
    channels: Option<usize>,
    start: &Bound<'_, PyDict>,
) -> PyResult<Box<dyn DriftBank>> {
    let (p, q) = options.order;
    let unsupported = order_error((p as i64, q as i64));
    for_order!((p, q), started_sized(options, channels, start), Err(unsupported))
}

fn started_sized<const N: usize, const M: usize>(
    options: &Options,
    channels: Option<usize>,
    start: &Bound<'_, PyDict>,
) -> PyResult<Box<dyn DriftBank>> {
    let numbers = read(Start::<f64, N, M>::FIELDS, channels, start)?;
    let (params, behaviour) = (options.params, options.behaviour);
    match options.robust {
        Some(robust) => gated(
            bank(&numbers, |start| RobustFilter::<f64, N, M>::started(params, robust, start))?,
            behaviour,
        ),
        None => gated(
            bank(&numbers, |start| DriftFilter::<f64, N, M>::started(params, start))?,
            behaviour,
        ),
    }
}

/// A filter for the numbers of each start.
fn bank<F, const N: usize, const M: usize>(
    numbers: &[Vec<f64>],
    started: impl Fn(Start<f64, N, M>) -> Result<F, Error>,
) -> PyResult<Bank<F>> {
    let mut filters = memory::room(numbers.len()).map_err(NativeError::from)?;
    for numbers in numbers {
        filters.push(started(Start::read(numbers)).map_err(NativeError::from)?);
    }
    Ok(Bank::of(filters))
}

/// Refuses the method that learns its own start, before other checks.
pub fn check_method(params: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
    let method = params.map(|params| params.get_item("method")).transpose()?.flatten();
    let learns = method.map_or(Ok(true), |method| method.eq(METHOD))?;
    match learns {
        true => Err(PyValueError::new_err(
            "method 'auto', the default, learns its own start: start 'kf', 'akf', 'fading' or \
             'robust', or use power_on()",
        )),
        false => Ok(()),
    }
}

/// The numbers of each channel's start, one field after the other.
fn read(
    fields: &[Field],
    channels: Option<usize>,
    start: &Bound<'_, PyDict>,
) -> PyResult<Vec<Vec<f64>>> {
    let mut numbers =
        memory::filled(Vec::new(), channels.unwrap_or(1)).map_err(NativeError::from)?;
    for field in fields {
        let axes: Vec<usize> = channels.into_iter().chain(axes_of(field.shape)).collect();
        let values = array(start, field.name, &axes)?;
        for (numbers, own) in numbers.iter_mut().zip(values.chunks_exact(field.shape.numbers())) {
            numbers.extend_from_slice(own);
        }
    }
    Ok(numbers)
}

/// The dictionary that [`started`] reads, for filters that were started.
pub fn write<'py>(
    py: Python<'py>,
    shared: &Shared<dyn DriftBank>,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    let Some((fields, numbers)) = shared.bank.starts() else { return Ok(None) };
    let start = PyDict::new(py);
    for field in fields {
        start.set_item(field.name, shared.field(py, fields, field.name, &numbers, &[])?)?;
    }
    Ok(Some(start))
}

fn array(start: &Bound<'_, PyDict>, name: &str, shape: &[usize]) -> PyResult<Vec<f64>> {
    let value = start
        .get_item(name)?
        .ok_or_else(|| PyValueError::new_err(format!("start lacks {name:?}")))?;
    let numpy = start.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (&value, "float64")).map_err(|_| {
        PyTypeError::new_err(format!("start[{name:?}] must hold numbers of a rectangular array"))
    })?;
    let found: Vec<usize> = array.getattr("shape")?.extract()?;
    if found != shape {
        return Err(PyValueError::new_err(format!(
            "start[{name:?}] must have shape {}, got {}",
            arrays::tuple(shape),
            arrays::tuple(&found)
        )));
    }
    array.call_method0("ravel")?.call_method0("tolist")?.extract()
}
