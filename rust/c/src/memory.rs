//! The border itself: what C points to. All that reads or writes through a pointer of C is here.

use core::ffi::c_void;
use core::slice;

use crate::code::zr_code;

/// A shared reference to a value behind a pointer of C.
///
/// # Safety
/// The pointer is null, or points to such a value that nobody writes meanwhile.
pub(crate) unsafe fn shared<'a, T>(pointer: *const T) -> Result<&'a T, zr_code> {
    // SAFETY: as above.
    unsafe { pointer.as_ref() }.ok_or(zr_code::ZR_NULL)
}

/// An exclusive reference to a value behind a pointer of C.
///
/// # Safety
/// The pointer is null, or points to such a value that nobody else reads or writes meanwhile.
pub(crate) unsafe fn exclusive<'a, T>(pointer: *mut T) -> Result<&'a mut T, zr_code> {
    // SAFETY: as above.
    unsafe { pointer.as_mut() }.ok_or(zr_code::ZR_NULL)
}

/// Three numbers.
///
/// # Safety
/// The pointer is null, or points to three numbers.
pub(crate) unsafe fn three(pointer: *const f64) -> Result<[f64; 3], zr_code> {
    // SAFETY: as above; arrays lie as their numbers do.
    unsafe { shared(pointer.cast::<[f64; 3]>()) }.copied()
}

/// Bytes, to be read. Nothing is read of none.
///
/// # Safety
/// The pointer is null, or points to as many bytes that nobody writes meanwhile.
pub(crate) unsafe fn bytes<'a>(pointer: *const u8, size: usize) -> Result<&'a [u8], zr_code> {
    match (pointer.is_null(), size) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(zr_code::ZR_NULL),
        // SAFETY: as above.
        (false, _) => Ok(unsafe { slice::from_raw_parts(pointer, size) }),
    }
}

/// Bytes, to be written.
///
/// # Safety
/// The pointer is null, or points to as many bytes that nobody else reads or writes meanwhile.
pub(crate) unsafe fn bytes_mut<'a>(pointer: *mut u8, size: usize) -> Result<&'a mut [u8], zr_code> {
    match (pointer.is_null(), size) {
        (_, 0) => Ok(&mut []),
        (true, _) => Err(zr_code::ZR_NULL),
        // SAFETY: as above. What C has not written yet is no byte: zeros are.
        (false, _) => Ok(unsafe {
            pointer.write_bytes(0, size);
            slice::from_raw_parts_mut(pointer, size)
        }),
    }
}

/// Puts a value down in memory of C and tells where it is.
///
/// # Safety
/// `memory` is null, or points to `size` bytes that nobody else reads or writes meanwhile; `place`
/// is null, or a pointer can be put down there.
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
    // SAFETY: not null, as large and as aligned as such a value; the rest as above.
    unsafe {
        memory.write(value);
        place.write(memory);
    }
    Ok(())
}

/// Hands each number to `step` and puts down what it returns: where it was read, if C wants so.
///
/// # Safety
/// Both pointers are null, or point to `n` numbers that nobody else writes meanwhile.
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
        // SAFETY: within both arrays, which may be one.
        unsafe { outputs.add(k).write(step(inputs.add(k).read())) };
    }
    Ok(())
}
