//! Errors of parameters and checkpoints, and checks of parameters.

use core::fmt;

use crate::stream::checkpoint::Label;

/// Every error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter is outside its range.
    #[error("{name} must be {expected}, got {value:?}")]
    Parameter {
        /// Name of the parameter, as users write it.
        name: &'static str,
        /// Required range.
        expected: &'static str,
        /// Stated value.
        value: f64,
    },
    /// A matrix is not valid for a filter.
    #[error("{} must be {expected}", Named(name, *step))]
    Matrix {
        /// Name of the parameter, as users write it.
        name: &'static str,
        /// Step of the matrix, if each step has a matrix.
        step: Option<usize>,
        /// The expected values.
        expected: &'static str,
    },
    /// The bytes are not a checkpoint of this library.
    #[error("these bytes are not a zerorate checkpoint: they do not start with its signature")]
    NotACheckpoint,
    /// The checkpoint has a format unknown to this version.
    #[error("checkpoint has layout version {found}, this zerorate reads version {expected}")]
    Layout {
        /// Version in the bytes.
        found: u16,
        /// Version that this library reads.
        expected: u16,
    },
    /// The checkpoint is too short or too long.
    #[error("checkpoint is {found} bytes long, its header says {expected}: truncated or padded")]
    Length {
        /// Length of the bytes.
        found: usize,
        /// Length in the header.
        expected: usize,
    },
    /// The checksum does not match the bytes.
    #[error("checkpoint is damaged: its checksum does not match its content")]
    Checksum,
    /// The checkpoint belongs to another type, version or order.
    #[error("checkpoint holds {found}, expected {expected}")]
    Type {
        /// Label in the bytes.
        found: Label,
        /// Requested label.
        expected: Label,
    },
    /// The checksum matches, but the content is not a valid state of this type.
    #[error("checkpoint content is not the state of this filter")]
    Content,
    /// The buffer is too small for a checkpoint.
    #[error("the buffer given is too small for this checkpoint")]
    Buffer,
    /// No memory is available for a new object.
    #[error("{bytes} bytes of memory were refused")]
    Memory {
        /// Requested bytes.
        bytes: usize,
    },
    /// The work was cancelled.
    #[error("stopped before the result was there")]
    Stopped,
}

/// A parameter, or a parameter of one step.
struct Named(&'static str, Option<usize>);

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.1 {
            None => f.write_str(self.0),
            Some(step) => write!(f, "{}[{step}]", self.0),
        }
    }
}

pub(crate) fn check_positive(
    name: &'static str,
    expected: &'static str,
    value: f64,
) -> Result<(), Error> {
    require(value > 0.0 && value.is_finite(), name, expected, value)
}

pub(crate) fn check_not_negative(
    name: &'static str,
    expected: &'static str,
    value: f64,
) -> Result<(), Error> {
    require(value >= 0.0 && value.is_finite(), name, expected, value)
}

pub(crate) fn check_rate(value: f64) -> Result<(), Error> {
    // The period must be finite, too.
    let is_rate = value > 0.0 && value.is_finite() && value.recip().is_finite();
    require(is_rate, "rate", "a positive number of samples a second", value)
}

pub(crate) fn check_fading(value: f64) -> Result<(), Error> {
    require(value > 0.0 && value <= 1.0, "fading", "above 0 and at most 1", value)
}

pub(crate) fn check_forgetting_factor(value: f64) -> Result<(), Error> {
    require(value > 0.0 && value <= 1.0, "forgetting_factor", "above 0 and at most 1", value)
}

pub(crate) fn check_scale(value: Option<f64>) -> Result<(), Error> {
    value.map_or(Ok(()), |scale| check_positive("scale", "a positive number", scale))
}

pub(crate) fn require(
    holds: bool,
    name: &'static str,
    expected: &'static str,
    value: f64,
) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(Error::Parameter { name, expected, value }) }
}
