//! MCAP recordings: their channels, and the messages of some of them in the order of their times.
//!
//! A file is records of an operation, a length and as many bytes, between two equal marks; a chunk
//! holds records in turn, compressed or not, with their checksum. The specification is at
//! <https://mcap.dev/spec>.

use thiserror::Error;

use crate::error::Error as Refused;
use crate::{memory, work};

const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";

const HEADER: u8 = 0x01;
const FOOTER: u8 = 0x02;
const SCHEMA: u8 = 0x03;
const CHANNEL: u8 = 0x04;
const MESSAGE: u8 = 0x05;
const CHUNK: u8 = 0x06;

/// Why a recording cannot be read.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Fault {
    /// It does not begin or end with the mark of the format.
    #[error("it has no {0} mark")]
    Mark(&'static str),
    /// A record does not hold what it must.
    #[error("its record at byte {0} is damaged")]
    Record(usize),
    /// Nobody here can unpack a chunk.
    #[error("its chunk at byte {0} has the compression '{1}', expected lz4, zstd or none")]
    Compression(usize, String),
    /// There is no memory for it.
    #[error(transparent)]
    Memory(#[from] Refused),
}

/// Messages of one kind, as they are declared.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Channel {
    /// Its number.
    pub id: u16,
    /// Its topic.
    pub topic: String,
    /// The encoding of its messages.
    pub encoding: String,
    /// Name, encoding and text of their type; empty where none is given.
    pub schema: (String, String, Vec<u8>),
}

/// Messages, in the order of their times.
#[derive(Debug, Clone, Default)]
pub struct Messages {
    /// The channel of each.
    pub channels: Vec<u16>,
    /// When each was recorded, ns.
    pub times: Vec<u64>,
    /// Where what is kept of each begins in `raw`.
    pub begins: Vec<u64>,
    /// Bytes of each in the file.
    pub lengths: Vec<u64>,
    /// All that is kept.
    pub raw: Vec<u8>,
}

/// What was read of a recording.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    /// The conventions that it follows, such as `ros2`.
    pub profile: String,
    /// In the order of their declaration.
    pub channels: Vec<Channel>,
    /// Of the channels asked for.
    pub messages: Messages,
}

/// Unpacks bytes of a compression into at most so many; `None` if it cannot. Memory grows with the
/// unpacked bytes, because a damaged file may declare any size.
pub type Unpack = fn(&str, &[u8], usize) -> Option<Vec<u8>>;

impl Recording {
    /// The channels of a recording, and at most `limit` messages of those in `wanted`. Of a message
    /// the parts in `kept` are kept, from one byte to another, counted from its end where they are
    /// below zero; or all of it, where there are none.
    ///
    /// Chunks are left out where no message is wanted and the end of the file repeats the channels.
    ///
    /// # Errors
    /// [`Fault`] at the first record that does not hold what it must.
    pub fn read(
        raw: &[u8],
        wanted: &[u16],
        limit: usize,
        kept: &[(isize, isize)],
        unpack: Unpack,
    ) -> Result<Self, Fault> {
        let inner = raw.strip_prefix(MAGIC).ok_or(Fault::Mark("first"))?;
        inner.strip_suffix(MAGIC).ok_or(Fault::Mark("last"))?;
        let mut walk = Walk { wanted, limit, kept, unpack, ..Walk::default() };
        walk.leaves_chunks = wanted.is_empty() && has_summary(raw);
        walk.run(raw, MAGIC.len())?;
        if !walk.ended {
            return Err(Fault::Mark("last"));
        }
        Ok(walk.finish())
    }
}

/// True if the footer says where the summary begins.
fn has_summary(raw: &[u8]) -> bool {
    // Operation and length of the footer stand before its 20 bytes.
    let footer = raw.len().checked_sub(MAGIC.len() + 29).map(|at| &raw[at..]);
    footer.is_some_and(|footer| footer[0] == FOOTER && footer[9..17] != [0; 8])
}

fn unknown(_: &str, _: &[u8], _: usize) -> Option<Vec<u8>> {
    None
}

/// Name, encoding and text.
type Schema = (String, String, Vec<u8>);

struct Walk<'a> {
    wanted: &'a [u16],
    limit: usize,
    kept: &'a [(isize, isize)],
    unpack: Unpack,
    leaves_chunks: bool,
    ended: bool,
    schemas: Vec<(u16, Schema)>,
    /// Each with the number of its schema.
    channels: Vec<(u16, Channel)>,
    recording: Recording,
}

impl Default for Walk<'_> {
    fn default() -> Self {
        Self {
            wanted: &[],
            limit: 0,
            kept: &[],
            unpack: unknown,
            leaves_chunks: false,
            ended: false,
            schemas: Vec::new(),
            channels: Vec::new(),
            recording: Recording::default(),
        }
    }
}

impl Walk<'_> {
    /// Takes the records of a file from its first byte on, or of a chunk.
    fn run(&mut self, raw: &[u8], from: usize) -> Result<(), Fault> {
        let mut rest = Cursor { raw, at: from };
        while rest.at < raw.len() && !self.ended {
            let at = rest.at;
            let (kind, body) = rest.record().ok_or(Fault::Record(at))?;
            let taken = match kind {
                CHUNK if self.leaves_chunks => Some(()),
                CHUNK => {
                    self.chunk(body, at)?;
                    Some(())
                }
                _ => self.take(kind, body)?,
            };
            taken.ok_or(Fault::Record(at))?;
            if self.recording.messages.times.len() >= self.limit && !self.wanted.is_empty() {
                self.ended = true;
            }
        }
        Ok(())
    }

    /// Takes a record that is no chunk; nothing where it is damaged.
    fn take(&mut self, kind: u8, body: &[u8]) -> Result<Option<()>, Fault> {
        let mut rest = Cursor { raw: body, at: 0 };
        Ok(match kind {
            HEADER => rest.text().map(|profile| self.recording.profile = profile),
            FOOTER => {
                self.ended = true;
                Some(())
            }
            SCHEMA => self.schema(&mut rest),
            CHANNEL => self.channel(&mut rest),
            MESSAGE => return self.message(&mut rest),
            _ => Some(()),
        })
    }

    fn schema(&mut self, rest: &mut Cursor<'_>) -> Option<()> {
        let id = rest.u16()?;
        let schema = (rest.text()?, rest.text()?, rest.bytes()?.to_vec());
        if self.schemas.iter().all(|(known, _)| *known != id) {
            self.schemas.push((id, schema));
        }
        Some(())
    }

    fn channel(&mut self, rest: &mut Cursor<'_>) -> Option<()> {
        let (id, schema) = (rest.u16()?, rest.u16()?);
        let (topic, encoding) = (rest.text()?, rest.text()?);
        if self.channels.iter().all(|(_, known)| known.id != id) {
            let channel = Channel { id, topic, encoding, ..Channel::default() };
            self.channels.push((schema, channel));
        }
        Some(())
    }

    fn message(&mut self, rest: &mut Cursor<'_>) -> Result<Option<()>, Fault> {
        let head = (|| {
            let (channel, _sequence, time) = (rest.u16()?, rest.u32()?, rest.u64()?);
            rest.u64()?;
            Some((channel, time))
        })();
        let Some((channel, time)) = head else { return Ok(None) };
        if self.wanted.contains(&channel) {
            let body = &rest.raw[rest.at..];
            let messages = &mut self.recording.messages;
            let begin = messages.raw.len() as u64;
            memory::reserve(&mut messages.raw, body.len())?;
            if self.kept.is_empty() {
                messages.raw.extend_from_slice(body);
            }
            for (from, to) in self.kept {
                let place = |at: isize| match at < 0 {
                    true => body.len().checked_sub(at.unsigned_abs()),
                    false => Some(at.unsigned_abs()),
                };
                let part = place(*from).zip(place(*to)).and_then(|(from, to)| body.get(from..to));
                let Some(part) = part else { return Ok(None) };
                messages.raw.extend_from_slice(part);
            }
            work::push(&mut messages.channels, channel);
            work::push(&mut messages.times, time);
            work::push(&mut messages.begins, begin);
            work::push(&mut messages.lengths, body.len() as u64);
        }
        Ok(Some(()))
    }

    fn chunk(&mut self, body: &[u8], at: usize) -> Result<(), Fault> {
        work::pause();
        let damaged = || Fault::Record(at);
        let mut rest = Cursor { raw: body, at: 16 };
        let head = (|| Some((rest.u64()?, rest.u32()?, rest.text()?, rest.u64()?)))();
        let (size, checksum, compression, packed) = head.ok_or_else(damaged)?;
        let packed = usize::try_from(packed).ok().and_then(|n| rest.take(n)).ok_or_else(damaged)?;
        if compression.is_empty() {
            return self.records(packed, checksum).map_err(|fault| placed(fault, at));
        }
        if !["lz4", "zstd"].contains(&compression.as_str()) {
            return Err(Fault::Compression(at, compression));
        }
        let size = usize::try_from(size).map_err(|_| damaged())?;
        let unpacked = (self.unpack)(&compression, packed, size).ok_or_else(damaged)?;
        if unpacked.len() != size {
            return Err(damaged());
        }
        self.records(&unpacked, checksum).map_err(|fault| placed(fault, at))
    }

    /// Takes the records of a chunk whose checksum is right, or zero for none.
    fn records(&mut self, raw: &[u8], checksum: u32) -> Result<(), Fault> {
        let right = checksum == 0 || checksum == crc32fast::hash(raw);
        let nested = Cursor { raw, at: 0 }.record().is_some_and(|(kind, _)| kind == CHUNK);
        if right && !nested { self.run(raw, 0) } else { Err(Fault::Record(0)) }
    }

    /// With the schema of each channel, and the messages in order.
    fn finish(self) -> Recording {
        let Self { schemas, channels, mut recording, .. } = self;
        recording.channels = channels
            .into_iter()
            .map(|(schema, channel)| {
                let own = schemas.iter().find(|(id, _)| *id == schema);
                Channel { schema: own.map(|(_, own)| own.clone()).unwrap_or_default(), ..channel }
            })
            .collect();
        recording.messages.sort();
        recording
    }
}

/// A fault in a chunk, at the byte of the file where the chunk begins.
fn placed(fault: Fault, at: usize) -> Fault {
    match fault {
        Fault::Record(_) => Fault::Record(at),
        other => other,
    }
}

impl Messages {
    fn sort(&mut self) {
        if self.times.is_sorted() {
            return;
        }
        let mut order: Vec<usize> = (0..self.times.len()).collect();
        order.sort_by_key(|i| self.times[*i]);
        self.channels = order.iter().map(|i| self.channels[*i]).collect();
        for numbers in [&mut self.times, &mut self.begins, &mut self.lengths] {
            *numbers = order.iter().map(|i| numbers[*i]).collect();
        }
    }
}

/// A place in bytes; nothing is returned where they end.
struct Cursor<'a> {
    raw: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let taken = self.raw.get(self.at..self.at.checked_add(count)?)?;
        self.at += count;
        Some(taken)
    }

    fn u16(&mut self) -> Option<u16> {
        self.take(2)?.first_chunk().map(|bytes| u16::from_le_bytes(*bytes))
    }

    fn u32(&mut self) -> Option<u32> {
        self.take(4)?.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
    }

    fn u64(&mut self) -> Option<u64> {
        self.take(8)?.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))
    }

    fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()?;
        self.take(usize::try_from(length).ok()?)
    }

    fn text(&mut self) -> Option<String> {
        self.bytes().map(|bytes| String::from_utf8_lossy(bytes).into_owned())
    }

    /// Operation and bytes of a record.
    fn record(&mut self) -> Option<(u8, &'a [u8])> {
        let kind = self.take(1)?[0];
        let length = self.u64()?;
        Some((kind, self.take(usize::try_from(length).ok()?)?))
    }
}

#[cfg(test)]
mod tests {
    use super::{CHANNEL, CHUNK, FOOTER, Fault, HEADER, MAGIC, MESSAGE, Recording, SCHEMA};
    use proptest::prelude::*;

    fn record(kind: u8, parts: &[&[u8]]) -> Vec<u8> {
        let body = parts.concat();
        [&[kind][..], &(body.len() as u64).to_le_bytes(), &body].concat()
    }

    fn text(words: &str) -> Vec<u8> {
        [&(words.len() as u32).to_le_bytes()[..], words.as_bytes()].concat()
    }

    fn message(channel: u16, time: u64) -> Vec<u8> {
        let head = [&channel.to_le_bytes()[..], &[0; 4], &time.to_le_bytes(), &[0; 8]].concat();
        record(MESSAGE, &[&head, &time.to_le_bytes()])
    }

    /// Two channels; a chunk that is packed by inverting every bit, one that is not packed, and a
    /// late message outside chunks.
    fn file() -> Vec<u8> {
        let declared = [
            record(SCHEMA, &[&[1, 0], &text("Imu"), &text("ros2msg"), &text("float64 x")]),
            record(CHANNEL, &[&[0, 0, 1, 0], &text("/a"), &text("cdr"), &[0; 4]]),
            record(CHANNEL, &[&[1, 0, 0, 0], &text("/b"), &text("json"), &[0; 4]]),
        ]
        .concat();
        let chunk = |inner: Vec<u8>, name: &str| {
            let crc = crc32fast::hash(&inner).to_le_bytes();
            let size = (inner.len() as u64).to_le_bytes();
            let kept =
                inner.iter().map(|b| if name.is_empty() { *b } else { !b }).collect::<Vec<_>>();
            record(CHUNK, &[&[0; 16], &size, &crc, &text(name), &size, &kept])
        };
        let first: Vec<u8> = (0..5).flat_map(|k| message(k % 2, 10 + u64::from(k))).collect();
        let second: Vec<u8> = (0..5).flat_map(|k| message(k % 2, 20 + u64::from(k))).collect();
        [
            MAGIC.to_vec(),
            record(HEADER, &[&text("ros2"), &text("test")]),
            chunk([declared, first].concat(), "lz4"),
            chunk(second, ""),
            message(0, 3),
            record(FOOTER, &[&[0; 20]]),
            MAGIC.to_vec(),
        ]
        .concat()
    }

    fn turned(_: &str, packed: &[u8], size: usize) -> Option<Vec<u8>> {
        (packed.len() == size).then(|| packed.iter().map(|byte| !byte).collect())
    }

    fn read(raw: &[u8], wanted: &[u16], limit: usize) -> Result<Recording, Fault> {
        Recording::read(raw, wanted, limit, &[], turned)
    }

    #[test]
    fn messages_come_in_the_order_of_their_times() {
        let found = read(&file(), &[0], usize::MAX).expect("it is whole");
        assert_eq!(found.profile, "ros2");
        assert_eq!(found.channels.len(), 2);
        assert_eq!((&*found.channels[0].topic, &*found.channels[0].schema.0), ("/a", "Imu"));
        assert_eq!((&*found.channels[1].encoding, &*found.channels[1].schema.0), ("json", ""));
        assert_eq!(found.messages.times, [3, 10, 12, 14, 20, 22, 24]);
        for (begin, time) in found.messages.begins.iter().zip(&found.messages.times) {
            let at = *begin as usize;
            assert_eq!(found.messages.raw[at..at + 8], time.to_le_bytes());
        }
        assert_eq!(read(&file(), &[0], 2).expect("it is whole").messages.times, [10, 12]);
        assert!(read(&file(), &[], 0).expect("it is whole").messages.times.is_empty());
    }

    #[test]
    fn parts_of_messages_are_kept() {
        let of = |kept: &[(isize, isize)]| Recording::read(&file(), &[1], 3, kept, turned);
        let found = of(&[(0, 1), (-2, -1)]).expect("it is whole").messages;
        assert_eq!(
            (&found.raw[..], &found.begins[..]),
            (&[11, 0, 13, 0, 21, 0][..], &[0, 2, 4][..])
        );
        assert_eq!(found.lengths, [8; 3]);
        for beyond in [(0, 9), (-9, -1), (3, 2)] {
            assert!(matches!(of(&[beyond]), Err(Fault::Record(_))), "{beyond:?}");
        }
    }

    #[test]
    fn what_is_cut_or_unknown_is_told() {
        let whole = file();
        for end in 0..whole.len() {
            assert!(read(&whole[..end], &[0, 1], usize::MAX).is_err(), "{end}");
        }
        let place = whole.windows(3).position(|word| word == b"lz4").expect("it is there");
        let mut other = whole;
        other[place] = b'x';
        let fault = read(&other, &[0], 9).expect_err("nobody knows it").to_string();
        assert!(fault.ends_with("'xz4', expected lz4, zstd or none"), "{fault}");
    }

    #[test]
    fn a_declared_size_takes_no_memory() {
        let mut raw = file();
        let name = raw.windows(3).position(|word| word == b"lz4").expect("it is there");
        let size = name - 16..name - 8;
        for declared in [1 << 62, 1 << 40, 0, 7] {
            raw[size.clone()].copy_from_slice(&u64::to_le_bytes(declared));
            assert!(matches!(read(&raw, &[0], usize::MAX), Err(Fault::Record(_))), "{declared}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
            cut in prop::option::of(any::<prop::sample::Index>()),
        ) {
            let mut raw = file();
            for (place, byte) in changes {
                let at = place.index(raw.len());
                raw[at] = byte;
            }
            if let Some(cut) = cut {
                let at = cut.index(raw.len());
                raw.drain(at..(at + 9).min(raw.len()));
            }
            if let Ok(found) = read(&raw, &[0, 1], usize::MAX) {
                prop_assert!(found.messages.times.is_sorted());
                prop_assert!(found.messages.raw.len() <= raw.len());
                for (begin, length) in found.messages.begins.iter().zip(&found.messages.lengths) {
                    prop_assert!((begin + length) as usize <= found.messages.raw.len());
                }
            }
        }
    }
}
