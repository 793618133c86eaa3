//! Rows of plain numbers in a text. The doubles equal those of any reader that rounds to the
//! nearest. If a row holds anything else, nothing is returned.

use std::mem;

use crate::math::parallel;
use crate::work;

/// Bytes of a text in one task.
const TASK_BYTES: usize = 1 << 18;

/// Number of digits that 64 bits always hold.
const MAX_DIGITS: usize = 19;

/// Largest whole number up to which a double is exact.
const MAX_EXACT: u64 = 1 << f64::MANTISSA_DIGITS;

/// Powers of ten that doubles hold without rounding.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// Kind of a cell: its column, and a flag for whole numbers, whose 64 bits are stored in the
/// column.
#[derive(Debug, Clone, Copy)]
pub enum Cell {
    /// The cell is not read.
    Unwanted,
    /// The double nearest to the number, NaN if it is missing.
    Double(usize),
    /// A whole number.
    Whole(usize),
}

/// Format of rows.
#[derive(Debug, Clone)]
pub struct Form {
    /// Delimiter of cells; None for any run of blanks.
    pub delimiter: Option<u8>,
    /// Decimal point.
    pub point: u8,
    /// Cells of every row.
    pub cells: Vec<Cell>,
    /// Texts of a missing value.
    pub missing: Vec<Vec<u8>>,
}

impl Form {
    /// True if all rows are plain; the last row has no line end. The columns, with one number per
    /// line, then hold the numbers. Otherwise they hold arbitrary numbers.
    ///
    /// Not plain are quotes, remarks, empty lines, texts, infinities, numbers too large for a
    /// double or for 64 bits, and rows with more or fewer cells.
    pub fn read(&self, text: &[u8], mut columns: Vec<&mut [f64]>, parallel: bool) -> bool {
        let mut tasks = work::room(text.len() / TASK_BYTES + 1);
        let mut rest = text;
        while !rest.is_empty() {
            let lines = &rest[..line_end(rest, TASK_BYTES)];
            rest = rest.get(lines.len() + 1..).unwrap_or_default();
            let count = count(lines);
            let mut parts = work::room(columns.len());
            for column in &mut columns {
                let Some((part, others)) = mem::take(column).split_at_mut_checked(count) else {
                    return false;
                };
                *column = others;
                parts.push(part);
            }
            tasks.push((lines, parts));
        }
        let filled = columns.iter().all(|column| column.is_empty());
        let task = |(lines, mut parts): (&[u8], Vec<&mut [f64]>)| self.task(lines, &mut parts);
        filled && parallel::map(tasks, parallel, task).into_iter().all(|plain| plain.is_some())
    }

    fn task(&self, lines: &[u8], columns: &mut [&mut [f64]]) -> Option<()> {
        work::pause();
        let mut text = Cursor { text: lines, at: 0, form: self };
        let rows = columns.first().map_or_else(|| count(lines), |column| column.len());
        for row in 0..rows {
            text.begin_row()?;
            for (i, cell) in self.cells.iter().enumerate() {
                let last = i + 1 == self.cells.len();
                match *cell {
                    Cell::Unwanted => text.pass()?,
                    Cell::Double(index) => columns[index][row] = text.double()?,
                    Cell::Whole(index) => {
                        columns[index][row] = f64::from_bits(text.whole()?.cast_unsigned());
                    }
                }
                text.end_cell(last)?;
            }
        }
        Some(())
    }
}

/// End of the line that contains a byte, or end of the text.
fn line_end(text: &[u8], byte: usize) -> usize {
    let after = text.get(byte..).and_then(|rest| rest.iter().position(|b| *b == b'\n'));
    after.map_or(text.len(), |more| byte + more)
}

fn count(lines: &[u8]) -> usize {
    // As many at once as a byte can count, in parallel.
    let ends = |part: &[u8]| part.iter().map(|byte| u8::from(*byte == b'\n')).sum::<u8>();
    1 + lines.chunks(255).map(|part| usize::from(ends(part))).sum::<usize>()
}

/// A position in a text; its methods return `None` if the text is not plain.
struct Cursor<'a> {
    text: &'a [u8],
    at: usize,
    form: &'a Form,
}

impl Cursor<'_> {
    #[inline(always)]
    fn here(&self) -> u8 {
        self.text.get(self.at).copied().unwrap_or(b'\n')
    }

    #[inline(always)]
    fn is_blank(&self, byte: u8) -> bool {
        byte == b' ' || (byte == b'\t' && self.form.delimiter != Some(b'\t'))
    }

    #[inline(always)]
    fn skip_blanks(&mut self) {
        while self.is_blank(self.here()) {
            self.at += 1;
        }
    }

    /// Moves to the first cell; `None` for a possible remark, or no row.
    #[inline(always)]
    fn begin_row(&mut self) -> Option<()> {
        self.skip_blanks();
        let plain = !matches!(self.here(), b'#' | b'%' | b'/' | b'\n' | b'\r');
        plain.then_some(())
    }

    /// Moves to the next cell, or after the last cell to the next row.
    #[inline(always)]
    fn end_cell(&mut self, last: bool) -> Option<()> {
        let before = self.at;
        self.skip_blanks();
        if last {
            self.at += usize::from(self.here() == b'\r');
            let ends = self.here() == b'\n';
            self.at += 1;
            return ends.then_some(());
        }
        match self.form.delimiter {
            Some(mark) => {
                let ends = self.here() == mark;
                self.at += 1;
                ends.then_some(())
            }
            None => (self.at > before && !matches!(self.here(), b'\n' | b'\r')).then_some(()),
        }
    }

    #[inline(always)]
    fn ends_cell(&self, byte: u8) -> bool {
        let blank = self.form.delimiter.is_none() && self.is_blank(byte);
        Some(byte) == self.form.delimiter || matches!(byte, b'\n' | b'\r') || blank
    }

    /// Skips a cell. Quotes might enclose delimiters. Beyond ASCII there are more blanks, which
    /// matter if blanks are delimiters.
    #[inline(always)]
    fn pass(&mut self) -> Option<()> {
        let blanks = self.form.delimiter.is_none();
        while !self.ends_cell(self.here()) {
            if self.here() == b'"' || (blanks && !(b' '..0x7f).contains(&self.here())) {
                return None;
            }
            self.at += 1;
        }
        Some(())
    }

    /// The number in a cell, NaN if it is missing.
    #[inline(always)]
    fn double(&mut self) -> Option<f64> {
        self.skip_blanks();
        let begin = self.at;
        let negative = self.sign();
        let from = self.at;
        let mut mantissa = self.digits(0);
        let mut digits = self.at - from;
        let mut exponent = 0;
        if self.here() == self.form.point {
            self.at += 1;
            let from = self.at;
            mantissa = self.digits(mantissa);
            digits += self.at - from;
            exponent = -i64::try_from(self.at - from).ok()?;
        }
        if digits == 0 {
            self.at = begin;
            return self.missing();
        }
        if matches!(self.here(), b'e' | b'E') {
            self.at += 1;
            exponent += self.exponent()?;
        }
        let power = POWERS.get(usize::try_from(exponent.unsigned_abs()).ok()?);
        let value = match power {
            // The two doubles are exact, and the result has one rounding.
            Some(power) if digits <= MAX_DIGITS && mantissa <= MAX_EXACT => {
                let whole = mantissa as f64;
                let size = if exponent < 0 { whole / power } else { whole * power };
                if negative { -size } else { size }
            }
            _ => self.any_double(begin)?,
        };
        value.is_finite().then_some(value)
    }

    #[inline(always)]
    fn sign(&mut self) -> bool {
        let sign = self.here();
        self.at += usize::from(matches!(sign, b'+' | b'-'));
        sign == b'-'
    }

    /// A number with more digits appended, modulo 2⁶⁴.
    #[inline(always)]
    fn digits(&mut self, mut number: u64) -> u64 {
        let mut count = 0;
        for byte in self.text.get(self.at..).unwrap_or_default() {
            let digit = byte.wrapping_sub(b'0');
            if digit > 9 {
                break;
            }
            number = number.wrapping_mul(10).wrapping_add(u64::from(digit));
            count += 1;
        }
        self.at += count;
        number
    }

    fn exponent(&mut self) -> Option<i64> {
        let negative = self.sign();
        let from = self.at;
        let size = self.digits(0);
        // More digits are left to another function.
        let size = matches!(self.at - from, 1..=4).then(|| size.cast_signed())?;
        Some(if negative { -size } else { size })
    }

    /// The double nearest to a number of any length.
    fn any_double(&self, begin: usize) -> Option<f64> {
        let mut number = self.text[begin..self.at].to_vec();
        number.iter_mut().filter(|byte| **byte == self.form.point).for_each(|byte| *byte = b'.');
        str::from_utf8(&number).ok()?.parse().ok()
    }

    /// NaN if a cell has a text of a missing value; a row with only this cell may be no row.
    #[cold]
    fn missing(&mut self) -> Option<f64> {
        let begin = self.at;
        self.pass()?;
        let cell = self.text[begin..self.at].trim_ascii_end();
        let known = self.form.missing.iter().any(|word| word == cell);
        (known && self.form.cells.len() > 1).then_some(f64::NAN)
    }

    /// The whole number in a cell, if 64 bits hold it.
    #[inline(always)]
    fn whole(&mut self) -> Option<i64> {
        self.skip_blanks();
        let begin = self.at;
        self.sign();
        let from = self.at;
        self.digits(0);
        if !matches!(self.at - from, 1..=MAX_DIGITS) {
            return None;
        }
        str::from_utf8(&self.text[begin..self.at]).ok()?.parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::{Cell, Form, TASK_BYTES};
    use proptest::prelude::*;

    /// Parts of rows, most of them plain.
    const PIECES: [&str; 24] = [
        "1,2\n",
        "-0.5,x\n",
        "7e-3,\n",
        "nan,0\n",
        ",1\n",
        " 3 , 4\r\n",
        "1",
        "9",
        ".",
        "-",
        "+",
        "e",
        "e30",
        "123456789012345678901",
        ",",
        ",5\n",
        "\n",
        "\r",
        " ",
        "\t",
        "#",
        "\"",
        "inf",
        "0x",
    ];

    fn comma(cells: &[Cell]) -> Form {
        let missing = vec![b"".to_vec(), b"nan".to_vec(), b"-".to_vec()];
        Form { delimiter: Some(b','), point: b'.', cells: cells.to_vec(), missing }
    }

    fn read(form: &Form, text: &str, columns: usize) -> Option<Vec<Vec<f64>>> {
        let rows = 1 + text.matches('\n').count();
        let mut all = vec![vec![0.0; rows]; columns];
        let plain =
            form.read(text.as_bytes(), all.iter_mut().map(Vec::as_mut_slice).collect(), false);
        plain.then_some(all)
    }

    #[test]
    fn any_double_is_read_to_the_last_bit() {
        let numbers = [
            "0",
            "-0",
            "+1.5",
            ".5",
            "2.",
            "1e-3",
            "9007199254740993",
            "0.1",
            "123456789012345678901",
            "1.7976931348623157e308",
            "4.9e-324",
            "2.2250738585072011e-308",
            "1e-400",
            "1e22",
            "1e23",
            "3.14159265358979323846264",
            "-12.34567e+1",
            "00000000000000000000001.5",
        ];
        let found = read(&comma(&[Cell::Double(0)]), &numbers.join("\n"), 1).expect("all plain");
        for (number, value) in numbers.iter().zip(&found[0]) {
            let exact: f64 = number.parse().expect("a number");
            assert_eq!(value.to_bits(), exact.to_bits(), "{number}");
        }
    }

    #[test]
    fn what_is_not_plain_is_left_to_others() {
        let form = comma(&[Cell::Double(0), Cell::Unwanted]);
        let odd = [
            "1",
            "1,2,3",
            "a,1",
            "inf,1",
            "1e999,1",
            "1_0,1",
            "0x1,1",
            "# 1,2",
            "\"1\",2",
            "1,\"2\"",
            "1,2\n\n3,4",
            "1\r,2",
            "1e,2",
            "1 2,3",
            "",
        ];
        for text in odd {
            assert_eq!(read(&form, text, 1), None, "{text:?}");
        }
        let found = read(&form, " 1 ,x\r\n,y\nnan ,\n-,z\n-2.5,", 1).expect("all plain");
        assert_eq!(found[0].map_nan(), [Some(1.0), None, None, None, Some(-2.5)]);
    }

    trait MapNan {
        fn map_nan(&self) -> Vec<Option<f64>>;
    }

    impl MapNan for Vec<f64> {
        fn map_nan(&self) -> Vec<Option<f64>> {
            self.iter().map(|value| (!value.is_nan()).then_some(*value)).collect()
        }
    }

    #[test]
    fn whole_numbers_keep_all_their_bits() {
        let form = comma(&[Cell::Whole(0)]);
        let found = read(&form, "9223372036854775807\n-9007199254740993", 1).expect("all plain");
        let bits = found[0].iter().map(|value| value.to_bits().cast_signed());
        assert_eq!(bits.collect::<Vec<_>>(), [i64::MAX, -9_007_199_254_740_993]);
        assert_eq!(read(&form, "9223372036854775808", 1), None);
        assert_eq!(read(&form, "1.5", 1), None);
    }

    #[test]
    fn tasks_join_without_a_seam() {
        let rows: Vec<String> = (0..TASK_BYTES / 8).map(|i| format!("{i};{},5", i % 7)).collect();
        let cells = vec![Cell::Double(0), Cell::Double(1)];
        let form = Form { delimiter: Some(b';'), point: b',', cells, missing: Vec::new() };
        let found = read(&form, &rows.join("\n"), 2).expect("all plain");
        for i in 0..rows.len() {
            assert_eq!((found[0][i], found[1][i]), (i as f64, (i % 7) as f64 + 0.5));
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_plain_rows_or_refused(
            pieces in prop::collection::vec(prop::sample::select(PIECES.to_vec()), 1..40),
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..3),
        ) {
            let mut raw = pieces.concat().into_bytes();
            for (place, byte) in changes {
                let at = place.index(raw.len());
                raw[at] = byte;
            }
            let form = comma(&[Cell::Double(0), Cell::Unwanted]);
            let lines: Vec<&[u8]> = raw.split(|byte| *byte == b'\n').collect();
            let mut column = vec![0.0; lines.len()];
            if form.read(&raw, vec![&mut column], false) {
                for (line, x) in lines.iter().zip(&column) {
                    let cell = line.split(|byte| *byte == b',').next().expect("there is a first");
                    let cell = str::from_utf8(cell).expect("plain").trim();
                    let missing = ["", "nan", "-"].contains(&cell).then_some(f64::NAN);
                    let exact = missing.or_else(|| cell.parse().ok()).expect("a number");
                    prop_assert!(x.to_bits() == exact.to_bits() || (x.is_nan() && exact.is_nan()));
                }
            }
        }
    }

    #[test]
    fn blanks_of_any_length_part_cells() {
        let cells = vec![Cell::Double(0), Cell::Unwanted, Cell::Double(1)];
        let form = Form { delimiter: None, point: b'.', cells, missing: Vec::new() };
        let found = read(&form, "  1   a\t2 \n3 b 4", 2).expect("all plain");
        assert_eq!(found, [[1.0, 3.0], [2.0, 4.0]]);
        assert_eq!(read(&form, "1 a\n2 b 3", 2), None);
    }
}
