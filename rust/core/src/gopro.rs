//! Videos of GoPro cameras: the sensors in their telemetry track.
//!
//! An MP4 file consists of nested boxes. Its track of kind `gpmd` has a packet of telemetry about
//! every second. A packet consists of entries with a key, a type, a size and a count; an entry of
//! type zero contains entries. See <https://github.com/gopro/gpmf-parser>.

use thiserror::Error;

use crate::error::Error as Refused;
use crate::{memory, work};

/// Reason why a video cannot be read.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Fault {
    /// The video has no track of telemetry.
    #[error("it has no telemetry of a GoPro")]
    Absent,
    /// A box does not have the expected content.
    #[error("its box '{0}' is damaged")]
    Box(&'static str),
    /// Packets share bytes of the file.
    #[error("packets of its telemetry overlap")]
    Overlap,
    /// Memory ran out.
    #[error(transparent)]
    Memory(#[from] Refused),
}

/// Keys of the numbers that [`Packet::marks`] holds: samples to date, clock in us, clock in ms,
/// temperature in degC, kind of fix, time of the fix.
pub const MARKS: [&[u8; 4]; 5] = [b"TSMP", b"STMP", b"TICK", b"TMPC", b"GPSF"];

/// Part of a stream that one packet holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Packet {
    /// Index of its first sample in the stream.
    pub begin: usize,
    /// Start and duration of the packet in the video, s.
    pub span: [f64; 2],
    /// One number for each of [`MARKS`], NaN if absent.
    pub marks: [f64; MARKS.len()],
}

/// Samples of one sensor.
#[derive(Debug, Clone, Default)]
pub struct Stream {
    /// Key of its data, such as `GYRO`.
    pub key: [u8; 4],
    /// Description, in Latin-1.
    pub name: Vec<u8>,
    /// Unit, in Latin-1.
    pub unit: Vec<u8>,
    /// Axis of each channel; a lower-case letter is the negative axis. Empty if not given.
    pub axes: Vec<u8>,
    /// Values of a sample.
    pub width: usize,
    /// Values of all samples, scaled.
    pub values: Vec<f64>,
    /// Packets in the order of the track.
    pub packets: Vec<Packet>,
    device: f64,
}

/// Telemetry of a video.
#[derive(Debug, Clone, Default)]
pub struct Telemetry {
    /// Model of the camera, in Latin-1; empty if not given.
    pub camera: Vec<u8>,
    /// Requested streams, in the order in which they begin.
    pub streams: Vec<Stream>,
    /// Names of the other streams, in Latin-1.
    pub others: Vec<Vec<u8>>,
    /// Number of packets, and the number of damaged packets, which are left out.
    pub packets: [usize; 2],
}

impl Telemetry {
    /// Reads the streams with the keys in `wanted` from the bytes of an MP4 file.
    ///
    /// # Errors
    /// [`Fault`] if there is no telemetry, or the index of its packets is damaged.
    pub fn read(raw: &[u8], wanted: &[[u8; 4]]) -> Result<Self, Fault> {
        let movie = find(raw, &[b"moov"]).ok_or(Fault::Absent)?;
        let track = boxes(movie)
            .filter(|(kind, _)| kind == b"trak")
            .find_map(|(_, body)| Track::of(body))
            .ok_or(Fault::Absent)??;
        let mut telemetry =
            Self { camera: model(raw, movie).unwrap_or_default(), ..Self::default() };
        for (payload, span) in track.packets(raw)? {
            work::pause();
            telemetry.packets[0] += 1;
            let streams = payload.and_then(|payload| streams(payload, wanted));
            match streams {
                Some(streams) => telemetry.add(streams, span)?,
                None => telemetry.packets[1] += 1,
            }
        }
        Ok(telemetry)
    }

    fn add(&mut self, parts: Vec<Part>, span: [f64; 2]) -> Result<(), Fault> {
        for Part { stream: part, marks, wanted } in parts {
            if !wanted {
                if self.others.len() < MAX_OTHERS && !self.others.contains(&part.name) {
                    self.others.push(part.name);
                }
                continue;
            }
            let same = |known: &Stream| {
                (known.key, known.device, known.width) == (part.key, part.device, part.width)
            };
            let known = self.streams.iter().position(same);
            let index = known.unwrap_or(self.streams.len());
            if known.is_none() {
                self.streams.push(Stream { values: vec![], ..part.clone() });
            }
            let stream = &mut self.streams[index];
            let begin = stream.values.len() / stream.width;
            stream.packets.push(Packet { begin, span, marks });
            memory::reserve(&mut stream.values, part.values.len())?;
            stream.values.extend_from_slice(&part.values);
        }
        Ok(())
    }
}

/// Names of other streams that are kept.
const MAX_OTHERS: usize = 64;

/// Bytes in front of the pictures in which old cameras state their model.
const MODEL_BYTES: usize = 512;

/// Depth of entries in entries.
const MAX_DEPTH: usize = 4;

/// One stream of a packet.
struct Part {
    stream: Stream,
    marks: [f64; MARKS.len()],
    wanted: bool,
}

/// Streams of a packet; nothing if an entry is damaged.
fn streams(payload: &[u8], wanted: &[[u8; 4]]) -> Option<Vec<Part>> {
    let mut parts = Vec::new();
    for device in entries(payload) {
        let device = device?;
        if &device.key != b"DEVC" {
            continue;
        }
        let mut id = 0.0;
        for entry in entries(device.data) {
            let entry = entry?;
            match &entry.key {
                b"DVID" => id = *entry.numbers(&[])?.first()?,
                b"STRM" => parts.extend(part(entry.data, id, wanted)?),
                _ => {}
            }
        }
    }
    Some(parts)
}

/// The stream of an entry, `Some(None)` if it has no data; nothing if it is damaged.
fn part(raw: &[u8], device: f64, wanted: &[[u8; 4]]) -> Option<Option<Part>> {
    let mut stream = Stream { device, ..Stream::default() };
    let mut marks = [f64::NAN; MARKS.len()];
    let (mut types, mut scales) = (&[][..], vec![]);
    let mut data = None;
    for entry in entries(raw) {
        let entry = entry?;
        match &entry.key {
            b"STNM" => stream.name = entry.text(),
            b"SIUN" | b"UNIT" => stream.unit = entry.text(),
            b"ORIN" => stream.axes = entry.text(),
            b"TYPE" => types = entry.data,
            b"SCAL" => scales = entry.numbers(&[])?,
            key => {
                if let Some(mark) = MARKS.iter().position(|mark| *mark == key) {
                    marks[mark] = entry.numbers(&[])?.first().copied().unwrap_or(f64::NAN);
                }
                data = Some(entry);
            }
        }
    }
    let Some(entry) = data else { return Some(None) };
    stream.key = entry.key;
    if stream.name.is_empty() {
        stream.name = entry.key.to_vec();
    }
    let wanted = wanted.contains(&entry.key);
    if wanted {
        stream.values = entry.numbers(types)?;
        stream.width = stream.values.len().checked_div(entry.count).unwrap_or(0);
        if stream.width == 0 {
            return Some(None);
        }
        for (index, value) in stream.values.iter_mut().enumerate() {
            let scale = match scales.len() {
                1 => scales[0],
                _ => scales.get(index % stream.width).copied().unwrap_or(1.0),
            };
            *value /= if scale == 0.0 { 1.0 } else { scale };
        }
    }
    Some(Some(Part { stream, marks, wanted }))
}

/// Key, type and values of an entry.
struct Entry<'a> {
    key: [u8; 4],
    kind: u8,
    size: usize,
    count: usize,
    data: &'a [u8],
}

impl Entry<'_> {
    fn text(&self) -> Vec<u8> {
        let end = self.data.iter().position(|byte| *byte == 0).unwrap_or(self.data.len());
        self.data[..end].to_vec()
    }

    /// All values; `types` has the types of the values of a sample whose own type is `?`.
    fn numbers(&self, types: &[u8]) -> Option<Vec<f64>> {
        let own = [self.kind];
        let types = if self.kind == b'?' { types } else { &own[..] };
        let width = types.iter().map(|kind| number_size(*kind)).sum::<Option<usize>>()?;
        let samples = if self.kind == b'?' { self.count } else { self.data.len() / width.max(1) };
        let mut values = memory::room(samples.checked_mul(types.len())?).ok()?;
        if width == 0 || (self.kind == b'?' && self.size != width) {
            return None;
        }
        for sample in self.data.chunks_exact(width) {
            let mut rest = sample;
            for kind in types {
                let (value, after) = rest.split_at(number_size(*kind)?);
                values.push(number(*kind, value)?);
                rest = after;
            }
        }
        Some(values)
    }
}

/// Bytes of a number; nothing for a type that is no number.
fn number_size(kind: u8) -> Option<usize> {
    Some(match kind {
        b'b' | b'B' => 1,
        b's' | b'S' => 2,
        b'l' | b'L' | b'f' | b'q' | b'F' => 4,
        b'd' | b'j' | b'J' | b'Q' => 8,
        _ => return None,
    })
}

/// A number in the byte order of the format, the most significant byte first.
fn number(kind: u8, raw: &[u8]) -> Option<f64> {
    let bits = raw.iter().fold(0_u64, |bits, byte| bits << 8 | u64::from(*byte));
    let unused = 64_u32.checked_sub(8 * u32::try_from(raw.len()).ok()?)?;
    let signed = ((bits << unused) as i64 >> unused) as f64;
    Some(match kind {
        b'b' | b's' | b'l' | b'j' => signed,
        b'f' => f64::from(f32::from_bits(bits as u32)),
        b'd' => f64::from_bits(bits),
        b'q' => signed / f64::from(1_u32 << 16),
        b'Q' => signed / (1_u64 << 32) as f64,
        _ => bits as f64,
    })
}

/// The entries of some bytes; `None` in place of a damaged one, after which there are no more.
fn entries(raw: &[u8]) -> impl Iterator<Item = Option<Entry<'_>>> {
    let mut rest = raw;
    core::iter::from_fn(move || {
        // Zeros fill a packet up.
        if rest.iter().take(4).all(|byte| *byte == 0) {
            return None;
        }
        let entry = entry(rest);
        rest = entry.as_ref().map_or(&[], |(_, after)| after);
        Some(entry.map(|(entry, _)| entry))
    })
}

/// The first entry of some bytes, and the bytes after it.
fn entry(raw: &[u8]) -> Option<(Entry<'_>, &[u8])> {
    let (head, body) = raw.split_first_chunk::<8>()?;
    let [a, b, c, d, kind, size, high, low] = *head;
    let (size, count) = (usize::from(size), usize::from(u16::from_be_bytes([high, low])));
    let length = size * count;
    let data = body.get(..length)?;
    let after = body.get(length.next_multiple_of(4)..).unwrap_or_default();
    Some((Entry { key: [a, b, c, d], kind, size, count, data }, after))
}

/// The model of the camera, from the telemetry in the description of the movie; old models have
/// it in front of the pictures.
fn model(raw: &[u8], movie: &[u8]) -> Option<Vec<u8>> {
    fn search(raw: &[u8], depth: usize) -> Option<Vec<u8>> {
        entries(raw).map_while(|entry| entry).find_map(|entry| match (&entry.key, entry.kind) {
            (b"MINF", _) => Some(entry.text()),
            (_, 0) if depth < MAX_DEPTH => search(entry.data, depth + 1),
            _ => None,
        })
    }
    let described = find(movie, &[b"udta", b"GPMF"]).and_then(|telemetry| search(telemetry, 0));
    described.or_else(|| {
        let head = find(raw, &[b"mdat"])?.get(..MODEL_BYTES)?.strip_prefix(b"GPRO")?;
        let at = head.windows(4).position(|word| word == b"HERO")?;
        head[at..].split(|byte| *byte == 0).next().map(<[u8]>::to_vec)
    })
}

/// Kinds and contents of the boxes in some bytes, up to the first damaged one.
fn boxes(raw: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    let mut rest = raw;
    core::iter::from_fn(move || {
        let (size, kind) = (number_at(rest, 0, 4)?, *rest.get(4..)?.first_chunk()?);
        let (head, size) = match size {
            0 => (8, rest.len()),
            1 => (16, usize::try_from(number_at(rest, 8, 8)?).ok()?),
            size => (8, usize::try_from(size).ok()?),
        };
        let body = rest.get(head..size.min(rest.len()))?;
        rest = rest.get(size..).unwrap_or_default();
        Some((kind, body))
    })
}

/// The content of a box in boxes.
fn find<'a>(raw: &'a [u8], path: &[&[u8; 4]]) -> Option<&'a [u8]> {
    path.iter().try_fold(raw, |raw, wanted| {
        boxes(raw).find(|(kind, _)| kind == *wanted).map(|(_, body)| body)
    })
}

/// An unsigned number of so many bytes at an offset.
fn number_at(raw: &[u8], at: usize, bytes: usize) -> Option<u64> {
    let bytes = raw.get(at..at.checked_add(bytes)?)?;
    Some(bytes.iter().fold(0, |bits, byte| bits << 8 | u64::from(*byte)))
}

/// Index of the packets of telemetry.
struct Track<'a> {
    /// Ticks of a second.
    timescale: u64,
    /// Counts of packets and their durations, in ticks.
    durations: &'a [u8],
    /// First chunk, and packets of a chunk from there on.
    chunks: &'a [u8],
    /// Bytes of all packets, or zero and the bytes of each.
    sizes: &'a [u8],
    /// Offsets of the chunks, and the bytes of an offset.
    offsets: (&'a [u8], usize),
}

type Payload<'a> = (Option<&'a [u8]>, [f64; 2]);

impl<'a> Track<'a> {
    /// The index of a track; nothing for a track of another kind.
    fn of(track: &'a [u8]) -> Option<Result<Self, Fault>> {
        let media = find(track, &[b"mdia"])?;
        let table = find(media, &[b"minf", b"stbl"])?;
        let kind = find(table, &[b"stsd"])?.get(12..16)?;
        (kind == b"gpmd").then(|| Self::index(media, table))
    }

    fn index(media: &'a [u8], table: &'a [u8]) -> Result<Self, Fault> {
        let of = |kind: &'static [u8; 4], name| find(table, &[kind]).ok_or(Fault::Box(name));
        let head = find(media, &[b"mdhd"]).ok_or(Fault::Box("mdhd"))?;
        let at = if head.first() == Some(&1) { 20 } else { 12 };
        let timescale = number_at(head, at, 4).filter(|n| *n > 0).ok_or(Fault::Box("mdhd"))?;
        let offsets = match of(b"stco", "stco") {
            Ok(offsets) => (offsets, 4),
            Err(_) => (of(b"co64", "stco")?, 8),
        };
        let (durations, chunks) = (of(b"stts", "stts")?, of(b"stsc", "stsc")?);
        Ok(Self { timescale, durations, chunks, sizes: of(b"stsz", "stsz")?, offsets })
    }

    /// The packets in the order of the track; no bytes for one outside the file.
    fn packets(&self, raw: &'a [u8]) -> Result<Vec<Payload<'a>>, Fault> {
        let (offsets, width) = self.offsets;
        let damaged = Fault::Box;
        let count = number_at(self.sizes, 8, 4).ok_or(damaged("stsz"))?;
        let common = number_at(self.sizes, 4, 4).ok_or(damaged("stsz"))?;
        let mut packets = Vec::new();
        let (mut bytes, mut ticks) = (0_usize, Durations::new(self.durations));
        let mut runs = self.chunks.get(8..).unwrap_or_default().chunks_exact(12).peekable();
        let mut packets_of_chunk = 0;
        for chunk in 0..(offsets.len().saturating_sub(8) / width) {
            let begins = |run: &&[u8]| number_at(run, 0, 4) <= Some(chunk as u64 + 1);
            while let Some(run) = runs.next_if(begins) {
                packets_of_chunk = number_at(run, 4, 4).unwrap_or(0);
            }
            let mut offset = number_at(offsets, 8 + width * chunk, width).ok_or(damaged("stco"))?;
            for _ in 0..packets_of_chunk {
                if packets.len() as u64 >= count {
                    return Ok(packets);
                }
                let size = match common {
                    0 => number_at(self.sizes, 12 + 4 * packets.len(), 4).ok_or(damaged("stsz"))?,
                    size => size,
                };
                let payload = || {
                    let begin = usize::try_from(offset).ok()?;
                    raw.get(begin..begin.checked_add(usize::try_from(size).ok()?)?)
                };
                let payload = payload();
                bytes = bytes.saturating_add(payload.map_or(8, <[u8]>::len).max(8));
                if bytes > raw.len() {
                    return Err(Fault::Overlap);
                }
                let span = ticks.next_span(self.timescale);
                memory::reserve(&mut packets, 1)?;
                packets.push((payload, span));
                offset = offset.saturating_add(size);
            }
        }
        Ok(packets)
    }
}

/// Durations of packets, from runs of equal ones.
struct Durations<'a> {
    runs: core::slice::ChunksExact<'a, u8>,
    left: u64,
    ticks: u64,
    at: u64,
}

impl<'a> Durations<'a> {
    fn new(raw: &'a [u8]) -> Self {
        let runs = raw.get(8..).unwrap_or_default().chunks_exact(8);
        Self { runs, left: 0, ticks: 0, at: 0 }
    }

    /// Start and duration of the next packet, s; the last run goes on if there is no other.
    fn next_span(&mut self, timescale: u64) -> [f64; 2] {
        while self.left == 0 {
            let Some(run) = self.runs.next() else { break };
            self.left = number_at(run, 0, 4).unwrap_or(0);
            self.ticks = number_at(run, 4, 4).unwrap_or(0);
        }
        self.left = self.left.saturating_sub(1);
        let span = [self.at, self.ticks].map(|ticks| ticks as f64 / timescale as f64);
        self.at = self.at.saturating_add(self.ticks);
        span
    }
}

#[cfg(test)]
mod tests {
    use super::{Fault, Telemetry};
    use proptest::prelude::*;

    fn entry(key: &[u8; 4], kind: u8, size: u8, data: &[u8]) -> Vec<u8> {
        let count = (data.len() / usize::from(size)) as u16;
        let fill = vec![0; data.len().next_multiple_of(4) - data.len()];
        [key, &[kind, size][..], &count.to_be_bytes(), data, &fill].concat()
    }

    fn cell(kind: &[u8; 4], parts: &[&[u8]]) -> Vec<u8> {
        let body = parts.concat();
        [&(8 + body.len() as u32).to_be_bytes()[..], kind, &body].concat()
    }

    fn numbers(values: &[u32]) -> Vec<u8> {
        values.iter().flat_map(|value| value.to_be_bytes()).collect()
    }

    /// Samples of a gyro, after two other entries.
    fn packet(samples: &[[i16; 3]], total: u32) -> Vec<u8> {
        let raw: Vec<u8> = samples.as_flattened().iter().flat_map(|n| n.to_be_bytes()).collect();
        let stream = [
            entry(b"TSMP", b'L', 4, &numbers(&[total])),
            entry(b"STNM", b'c', 1, b"Gyroscope"),
            entry(b"SIUN", b'c', 5, b"rad/s"),
            entry(b"SCAL", b's', 2, &4_i16.to_be_bytes()),
            entry(b"ORIN", b'c', 1, b"ZxY"),
            entry(b"GYRO", b's', 6, &raw),
        ];
        let other = entry(b"SHUT", b'f', 4, &numbers(&[0]));
        let streams = [entry(b"STRM", 0, 1, &stream.concat()), entry(b"STRM", 0, 1, &other)];
        entry(b"DEVC", 0, 1, &[entry(b"DVID", b'L', 4, &numbers(&[1])), streams.concat()].concat())
    }

    /// A video of two packets, of half a second and a quarter, with two chunks.
    fn file() -> Vec<u8> {
        let packets = [packet(&[[4, -8, 12]; 2], 2), packet(&[[1, 2, 3]], 3)];
        let begin = 16_u32;
        let sizes = packets.each_ref().map(|packet| packet.len() as u32);
        let tables = [
            cell(b"stsd", &[&numbers(&[0, 1, 16]), b"gpmd"]),
            cell(b"stts", &[&numbers(&[0, 2, 1, 500, 1, 250])]),
            cell(b"stsc", &[&numbers(&[0, 1, 1, 1, 1])]),
            cell(b"stsz", &[&numbers(&[0, 0, 2, sizes[0], sizes[1]])]),
            cell(b"stco", &[&numbers(&[0, 2, begin, begin + sizes[0]])]),
        ];
        let media = [
            cell(b"mdhd", &[&numbers(&[0, 0, 0, 1000, 750])]),
            cell(b"minf", &[&cell(b"stbl", &[&tables.concat()])]),
        ];
        let track = cell(b"trak", &[&cell(b"mdia", &[&media.concat()])]);
        let about = cell(b"udta", &[&cell(b"GPMF", &[&entry(b"MINF", b'c', 1, b"HERO")])]);
        [cell(b"ftyp", &[]), cell(b"mdat", &[&packets.concat()]), cell(b"moov", &[&track, &about])]
            .concat()
    }

    #[test]
    fn packets_of_a_stream_follow_one_another() {
        let telemetry = Telemetry::read(&file(), &[*b"GYRO"]).expect("it is whole");
        assert_eq!((&telemetry.camera[..], telemetry.packets), (&b"HERO"[..], [2, 0]));
        assert_eq!(telemetry.others, [b"SHUT"]);
        let [gyro] = &telemetry.streams[..] else { panic!("one stream") };
        assert_eq!((gyro.width, &gyro.axes[..], &gyro.unit[..]), (3, &b"ZxY"[..], &b"rad/s"[..]));
        assert_eq!(gyro.values, [1.0, -2.0, 3.0, 1.0, -2.0, 3.0, 0.25, 0.5, 0.75]);
        let spans: Vec<_> = gyro.packets.iter().map(|p| (p.begin, p.span, p.marks[0])).collect();
        assert_eq!(spans, [(0, [0.0, 0.5], 2.0), (2, [0.5, 0.25], 3.0)]);
    }

    #[test]
    fn a_video_without_telemetry_is_refused() {
        let fault = Telemetry::read(&cell(b"moov", &[]), &[]).expect_err("it has none");
        assert_eq!(fault, Fault::Absent);
        let raw = file();
        let cut = Telemetry::read(&raw[..raw.len() / 2], &[*b"GYRO"]);
        assert_eq!(cut.expect_err("it has no index"), Fault::Absent);
    }

    proptest! {
        #[test]
        fn any_bytes_are_telemetry_or_refused(
            changes in proptest::collection::vec((0..2000_usize, any::<u8>()), 0..8),
            length in 0..2000_usize,
        ) {
            let mut raw = file();
            let count = raw.len();
            for (at, byte) in changes {
                raw[at % count] = byte;
            }
            let part = &raw[..count.min(count / 2 + length)];
            if let Ok(telemetry) = Telemetry::read(part, &[*b"GYRO", *b"SHUT"]) {
                for stream in telemetry.streams {
                    let samples = stream.values.len() / stream.width;
                    prop_assert!(stream.packets.iter().all(|packet| packet.begin <= samples));
                }
            }
        }
    }
}
