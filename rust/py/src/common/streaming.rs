//! Streaming classes of Python: a bank that one thread uses at a time, and their common methods.

use std::any::Any;
use std::fmt;
use std::ops::Range;

use numpy::PyArrayMethods;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::False;
use pyo3::types::{PyBytes, PyTuple};
use pyo3::{IntoPyObjectExt, PyClass};
use zerorate_core::checkpoint::{self, Checkpoint};
use zerorate_core::stream::{Field, Input, Output, Parts, Shape, Values, sizes};
use zerorate_core::{Bank, Error, MotionAware, Stream, memory};

use super::arrays::{self, Samples};
use super::errors::{NativeError, about, in_use};
use super::outputs::Outputs;
use super::work::in_pieces;

/// A bank of streams; the stream's type is known only inside the box.
pub trait AnyBank: Any + Send + Sync {
    /// Numbers in a sample.
    fn width(&self) -> usize;
    /// Parts of an output.
    fn fields(&self) -> &'static [Field];
    fn channels(&self) -> usize;
    /// Bytes of the bank's state.
    fn bytes(&self) -> usize;
    /// An independent bank in the same state.
    fn try_clone(&self) -> Result<Box<dyn Any + Send>, Error>;
    /// Takes over the state of a clone.
    fn replace_with(&mut self, other: Box<dyn Any + Send>);
    fn update(&mut self, row: &[f64], numbers: &mut [f64], flags: &mut [bool]);
    fn process(
        &mut self,
        rows: &[f64],
        numbers: &mut [f64],
        flags: &mut [bool],
        threads: usize,
    ) -> Result<(), Error>;
    fn reset(&mut self);
    fn save(&self, channels: Option<usize>) -> Result<Vec<u8>, Error>;
}

impl<S: Stream + Checkpoint + Clone + Send + Sync + 'static> AnyBank for Bank<S> {
    fn width(&self) -> usize {
        S::Input::NUMBERS
    }

    fn fields(&self) -> &'static [Field] {
        S::Output::FIELDS
    }

    fn channels(&self) -> usize {
        self.streams().len()
    }

    fn bytes(&self) -> usize {
        Bank::bytes(self)
    }

    fn try_clone(&self) -> Result<Box<dyn Any + Send>, Error> {
        Ok(Box::new(Bank::try_clone(self)?))
    }

    fn replace_with(&mut self, other: Box<dyn Any + Send>) {
        if let Ok(other) = other.downcast::<Self>() {
            *self = *other;
        }
    }

    #[inline]
    fn update(&mut self, row: &[f64], numbers: &mut [f64], flags: &mut [bool]) {
        Bank::update(self, row, numbers, flags);
    }

    fn process(
        &mut self,
        rows: &[f64],
        numbers: &mut [f64],
        flags: &mut [bool],
        threads: usize,
    ) -> Result<(), Error> {
        self.process_on_threads(rows, numbers, flags, threads)
    }

    fn reset(&mut self) {
        Bank::reset(self);
    }

    fn save(&self, channels: Option<usize>) -> Result<Vec<u8>, Error> {
        checkpoint::save(channels, self)
    }
}

/// A bank whose streams accept a flag of the body's motion.
pub trait MotionBank: AnyBank {
    /// Processes rows. At the end of each row the body either is known to move, or its motion is
    /// unknown.
    fn process_while(
        &mut self,
        rows: &[f64],
        moving: &[bool],
        numbers: &mut [f64],
        flags: &mut [bool],
    );
}

impl<S> MotionBank for Bank<S>
where
    S: MotionAware + Checkpoint + Clone + Send + Sync + 'static,
{
    fn process_while(
        &mut self,
        rows: &[f64],
        moving: &[bool],
        numbers: &mut [f64],
        flags: &mut [bool],
    ) {
        let (streams, width) = (self.streams_mut(), S::Input::NUMBERS);
        let (n, f) = (S::Output::NUMBERS, S::Output::FLAGS);
        for (k, sample) in rows.chunks_exact(width).enumerate() {
            let (row, channel) = (k / streams.len(), k % streams.len());
            let output = streams[channel].update_while(S::Input::read(sample), moving[row]);
            output.write(&mut numbers[k * n..][..n], &mut flags[k * f..][..f]);
        }
    }
}

/// A bank of `channels` channels, or of a single signal if `None`.
pub struct Shared<B: ?Sized> {
    pub channels: Option<usize>,
    /// Output of a sample.
    output: Kind,
    /// Axes of one row of samples.
    axes: Vec<usize>,
    /// Axes that an output of one part adds to its channels.
    part: Vec<usize>,
    /// Number of values in the outputs of one row.
    numbers: Vec<f64>,
    flags: Vec<bool>,
    pub bank: Box<B>,
}

// The state is left out: text for every kind of stream would be a twentieth of the library.
impl<B: ?Sized> fmt::Debug for Shared<B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Shared").field("channels", &self.channels).finish_non_exhaustive()
    }
}

/// Output of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Nothing,
    Number,
    /// One vector or matrix.
    Array,
    Flag,
    Several,
}

/// The object, borrowed for changes; an error if another thread is using it.
#[inline]
pub fn exclusive<'py, T: PyClass<Frozen = False>>(
    object: &Bound<'py, T>,
) -> PyResult<PyRefMut<'py, T>> {
    object.try_borrow_mut().map_err(|_| in_use())
}

/// The object, borrowed for reading; an error if another thread is changing it.
pub fn reading<'py, T: PyClass>(object: &Bound<'py, T>) -> PyResult<PyRef<'py, T>> {
    object.try_borrow().map_err(|_| in_use())
}

/// A number from Python that must be at least one.
pub fn positive(name: &str, value: i128) -> PyResult<usize> {
    usize::try_from(value)
        .ok()
        .filter(|value| *value > 0)
        .ok_or_else(|| about(name, format!("{name} must be at least 1, got {value}")))
}

/// The number of channels from Python, which must not be zero.
pub fn channels(given: Option<i128>) -> PyResult<Option<usize>> {
    given.map(|value| positive("channels", value)).transpose()
}

/// The number of threads from Python, one by default; it may exceed the number of channels.
pub fn threads(given: Option<i128>) -> PyResult<usize> {
    given.map_or(Ok(1), |value| positive("threads", value.min(i128::from(u16::MAX))))
}

impl<B: AnyBank + ?Sized> Shared<B> {
    pub fn new(channels: Option<usize>, bank: Box<B>) -> Result<Self, Error> {
        let vector = (bank.width() > 1).then_some(bank.width());
        let axes = channels.into_iter().chain(vector).collect();
        Self::shaped(channels, axes, bank)
    }

    /// A single signal whose samples have these axes.
    pub fn with_axes(axes: Vec<usize>, bank: Box<B>) -> Result<Self, Error> {
        Self::shaped(None, axes, bank)
    }

    fn shaped(channels: Option<usize>, axes: Vec<usize>, bank: Box<B>) -> Result<Self, Error> {
        let output = match bank.fields() {
            [] => Kind::Nothing,
            [Field { shape: Shape::Flag, .. }] => Kind::Flag,
            [Field { shape: Shape::Number, .. }] => Kind::Number,
            [_] => Kind::Array,
            _ => Kind::Several,
        };
        let part = match bank.fields() {
            [one] => axes_of(one.shape),
            _ => vec![],
        };
        let (count, sizes) = (channels.unwrap_or(1), sizes(bank.fields()));
        let numbers = memory::filled(0.0, count.saturating_mul(sizes.0))?;
        let flags = memory::filled(false, count.saturating_mul(sizes.1))?;
        Ok(Self { channels, output, axes, part, numbers, flags, bank })
    }

    #[inline]
    pub fn update<'py>(&mut self, z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        if self.axes.is_empty() {
            self.update_row(z.py(), &[arrays::sample(z)?])
        } else {
            self.update_row(z.py(), &arrays::row(z, &self.axes)?)
        }
    }

    /// Processes one row of samples.
    #[inline]
    pub fn update_row<'py>(&mut self, py: Python<'py>, row: &[f64]) -> PyResult<Bound<'py, PyAny>> {
        self.bank.update(row, &mut self.numbers, &mut self.flags);
        self.answer(py)
    }

    /// Output of the last row.
    #[inline]
    fn answer<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match (self.output, self.channels) {
            (Kind::Number, None) => self.numbers[0].into_bound_py_any(py),
            (Kind::Number, Some(_)) => Ok(arrays::small(py, &self.numbers)),
            (Kind::Array, _) => arrays::array(py, self.numbers.clone(), &self.row_axes()),
            (Kind::Flag, None) => self.flags[0].into_bound_py_any(py),
            (Kind::Flag, Some(_)) => Ok(arrays::small(py, &self.flags)),
            (Kind::Nothing, _) => py.None().into_bound_py_any(py),
            (Kind::Several, _) => {
                let mut parts = Parts::new(self.bank.fields(), 1).map_err(NativeError::from)?;
                parts.add(&self.numbers, &self.flags);
                let axes: Vec<usize> = self.channels.into_iter().collect();
                PyTuple::new(py, arrays_of(py, parts, &axes)?)?.into_bound_py_any(py)
            }
        }
    }

    /// Processes a batch; returns an array, or a tuple of arrays for an output of several parts.
    pub fn process<'py>(
        &mut self,
        z: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.process_samples(z.py(), arrays::samples(z, &self.axes)?, out, threads)
    }

    /// Processes a batch that has been read.
    pub fn process_samples<'py>(
        &mut self,
        py: Python<'py>,
        samples: Samples<'py>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Option<i128>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let threads = self::threads(threads)?;
        let row = self.axes.iter().product();
        match self.output {
            Kind::Nothing => {
                let (bank, rows) = (&mut *self.bank, samples.values()?);
                let n = samples.shape()[0];
                in_pieces(py, bank, n, threads, |bank, piece| {
                    bank.process(&rows[places(piece, row)], &mut [], &mut [], threads)
                })?;
                py.None().into_bound_py_any(py)
            }
            Kind::Number | Kind::Array => {
                let run = |bank: &mut B, _, rows: &[f64], out: &mut [f64]| {
                    bank.process(rows, out, &mut [], threads)
                };
                self.fill(py, samples, out, threads, run)
            }
            Kind::Flag => {
                let run = |bank: &mut B, _, rows: &[f64], out: &mut [bool]| {
                    bank.process(rows, &mut [], out, threads)
                };
                self.fill(py, samples, out, threads, run)
            }
            Kind::Several if out.is_some() => Err(PyValueError::new_err(
                "out= is for what returns one array: this returns several, as a tuple",
            )),
            Kind::Several => {
                let axes = self.batch_axes(samples.shape()[0]);
                let mut outputs = Outputs::new(py, self.bank.fields(), &axes)?;
                outputs.fill(py, &mut *self.bank, samples.values()?, threads)?;
                PyTuple::new(py, outputs.into_arrays())?.into_bound_py_any(py)
            }
        }
    }

    /// Writes the outputs directly into the array that is returned.
    fn fill<'py, T: numpy::Element + Copy + Default + Send>(
        &mut self,
        py: Python<'py>,
        samples: Samples<'py>,
        out: Option<&Bound<'py, PyAny>>,
        threads: usize,
        run: impl Fn(&mut B, Range<usize>, &[f64], &mut [T]) -> Result<(), Error> + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (width, row) = (self.axes.iter().product(), self.row_axes());
        let shape: Vec<usize> = std::iter::once(samples.shape()[0]).chain(row).collect();
        let (bank, row) = (&mut *self.bank, shape[1..].iter().product());
        put_into(py, samples, out, &shape, &mut |rows, out| {
            in_pieces(py, bank, shape[0], threads, |bank, piece| {
                let rows = &rows[places(piece.clone(), width)];
                run(bank, piece.clone(), rows, &mut out[places(piece, row)])
            })
        })
    }

    /// Axes of one row of samples.
    pub fn axes(&self) -> &[usize] {
        &self.axes
    }

    /// Axes of the output for one row, if the output has one part.
    fn row_axes(&self) -> Vec<usize> {
        self.channels.into_iter().chain(self.part.iter().copied()).collect()
    }

    /// Axes of the output for `n` rows, before the axes of a field.
    pub fn batch_axes(&self, n: usize) -> Vec<usize> {
        std::iter::once(n).chain(self.channels).collect()
    }

    pub fn save<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.bank.save(self.channels).map_err(NativeError::from)?;
        PyBytes::new_with(py, bytes.len(), |place| {
            place.copy_from_slice(&bytes);
            Ok(())
        })
    }

    /// One number per channel: a float for a single signal, else an array.
    pub fn numbers<'py, T>(&self, py: Python<'py>, values: Vec<T>) -> PyResult<Bound<'py, PyAny>>
    where
        T: numpy::Element + IntoPyObjectExt<'py> + Copy,
    {
        self.arrays(py, values, &[])
    }

    /// One array of `shape` per channel, stacked for several channels.
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

    /// One field of each channel's output, found by its name.
    pub fn field<'py>(
        &self,
        py: Python<'py>,
        fields: &'static [Field],
        name: &str,
        numbers: &[f64],
        flags: &[bool],
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut parts =
            Parts::new(fields, self.channels.unwrap_or(1)).map_err(NativeError::from)?;
        parts.add(numbers, flags);
        let mut named = parts.into_fields().filter(|(field, _)| field.name == name);
        match named.next() {
            Some((field, Values::Numbers(values))) => {
                self.arrays(py, values, &axes_of(field.shape))
            }
            Some((_, Values::Flags(values))) => self.numbers(py, values),
            None => Ok(py.None().into_bound(py)),
        }
    }
}

impl<S> Shared<Bank<S>> {
    /// One value per channel.
    pub fn each<'py, T>(&self, py: Python<'py>, of: impl Fn(&S) -> T) -> PyResult<Bound<'py, PyAny>>
    where
        S: Stream + Checkpoint + Clone + Send + Sync + 'static,
        T: numpy::Element + IntoPyObjectExt<'py> + Copy,
    {
        self.numbers(py, self.bank.streams().iter().map(of).collect())
    }
}

impl<B: MotionBank + ?Sized> Shared<B> {
    /// [`update`](Self::update) while the body is known to move.
    pub fn update_moving<'py>(&mut self, z: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let row = match self.channels {
            None => vec![arrays::sample(z)?],
            Some(_) => arrays::row(z, &self.axes)?,
        };
        self.bank.process_while(&row, &[true], &mut self.numbers, &mut self.flags);
        self.answer(z.py())
    }

    /// [`process`](Self::process) of samples, with a flag of known motion for each sample.
    pub fn process_while<'py>(
        &mut self,
        z: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        moving: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, samples) = (z.py(), arrays::samples(z, &self.axes)?);
        let moving = arrays::flags("moving", moving, samples.shape()[0])?;
        match self.output {
            Kind::Flag => self.fill(py, samples, out, 1, |bank, piece, rows, out: &mut [bool]| {
                bank.process_while(rows, &moving[piece], &mut [], out);
                Ok(())
            }),
            _ => self.fill(py, samples, out, 1, |bank, piece, rows, out: &mut [f64]| {
                bank.process_while(rows, &moving[piece], out, &mut []);
                Ok(())
            }),
        }
    }
}

/// The call that creates such an object. Each argument has the text of its value and of its
/// default; an argument equal to its default is left out.
pub fn call(class: &str, arguments: &[(&str, String, &str)], channels: Option<usize>) -> String {
    let other = arguments.iter().filter(|(_, value, default)| value != default);
    let named = other.map(|(name, value, _)| format!("{name}={value}"));
    let several = channels.map(|k| format!("channels={k}"));
    format!("{class}({})", named.chain(several).collect::<Vec<_>>().join(", "))
}

/// A number as Python writes it, or None.
pub fn text(number: impl Into<Option<f64>>) -> String {
    number.into().map_or_else(|| "None".to_owned(), |number| format!("{number:?}"))
}

/// Joins words as in a sentence.
pub fn quoted(words: &[&str], last: &str) -> String {
    let words: Vec<String> = words.iter().map(|word| format!("'{word}'")).collect();
    match words.split_last() {
        Some((end, [])) => end.clone(),
        Some((end, before)) => format!("{} {last} {end}", before.join(", ")),
        None => String::new(),
    }
}

/// Function from rows to numbers or flags for any bank: compiled once for each of the two.
type Filling<'a, T> = dyn FnMut(&[f64], &mut [T]) -> PyResult<()> + 'a;

/// The output of `filling` for samples, in `out` or in a new array of this shape.
fn put_into<'py, T: numpy::Element + Copy + Default + Send>(
    py: Python<'py>,
    mut samples: Samples<'py>,
    out: Option<&Bound<'py, PyAny>>,
    shape: &[usize],
    filling: &mut Filling<'_, T>,
) -> PyResult<Bound<'py, PyAny>> {
    let Some(out) = out else {
        let array = arrays::zeros::<T>(py, shape)?;
        let mut writable = array.try_readwrite()?;
        filling(samples.values()?, writable.as_slice_mut()?)?;
        drop(writable);
        return Ok(array.into_any());
    };
    let array = arrays::check_out::<T>(out, shape)?;
    if !arrays::is_plain(array) {
        let length = shape.iter().product();
        let mut filled = memory::filled(T::default(), length).map_err(NativeError::from)?;
        filling(samples.values()?, &mut filled)?;
        drop(samples);
        arrays::copy_to(array, filled)?;
        return Ok(out.clone());
    }
    // In-place filtering is allowed.
    if array.try_readwrite().is_err() {
        samples = samples.copied()?;
    }
    let mut writable = array.try_readwrite()?;
    filling(samples.values()?, writable.as_slice_mut()?)?;
    Ok(out.clone())
}

/// Range of the numbers in some rows.
pub fn places(rows: Range<usize>, width: usize) -> Range<usize> {
    rows.start * width..rows.end * width
}

/// Axes that a field adds to those of the samples.
pub fn axes_of(shape: Shape) -> Vec<usize> {
    match shape {
        Shape::Number | Shape::Flag => vec![],
        Shape::Vector(n) => vec![n],
        Shape::Matrix(n) => vec![n, n],
    }
}

/// One array per field, with these axes before the field's own axes.
pub fn arrays_of<'py>(
    py: Python<'py>,
    parts: Parts,
    axes: &[usize],
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let array = |(field, values): (&Field, Values)| match values {
        Values::Numbers(values) => {
            arrays::array(py, values, &[axes, &axes_of(field.shape)].concat())
        }
        Values::Flags(values) => arrays::array(py, values, axes),
    };
    parts.into_fields().map(array).collect()
}

/// The methods that all streaming classes share. `out` names methods that can write their output
/// into a given array. `moving` names methods that accept a flag of the body's motion, after
/// `check_motion`. A class with several arrays per sample has its own `update` and `process`.
macro_rules! streaming {
    ($class:ident, update: $update:literal, process: $process:literal, moving) => {
        streaming!($class);

        #[pymethods]
        impl $class {
            #[doc = $update]
            #[pyo3(signature = (z, moving=false))]
            #[inline]
            fn update<'py>(
                slf: &Bound<'py, Self>,
                z: &Bound<'py, PyAny>,
                moving: bool,
            ) -> PyResult<Bound<'py, PyAny>> {
                let mut this = $crate::common::streaming::exclusive(slf)?;
                if !moving {
                    return this.shared.update(z);
                }
                this.check_motion()?;
                this.shared.update_moving(z)
            }

            #[doc = $process]
            #[pyo3(signature = (z, out=None, threads=None, moving=None))]
            fn process<'py>(
                slf: &Bound<'py, Self>,
                z: &Bound<'py, PyAny>,
                out: Option<&Bound<'py, PyAny>>,
                threads: Option<i128>,
                moving: Option<&Bound<'py, PyAny>>,
            ) -> PyResult<Bound<'py, PyAny>> {
                let [z] = $crate::common::arrays::taken(slf, ["z"], [Some(z)])?;
                let mut this = $crate::common::streaming::exclusive(slf)?;
                let Some(moving) = moving else {
                    return this.shared.process(&z, out, threads);
                };
                $crate::common::streaming::threads(threads)?;
                this.check_motion()?;
                this.shared.process_while(&z, out, moving)
            }
        }
    };
    ($class:ident, update: $update:literal, process: $process:literal $(, $out:ident)?) => {
        streaming!(@process $class, $process $(, $out)?);
        streaming!($class);

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
        }
    };
    ($class:ident) => {
        streaming!(@state $class);

        #[pymethods]
        impl $class {
            /// Number of channels; None for a single signal without a channel axis.
            #[getter]
            fn channels(slf: &Bound<'_, Self>) -> PyResult<Option<usize>> {
                Ok($crate::common::streaming::reading(slf)?.shared.channels)
            }
        }
    };
    // A class whose streams all have one type.
    (@bank $class:ident, $core:ty) => {
        impl $class {
            fn restored(bytes: &[u8]) -> Result<Self, zerorate_core::Error> {
                let (channels, bank) = zerorate_core::checkpoint::restore(bytes)?;
                Self::of(channels, bank)
            }

            fn of(
                channels: Option<usize>,
                bank: zerorate_core::Bank<$core>,
            ) -> Result<Self, zerorate_core::Error> {
                let bank = Box::new(bank);
                Ok(Self { shared: $crate::common::streaming::Shared::new(channels, bank)? })
            }

            fn first(&self) -> &$core {
                &self.shared.bank.streams()[0]
            }
        }
    };
    (@state $class:ident) => {
        #[pymethods]
        impl $class {
            /// Reset to the state before the first sample, with the same parameters.
            fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
                $crate::common::streaming::exclusive(slf)?.shared.bank.reset();
                Ok(())
            }

            /// Return parameters and state as bytes, with versions and a checksum.
            fn to_bytes<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyBytes>> {
                $crate::common::streaming::reading(slf)?.shared.save(slf.py())
            }

            /// Return the object saved by ``to_bytes``; it continues with identical results.
            ///
            /// A ValueError is raised if the bytes do not hold an object of this class.
            #[staticmethod]
            fn from_bytes(b: &[u8]) -> PyResult<Self> {
                Ok(Self::restored(b).map_err($crate::common::errors::NativeError::from)?)
            }

            /// Return an independent object in the same state.
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
                let [z] = $crate::common::arrays::taken(slf, ["z"], [Some(z)])?;
                $crate::common::streaming::exclusive(slf)?.shared.process(&z, out, threads)
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
                let [z] = $crate::common::arrays::taken(slf, ["z"], [Some(z)])?;
                $crate::common::streaming::exclusive(slf)?.shared.process(&z, None, threads)
            }
        }
    };
}
pub(crate) use streaming;
