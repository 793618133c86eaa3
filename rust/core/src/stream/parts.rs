//! Records of several fields, separated into one list per field.

use super::sample::{Field, Shape, sizes};
use crate::error::Error;
use crate::memory;

/// The fields of records, each in its own list.
#[derive(Debug)]
pub struct Parts {
    fields: &'static [Field],
    values: Vec<Values>,
}

/// One field of every record.
#[derive(Debug)]
pub enum Values {
    /// Numbers of a field, record after record.
    Numbers(Vec<f64>),
    /// Values of a flag.
    Flags(Vec<bool>),
}

/// Number of rows whose records are separated before the next rows: they stay in the cache.
const ROWS: usize = 128;

impl Parts {
    /// Empty lists with room for this number of records.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory.
    pub fn new(fields: &'static [Field], records: usize) -> Result<Self, Error> {
        let values = |field: &Field| {
            Ok(match field.shape {
                Shape::Flag => Values::Flags(memory::room(records)?),
                shape => Values::Numbers(memory::room(records.saturating_mul(shape.numbers()))?),
            })
        };
        Ok(Self { fields, values: fields.iter().map(values).collect::<Result<_, _>>()? })
    }

    /// Separates the records that `work` makes from rows of `channels` times `width` numbers.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory for some records, before `work` has begun.
    pub fn add_rows(
        &mut self,
        channels: usize,
        rows: &[f64],
        width: usize,
        mut work: impl FnMut(&[f64], &mut [f64], &mut [bool]),
    ) -> Result<(), Error> {
        let (n, f) = sizes(self.fields);
        let width = width.max(1);
        let most = ROWS.min(rows.len() / width).saturating_mul(channels);
        let mut numbers = memory::filled(0.0, most.saturating_mul(n))?;
        let mut flags = memory::filled(false, most.saturating_mul(f))?;
        for rows in rows.chunks(ROWS * width) {
            let records = rows.len() / width * channels;
            let (numbers, flags) = (&mut numbers[..records * n], &mut flags[..records * f]);
            work(rows, numbers, flags);
            self.add(numbers, flags);
        }
        Ok(())
    }

    /// Adds more records.
    pub fn add(&mut self, numbers: &[f64], flags: &[bool]) {
        let (n, f) = sizes(self.fields);
        let (mut number, mut flag) = (0, 0);
        for (field, values) in self.fields.iter().zip(&mut self.values) {
            match values {
                Values::Numbers(values) => {
                    let length = field.shape.numbers();
                    let records = numbers.chunks_exact(n);
                    if length == 1 {
                        values.extend(records.map(|record| record[number]));
                    } else {
                        let before = values.len();
                        values.resize(before + records.len() * length, 0.0);
                        let slots = values[before..].chunks_exact_mut(length);
                        for (slot, record) in slots.zip(records) {
                            let own = record[number..].iter();
                            slot.iter_mut().zip(own).for_each(|(slot, x)| *slot = *x);
                        }
                    }
                    number += length;
                }
                Values::Flags(values) => {
                    values.extend(flags.chunks_exact(f).map(|record| record[flag]));
                    flag += 1;
                }
            }
        }
    }

    /// The fields with their values.
    pub fn into_fields(self) -> impl Iterator<Item = (&'static Field, Values)> {
        self.fields.iter().zip(self.values)
    }
}
