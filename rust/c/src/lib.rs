#![doc = include_str!("../README.md")]
#![no_std]
// The names are the names in C.
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

/// Without `std` a panic handler is needed here. No function of this library panics.
#[cfg(not(feature = "std"))]
#[panic_handler]
fn stop(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
