//! Blackbox logs of flight controllers: Betaflight, INAV and others with version 2 of the format.
//!
//! A log begins with lines of text, the headers, which declare the fields of its frames. A frame
//! is one letter and the encoded fields. An intra frame `I` holds whole values; an inter frame `P`
//! holds differences from values that the frames before predict. Frames have no checksum: a frame
//! is valid if another one, or the end, follows it. After a damaged frame the predictions are
//! wrong, so inter frames are left out up to the next intra frame.
//! See <https://betaflight.com/docs/development/Blackbox-Internals>.

use crate::error::Error;
use crate::{memory, work};

/// First line of each log.
pub const MARK: &[u8] = b"H Product:Blackbox";

/// Steps of the clock that no logger makes, us.
const MAX_STEP_US: i64 = 10_000_000;

/// Frames between two looks at whether the work is to end.
const FRAMES_PER_CHECK: usize = 1 << 14;

/// Fields of one kind of frames, encoded and predicted.
#[derive(Debug, Clone, Default)]
struct Fields {
    names: Vec<String>,
    signed: Vec<bool>,
    predictors: Vec<u8>,
    encodings: Vec<u8>,
}

impl Fields {
    fn is_complete(&self) -> bool {
        let count = self.encodings.len();
        count > 0 && count == self.predictors.len()
    }
}

/// One log of a file: from arming to disarming.
#[derive(Debug, Clone, Default)]
pub struct Log {
    /// Keys and values of the headers.
    pub headers: Vec<(String, String)>,
    /// Names of the requested fields; the clock is the first.
    pub names: Vec<String>,
    /// Values of each requested field; the clock, us, does not wrap.
    pub columns: Vec<Vec<i64>>,
    /// Damaged bytes, and inter frames left out after them.
    pub lost: usize,
    /// Bytes of the log after its headers.
    pub bytes: usize,
}

impl Log {
    /// Reads the logs in the bytes of a file, with the clock and the fields that `wanted` accepts.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory for the values.
    pub fn all(raw: &[u8], wanted: impl Fn(&str) -> bool) -> Result<Vec<Self>, Error> {
        let begins: Vec<usize> = raw
            .split_inclusive(|byte| *byte == b'\n')
            .scan(0, |at, line| {
                let begin = *at;
                *at += line.len();
                // The log before may end within a line.
                Some(find(line, MARK).map(|inside| begin + inside))
            })
            .flatten()
            .collect();
        let ends = begins.iter().skip(1).copied().chain([raw.len()]);
        begins.iter().zip(ends).map(|(begin, end)| Self::of(&raw[*begin..end], &wanted)).collect()
    }

    fn of(raw: &[u8], wanted: &impl Fn(&str) -> bool) -> Result<Self, Error> {
        let (headers, body) = split_headers(raw);
        let mut log = Self { headers, bytes: raw.len() - body, ..Self::default() };
        if let Some(mut decoder) = Decoder::new(&log, &raw[body..], wanted) {
            log.names = decoder.wanted.iter().map(|at| decoder.intra.names[*at].clone()).collect();
            log.columns = vec![Vec::new(); log.names.len()];
            decoder.run(&mut log)?;
        }
        Ok(log)
    }

    /// The value of a header.
    #[must_use]
    pub fn header(&self, key: &str) -> Option<&str> {
        self.headers.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }

    fn fields(&self, frame: char) -> Fields {
        let list = |what: &str| {
            let text = self.header(&format!("Field {frame} {what}")).unwrap_or_default();
            text.split(',').map(str::trim).filter(|cell| !cell.is_empty())
        };
        let numbers = |what| list(what).map(|cell| cell.parse().unwrap_or(u8::MAX)).collect();
        Fields {
            names: list("name").map(str::to_owned).collect(),
            signed: list("signed").map(|cell| cell == "1").collect(),
            predictors: numbers("predictor"),
            encodings: numbers("encoding"),
        }
    }
}

/// Keys and values of the header lines, and where the frames begin.
fn split_headers(raw: &[u8]) -> (Vec<(String, String)>, usize) {
    let mut headers = Vec::new();
    let mut at = 0;
    while raw[at..].starts_with(b"H ") {
        let line = raw[at..].split(|byte| *byte == b'\n').next().unwrap_or_default();
        let Some(colon) = line.iter().position(|byte| *byte == b':') else { break };
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
        headers.push((text(&line[2..colon.max(2)]), text(&line[colon + 1..])));
        at = (at + line.len() + 1).min(raw.len());
    }
    (headers, at)
}

fn find(line: &[u8], mark: &[u8]) -> Option<usize> {
    line.windows(mark.len()).position(|window| window == mark)
}

/// Values that headers give to predictors.
struct Constants {
    min_throttle: i64,
    min_motor: i64,
    voltage: i64,
}

/// State of the decoding of the frames of one log.
struct Decoder<'a> {
    raw: &'a [u8],
    at: usize,
    intra: Fields,
    inter: Fields,
    others: [(u8, Fields); 3],
    constants: Constants,
    motor: Option<usize>,
    time: usize,
    /// Indices of the requested fields.
    wanted: Vec<usize>,
    /// The last two main frames; none after damage.
    last: Option<[Vec<i64>; 2]>,
    /// Time of the last valid frame, unwrapped, us.
    now: Option<i64>,
    /// True if the logger paused after that frame.
    paused: bool,
    /// Time of an intra frame that did not go on from the last valid frame, us.
    rejected: Option<i64>,
    values: Vec<i64>,
}

/// Content of a frame.
enum Frame {
    Main {
        intra: bool,
    },
    Other,
    /// An inter frame whose predictions are missing.
    Unpredicted,
    Resume,
    End,
}

impl<'a> Decoder<'a> {
    /// A decoder, if the headers declare main frames with a clock.
    fn new(log: &Log, raw: &'a [u8], wanted: &impl Fn(&str) -> bool) -> Option<Self> {
        let intra = log.fields('I');
        let inter = Fields { names: vec![], signed: intra.signed.clone(), ..log.fields('P') };
        let time = intra.names.iter().position(|name| name == "time")?;
        let count = intra.encodings.len();
        let same = [intra.names.len(), intra.signed.len(), inter.encodings.len()];
        if !intra.is_complete() || !inter.is_complete() || same.iter().any(|own| *own != count) {
            return None;
        }
        let integer = |key| log.header(key).and_then(|text| text.split(',').next()?.parse().ok());
        let constants = Constants {
            min_throttle: integer("minthrottle").unwrap_or(0),
            min_motor: integer("motorOutput").unwrap_or(0),
            voltage: integer("vbatref").unwrap_or(0),
        };
        let asked = |at: &usize| *at != time && wanted(&intra.names[*at]);
        let wanted = std::iter::once(time).chain((0..count).filter(asked)).collect();
        let others = ['S', 'G', 'H'].map(|frame| (frame as u8, log.fields(frame)));
        let motor = intra.names.iter().position(|name| name == "motor[0]");
        let (last, now, rejected, values) = (None, None, None, Vec::new());
        Some(Self {
            raw,
            at: 0,
            intra,
            inter,
            others,
            constants,
            motor,
            time,
            wanted,
            last,
            now,
            paused: false,
            rejected,
            values,
        })
    }

    fn run(&mut self, log: &mut Log) -> Result<(), Error> {
        let mut count = 0_usize;
        while self.at < self.raw.len() {
            if count.is_multiple_of(FRAMES_PER_CHECK) {
                work::pause();
            }
            count += 1;
            let begin = self.at;
            let frame = self.frame().filter(|_| self.is_followed());
            match frame {
                Some(Frame::Main { intra }) if self.goes_on(intra) => self.keep(log, intra)?,
                Some(Frame::Other) => {}
                Some(Frame::Resume) => self.paused = true,
                Some(Frame::End) => return Ok(()),
                Some(Frame::Unpredicted) => log.lost += self.at - begin,
                Some(Frame::Main { .. }) | None => {
                    self.last = None;
                    self.at = begin + 1;
                    let rest = &self.raw[self.at..];
                    self.at += rest.iter().position(|b| is_frame(*b)).unwrap_or(rest.len());
                    log.lost += self.at - begin;
                }
            }
        }
        Ok(())
    }

    /// True if the bytes go on with a frame, or end.
    fn is_followed(&self) -> bool {
        self.raw.get(self.at).is_none_or(|byte| is_frame(*byte))
    }

    /// Reads a frame; nothing if it is damaged.
    fn frame(&mut self) -> Option<Frame> {
        match self.byte()? {
            b'I' => {
                self.decode(true)?;
                Some(Frame::Main { intra: true })
            }
            b'P' => {
                let predicted = self.last.is_some();
                self.decode(false)?;
                Some(if predicted { Frame::Main { intra: false } } else { Frame::Unpredicted })
            }
            b'E' => self.event(),
            kind => {
                let at = self.others.iter().position(|(own, _)| *own == kind)?;
                let encodings = self.others[at].1.encodings.clone();
                (!encodings.is_empty()).then_some(())?;
                self.encoded(&encodings)?;
                Some(Frame::Other)
            }
        }
    }

    /// Reads an event, of which only the end and a pause matter.
    fn event(&mut self) -> Option<Frame> {
        match self.byte()? {
            // A beep, disarming, a failure of the IMU.
            0 | 15 | 40 => self.unsigned().map(drop),
            // A setting changed in flight.
            13 => match self.byte()? {
                0..128 => self.unsigned().map(drop),
                128.. => self.take(4).map(drop),
            },
            20 => self.byte().and(self.unsigned()).and(self.take(2)).map(drop),
            30 => self.unsigned().and(self.unsigned()).map(drop),
            14 => {
                self.unsigned().and(self.unsigned())?;
                return Some(Frame::Resume);
            }
            255 => return (self.take(11)? == b"End of log\0").then_some(Frame::End),
            _ => None,
        }?;
        Some(Frame::Other)
    }

    /// Decodes and predicts the fields of a main frame.
    fn decode(&mut self, intra: bool) -> Option<()> {
        let encodings = std::mem::take(if intra {
            &mut self.intra.encodings
        } else {
            &mut self.inter.encodings
        });
        let encoded = self.encoded(&encodings);
        let fields = if intra { &mut self.intra } else { &mut self.inter };
        fields.encodings = encodings;
        encoded?;
        for field in 0..self.values.len() {
            let prediction = self.prediction(intra, field)?;
            let value = self.values[field].wrapping_add(prediction);
            let signed = self.intra.signed[field];
            self.values[field] =
                if signed { i64::from(value as i32) } else { i64::from(value as u32) };
        }
        Some(())
    }

    fn prediction(&self, intra: bool, field: usize) -> Option<i64> {
        let fields = if intra { &self.intra } else { &self.inter };
        let [last, before] = match &self.last {
            Some([last, before]) => [last[field], before[field]],
            None => [0, 0],
        };
        Some(match fields.predictors[field] {
            0 | 10 => 0,
            1 => last,
            2 => 2 * last - before,
            3 => (last + before) / 2,
            4 => self.constants.min_throttle,
            5 => *self.motor.filter(|motor| *motor < field).and_then(|at| self.values.get(at))?,
            6 => last + 1,
            8 => 1500,
            9 => self.constants.voltage,
            11 => self.constants.min_motor,
            _ => return None,
        })
    }

    /// True if the clock of the decoded frame goes on from the last valid frame. An intra frame
    /// need only go on from another intra frame, which was rejected.
    fn goes_on(&mut self, intra: bool) -> bool {
        let follows = |step: i64| (1..MAX_STEP_US).contains(&step);
        let valid = self.now.is_none_or(|now| match self.paused {
            true => self.step(now) > 0,
            false => follows(self.step(now)),
        });
        let again = intra && self.rejected.is_some_and(|time| follows(self.step(time)));
        if intra && !valid && !again {
            self.rejected = Some(self.values[self.time]);
        }
        valid || again
    }

    /// Step of the 32-bit clock since a time.
    fn step(&self, time: i64) -> i64 {
        i64::from((self.values[self.time] as u32).wrapping_sub(time as u32) as i32)
    }

    /// Keeps the requested fields, and the frame for the next predictions.
    fn keep(&mut self, log: &mut Log, intra: bool) -> Result<(), Error> {
        let now = self.now.map_or(self.values[self.time], |now| now + self.step(now));
        (self.now, self.paused, self.rejected) = (Some(now), false, None);
        for (column, at) in log.columns.iter_mut().zip(&self.wanted) {
            memory::reserve(column, 1)?;
            column.push(if *at == self.time { now } else { self.values[*at] });
        }
        let [last, mut oldest] = self.last.take().unwrap_or_default();
        std::mem::swap(&mut oldest, &mut self.values);
        let newest = oldest;
        let before = if intra { newest.clone() } else { last };
        self.last = Some([newest, before]);
        Ok(())
    }

    fn byte(&mut self) -> Option<u8> {
        let byte = *self.raw.get(self.at)?;
        self.at += 1;
        Some(byte)
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let taken = self.raw.get(self.at..self.at.checked_add(count)?)?;
        self.at += count;
        Some(taken)
    }

    /// A number in groups of seven bits, the least significant first.
    fn unsigned(&mut self) -> Option<u32> {
        let mut value = 0_u32;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f).checked_shl(shift).unwrap_or(0);
            if byte < 128 {
                return Some(value);
            }
        }
        None
    }

    /// A signed number, whose sign is the lowest bit.
    fn signed(&mut self) -> Option<i64> {
        let value = self.unsigned()?;
        Some(i64::from((value >> 1) as i32 ^ -((value & 1) as i32)))
    }

    /// Reads the encoded fields of a frame into `values`.
    fn encoded(&mut self, encodings: &[u8]) -> Option<()> {
        self.values.clear();
        while self.values.len() < encodings.len() {
            let at = self.values.len();
            let left = encodings.len() - at;
            let run = encodings[at..].iter().take_while(|own| **own == encodings[at]).count();
            match encodings[at] {
                0 => {
                    let value = self.signed()?;
                    self.values.push(value);
                }
                1 => {
                    let value = self.unsigned()?;
                    self.values.push(value.into());
                }
                3 => {
                    let value = self.unsigned()?;
                    self.values.push(-extend(value, 14));
                }
                6 => self.bytes_by_mask(run.min(8))?,
                7 => self.three(left, false)?,
                8 => self.four(left)?,
                9 => self.values.push(0),
                10 => self.three(left, true)?,
                _ => return None,
            }
        }
        Some(())
    }

    /// Up to eight fields: a mask of those that are not zero, then these; one field has no mask.
    fn bytes_by_mask(&mut self, run: usize) -> Option<()> {
        let mask = if run == 1 { 1 } else { self.byte()? };
        for bit in 0..run {
            let value = if mask >> bit & 1 == 1 { self.signed()? } else { 0 };
            self.values.push(value);
        }
        Some(())
    }

    /// Three fields of few bits each, or of one to four bytes each.
    fn three(&mut self, left: usize, variable: bool) -> Option<()> {
        let head = u32::from(self.byte()?);
        let widths = match (head >> 6, variable) {
            (0, _) => [2, 2, 2],
            (1, false) => [4, 4, 4],
            (2, false) => [6, 6, 6],
            (1, true) => [5, 5, 4],
            (2, true) => [8, 7, 7],
            _ => return self.three_of_bytes(head, left),
        };
        let mut bits = u64::from(head);
        let spaced = !variable && head >> 6 == 2;
        let bytes = match head >> 6 {
            0 => 0,
            1 => 1,
            _ => 2,
        };
        for _ in 0..bytes {
            bits = bits << 8 | u64::from(self.byte()?);
        }
        // Six bits stand in a byte each; all others follow one another.
        let mut shift = if spaced { 24 } else { widths.iter().sum() };
        for width in widths.into_iter().take(left) {
            shift -= if spaced { 8 } else { width };
            self.values.push(extend((bits >> shift) as u32, width));
        }
        Some(())
    }

    fn three_of_bytes(&mut self, head: u32, left: usize) -> Option<()> {
        for field in 0..3 {
            let count = (head >> (2 * field) & 3) as usize + 1;
            let bytes = self.take(count)?;
            let value = bytes.iter().rev().fold(0_u32, |value, byte| value << 8 | u32::from(*byte));
            if field < left {
                self.values.push(extend(value, 8 * count as u32));
            }
        }
        Some(())
    }

    /// Four fields of no, four, eight or sixteen bits, packed without gaps between them.
    fn four(&mut self, left: usize) -> Option<()> {
        let tags = self.byte()?;
        let (mut bits, mut available) = (0_u32, 0_u32);
        for field in 0..4 {
            let width = [0, 4, 8, 16][usize::from(tags >> (2 * field) & 3)];
            while available < width {
                bits = bits << 8 | u32::from(self.byte()?);
                available += 8;
            }
            available -= width;
            if field < left {
                let value = if width == 0 { 0 } else { extend(bits >> available, width) };
                self.values.push(value);
            }
        }
        Some(())
    }
}

/// The lowest bits of a number, with their sign.
fn extend(value: u32, bits: u32) -> i64 {
    let unused = 32 - bits;
    i64::from((value << unused) as i32 >> unused)
}

fn is_frame(byte: u8) -> bool {
    b"IPSGHE".contains(&byte)
}

#[cfg(test)]
mod tests {
    use super::Log;
    use proptest::prelude::*;

    const HEADERS: &str = "H Product:Blackbox flight data recorder by Nicholas Sherlock
H Data version:2
H Field I name:loopIteration,time,gyroADC[0],gyroADC[1],gyroADC[2],motor[0],motor[1]
H Field I signed:0,0,1,1,1,0,0
H Field I predictor:0,0,0,0,0,11,5
H Field I encoding:1,1,0,0,0,1,0
H Field P predictor:6,2,1,1,1,3,3
H Field P encoding:9,0,7,7,7,6,6
H Field S name:flightModeFlags
H Field S encoding:1
H motorOutput:158,2047
";

    /// An intra frame, two inter frames, a slow frame, the end; and the same log once more.
    fn file() -> Vec<u8> {
        let frames: [&[u8]; 5] = [
            // 1000 us; 3, -3, 64; 158 + 2, 160 - 1.
            &[b'I', 0, 0xe8, 0x07, 6, 5, 0x80, 0x01, 2, 1],
            // 2000 us: the clock is expected to stand still; gyro + 1, - 2, - 1.
            &[b'P', 0xd0, 0x0f, 0b01_10_11, 0b01, 4],
            &[b'S', 5],
            // 3001 us: one more than on a straight line; gyro + 7, - 8, + 1 in four bits.
            &[b'P', 2, 0x47, 0x81, 0],
            &[b'E', 255],
        ];
        let log = [HEADERS.as_bytes(), &frames.concat(), b"End of log\0"].concat();
        [log.clone(), log].concat()
    }

    fn read(raw: &[u8]) -> Vec<Log> {
        Log::all(raw, |name| !name.starts_with("loop")).expect("there is memory")
    }

    #[test]
    fn frames_are_predicted_and_differ() {
        let logs = read(&file());
        assert_eq!(logs.len(), 2);
        for log in &logs {
            assert_eq!(log.names[..2], ["time", "gyroADC[0]"]);
            assert_eq!(log.columns[0], [1000, 2000, 3001]);
            assert_eq!(log.columns[1], [3, 4, 11]);
            assert_eq!(log.columns[2], [-3, -5, -13]);
            assert_eq!(log.columns[3], [64, 63, 64]);
            // Of 160 and 159: the mean of two is 160 and 159; then 2 more.
            assert_eq!(log.columns[4], [160, 162, 161]);
            assert_eq!(log.columns[5], [159, 159, 159]);
            assert_eq!((log.lost, log.header("Data version")), (0, Some("2")));
        }
    }

    #[test]
    fn differences_from_damaged_frames_are_left_out() {
        let mut raw = file();
        let end = raw.len() / 2;
        let first = raw.windows(2).position(|pair| pair == [b'P', 0xd0]).expect("a frame");
        raw[first + 3] = 0xff;
        let logs = read(&raw[..end]);
        assert_eq!(logs[0].columns[0], [1000]);
        assert!(logs[0].lost > 0);
    }

    proptest! {
        #[test]
        fn any_bytes_are_decoded_or_left_out(
            changes in proptest::collection::vec((0..2000_usize, any::<u8>()), 0..8),
            length in 0..2000_usize,
        ) {
            let mut raw = file();
            let count = raw.len();
            for (at, byte) in changes {
                raw[at % count] = byte;
            }
            for log in read(&raw[..count.min(length.max(1))]) {
                for column in &log.columns {
                    prop_assert_eq!(column.len(), log.columns[0].len());
                }
                prop_assert!(log.lost <= log.bytes);
            }
        }
    }
}
