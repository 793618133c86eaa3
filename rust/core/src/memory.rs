//! Memory with a size that a caller chooses. If there is no memory, the functions return an error;
//! Rust's own collections would end the process.

use crate::error::Error;

/// Reserves room for this number of additional elements.
///
/// # Errors
/// [`Error::Memory`] if there is no memory, or the size is impossible.
pub fn reserve<T>(values: &mut Vec<T>, additional: usize) -> Result<(), Error> {
    let bytes = || values_bytes::<T>(additional);
    values.try_reserve(additional).map_err(|_| Error::Memory { bytes: bytes() })
}

fn values_bytes<T>(length: usize) -> usize {
    length.saturating_mul(size_of::<T>())
}

/// Returns a vector with room for exactly this number of elements.
///
/// # Errors
/// [`Error::Memory`] if there is no memory.
pub fn room<T>(length: usize) -> Result<Vec<T>, Error> {
    let mut values = Vec::new();
    let refused = Error::Memory { bytes: values_bytes::<T>(length) };
    values.try_reserve_exact(length).map_err(|_| refused)?;
    Ok(values)
}

/// Returns this number of equal elements.
///
/// # Errors
/// [`Error::Memory`] if there is no memory.
pub fn filled<T: Clone>(value: T, length: usize) -> Result<Vec<T>, Error> {
    let mut values = room(length)?;
    values.resize(length, value);
    Ok(values)
}

/// Returns a copy of the elements.
///
/// # Errors
/// [`Error::Memory`] if there is no memory.
pub fn copied<T: Clone>(values: &[T]) -> Result<Vec<T>, Error> {
    let mut copy = room(values.len())?;
    copy.extend_from_slice(values);
    Ok(copy)
}
