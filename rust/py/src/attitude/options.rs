//! Constants of the methods: conversion between Python and the core's tables.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use zerorate_core::attitude::{
    BIAS_METHODS, BIAS_SIGMA_METHODS, CONSTANTS, Constant, Constants, FieldCorrection, METHODS,
    TILT_CONSTANTS, TILT_METHODS, TiltConstants,
};
use zerorate_core::position::POSITION_METHODS;

use crate::common::streaming::{quoted, text};

/// Constants from keyword arguments.
pub fn read<C: Default>(
    class: &str,
    table: &'static [Constant<C>],
    method: &str,
    given: Option<&Bound<'_, PyDict>>,
) -> PyResult<C> {
    let mut constants = C::default();
    for (name, value) in given.into_iter().flatten() {
        let name: String = name.extract()?;
        let Some(row) = table.iter().find(|row| row.name == name) else {
            return Err(PyTypeError::new_err(format!(
                "{class}() got an unexpected keyword argument '{name}'"
            )));
        };
        check_used(&name, method, row.methods)?;
        let value: Option<f64> = value
            .extract()
            .map_err(|_| PyTypeError::new_err(format!("{name} must be a number, got {value:?}")))?;
        if let Some(value) = value {
            (row.set)(&mut constants, value);
        }
    }
    Ok(constants)
}

/// Refuses a prior of the bias if the method does not use it.
pub fn check_bias(method: &str, bias: bool, sigma: bool, limit: bool) -> PyResult<()> {
    for (name, given, methods) in [
        ("bias", bias, BIAS_METHODS),
        ("bias_sigma", sigma, BIAS_SIGMA_METHODS),
        ("bias_limit", limit, &METHODS[..1]),
    ] {
        if given {
            check_used(name, method, methods)?;
        }
    }
    Ok(())
}

/// Refuses options of a magnetometer if there is no magnetometer.
pub fn check_field(mag: bool, given: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
    let name = "mag_noise";
    let said = given.is_some_and(|given| given.contains(name).unwrap_or(false));
    match said && !mag {
        false => Ok(()),
        true => Err(PyValueError::new_err(format!("{name} has no effect with mag=False"))),
    }
}

/// Correction of the magnetometer by a calibration, if it has one.
pub fn correction(
    given: Option<&Bound<'_, PyAny>>,
    method: &str,
    mag: bool,
) -> PyResult<Option<FieldCorrection>> {
    let Some(given) = given else { return Ok(None) };
    check_used("magnetometer", method, &METHODS[..1])?;
    if !mag {
        return Err(PyValueError::new_err("magnetometer has no effect with mag=False"));
    }
    let Some(ask) = given.getattr_opt("__field_correction__")? else {
        return Err(PyTypeError::new_err(format!(
            "magnetometer must be a MagnetometerCalibration, got {}",
            given.get_type().name()?
        )));
    };
    let found: Option<([f64; 3], [[f64; 3]; 3])> = ask.call0()?.extract()?;
    Ok(found.map(|(iron, matrix)| FieldCorrection { iron, matrix }))
}

/// Refuses to learn the hard iron if the method does not use it or there is no magnetometer.
pub fn check_learns(learns: bool, method: &str, mag: bool) -> PyResult<()> {
    if !learns {
        return Ok(());
    }
    check_used("learn_magnetometer", method, &METHODS[..1])?;
    match mag {
        true => Ok(()),
        false => Err(PyValueError::new_err("learn_magnetometer has no effect with mag=False")),
    }
}

fn check_used(name: &str, method: &str, methods: &[&str]) -> PyResult<()> {
    // The name of an unknown method is refused elsewhere.
    let mut all = METHODS.iter().chain(&TILT_METHODS).chain(&POSITION_METHODS);
    let known = all.any(|known| *known == method);
    if methods.contains(&method) || !known {
        return Ok(());
    }
    Err(PyValueError::new_err(format!(
        "{name} has no effect on method '{method}', only on {}",
        quoted(methods, "and")
    )))
}

/// Name, value and default of the constants that a method uses, as Python writes them.
pub fn written<C: Default>(
    table: &'static [Constant<C>],
    method: &str,
    constants: &C,
) -> Vec<(&'static str, String, String)> {
    let defaults = C::default();
    let used = table.iter().filter(|row| row.methods.contains(&method));
    used.map(|row| (row.name, text((row.get)(constants)), text((row.get)(&defaults)))).collect()
}

/// Return the table of the constants of ``Attitude`` as dictionaries.
///
/// Keys are name, kind, default, unit, expected, choices, meaning, and the methods that use the
/// constant.
#[pyfunction]
pub fn attitude_options(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let meaning = "'auto' learns bias, scale and misalignment of the gyro and needs no settings; the \
                   others are those of textbooks";
    table::<Constants>(py, &METHODS, METHODS[0], meaning, CONSTANTS)
}

/// Return the table of the constants of ``Tilt`` as dictionaries, as for ``Attitude``.
#[pyfunction]
pub fn tilt_options(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let meaning = "The complementary filter of first order, or the Kalman filter of angle and bias";
    table::<TiltConstants>(py, &TILT_METHODS, TILT_METHODS[0], meaning, TILT_CONSTANTS)
}

/// A table of constants as dictionaries, after a row with the methods.
pub fn table<'py, C: Default>(
    py: Python<'py>,
    methods: &[&str],
    usual: &str,
    meaning: &str,
    constants: &[Constant<C>],
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let row = PyDict::new(py);
    row.set_item("name", "method")?;
    row.set_item("kind", "choice")?;
    row.set_item("default", usual)?;
    row.set_item("unit", "")?;
    row.set_item("expected", quoted(methods, "or"))?;
    row.set_item("choices", methods)?;
    row.set_item("meaning", meaning)?;
    row.set_item("methods", methods)?;
    let (mut rows, defaults) = (vec![row], C::default());
    for constant in constants {
        let row = PyDict::new(py);
        row.set_item("name", constant.name)?;
        row.set_item("kind", if constant.unit == "s" { "seconds" } else { "number" })?;
        row.set_item("default", (constant.get)(&defaults))?;
        row.set_item("unit", constant.unit)?;
        row.set_item("expected", constant.expected)?;
        row.set_item("choices", Vec::<String>::new())?;
        row.set_item("meaning", constant.meaning)?;
        row.set_item("methods", constant.methods)?;
        rows.push(row);
    }
    Ok(rows)
}
