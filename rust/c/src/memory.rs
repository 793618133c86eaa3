//! Access to memory of C. All reads and writes through a pointer of C are here.

use core::ffi::c_void;
use core::slice;

use crate::code::zr_code;

/// A shared reference to a value behind a pointer of C.
///
/// # Safety
/// The pointer is null, or points to such a value; nothing else writes it meanwhile.
pub(crate) unsafe fn shared<'a, T>(pointer: *const T) -> Result<&'a T, zr_code> {
    // SAFETY: as above.
    unsafe { pointer.as_ref() }.ok_or(zr_code::ZR_NULL)
}

/// An exclusive reference to a value behind a pointer of C.
///
/// # Safety
/// The pointer is null, or points to such a value; nothing else reads or writes it meanwhile.
pub(crate) unsafe fn exclusive<'a, T>(pointer: *mut T) -> Result<&'a mut T, zr_code> {
    // SAFETY: as above.
    unsafe { pointer.as_mut() }.ok_or(zr_code::ZR_NULL)
}

/// Three numbers.
///
/// # Safety
/// The pointer is null, or points to three numbers.
pub(crate) unsafe fn three(pointer: *const f64) -> Result<[f64; 3], zr_code> {
    // SAFETY: as above; an array has the layout of its numbers.
    unsafe { shared(pointer.cast::<[f64; 3]>()) }.copied()
}

/// Bytes for reading. With null nothing is read.
///
/// # Safety
/// The pointer is null, or points to as many bytes; nothing else writes them meanwhile.
pub(crate) unsafe fn bytes<'a>(pointer: *const u8, size: usize) -> Result<&'a [u8], zr_code> {
    match (pointer.is_null(), size) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(zr_code::ZR_NULL),
        // SAFETY: as above.
        (false, _) => Ok(unsafe { slice::from_raw_parts(pointer, size) }),
    }
}

/// Bytes for writing.
///
/// # Safety
/// The pointer is null, or points to as many bytes; nothing else reads or writes them meanwhile.
pub(crate) unsafe fn bytes_mut<'a>(pointer: *mut u8, size: usize) -> Result<&'a mut [u8], zr_code> {
    match (pointer.is_null(), size) {
        (_, 0) => Ok(&mut []),
        (true, _) => Err(zr_code::ZR_NULL),
        // SAFETY: as above. Bytes that C has not written are uninitialised, and are set to zero
        // first.
        (false, _) => Ok(unsafe {
            pointer.write_bytes(0, size);
            slice::from_raw_parts_mut(pointer, size)
        }),
    }
}

/// Writes a value to memory of C and returns its address.
///
/// # Safety
/// `memory` is null, or points to `size` bytes; nothing else reads or writes them meanwhile.
/// `place` is null, or has room for a pointer.
pub(crate) unsafe fn put<T: Copy>(
    value: impl FnOnce() -> Result<T, zr_code>,
    memory: *mut c_void,
    size: usize,
    place: *mut *mut T,
) -> Result<(), zr_code> {
    if memory.is_null() || place.is_null() {
        return Err(zr_code::ZR_NULL);
    }
    let memory = memory.cast::<T>();
    if size < size_of::<T>() || !memory.is_aligned() {
        return Err(zr_code::ZR_MEMORY);
    }
    let value = value()?;
    // SAFETY: not null, with the size and alignment of such a value; the rest as above.
    unsafe {
        memory.write(value);
        place.write(memory);
    }
    Ok(())
}

/// Gives each number to `step` and writes the result, in place if both pointers are equal.
///
/// # Safety
/// The two pointers are null, or point to `n` numbers; nothing else writes them meanwhile.
pub(crate) unsafe fn each(
    inputs: *const f64,
    outputs: *mut f64,
    n: usize,
    mut step: impl FnMut(f64) -> f64,
) -> Result<(), zr_code> {
    if n > 0 && (inputs.is_null() || outputs.is_null()) {
        return Err(zr_code::ZR_NULL);
    }
    for k in 0..n {
        // SAFETY: within the two arrays, which may be the same array.
        unsafe { outputs.add(k).write(step(inputs.add(k).read())) };
    }
    Ok(())
}
