//! The Kalman filter of a drift model, and how its process noise adapts.
#![allow(non_snake_case)]

mod companion;
mod sage_husa;

pub use companion::{Belief, Correction};
pub use sage_husa::{Room, adapt, room_below};
