//! The filters in a library for firmware. Its build proves that they need neither `std` nor an
//! allocator: `std` would add a second panic handler, and an allocation would need an allocator,
//! which is not provided.

#![no_std]

use core::panic::PanicInfo;

use zerorate_core::checkpoint;
use zerorate_core::{
    AutoFilter, AutoParams, Behaviour, DriftFilter, Error, Params, RestGated, Stream,
};

/// The filter that tunes itself, and a published filter.
#[derive(Debug)]
pub struct Axis {
    auto: AutoFilter<f32>,
    published: RestGated<f32, 3, 4>,
}

/// Filters of an axis before its first sample.
///
/// # Errors
/// [`Error::Parameter`] for a rate out of range.
#[unsafe(no_mangle)]
pub fn axis(rate: f64) -> Result<Axis, Error> {
    let published = DriftFilter::new(Params { rate, ..Params::default() })?;
    Ok(Axis {
        auto: AutoFilter::new(AutoParams { rate, ..AutoParams::default() })?,
        published: RestGated::new(published, Behaviour::default())?,
    })
}

/// The compensated rates of both filters.
#[unsafe(no_mangle)]
pub fn step(axis: &mut Axis, z: f32) -> [f32; 2] {
    [axis.auto.update(z), axis.published.update(z)]
}

/// Saves the filter that tunes itself; returns the number of bytes.
///
/// # Errors
/// [`Error::Buffer`] if the buffer is too small.
#[unsafe(no_mangle)]
pub fn save(axis: &Axis, buffer: &mut [u8]) -> Result<usize, Error> {
    checkpoint::write(&axis.auto, buffer).map(|saved| saved.len())
}

/// Restores the filter from the bytes of [`save`].
///
/// # Errors
/// Every variant of [`Error`] on checkpoints.
#[unsafe(no_mangle)]
pub fn restore(axis: &mut Axis, saved: &[u8]) -> Result<(), Error> {
    axis.auto = checkpoint::read(saved)?;
    Ok(())
}

#[panic_handler]
fn stop(_: &PanicInfo<'_>) -> ! {
    loop {}
}
