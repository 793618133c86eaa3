//! Position of a receiver, without the wandering of fixes at rest or at low speed.
//!
//! A fix is a position east and north in a plane, m. The receiver may also give the Doppler
//! velocity, the strength of the signals, and rest of the platform. [`PositionFilter`] is the
//! stream; its method defines the use of these inputs. The default, [`PositionMethod::Aided`],
//! takes displacements from Doppler and rest, and estimates the slow error of the receiver. The
//! other methods are from papers, for comparison.
//!
//! No method removes the slow error of a receiver; the methods reduce the wandering of the fixes.

mod filter;
mod options;
mod pair;

pub use filter::{Fix, PositionFilter, PositionSnapshot};
pub use options::{
    MAX_WINDOW, POSITION_CONSTANTS, POSITION_METHODS, PositionConstants, PositionMethod,
    PositionParams,
};
