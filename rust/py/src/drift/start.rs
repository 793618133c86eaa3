//! What a filter is started with, between Python and the core.
#![allow(non_snake_case)]

use nalgebra::{SMatrix, SVector};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use zerorate_core::Start;

use super::any::AnyDrift;
use crate::arrays;
use crate::shared::Shared;

/// The start of one channel; matrices are symmetric, so row after row is column after column.
#[derive(Debug)]
pub struct Known {
    offset: f64,
    scale: f64,
    coefficients: Vec<f64>,
    covariance: Vec<f64>,
    measurement_noise: f64,
    process_noise: f64,
    state_covariance: Vec<f64>,
}

impl<const N: usize, const M: usize> From<&Known> for Start<f64, N, M> {
    fn from(known: &Known) -> Self {
        Self {
            offset: known.offset,
            scale: known.scale,
            coefficients: SVector::from_column_slice(&known.coefficients),
            covariance: SMatrix::from_column_slice(&known.covariance),
            measurement_noise: known.measurement_noise,
            process_noise: known.process_noise,
            state_covariance: SMatrix::from_column_slice(&known.state_covariance),
        }
    }
}

impl<const N: usize, const M: usize> From<&Start<f64, N, M>> for Known {
    fn from(start: &Start<f64, N, M>) -> Self {
        Self {
            offset: start.offset,
            scale: start.scale,
            coefficients: start.coefficients.as_slice().to_vec(),
            covariance: start.covariance.as_slice().to_vec(),
            measurement_noise: start.measurement_noise,
            process_noise: start.process_noise,
            state_covariance: start.state_covariance.as_slice().to_vec(),
        }
    }
}

/// The starts of all channels, each array with a first axis for the channels if there are any.
pub fn read(
    start: &Bound<'_, PyDict>,
    channels: Option<usize>,
    (p, q): (usize, usize),
) -> PyResult<Vec<Known>> {
    let (n, m) = (p + 1, p + q + 1);
    let values = |name: &str, shape: &[usize]| -> PyResult<Vec<Vec<f64>>> {
        let axes = channels.as_slice();
        let values = array(start, name, &[axes, shape].concat())?;
        Ok(values.chunks_exact(shape.iter().product()).map(<[f64]>::to_vec).collect())
    };
    let numbers = |name: &str| -> PyResult<Vec<f64>> { Ok(values(name, &[])?.concat()) };
    let (offset, scale) = (numbers("offset")?, numbers("scale")?);
    let (R, G) = (numbers("measurement_noise")?, numbers("process_noise")?);
    let mut coefficients = values("coefficients", &[m])?;
    let mut covariance = values("covariance", &[m, m])?;
    let mut state_covariance = values("state_covariance", &[n, n])?;
    let known = |c: usize| Known {
        offset: offset[c],
        scale: scale[c],
        coefficients: std::mem::take(&mut coefficients[c]),
        covariance: std::mem::take(&mut covariance[c]),
        measurement_noise: R[c],
        process_noise: G[c],
        state_covariance: std::mem::take(&mut state_covariance[c]),
    };
    Ok((0..channels.unwrap_or(1)).map(known).collect())
}

/// The dictionary that [`read`] reads.
pub fn write<'py>(
    py: Python<'py>,
    starts: &[Known],
    shared: &Shared<dyn AnyDrift>,
    (p, q): (usize, usize),
) -> PyResult<Bound<'py, PyDict>> {
    let (n, m) = (p + 1, p + q + 1);
    let start = PyDict::new(py);
    let set = |name: &str, shape: &[usize], part: fn(&Known) -> &[f64]| {
        let values = starts.iter().flat_map(|known| part(known).iter().copied()).collect();
        start.set_item(name, shared.arrays(py, values, shape)?)
    };
    set("offset", &[], |known| std::slice::from_ref(&known.offset))?;
    set("scale", &[], |known| std::slice::from_ref(&known.scale))?;
    set("coefficients", &[m], |known| &known.coefficients)?;
    set("covariance", &[m, m], |known| &known.covariance)?;
    set("measurement_noise", &[], |known| std::slice::from_ref(&known.measurement_noise))?;
    set("process_noise", &[], |known| std::slice::from_ref(&known.process_noise))?;
    set("state_covariance", &[n, n], |known| &known.state_covariance)?;
    Ok(start)
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
