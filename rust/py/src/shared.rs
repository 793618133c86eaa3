//! A filter as Python holds it: one user at a time, a clear error for a second one.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::False;
use pyo3::types::{PyBytes, PyFloat};
use pyo3::{IntoPyObjectExt, PyClass};

use crate::arrays;
use crate::errors::{NativeError, in_use};
use crate::stream::Stream;

/// A filter of `channels` channels, or of a single signal for `None`.
#[derive(Debug)]
pub struct Shared<S: ?Sized> {
    pub channels: Option<usize>,
    pub filter: Box<S>,
}

/// The object, to change it, if no other thread is using it.
#[inline]
pub fn exclusive<'py, T: PyClass<Frozen = False>>(
    object: &Bound<'py, T>,
) -> PyResult<PyRefMut<'py, T>> {
    object.try_borrow_mut().map_err(|_| in_use())
}

/// The object, to read it, if no other thread is changing it.
pub fn reading<'py, T: PyClass>(object: &Bound<'py, T>) -> PyResult<PyRef<'py, T>> {
    object.try_borrow().map_err(|_| in_use())
}

/// A number that Python gave and that must be at least one.
pub fn positive(name: &str, value: i128) -> PyResult<usize> {
    usize::try_from(value)
        .ok()
        .filter(|value| *value > 0)
        .ok_or_else(|| PyValueError::new_err(format!("{name} must be at least 1, got {value}")))
}

/// The number of channels that Python gave, which must not be zero.
pub fn channels(given: Option<i128>) -> PyResult<Option<usize>> {
    given.map(|value| positive("channels", value)).transpose()
}

/// The number of threads that Python gave, one if it gave none; more than channels are no harm.
pub fn threads(given: Option<i128>) -> PyResult<usize> {
    given.map_or(Ok(1), |value| positive("threads", value.min(i128::from(u16::MAX))))
}

impl<S: Stream + ?Sized> Shared<S> {
    pub fn new(channels: Option<usize>, filter: Box<S>) -> Self {
        Self { channels, filter }
    }

    #[inline]
    pub fn update<'py>(&mut self, z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = z.py();
        match self.channels {
            None => {
                let z = arrays::sample(z)?;
                let answer = self.filter.update(z);
                Ok(PyFloat::new(py, answer).into_any())
            }
            Some(channels) => {
                let mut row = arrays::row(z, channels)?;
                self.filter.update_row(&mut row);
                Ok(arrays::answers(py, &row))
            }
        }
    }

    pub fn process<'py>(
        &mut self,
        z: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = z.py();
        let threads = self::threads(threads)?;
        let mut samples = arrays::batch(z, self.channels)?;
        let out = out.map(|out| arrays::check_out(out, &samples.shape)).transpose()?;
        let filter = &mut *self.filter;
        py.detach(|| filter.process(&mut samples.values, threads));
        match out {
            Some(out) => {
                arrays::fill(out, samples.values)?;
                Ok(out.clone().into_any())
            }
            None => arrays::array(py, samples.values, &samples.shape),
        }
    }

    pub fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.filter.to_bytes(self.channels).map_err(NativeError::from)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// One number a channel: a float for a single signal, else an array.
    pub fn numbers<'py, T>(&self, py: Python<'py>, values: Vec<T>) -> PyResult<Bound<'py, PyAny>>
    where
        T: numpy::Element + IntoPyObjectExt<'py> + Copy,
    {
        self.arrays(py, values, &[])
    }

    /// One array of `shape` a channel, stacked for several channels.
    pub fn arrays<'py, T>(
        &self,
        py: Python<'py>,
        values: Vec<T>,
        shape: &[usize],
    ) -> PyResult<Bound<'py, PyAny>>
    where
        T: numpy::Element + IntoPyObjectExt<'py> + Copy,
    {
        match (self.channels, shape) {
            (None, []) => values[0].into_bound_py_any(py),
            (None, _) => arrays::array(py, values, shape),
            (Some(k), _) => arrays::array(py, values, &[&[k], shape].concat()),
        }
    }
}
