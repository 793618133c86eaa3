//! Samples of gyro, accelerometer and magnetometer from Python, put side by side.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use zerorate_core::memory;

use crate::common::arrays::{self, Record, Samples};
use crate::common::errors::NativeError;

/// Numbers in a sample: three of each sensor, and the time since the sample before.
pub const WIDTH: usize = 10;

/// What one call gives.
#[derive(Debug, Clone, Copy)]
pub struct Given<'a, 'py> {
    pub gyro: &'a Bound<'py, PyAny>,
    pub accel: &'a Bound<'py, PyAny>,
    pub mag: Option<&'a Bound<'py, PyAny>>,
    pub dt: Option<&'a Bound<'py, PyAny>>,
}

impl Given<'_, '_> {
    /// One sample of each body.
    pub fn row(&self, channels: Option<usize>) -> PyResult<Vec<f64>> {
        let count = channels.unwrap_or(1);
        let axes: &[usize] = match &channels {
            Some(k) => &[*k, 3],
            None => &[3],
        };
        let mut row = vec![f64::NAN; WIDTH * count];
        for (first, name, given) in self.sensors() {
            let Some(given) = given else { continue };
            let values = arrays::row(given, axes).map_err(|error| named(name, error, given))?;
            for (place, axes) in row.chunks_exact_mut(WIDTH).zip(values.chunks_exact(3)) {
                place[first..first + 3].copy_from_slice(axes);
            }
        }
        if let Some(dt) = self.dt {
            let dt = checked(arrays::sample(dt).map_err(|error| named("dt", error, dt))?)?;
            row.iter_mut().skip(WIDTH - 1).step_by(WIDTH).for_each(|place| *place = dt);
        }
        Ok(row)
    }

    /// The samples of a batch.
    pub fn rows(&self, channels: Option<usize>) -> PyResult<Samples<'static>> {
        let count = channels.unwrap_or(1);
        let axes: Vec<usize> = channels.into_iter().chain([3]).collect();
        let mut rows: Option<(usize, Vec<f64>)> = None;
        for (first, name, given) in self.sensors() {
            let Some(given) = given else { continue };
            let samples = arrays::samples(given, &axes).map_err(|e| named(name, e, given))?;
            let n = samples.shape()[0];
            if rows.is_none() {
                let filled = memory::filled(f64::NAN, n.saturating_mul(WIDTH * count));
                rows = Some((n, filled.map_err(NativeError::from)?));
            }
            if let Some((length, rows)) = &mut rows {
                check_length(name, n, *length)?;
                let places = rows.as_chunks_mut::<WIDTH>().0.iter_mut();
                for (place, axes) in places.zip(samples.values()?.as_chunks::<3>().0) {
                    place[first..first + 3].copy_from_slice(axes);
                }
            }
        }
        let (n, mut rows) = rows.unwrap_or_default();
        if let Some(dt) = self.dt {
            put_times(dt, n, count, &mut rows)?;
        }
        let shape = [&[n], channels.as_slice(), &[WIDTH]].concat();
        Ok(Samples::Copied(Record { values: rows, shape }))
    }

    fn sensors(&self) -> [(usize, &'static str, Option<&Bound<'_, PyAny>>); 3] {
        [(0, "gyro", Some(self.gyro)), (3, "accel", Some(self.accel)), (6, "mag", self.mag)]
    }
}

/// One time for all samples, or one for each.
fn put_times(dt: &Bound<'_, PyAny>, n: usize, count: usize, rows: &mut [f64]) -> PyResult<()> {
    let times = match arrays::sample(dt) {
        Ok(one) => memory::filled(one, n).map_err(NativeError::from)?,
        Err(_) => arrays::named("dt", dt, &format!("({n},)"), |shape| shape == [n])?.values,
    };
    for (row, dt) in rows.chunks_exact_mut(WIDTH * count).zip(times) {
        let dt = checked(dt)?;
        row.iter_mut().skip(WIDTH - 1).step_by(WIDTH).for_each(|place| *place = dt);
    }
    Ok(())
}

/// Six or nine floats in place of two or three arrays.
pub fn of_floats(
    first: [&Bound<'_, PyAny>; 2],
    mag: Option<&Bound<'_, PyAny>>,
    more: &Bound<'_, PyTuple>,
    dt: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<f64>> {
    let mut row = vec![f64::NAN; WIDTH];
    let count = 2 + usize::from(mag.is_some()) + more.len();
    if count != 6 && count != 9 {
        return Err(PyTypeError::new_err(format!(
            "update takes arrays of three axes, or six or nine floats, got {count} arguments"
        )));
    }
    for (place, given) in row.iter_mut().zip(first.into_iter().chain(mag)) {
        *place = arrays::sample(given)?;
    }
    for (place, given) in row[3..].iter_mut().zip(more) {
        *place = arrays::sample(&given)?;
    }
    if let Some(dt) = dt {
        row[WIDTH - 1] = checked(arrays::sample(dt)?)?;
    }
    Ok(row)
}

fn checked(dt: f64) -> PyResult<f64> {
    match dt < 0.0 {
        false => Ok(dt),
        true => Err(PyValueError::new_err(format!("dt must not be negative, got {dt:?} s"))),
    }
}

fn check_length(name: &str, n: usize, expected: usize) -> PyResult<()> {
    if n == expected {
        return Ok(());
    }
    Err(PyValueError::new_err(format!(
        "{name} must have as many samples as gyro, {expected}, got {n}"
    )))
}

/// The error by the argument's own name.
fn named(name: &str, error: PyErr, given: &Bound<'_, PyAny>) -> PyErr {
    let text = error.value(given.py()).to_string();
    match text.strip_prefix("z must") {
        Some(rest) => PyValueError::new_err(format!("{name} must{rest}")),
        None => error,
    }
}
