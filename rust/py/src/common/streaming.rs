//! What every streaming class of Python is: a bank behind a lock, and the methods that all share.

use std::any::Any;
use std::fmt::Debug;

use numpy::{PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::False;
use pyo3::types::{PyBytes, PyTuple};
use pyo3::{IntoPyObjectExt, PyClass};
use zerorate_core::checkpoint::{self, Checkpoint};
use zerorate_core::stream::{Field, Input, Output, Shape};
use zerorate_core::{Bank, Error, Stream};

use super::arrays::{self, Samples};
use super::errors::{NativeError, in_use};

/// A bank whose streams only the box knows.
pub trait AnyBank: Any + Debug + Send + Sync {
    /// Numbers in a sample.
    fn width(&self) -> usize;
    /// Parts of an output.
    fn fields(&self) -> &'static [Field];
    fn update(&mut self, row: &[f64], numbers: &mut [f64], flags: &mut [bool]);
    fn process(&mut self, rows: &[f64], numbers: &mut [f64], flags: &mut [bool], threads: usize);
    fn reset(&mut self);
    fn save(&self, channels: Option<usize>) -> Result<Vec<u8>, Error>;
}

impl<S: Stream + Checkpoint + Debug + Send + Sync + 'static> AnyBank for Bank<S> {
    fn width(&self) -> usize {
        S::Input::NUMBERS
    }

    fn fields(&self) -> &'static [Field] {
        S::Output::FIELDS
    }

    #[inline]
    fn update(&mut self, row: &[f64], numbers: &mut [f64], flags: &mut [bool]) {
        Bank::update(self, row, numbers, flags);
    }

    fn process(&mut self, rows: &[f64], numbers: &mut [f64], flags: &mut [bool], threads: usize) {
        self.process_on_threads(rows, numbers, flags, threads);
    }

    fn reset(&mut self) {
        Bank::reset(self);
    }

    fn save(&self, channels: Option<usize>) -> Result<Vec<u8>, Error> {
        checkpoint::save(channels, self)
    }
}

/// A bank of `channels` channels, or of a single signal for `None`.
#[derive(Debug)]
pub struct Shared<B: ?Sized> {
    pub channels: Option<usize>,
    pub bank: Box<B>,
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
fn threads(given: Option<i128>) -> PyResult<usize> {
    given.map_or(Ok(1), |value| positive("threads", value.min(i128::from(u16::MAX))))
}

impl<B: AnyBank + ?Sized> Shared<B> {
    pub fn new(channels: Option<usize>, bank: Box<B>) -> Self {
        Self { channels, bank }
    }

    /// Channels, one for a single signal.
    fn count(&self) -> usize {
        self.channels.unwrap_or(1)
    }

    #[inline]
    pub fn update<'py>(&mut self, z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = z.py();
        let fields = self.bank.fields();
        if let (None, 1, [] | [_]) = (self.channels, self.bank.width(), fields) {
            let (mut number, mut flag) = ([0.0], [false]);
            self.bank.update(&[arrays::sample(z)?], &mut number, &mut flag);
            return match fields {
                [] => py.None().into_bound_py_any(py),
                [Field { shape: Shape::Flag, .. }] => flag[0].into_bound_py_any(py),
                _ => number[0].into_bound_py_any(py),
            };
        }
        let row = arrays::row(z, &self.axes(self.bank.width()))?;
        let (mut numbers, mut flags) = self.room(1);
        self.bank.update(&row, &mut numbers, &mut flags);
        match fields {
            [] => py.None().into_bound_py_any(py),
            [Field { shape: Shape::Flag, .. }] => self.arrays(py, flags, &[]),
            [Field { shape: Shape::Number, .. }] => Ok(arrays::small(py, &numbers)),
            _ => self.split(py, fields, &numbers, &flags),
        }
    }

    /// Takes a batch; returns an array, or a tuple of them for an output of several parts.
    pub fn process<'py>(
        &mut self,
        z: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = z.py();
        let threads = self::threads(threads)?;
        let samples = arrays::samples(z, &self.axes(self.bank.width()))?;
        match self.bank.fields() {
            [] => {
                let (bank, rows) = (&mut *self.bank, samples.values()?);
                py.detach(|| bank.process(rows, &mut [], &mut [], threads));
                py.None().into_bound_py_any(py)
            }
            [Field { shape: Shape::Number, .. }] => {
                let run = |bank: &mut B, rows: &[f64], out: &mut [f64]| {
                    bank.process(rows, out, &mut [], threads);
                };
                self.fill(py, samples, out, run)
            }
            [Field { shape: Shape::Flag, .. }] => {
                let run = |bank: &mut B, rows: &[f64], out: &mut [bool]| {
                    bank.process(rows, &mut [], out, threads);
                };
                self.fill(py, samples, out, run)
            }
            fields => {
                let (bank, rows) = (&mut *self.bank, samples.values()?);
                let count = self.channels.unwrap_or(1);
                let n = rows.len() / (bank.width() * count).max(1);
                let sizes = sizes(fields);
                let mut numbers = vec![0.0; n * count * sizes.0];
                let mut flags = vec![false; n * count * sizes.1];
                py.detach(|| bank.process(rows, &mut numbers, &mut flags, threads));
                split(py, fields, &self.batch_axes(n), &numbers, &flags)
            }
        }
    }

    /// Samples straight into the array that is returned.
    fn fill<'py, T: numpy::Element + Copy + Default + Send>(
        &mut self,
        py: Python<'py>,
        mut samples: Samples<'py>,
        out: Option<&Bound<'py, PyAny>>,
        run: impl Fn(&mut B, &[f64], &mut [T]) + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let bank = &mut *self.bank;
        let shape = samples.shape().to_vec();
        let Some(out) = out else {
            let array = PyArrayDyn::<T>::zeros(py, shape.as_slice(), false);
            let mut writable = array.try_readwrite()?;
            let (rows, places) = (samples.values()?, writable.as_slice_mut()?);
            py.detach(|| run(bank, rows, places));
            drop(writable);
            return Ok(array.into_any());
        };
        let array = arrays::check_out::<T>(out, &shape)?;
        if !arrays::is_plain(array) {
            let mut places = vec![T::default(); shape.iter().product()];
            let rows = samples.values()?;
            py.detach(|| run(bank, rows, &mut places));
            drop(samples);
            arrays::copy_to(array, places)?;
            return Ok(out.clone());
        }
        // Samples may be filtered in their own place.
        if array.try_readwrite().is_err() {
            samples = samples.copied()?;
        }
        let mut writable = array.try_readwrite()?;
        let (rows, places) = (samples.values()?, writable.as_slice_mut()?);
        py.detach(|| run(bank, rows, places));
        Ok(out.clone())
    }

    /// Axes of one row of samples.
    fn axes(&self, width: usize) -> Vec<usize> {
        let vector = (width > 1).then_some(width);
        self.channels.into_iter().chain(vector).collect()
    }

    /// Axes of what is returned for `n` rows, before those of a field.
    pub fn batch_axes(&self, n: usize) -> Vec<usize> {
        std::iter::once(n).chain(self.channels).collect()
    }

    /// Places for the outputs of so many rows.
    fn room(&self, rows: usize) -> (Vec<f64>, Vec<bool>) {
        let (numbers, flags) = sizes(self.bank.fields());
        let count = rows * self.count();
        (vec![0.0; count * numbers], vec![false; count * flags])
    }

    pub fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.bank.save(self.channels).map_err(NativeError::from)?;
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

    /// Every field of one row of outputs, in a tuple.
    fn split<'py>(
        &self,
        py: Python<'py>,
        fields: &[Field],
        numbers: &[f64],
        flags: &[bool],
    ) -> PyResult<Bound<'py, PyAny>> {
        let axes: Vec<usize> = self.channels.into_iter().collect();
        split(py, fields, &axes, numbers, flags)
    }

    /// One field of an output that each channel has, found by its name.
    pub fn field<'py>(
        &self,
        py: Python<'py>,
        fields: &[Field],
        name: &str,
        numbers: &[f64],
        flags: &[bool],
    ) -> PyResult<Bound<'py, PyAny>> {
        let place = fields.iter().position(|field| field.name == name).unwrap_or_default();
        match fields[place].shape {
            Shape::Flag => self.numbers(py, part_of(flags, fields, place, flags_of)),
            shape => self.arrays(py, part_of(numbers, fields, place, numbers_of), &axes_of(shape)),
        }
    }
}

/// Numbers and flags of a record of these fields.
pub fn sizes(fields: &[Field]) -> (usize, usize) {
    let sum = |size: fn(&Field) -> usize| fields.iter().map(size).sum();
    (sum(numbers_of), sum(flags_of))
}

fn numbers_of(field: &Field) -> usize {
    field.shape.numbers()
}

fn flags_of(field: &Field) -> usize {
    usize::from(field.shape == Shape::Flag)
}

/// Axes that a field adds to those of the samples.
pub fn axes_of(shape: Shape) -> Vec<usize> {
    match shape {
        Shape::Number | Shape::Flag => vec![],
        Shape::Vector(n) => vec![n],
        Shape::Matrix(n) => vec![n, n],
    }
}

/// One field of every record: `size` says what each field takes of `values`.
fn part_of<T: Copy>(
    values: &[T],
    fields: &[Field],
    place: usize,
    size: fn(&Field) -> usize,
) -> Vec<T> {
    let (width, first) = (fields.iter().map(size).sum(), fields[..place].iter().map(size).sum());
    let length: usize = size(&fields[place]);
    let records = values.chunks_exact(width);
    records.flat_map(|record: &[T]| record[first..first + length].iter().copied()).collect()
}

/// Records as one array a field, with these axes before its own.
pub fn by_field<'py>(
    py: Python<'py>,
    fields: &[Field],
    axes: &[usize],
    numbers: &[f64],
    flags: &[bool],
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let array = |place: usize| match fields[place].shape {
        Shape::Flag => arrays::array(py, part_of(flags, fields, place, flags_of), axes),
        shape => {
            let axes = [axes, &axes_of(shape)].concat();
            arrays::array(py, part_of(numbers, fields, place, numbers_of), &axes)
        }
    };
    (0..fields.len()).map(array).collect()
}

fn split<'py>(
    py: Python<'py>,
    fields: &[Field],
    axes: &[usize],
    numbers: &[f64],
    flags: &[bool],
) -> PyResult<Bound<'py, PyAny>> {
    let arrays = by_field(py, fields, axes, numbers, flags)?;
    match arrays.as_slice() {
        [only] => Ok(only.clone()),
        _ => PyTuple::new(py, arrays)?.into_bound_py_any(py),
    }
}

/// The methods that all streaming classes share. `out` names those that have an output to put
/// somewhere.
macro_rules! streaming {
    ($class:ident, update: $update:literal, process: $process:literal $(, $out:ident)?) => {
        streaming!(@process $class, $process $(, $out)?);

        #[pymethods]
        impl $class {
            #[doc = $update]
            #[inline]
            fn update<'py>(
                slf: &Bound<'py, Self>,
                z: &Bound<'py, PyAny>,
            ) -> PyResult<Bound<'py, PyAny>> {
                $crate::common::streaming::exclusive(slf)?.shared.update(z)
            }

            /// Back to before the first sample, with the same parameters.
            fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
                $crate::common::streaming::exclusive(slf)?.shared.bank.reset();
                Ok(())
            }

            /// Parameters and state as bytes, with versions and a checksum.
            fn to_bytes<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyBytes>> {
                $crate::common::streaming::reading(slf)?.shared.save(slf.py())
            }

            /// The object that ``to_bytes`` saved, which goes on equal to the last bit; ValueError
            /// if the bytes are not one.
            #[staticmethod]
            fn from_bytes(b: &[u8]) -> PyResult<Self> {
                Ok(Self::restored(b).map_err($crate::common::errors::NativeError::from)?)
            }

            /// An independent object in the same state.
            fn copy(slf: &Bound<'_, Self>) -> PyResult<Self> {
                Self::from_bytes(Self::to_bytes(slf)?.as_bytes())
            }

            fn __copy__(slf: &Bound<'_, Self>) -> PyResult<Self> {
                Self::copy(slf)
            }

            fn __deepcopy__(slf: &Bound<'_, Self>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
                Self::copy(slf)
            }

            fn __reduce__<'py>(
                slf: &Bound<'py, Self>,
            ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
                Ok((slf.get_type().getattr("from_bytes")?, (Self::to_bytes(slf)?,)))
            }

            /// Number of signals, None for a single one.
            #[getter]
            fn channels(slf: &Bound<'_, Self>) -> PyResult<Option<usize>> {
                Ok($crate::common::streaming::reading(slf)?.shared.channels)
            }
        }
    };
    (@process $class:ident, $process:literal, out) => {
        #[pymethods]
        impl $class {
            #[doc = $process]
            #[pyo3(signature = (z, out=None, threads=None))]
            fn process<'py>(
                slf: &Bound<'py, Self>,
                z: &Bound<'py, PyAny>,
                out: Option<&Bound<'py, PyAny>>,
                threads: Option<i128>,
            ) -> PyResult<Bound<'py, PyAny>> {
                $crate::common::streaming::exclusive(slf)?.shared.process(z, out, threads)
            }
        }
    };
    (@process $class:ident, $process:literal) => {
        #[pymethods]
        impl $class {
            #[doc = $process]
            #[pyo3(signature = (z, threads=None))]
            fn process<'py>(
                slf: &Bound<'py, Self>,
                z: &Bound<'py, PyAny>,
                threads: Option<i128>,
            ) -> PyResult<Bound<'py, PyAny>> {
                $crate::common::streaming::exclusive(slf)?.shared.process(z, None, threads)
            }
        }
    };
}
pub(crate) use streaming;
