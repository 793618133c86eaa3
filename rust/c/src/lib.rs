#![doc = include_str!("../README.md")]
#![no_std]
// The names are those of C.
#![allow(non_camel_case_types)]

#[cfg(feature = "std")]
extern crate std;

mod attitude;
mod code;
mod drift;
mod memory;

pub use attitude::*;
pub use code::*;
pub use drift::*;

/// Without `std` nobody else says what a panic does. No function of this library panics.
#[cfg(not(feature = "std"))]
#[panic_handler]
fn stop(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
