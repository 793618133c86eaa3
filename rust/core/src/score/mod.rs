//! What a filter brought to one axis, measured while its samples pass.
//!
//! The work is done in blocks that begin at fixed samples, so that the pieces in which a record
//! comes do not change a digit, and no sum loses any in a long one.

mod axis;
mod coasting;
mod moments;
mod sum;

pub use axis::{AxisScores, Score, Seen};

/// Samples that are worked on together.
const BLOCK: usize = 256;
