//! Position of a receiver, without the wandering of fixes at rest or at low speed.
//!
//! A fix is metres east and north in a plane, with what the receiver may tell besides: speed by
//! Doppler, strength of the signals, and whether the platform rests. [`PositionFilter`] is the
//! stream; its method says what is made of them. The default, [`PositionMethod::Aided`], takes the
//! position from Doppler and rest, and the slow error of the receiver for what it is: a state. The
//! others are the named ones that stand in papers, to compare with.
//!
//! None of them removes the slow error of a receiver: they remove what makes it wander.

mod filter;
mod options;
mod pair;

pub use filter::{Fix, PositionFilter, PositionSnapshot};
pub use options::{
    MAX_WINDOW, POSITION_CONSTANTS, POSITION_METHODS, PositionConstants, PositionMethod,
    PositionParams,
};
