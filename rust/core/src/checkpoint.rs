//! The state of a filter as bytes: signature, format version, what it is, length, content in
//! postcard's format, CRC-32 of all before it.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::error::Error;

const SIGNATURE: [u8; 4] = *b"ZRTE";
/// Changes whenever the content of any filter does.
const VERSION: u16 = 2;
const HEADER: usize = 14;
const CHECKSUM: usize = 4;

/// What kind of filter a checkpoint holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// [`DriftFilter`](crate::DriftFilter)s, one a channel.
    DriftFilter = 1,
    /// [`RecursiveLeastSquares`](crate::RecursiveLeastSquares), one a channel.
    RecursiveLeastSquares = 2,
    /// [`AllanNoise`](crate::allan::AllanNoise), one a channel.
    AllanNoise = 3,
    /// `StreamingAllan`, one a channel.
    StreamingAllan = 4,
    /// [`RestDetector`](crate::RestDetector)s, one a channel.
    RestDetector = 5,
    /// [`MotionSafe`](crate::MotionSafe) drift filters, one a channel.
    MotionSafe = 6,
    /// [`AutoFilter`](crate::AutoFilter)s, one a channel.
    AutoFilter = 7,
}

/// What a checkpoint holds: the kind of filter and the orders of its model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Label {
    /// The kind of filter.
    pub kind: Kind,
    /// AR order, zero where there is none.
    pub p: u8,
    /// MA order, zero where there is none.
    pub q: u8,
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.kind {
            Kind::DriftFilter => "a DriftFilter",
            Kind::RecursiveLeastSquares => "a RecursiveLeastSquares",
            Kind::AllanNoise => "an AllanNoise",
            Kind::StreamingAllan => "a StreamingAllan",
            Kind::RestDetector => "a RestDetector",
            Kind::MotionSafe => "a DriftFilter that holds or compensates",
            Kind::AutoFilter => "a DriftFilter that tunes itself",
        })?;
        if self.p == 0 {
            return Ok(());
        }
        write!(f, " of order ({}, {})", self.p, self.q)
    }
}

/// Writes `state` into `buffer`; answers the part used.
///
/// # Errors
/// [`Error::Buffer`] if it is too small.
pub fn write<'a, S: Serialize>(
    label: Label,
    state: &S,
    buffer: &'a mut [u8],
) -> Result<&'a mut [u8], Error> {
    let room = buffer.get_mut(HEADER..).ok_or(Error::Buffer)?;
    let content = postcard::to_slice(state, room).map_err(|_| Error::Buffer)?.len();
    let length = HEADER + content + CHECKSUM;
    let bytes = buffer.get_mut(..length).ok_or(Error::Buffer)?;
    bytes[..4].copy_from_slice(&SIGNATURE);
    bytes[4..6].copy_from_slice(&VERSION.to_le_bytes());
    bytes[6..10].copy_from_slice(&[label.kind as u8, label.p, label.q, 0]);
    bytes[10..HEADER].copy_from_slice(&(length as u32).to_le_bytes());
    let (head, tail) = bytes.split_at_mut(length - CHECKSUM);
    tail.copy_from_slice(&crc32fast::hash(head).to_le_bytes());
    Ok(bytes)
}

/// [`write()`] into a vector of its own.
///
/// # Errors
/// [`Error::Content`] if the state cannot be written.
#[cfg(feature = "std")]
pub fn to_vec<S: Serialize>(label: Label, state: &S) -> Result<Vec<u8>, Error> {
    let size = postcard::experimental::serialized_size(state).map_err(|_| Error::Content)?;
    let mut bytes = vec![0; HEADER + size + CHECKSUM];
    write(label, state, &mut bytes)?;
    Ok(bytes)
}

/// The state that [`write()`] wrote under the same label.
///
/// # Errors
/// Every variant of [`Error`] that speaks of a checkpoint.
pub fn read<'a, S: Deserialize<'a>>(expected: Label, bytes: &'a [u8]) -> Result<S, Error> {
    let found = label(bytes)?;
    if found != expected {
        return Err(Error::Kind { found, expected });
    }
    let content = &bytes[HEADER..bytes.len() - CHECKSUM];
    match postcard::take_from_bytes(content) {
        Ok((state, [])) => Ok(state),
        _ => Err(Error::Content),
    }
}

/// The [`label`] of a checkpoint that must hold this kind of filter.
///
/// # Errors
/// Those of [`label`], and [`Error::Kind`] for another kind.
pub fn label_of(kind: Kind, bytes: &[u8]) -> Result<Label, Error> {
    let found = label(bytes)?;
    if found.kind != kind {
        return Err(Error::Kind { found, expected: Label { kind, p: 0, q: 0 } });
    }
    Ok(found)
}

/// What these bytes hold, if they are a whole and undamaged checkpoint of this version.
///
/// # Errors
/// [`Error::NotACheckpoint`], [`Error::Version`], [`Error::Length`], [`Error::Checksum`] or
/// [`Error::Content`].
pub fn label(bytes: &[u8]) -> Result<Label, Error> {
    if !bytes.starts_with(&SIGNATURE) {
        return Err(Error::NotACheckpoint);
    }
    let short = Error::Length { found: bytes.len(), expected: HEADER + CHECKSUM };
    let header = bytes.get(..HEADER).ok_or(short)?;
    let version = u16::from_le_bytes([header[4], header[5]]);
    if version != VERSION {
        return Err(Error::Version { found: version, expected: VERSION });
    }
    let length = u32::from_le_bytes([header[10], header[11], header[12], header[13]]) as usize;
    if length != bytes.len() || length < HEADER + CHECKSUM {
        return Err(Error::Length { found: bytes.len(), expected: length });
    }
    let (content, checksum) = bytes.split_at(length - CHECKSUM);
    if crc32fast::hash(content).to_le_bytes() != checksum {
        return Err(Error::Checksum);
    }
    let kind = match header[6] {
        1 => Kind::DriftFilter,
        2 => Kind::RecursiveLeastSquares,
        3 => Kind::AllanNoise,
        4 => Kind::StreamingAllan,
        5 => Kind::RestDetector,
        6 => Kind::MotionSafe,
        7 => Kind::AutoFilter,
        _ => return Err(Error::Content),
    };
    Ok(Label { kind, p: header[7], q: header[8] })
}
