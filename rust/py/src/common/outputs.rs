//! Outputs of several parts, each in its own array.

use numpy::{PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;
use zerorate_core::memory;
use zerorate_core::stream::{Field, Shape, sizes};

use super::arrays;
use super::errors::NativeError;
use super::streaming::{AnyBank, axes_of, places};
use super::work::in_pieces;

/// Rows whose outputs are separated before the next rows: they stay in the cache. Threads are
/// faster only with more rows.
const ROWS: usize = 1 << 8;
const ROWS_OF_THREADS: usize = 1 << 16;

/// One array per part of an output; `shape` gives the axes of the records.
pub struct Outputs<'py> {
    fields: &'static [Field],
    arrays: Vec<Array<'py>>,
}

enum Array<'py> {
    Numbers(Bound<'py, PyArrayDyn<f64>>),
    Flags(Bound<'py, PyArrayDyn<bool>>),
}

/// Content of an array, and the count of its numbers per record.
enum Part<'a> {
    Numbers(&'a mut [f64], usize),
    Flags(&'a mut [bool]),
}

impl<'py> Outputs<'py> {
    pub fn new(py: Python<'py>, fields: &'static [Field], axes: &[usize]) -> PyResult<Self> {
        // NumPy allocates huge pages. With small pages the allocation would take longer than most
        // of the work.
        let array = |field: &Field| {
            let shape = [axes, &axes_of(field.shape)].concat();
            Ok(match field.shape {
                Shape::Flag => Array::Flags(arrays::zeros(py, &shape)?),
                _ => Array::Numbers(arrays::zeros(py, &shape)?),
            })
        };
        Ok(Self { fields, arrays: fields.iter().map(array).collect::<PyResult<_>>()? })
    }

    /// Writes the outputs of a bank for these rows.
    pub fn fill<B: AnyBank + ?Sized>(
        &mut self,
        py: Python<'py>,
        bank: &mut B,
        rows: &[f64],
        threads: usize,
    ) -> PyResult<()> {
        let channels = bank.channels();
        let width = channels * bank.width();
        let count = rows.len() / width;
        let most = if threads.min(channels) > 1 { ROWS_OF_THREADS } else { ROWS };
        let length = most.min(count).max(1);
        let sizes = sizes(self.fields);
        let [number, flag] = [sizes.0, sizes.1].map(|size| channels.saturating_mul(size));
        let numbers = memory::filled(0.0, length.saturating_mul(number));
        let mut numbers = numbers.map_err(NativeError::from)?;
        let flags = memory::filled(false, length.saturating_mul(flag));
        let mut flags = flags.map_err(NativeError::from)?;
        self.with_parts(|parts| {
            in_pieces(py, bank, count, threads, |bank, piece| {
                for first in piece.clone().step_by(length) {
                    let block = first..piece.end.min(first + length);
                    let numbers = &mut numbers[..block.len() * number];
                    let flags = &mut flags[..block.len() * flag];
                    bank.process(&rows[places(block.clone(), width)], numbers, flags, threads)?;
                    take_apart(parts, block.start * channels, sizes, numbers, flags);
                }
                Ok(())
            })
        })
    }

    fn with_parts<R>(&mut self, work: impl FnOnce(&mut [Part<'_>]) -> PyResult<R>) -> PyResult<R> {
        let (mut numbers, mut flags) = (vec![], vec![]);
        for array in &self.arrays {
            match array {
                Array::Numbers(array) => numbers.push(array.try_readwrite()?),
                Array::Flags(array) => flags.push(array.try_readwrite()?),
            }
        }
        let (mut numbers, mut flags) = (numbers.iter_mut(), flags.iter_mut());
        let mut parts = memory::room(self.fields.len()).map_err(NativeError::from)?;
        for field in self.fields {
            let part = match field.shape {
                Shape::Flag => flags.next().map(|array| array.as_slice_mut().map(Part::Flags)),
                shape => numbers.next().map(|array| {
                    array.as_slice_mut().map(|numbers| Part::Numbers(numbers, shape.numbers()))
                }),
            };
            parts.extend(part.transpose()?);
        }
        work(&mut parts)
    }

    /// The arrays, in the order of the parts.
    pub fn into_arrays(self) -> Vec<Bound<'py, PyAny>> {
        let any = |array| match array {
            Array::Numbers(array) => array.into_any(),
            Array::Flags(array) => array.into_any(),
        };
        self.arrays.into_iter().map(any).collect()
    }
}

/// Writes numbers and flags of records into the arrays, beginning with record `first`.
fn take_apart(
    parts: &mut [Part<'_>],
    first: usize,
    (n, f): (usize, usize),
    numbers: &[f64],
    flags: &[bool],
) {
    let (mut number, mut flag) = (0, 0);
    for part in parts {
        match part {
            Part::Numbers(places, length) => {
                let places = &mut places[first * *length..];
                match *length {
                    1 => column::<_, 1>(places, &numbers[number..], n),
                    3 => column::<_, 3>(places, &numbers[number..], n),
                    length => {
                        let records = numbers.chunks_exact(n);
                        for (place, record) in places.chunks_exact_mut(length).zip(records) {
                            place.copy_from_slice(&record[number..][..length]);
                        }
                    }
                }
                number += *length;
            }
            Part::Flags(places) => {
                column::<_, 1>(&mut places[first..], &flags[flag..], f);
                flag += 1;
            }
        }
    }
}

/// The first `L` of every `stride` elements.
fn column<T: Copy, const L: usize>(places: &mut [T], records: &[T], stride: usize) {
    for (place, record) in places.as_chunks_mut::<L>().0.iter_mut().zip(records.chunks(stride)) {
        if let Some(own) = record.first_chunk::<L>() {
            *place = *own;
        }
    }
}
