//! A sensor on a board: an ICM-42688-P behind any SPI of `embedded-hal`, and a drift filter of
//! `f32` for each axis of its gyro. Neither `std` nor an allocator is needed.
//!
//! ```ignore
//! let mut imu = Imu::new(spi, &mut delay, 200.0)?; // spi: an embedded_hal::spi::SpiDevice
//! loop {
//!     ready.wait(); // for the sensor's interrupt
//!     let rate = imu.rate()?; // deg/s, without the bias
//! }
//! ```
#![no_std]
#![deny(unsafe_code)]

#[cfg(feature = "std")]
extern crate std;

mod counted;
mod icm42688;
mod imu;

pub use counted::board_run;
pub use icm42688::{Fault, Icm42688, Sample};
pub use imu::Imu;

#[cfg(not(feature = "std"))]
#[panic_handler]
fn stop(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
