//! ArduPilot's binary logs: the declared messages, and the positions of their rows.
//!
//! A message begins with two constant bytes and its number. An earlier message, `FMT`, declares its
//! length and content, and describes itself in the same way. There are no checksums: a message is
//! valid if it is complete and followed by another message or the end.

use crate::work;

/// First bytes of every message, before its number.
const HEAD: [u8; 2] = [0xa3, 0x95];

/// Bytes before the fields of a message.
const START: usize = 3;

/// Number and length of the message that declares others.
const FMT: u8 = 128;
const FMT_LENGTH: usize = 89;

/// Largest number of declarations in a log: one per number, and some of other versions appended to
/// it.
const MAX_KINDS: usize = 1024;

/// Number of messages between two checks for a stop.
const MESSAGES_PER_CHECK: usize = 1 << 16;

/// A declared message type, with texts that end with zeros, and the positions of its rows.
#[derive(Debug, Clone)]
pub struct Kind {
    /// Number of the type.
    pub number: u8,
    /// Name of the type.
    pub name: [u8; 4],
    /// One letter per field.
    pub format: [u8; 16],
    /// Names of the fields, with commas between.
    pub columns: [u8; 64],
    /// Bytes of a message, with the three bytes before its fields.
    pub length: usize,
    /// Offsets of its messages, in the order of the log.
    pub offsets: Vec<u64>,
}

/// Valid messages of a log.
#[derive(Debug, Clone)]
pub struct Index {
    /// Message types in the order of declaration; `FMT` is the first.
    pub kinds: Vec<Kind>,
    /// Bytes that belong to no valid message.
    pub lost: usize,
    /// Bytes of a last message that the log cuts off.
    pub cut: usize,
}

impl Index {
    /// Finds the valid messages in the bytes of a log. Zeros or ones at its end are no damage.
    #[must_use]
    pub fn of(raw: &[u8]) -> Self {
        let mut walk = Walk::new(raw);
        walk.run();
        Self { kinds: walk.kinds, lost: walk.lost, cut: walk.cut }
    }
}

/// Bytes of a field with this letter; `None` for an unknown letter.
#[must_use]
pub fn width(letter: u8) -> Option<usize> {
    Some(match letter {
        b'b' | b'B' | b'M' => 1,
        b'h' | b'H' | b'c' | b'C' | b'g' => 2,
        b'i' | b'I' | b'f' | b'e' | b'E' | b'L' | b'n' => 4,
        b'd' | b'q' | b'Q' => 8,
        b'N' => 16,
        b'Z' | b'a' => 64,
        _ => return None,
    })
}

struct Walk<'a> {
    raw: &'a [u8],
    /// Position after which the log has only fill bytes.
    end: usize,
    kinds: Vec<Kind>,
    /// Type of each message number, and length of its messages; 0 for none.
    current: [usize; 256],
    lengths: [usize; 256],
    lost: usize,
    cut: usize,
}

impl<'a> Walk<'a> {
    fn new(raw: &'a [u8]) -> Self {
        let fill = raw.last().copied().filter(|byte| matches!(byte, 0x00 | 0xff));
        let end = fill.map_or(raw.len(), |fill| {
            raw.iter().rposition(|byte| *byte != fill).map_or(0, |last| last + 1)
        });
        let mut walk = Self {
            raw,
            end,
            kinds: Vec::new(),
            current: [0; 256],
            lengths: [0; 256],
            lost: 0,
            cut: 0,
        };
        let itself = Kind {
            number: FMT,
            name: *b"FMT\0",
            format: padded(b"BBnNZ"),
            columns: padded(b"Type,Length,Name,Format,Columns"),
            length: FMT_LENGTH,
            offsets: Vec::new(),
        };
        walk.add(itself);
        walk
    }

    fn run(&mut self) {
        let mut at = 0;
        while at < self.end {
            work::pause();
            for _ in 0..MESSAGES_PER_CHECK {
                match self.valid_message_end(at) {
                    Some(after) => {
                        self.take(at);
                        at = after;
                    }
                    None => at = self.behind_damage(at),
                }
                if at >= self.end {
                    break;
                }
            }
        }
    }

    /// End of a message that begins here, if it is complete.
    #[inline(always)]
    fn whole(&self, at: usize) -> Option<usize> {
        let [first, second, number] = *self.raw.get(at..)?.first_chunk::<START>()?;
        let length = self.lengths[usize::from(number)];
        let after = at + length;
        (first == HEAD[0] && second == HEAD[1] && length > 0 && after <= self.raw.len())
            .then_some(after)
    }

    /// End of a message that begins here, if another message or the end follows.
    #[inline(always)]
    fn valid_message_end(&self, at: usize) -> Option<usize> {
        let after = self.whole(at)?;
        let next = self.raw.get(after..after + HEAD.len());
        let followed = after >= self.end || next.is_none_or(|head| head == HEAD);
        followed.then_some(after)
    }

    fn take(&mut self, at: usize) {
        let number = usize::from(self.raw[at + HEAD.len()]);
        work::push(&mut self.kinds[self.current[number]].offsets, at as u64);
        if number == usize::from(FMT) {
            self.declare(at);
        }
    }

    fn declare(&mut self, at: usize) {
        let fields = &self.raw[at + START..at + FMT_LENGTH];
        let (head, columns) = fields.split_at(22);
        let kind = Kind {
            number: head[0],
            name: padded(&head[2..6]),
            format: padded(&head[6..]),
            columns: padded(columns),
            length: usize::from(head[1]),
            offsets: Vec::new(),
        };
        let known = self.lengths[usize::from(kind.number)] > 0;
        let before = &self.kinds[self.current[usize::from(kind.number)]];
        let same = known && before.length == kind.length && before.format == kind.format;
        if kind.number != FMT && kind.is_valid() && !same && self.kinds.len() < MAX_KINDS {
            self.add(kind);
        }
    }

    fn add(&mut self, kind: Kind) {
        let number = usize::from(kind.number);
        self.lengths[number] = kind.length;
        self.current[number] = self.kinds.len();
        work::push(&mut self.kinds, kind);
    }

    /// Offset of the next valid message after an offset without one.
    fn behind_damage(&mut self, at: usize) -> usize {
        let begins = self.raw[at..].starts_with(&HEAD);
        let mut from = at + 1;
        let next = loop {
            let rest = &self.raw[from..self.end.max(from)];
            let Some(there) = rest.iter().position(|byte| *byte == HEAD[0]) else {
                break self.end;
            };
            let there = from + there;
            let surely = self
                .valid_message_end(there)
                .is_some_and(|after| after >= self.end || self.whole(after).is_some());
            if surely {
                break there;
            }
            from = there + 1;
        };
        let number = self.raw.get(at + HEAD.len());
        let known = number.is_some_and(|number| self.lengths[usize::from(*number)] > 0);
        if next == self.end && begins && known && self.whole(at).is_none() {
            self.cut = next - at;
        } else {
            self.lost += next - at;
        }
        next
    }
}

impl Kind {
    /// True if a declaration is plausible: its known fields fill its messages.
    fn is_valid(&self) -> bool {
        let named = self.name[0].is_ascii_uppercase();
        let fields = self.format.split(|byte| *byte == 0).next().unwrap_or_default();
        let known: Option<usize> = fields.iter().map(|letter| width(*letter)).sum();
        let least = self.length > START && !fields.is_empty();
        named && least && known.is_none_or(|all| self.length == START + all)
    }
}

/// Bytes of a text, padded with zeros.
fn padded<const N: usize>(text: &[u8]) -> [u8; N] {
    let mut all = [0; N];
    for (to, from) in all.iter_mut().zip(text) {
        *to = *from;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::{FMT_LENGTH, HEAD, Index, Kind, START, width};
    use proptest::prelude::*;

    const ROW: usize = START + 8 + 4;

    fn declared(number: u8, name: &str, format: &str, columns: &str) -> Vec<u8> {
        let fields: usize = format.bytes().filter_map(width).sum();
        let length = u8::try_from(START + fields).expect("short");
        let mut raw = [&HEAD[..], &[128, number, length]].concat();
        for (text, size) in [(name, 4), (format, 16), (columns, 64)] {
            raw.extend(text.bytes().chain(std::iter::repeat(0)).take(size));
        }
        raw
    }

    fn log(rows: u64) -> Vec<u8> {
        let mut raw = declared(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
        raw.extend(declared(7, "GYR", "Qf", "TimeUS,GyrX"));
        for row in 0..rows {
            raw.extend([&HEAD[..], &[7], &row.to_le_bytes(), &1.5_f32.to_le_bytes()].concat());
        }
        raw
    }

    fn gyro(index: &Index) -> &Kind {
        index.kinds.iter().find(|kind| &kind.name == b"GYR\0").expect("declared")
    }

    #[test]
    fn every_row_has_its_place() {
        let index = Index::of(&log(5));
        assert_eq!((index.kinds.len(), index.lost, index.cut), (2, 0, 0));
        let offsets: Vec<u64> = (0..5).map(|row| (2 * FMT_LENGTH + row * ROW) as u64).collect();
        assert_eq!(gyro(&index).offsets, offsets);
        assert_eq!(&gyro(&index).columns[..11], b"TimeUS,GyrX");
    }

    #[test]
    fn a_log_that_ends_within_a_message_is_cut() {
        for cut in 1..ROW {
            let whole = log(5);
            let index = Index::of(&whole[..whole.len() - cut]);
            assert_eq!(gyro(&index).offsets.len(), 4);
            // Zeros at its end may be fill bytes.
            assert!((1..=ROW - cut).contains(&(index.cut + index.lost)));
            assert!(index.lost < START);
        }
    }

    #[test]
    fn what_fills_a_log_up_is_no_damage() {
        for fill in [0x00, 0xff] {
            let mut raw = log(5);
            raw.extend([fill; 500]);
            let index = Index::of(&raw);
            assert_eq!((gyro(&index).offsets.len(), index.lost, index.cut), (5, 0, 0));
        }
    }

    #[test]
    fn damage_takes_no_more_than_the_messages_that_it_is_in() {
        let mut raw = log(20);
        let at = 2 * FMT_LENGTH + 10 * ROW;
        raw.drain(at + 4..at + 9);
        let index = Index::of(&raw);
        assert_eq!((gyro(&index).offsets.len(), index.lost), (19, ROW - 5));
    }

    #[test]
    fn a_declaration_that_does_not_fit_declares_nothing() {
        let mut raw = log(3);
        let length = FMT_LENGTH + START + 1;
        raw[length] += 1;
        let index = Index::of(&raw);
        assert_eq!((index.kinds.len(), index.lost), (1, 3 * ROW));
    }

    proptest! {
        #[test]
        fn any_bytes_are_walked_once(
            mut raw in Just(log(40)),
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..40),
        ) {
            for (place, byte) in changes {
                let at = place.index(raw.len());
                raw[at] = byte;
            }
            let index = Index::of(&raw);
            let read: usize = index.kinds.iter().map(|kind| kind.length * kind.offsets.len()).sum();
            prop_assert!(read + index.lost + index.cut <= raw.len());
            for kind in &index.kinds {
                for place in &kind.offsets {
                    prop_assert!(*place as usize + kind.length <= raw.len());
                }
            }
        }
    }
}
