//! Memory of a size that a caller chooses: refused by an error, where Rust's own collections end the
//! process.

use crate::error::Error;

/// Room for so many more elements.
///
/// # Errors
/// [`Error::Memory`] if there is none, or no memory can be as large.
pub fn reserve<T>(values: &mut Vec<T>, additional: usize) -> Result<(), Error> {
    let bytes = || values_bytes::<T>(additional);
    values.try_reserve(additional).map_err(|_| Error::Memory { bytes: bytes() })
}

fn values_bytes<T>(length: usize) -> usize {
    length.saturating_mul(size_of::<T>())
}

/// Room for so many elements, and no more.
///
/// # Errors
/// [`Error::Memory`] if there is none.
pub fn room<T>(length: usize) -> Result<Vec<T>, Error> {
    let mut values = Vec::new();
    let refused = Error::Memory { bytes: values_bytes::<T>(length) };
    values.try_reserve_exact(length).map_err(|_| refused)?;
    Ok(values)
}

/// So many elements.
///
/// # Errors
/// [`Error::Memory`] if there is no memory for them.
pub fn filled<T: Clone>(value: T, length: usize) -> Result<Vec<T>, Error> {
    let mut values = room(length)?;
    values.resize(length, value);
    Ok(values)
}

/// The same elements once more.
///
/// # Errors
/// [`Error::Memory`] if there is no memory for them.
pub fn copied<T: Clone>(values: &[T]) -> Result<Vec<T>, Error> {
    let mut copy = room(values.len())?;
    copy.extend_from_slice(values);
    Ok(copy)
}
