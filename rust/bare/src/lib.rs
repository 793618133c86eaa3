//! The filters in a library for firmware. That it builds is the proof that they need neither `std`
//! nor an allocator: `std` would bring a second panic handler, and an allocation would ask for an
//! allocator, which nobody provides.

#![no_std]

use core::panic::PanicInfo;

use zerorate_core::checkpoint;
use zerorate_core::{
    AutoFilter, AutoParams, Behaviour, DriftFilter, Error, Params, RestGated, Stream,
};

/// The filter that tunes itself, and a published one.
#[derive(Debug)]
pub struct Axis {
    auto: AutoFilter<f32>,
    published: RestGated<f32, 3, 4>,
}

/// An axis that has seen nothing.
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

/// Saves the filter that tunes itself; answers the bytes used.
///
/// # Errors
/// [`Error::Buffer`] if they are too few.
#[unsafe(no_mangle)]
pub fn save(axis: &Axis, buffer: &mut [u8]) -> Result<usize, Error> {
    checkpoint::write(&axis.auto, buffer).map(|saved| saved.len())
}

/// Goes on with what [`save`] wrote.
///
/// # Errors
/// Every variant of [`Error`] that speaks of a checkpoint.
#[unsafe(no_mangle)]
pub fn restore(axis: &mut Axis, saved: &[u8]) -> Result<(), Error> {
    axis.auto = checkpoint::read(saved)?;
    Ok(())
}

#[panic_handler]
fn stop(_: &PanicInfo<'_>) -> ! {
    loop {}
}
