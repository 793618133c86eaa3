//! The state of a stream as bytes: signature, version of this layout, tag and version of the type,
//! its sizes, length, content in postcard's format, and CRC-32 of all of these.
//!
//! Each type has its own version: a change in one type leaves saved states of other types valid.

use core::fmt;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::error::Error;

const SIGNATURE: [u8; 4] = *b"ZRTE";
/// Version of the layout, not of a type's content.
const LAYOUT: u16 = 3;
const TAG: usize = 16;
const HEADER: usize = 30;
const CHECKSUM: usize = 4;

/// A type whose state can be saved and restored.
pub trait Checkpoint: Serialize + DeserializeOwned {
    /// Name of the type in its bytes: up to 16 ASCII characters, never changed.
    const TAG: &'static str;
    /// Version of the type's content; it changes with the content.
    const VERSION: u16;
    /// Sizes that distinguish types of one name, for example the orders of a model.
    const SIZES: [u8; 2] = [0; 2];

    /// Reads a state from the start of `bytes`, in postcard's format. A type that needs much memory
    /// never allocates more than `bytes` can fill.
    ///
    /// # Errors
    /// [`Error::Content`] if the bytes are not such a state, [`Error::Memory`] if there is no
    /// memory.
    fn take(bytes: &[u8]) -> Result<(Self, &[u8]), Error> {
        decode(bytes)
    }

    /// True if a restored state is possible in this type: samples can lead to every number, count
    /// and choice in it. All later results are then finite.
    fn is_valid(&self) -> bool;

    /// Returns a valid restored state, with the memory that its steps need.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory.
    fn with_reserve(self) -> Result<Self, Error> {
        Ok(self)
    }

    /// True if another state can be a channel of the same bank.
    fn is_like(&self, _other: &Self) -> bool {
        true
    }
}

/// Label of a checkpoint: type, version and sizes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Label {
    tag: [u8; TAG],
    /// Version of the type.
    pub version: u16,
    /// Sizes of the type, zero without sizes.
    pub sizes: [u8; 2],
}

impl Label {
    /// Label of a type.
    pub const fn of<S: Checkpoint>() -> Self {
        let name = S::TAG.as_bytes();
        assert!(name.len() <= TAG && S::TAG.is_ascii(), "a tag is up to 16 characters of ASCII");
        let mut tag = [0; TAG];
        let mut i = 0;
        while i < name.len() {
            tag[i] = name[i];
            i += 1;
        }
        Self { tag, version: S::VERSION, sizes: S::SIZES }
    }

    /// Name of the type.
    pub fn tag(&self) -> &str {
        let end = self.tag.iter().position(|byte| *byte == 0).unwrap_or(TAG);
        core::str::from_utf8(&self.tag[..end]).unwrap_or("something unknown")
    }
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "'{}' version {}", self.tag(), self.version)?;
        match self.sizes {
            [0, 0] => Ok(()),
            [p, q] => write!(f, " of order ({p}, {q})"),
        }
    }
}

/// Writes a state into `buffer`; returns the used part.
///
/// # Errors
/// [`Error::Buffer`] if the buffer is too small.
pub fn write<'a, S: Checkpoint>(state: &S, buffer: &'a mut [u8]) -> Result<&'a mut [u8], Error> {
    write_content(const { Label::of::<S>() }, state, buffer)
}

fn write_content<'a>(
    label: Label,
    content: &impl Serialize,
    buffer: &'a mut [u8],
) -> Result<&'a mut [u8], Error> {
    let rest = buffer.get_mut(HEADER..).ok_or(Error::Buffer)?;
    let content = postcard::to_slice(content, rest).map_err(|_| Error::Buffer)?.len();
    let length = HEADER + content + CHECKSUM;
    let bytes = buffer.get_mut(..length).ok_or(Error::Buffer)?;
    bytes[..HEADER].copy_from_slice(&header(label, length));
    let (head, tail) = bytes.split_at_mut(length - CHECKSUM);
    tail.copy_from_slice(&crc32fast::hash(head).to_le_bytes());
    Ok(bytes)
}

fn header(label: Label, length: usize) -> [u8; HEADER] {
    let mut header = [0; HEADER];
    header[..4].copy_from_slice(&SIGNATURE);
    header[4..6].copy_from_slice(&LAYOUT.to_le_bytes());
    header[6..22].copy_from_slice(&label.tag);
    header[22..24].copy_from_slice(&label.version.to_le_bytes());
    header[24..26].copy_from_slice(&label.sizes);
    header[26..].copy_from_slice(&(length as u32).to_le_bytes());
    header
}

/// Reads a state from bytes of [`write()`].
///
/// # Errors
/// Every variant of [`Error`] on checkpoints.
pub fn read<S: Checkpoint>(bytes: &[u8]) -> Result<S, Error> {
    match decode_valid(content(const { Label::of::<S>() }, bytes)?)? {
        (state, []) => Ok(state),
        _ => Err(Error::Content),
    }
}

/// Reads a valid state from the start of a content.
fn decode_valid<S: Checkpoint>(content: &[u8]) -> Result<(S, &[u8]), Error> {
    let (state, rest) = S::take(content)?;
    if state.is_valid() { Ok((state.with_reserve()?, rest)) } else { Err(Error::Content) }
}

/// Content between header and checksum of a checkpoint of this type.
fn content(expected: Label, bytes: &[u8]) -> Result<&[u8], Error> {
    let found = label(bytes)?;
    match found == expected {
        true => Ok(&bytes[HEADER..bytes.len() - CHECKSUM]),
        false => Err(Error::Type { found, expected }),
    }
}

/// Decodes a value from the start of `bytes`.
pub(crate) fn decode<'a, C: Deserialize<'a>>(bytes: &'a [u8]) -> Result<(C, &'a [u8]), Error> {
    postcard::take_from_bytes(bytes).map_err(|_| Error::Content)
}

/// Label of the bytes, if they are a complete and undamaged checkpoint.
///
/// # Errors
/// [`Error::NotACheckpoint`], [`Error::Layout`], [`Error::Length`] or [`Error::Checksum`].
pub fn label(bytes: &[u8]) -> Result<Label, Error> {
    if !bytes.starts_with(&SIGNATURE) {
        return Err(Error::NotACheckpoint);
    }
    let short = Error::Length { found: bytes.len(), expected: HEADER + CHECKSUM };
    let number = |at: usize| Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?));
    let layout = number(4).ok_or(short.clone())?;
    if layout != LAYOUT {
        return Err(Error::Layout { found: layout, expected: LAYOUT });
    }
    let header: &[u8; HEADER] = bytes.first_chunk().ok_or(short)?;
    let length = u32::from_le_bytes([header[26], header[27], header[28], header[29]]) as usize;
    if length != bytes.len() || length < HEADER + CHECKSUM {
        return Err(Error::Length { found: bytes.len(), expected: length });
    }
    let (content, checksum) = bytes.split_at(length - CHECKSUM);
    if crc32fast::hash(content).to_le_bytes() != checksum {
        return Err(Error::Checksum);
    }
    let mut tag = [0; TAG];
    tag.copy_from_slice(&header[6..22]);
    let version = u16::from_le_bytes([header[22], header[23]]);
    Ok(Label { tag, version, sizes: [header[24], header[25]] })
}

#[cfg(feature = "std")]
mod banks {
    use postcard::ser_flavors::Flavor;

    use super::{CHECKSUM, Checkpoint, HEADER, Label, content, decode, decode_valid, header};
    use crate::error::Error;
    use crate::memory;
    use crate::stream::Bank;

    /// Saves a bank of `channels` channels, or of a single signal for `None`, in a vector.
    ///
    /// # Errors
    /// [`Error::Content`] if the state cannot be written, or [`Error::Memory`] if there is no
    /// memory.
    pub fn save<S: Checkpoint>(channels: Option<usize>, bank: &Bank<S>) -> Result<Vec<u8>, Error> {
        let bytes = Growing(memory::filled(0, HEADER)?);
        let bytes = postcard::serialize_with_flavor(&(channels, bank), bytes)
            .map_err(|_| Error::Memory { bytes: size_of_val(bank.streams()) })?;
        labelled(const { Label::of::<S>() }, bytes)
    }

    /// Makes a checkpoint of a content with room for the header before it.
    fn labelled(label: Label, mut bytes: Vec<u8>) -> Result<Vec<u8>, Error> {
        let length = bytes.len() + CHECKSUM;
        // The header has four bytes for the length.
        if u32::try_from(length).is_err() {
            return Err(Error::Content);
        }
        memory::reserve(&mut bytes, CHECKSUM)?;
        bytes[..HEADER].copy_from_slice(&header(label, length));
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        Ok(bytes)
    }

    /// Bytes that grow while there is memory.
    struct Growing(Vec<u8>);

    impl Flavor for Growing {
        type Output = Vec<u8>;

        fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
            self.try_extend(&[byte])
        }

        fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
            memory::reserve(&mut self.0, bytes.len())
                .map_err(|_| postcard::Error::SerializeBufferFull)?;
            self.0.extend_from_slice(bytes);
            Ok(())
        }

        fn finalize(self) -> postcard::Result<Vec<u8>> {
            Ok(self.0)
        }
    }

    /// Returns the channels and the bank from bytes of [`save`].
    ///
    /// # Errors
    /// Every variant of [`Error`] on checkpoints, or [`Error::Memory`].
    pub fn restore<S: Checkpoint>(bytes: &[u8]) -> Result<(Option<usize>, Bank<S>), Error> {
        let (channels, mut content) = channels(const { Label::of::<S>() }, bytes)?;
        let mut streams = Vec::new();
        for _ in 0..channels.unwrap_or(1) {
            let (stream, rest) = decode_valid::<S>(content)?;
            if !streams.last().is_none_or(|last: &S| last.is_like(&stream)) {
                return Err(Error::Content);
            }
            memory::reserve(&mut streams, 1)?;
            streams.push(stream);
            content = rest;
        }
        match content {
            [] => Ok((channels, Bank::of(streams))),
            _ => Err(Error::Content),
        }
    }

    /// Channels of a bank with this label, and the bytes of its streams.
    fn channels(label: Label, bytes: &[u8]) -> Result<(Option<usize>, &[u8]), Error> {
        let ((channels, count), streams) =
            decode::<(Option<usize>, usize)>(content(label, bytes)?)?;
        match count {
            0 => Err(Error::Content),
            _ if count != channels.unwrap_or(1) => Err(Error::Content),
            _ => Ok((channels, streams)),
        }
    }
}
#[cfg(feature = "std")]
pub use banks::{restore, save};
