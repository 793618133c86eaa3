//! Options of a drift filter: conversion between Python and the core's table.

use std::fmt::Write;

use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use zerorate_core::drift::options::{
    DriftOption, Kind, METHOD, METHODS, OPTIONS, Options, Value, option,
};

use super::bank::{Order, order_error};
use crate::common::errors::{NativeError, about};
use crate::common::streaming::{self, quoted};

/// Options from keyword arguments, and the number of channels.
pub fn read(rate: f64, given: Option<&Bound<'_, PyDict>>) -> PyResult<(Options, Option<usize>)> {
    let mut options = method(given, rate)?;
    let mut channels = None;
    for (name, value) in given.into_iter().flatten() {
        let name: String = name.extract()?;
        match (name.as_str(), option(&name)) {
            ("method", _) => {}
            ("channels", _) => channels = streaming::channels(argument(&name, &value)?)?,
            (_, Some(option)) => set(&mut options, option, &value)?,
            _ => {
                return Err(PyTypeError::new_err(format!(
                    "DriftFilter() got an unexpected keyword argument '{name}'"
                )));
            }
        }
    }
    let options = options.validate().map_err(NativeError::from)?;
    check_limits(&options)?;
    Ok((options, channels))
}

/// Refuses a limit of rest if every sample counts as rest.
fn check_limits(options: &Options) -> PyResult<()> {
    let limits = [("rest_limit", options.limits.rest), ("bias_limit", options.limits.bias)];
    match limits.iter().find(|(_, limit)| limit.is_some()) {
        Some((name, _)) if !options.behaviour.hold_in_motion => {
            Err(about(name, format!("{name} has no effect on motion 'ignore', only on 'hold'")))
        }
        _ => Ok(()),
    }
}

fn method(given: Option<&Bound<'_, PyDict>>, rate: f64) -> PyResult<Options> {
    let given = given.map(|given| given.get_item("method")).transpose()?.flatten();
    let name: Option<String> = given.map(|name| argument("method", &name)).transpose()?;
    let name = name.as_deref().unwrap_or(METHOD);
    Options::of_method(name, rate).ok_or_else(|| {
        about("method", format!("method must be {}, got '{name}'", quoted(&METHODS, "or")))
    })
}

fn set(options: &mut Options, option: &DriftOption, value: &Bound<'_, PyAny>) -> PyResult<()> {
    if !options.uses(option) {
        let (name, method) = (option.name, options.method_name());
        let methods = quoted(option.methods, "and");
        return Err(about(
            name,
            format!("{name} has no effect on method '{method}', only on {methods}"),
        ));
    }
    // No value means the default of the method.
    if value.is_none() && matches!(option.kind, Kind::Choice(_)) && option.name == "motion" {
        return Ok(());
    }
    (option.set)(options, converted(option, value)?);
    Ok(())
}

fn converted(option: &DriftOption, value: &Bound<'_, PyAny>) -> PyResult<Value> {
    Ok(match option.kind {
        Kind::Number => Value::Number(argument(option.name, value)?),
        Kind::MaybeNumber => {
            let number: Option<f64> = argument(option.name, value)?;
            number.map_or(Value::None, Value::Number)
        }
        Kind::Order => match argument::<Order>(option.name, value)?.0 {
            order @ (1..=3, 0..=3) => Value::Order(order),
            order => return Err(order_error(order)),
        },
        Kind::PairOr(words) => match value.extract::<Vec<f64>>() {
            Ok(pair) if pair.len() == 2 => Value::Pair((pair[0], pair[1])),
            _ => word_of(words, option, value)?,
        },
        Kind::Choice(words) => {
            argument::<String>(option.name, value)?;
            word_of(words, option, value)?
        }
    })
}

/// The stated word, if it is in the list.
fn word_of(
    words: &[&'static str],
    option: &DriftOption,
    value: &Bound<'_, PyAny>,
) -> PyResult<Value> {
    let given = value.extract::<String>().ok();
    let word = words.iter().find(|word| given.as_deref() == Some(word));
    word.map(|word| Value::Word(word)).ok_or_else(|| {
        let given = value.repr().map_or_else(|_| String::new(), |text| text.to_string());
        about(option.name, format!("{} must be {}, got {given}", option.name, option.expected))
    })
}

/// The argument as this type; PyO3's own message for another type.
fn argument<'py, T>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<T>
where
    T: for<'a> FromPyObject<'a, 'py>,
{
    value.extract::<T>().map_err(|error| {
        let error: PyErr = error.into();
        let py = value.py();
        if error.is_instance_of::<PyTypeError>(py) && !error.value(py).to_string().contains(name) {
            return PyTypeError::new_err(format!("argument '{name}': {}", error.value(py)));
        }
        error
    })
}

/// Every argument that creates an equal filter.
pub fn write<'py>(
    py: Python<'py>,
    options: &Options,
    channels: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let arguments = PyDict::new(py);
    arguments.set_item("rate", options.params.rate)?;
    arguments.set_item("method", options.method_name())?;
    arguments.set_item("channels", channels)?;
    for option in OPTIONS.iter().filter(|option| options.uses(option)) {
        arguments.set_item(option.name, object(py, (option.get)(options))?)?;
    }
    Ok(arguments)
}

/// The call that creates an equal filter: the rate, and the values that are not the method's
/// defaults.
pub fn call(
    py: Python<'_>,
    options: &Options,
    channels: Option<usize>,
    started: bool,
) -> PyResult<String> {
    let name = options.method_name();
    let defaults = Options::of_method(name, options.params.rate);
    let mut text = match started {
        // A stated start is long: a call with an ellipsis creates no filter.
        true => "DriftFilter.started(..., ".to_owned(),
        false => "DriftFilter(".to_owned(),
    };
    let _ = write!(text, "rate={}", object(py, Value::Number(options.params.rate))?.repr()?);
    if name != METHOD {
        let _ = write!(text, ", method='{name}'");
    }
    if let Some(channels) = channels {
        let _ = write!(text, ", channels={channels}");
    }
    for option in OPTIONS.iter().filter(|option| options.uses(option)) {
        let value = (option.get)(options);
        if defaults.map(|defaults| (option.get)(&defaults)) != Some(value) {
            let _ = write!(text, ", {}={}", option.name, object(py, value)?.repr()?);
        }
    }
    Ok(text + ")")
}

fn object(py: Python<'_>, value: Value) -> PyResult<Bound<'_, PyAny>> {
    match value {
        Value::None => Ok(py.None().into_bound(py)),
        Value::Number(number) => number.into_bound_py_any(py),
        Value::Word(word) => word.into_bound_py_any(py),
        Value::Order(order) => order.into_bound_py_any(py),
        Value::Pair(pair) => pair.into_bound_py_any(py),
    }
}

const METHOD_MEANING: &str = "'auto' learns the bias by itself and needs no settings; 'kf', 'akf' \
    and 'fading' are the filters of Fu & Han 2019, 'robust' is that of Wu & Ran 2021";

/// Return the table of options as dictionaries.
///
/// Keys are name, kind ("order", "number", "seconds", "seconds or always", "choice" or "pair or
/// word"), default, unit, expected, choices, meaning, and the methods that use the option.
///
/// The default is None if it depends on the method or is learned.
#[pyfunction]
pub fn filter_options(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let defaults = Options::of_method(METHOD, 1.0);
    let method = row(py, "method", "choice", &METHODS, METHOD_MEANING)?;
    method.set_item("default", METHOD)?;
    method.set_item("unit", "")?;
    method.set_item("expected", quoted(&METHODS, "or"))?;
    method.set_item("methods", METHODS)?;
    let mut table = vec![method];
    for option in OPTIONS {
        let (kind, choices): (_, &[&str]) = match (option.kind, option.unit) {
            (Kind::Number, "s") => ("seconds", &[]),
            (Kind::MaybeNumber, "s") => ("seconds or always", &[]),
            (Kind::Number | Kind::MaybeNumber, _) => ("number", &[]),
            (Kind::Choice(words), _) => ("choice", words),
            (Kind::Order, _) => ("order", &[]),
            (Kind::PairOr(words), _) => ("pair or word", words),
        };
        let row = row(py, option.name, kind, choices, option.meaning)?;
        let value = defaults.filter(|_| option.name != "motion").map(|o| (option.get)(&o));
        row.set_item("default", object(py, value.unwrap_or(Value::None))?)?;
        row.set_item("unit", option.unit)?;
        row.set_item("expected", option.expected)?;
        row.set_item("methods", option.methods)?;
        table.push(row);
    }
    Ok(table)
}

fn row<'py>(
    py: Python<'py>,
    name: &str,
    kind: &str,
    choices: &[&str],
    meaning: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("name", name)?;
    row.set_item("kind", kind)?;
    row.set_item("choices", choices)?;
    row.set_item("meaning", meaning)?;
    Ok(row)
}
