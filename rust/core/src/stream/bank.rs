//! Streams side by side, one a channel, on arrays of rows.

use core::ops::Range;

use nalgebra::{Dyn, MatrixViewMut, Scalar, U1};
use serde::{Deserialize, Serialize};

use super::{Input, Output, Stream, Traced};

/// Rows that channels sharing registers work on before the next ones: putting their states
/// together and taking them apart costs as much as some thirty rows.
const ROWS_ABREAST: usize = 1 << 10;

/// Rows that a channel alone works on before the next one: they stay in the first-level cache.
const ROWS: usize = 1 << 8;

/// Rows of an array to be filled: whole ones, or the part of each that some channels have.
#[derive(Debug)]
pub struct Rows<'a, T: Scalar>(MatrixViewMut<'a, T, Dyn, Dyn, U1, Dyn>);

impl<'a, T: Scalar> Rows<'a, T> {
    /// So many rows of as many elements each as `elements` gives them.
    fn new(elements: &'a mut [T], rows: usize) -> Self {
        let columns = elements.len() / rows.max(1);
        let (width, rows) = (Dyn(columns), Dyn(rows));
        let stride = Dyn(columns);
        Self(MatrixViewMut::from_slice_with_strides_generic(elements, width, rows, U1, stride))
    }

    /// Some of the rows.
    fn range(&mut self, rows: Range<usize>) -> Rows<'_, T> {
        Rows(self.0.columns_mut(rows.start, rows.len()))
    }

    /// The first `columns` elements of each row, and the others.
    #[cfg(feature = "parallel")]
    fn split(&mut self, columns: usize) -> (Rows<'_, T>, Rows<'_, T>) {
        let (left, right) = self.0.rows_range_pair_mut(..columns, columns..);
        (Rows(left), Rows(right))
    }

    /// Row after row.
    #[inline(always)]
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut [T]> {
        self.0.column_iter_mut().map(|row| row.data.into_slice_mut())
    }
}

/// Rows of samples and of what is to be returned for them, for some channels side by side.
#[derive(Debug)]
pub struct Block<'a> {
    /// Whole rows, those of other channels included.
    input: &'a [f64],
    /// Numbers in a row of `input`.
    width: usize,
    /// Place of the first channel's number in a row of `input`.
    first: usize,
    numbers: Rows<'a, f64>,
    flags: Rows<'a, bool>,
}

impl<'a> Block<'a> {
    /// Rows of `channels` samples of `S`, and a place for each of their outputs.
    pub(crate) fn new<S: Stream>(
        channels: usize,
        input: &'a [f64],
        numbers: &'a mut [f64],
        flags: &'a mut [bool],
    ) -> Self {
        let width = channels * S::Input::NUMBERS;
        let rows = input.len() / width.max(1);
        debug_assert_eq!(numbers.len(), rows * channels * S::Output::NUMBERS);
        debug_assert_eq!(flags.len(), rows * channels * S::Output::FLAGS);
        let (numbers, flags) = (Rows::new(numbers, rows), Rows::new(flags, rows));
        Self { input, width, first: 0, numbers, flags }
    }

    /// How many rows it has.
    pub fn len(&self) -> usize {
        self.input.len() / self.width.max(1)
    }

    /// Whether it has no row.
    pub fn is_empty(&self) -> bool {
        self.input.is_empty()
    }

    /// The samples and the numbers to be returned, row after row.
    #[inline(always)]
    pub(crate) fn rows(&mut self) -> impl Iterator<Item = (&[f64], &mut [f64])> {
        let first = self.first;
        let input = self.input.chunks_exact(self.width.max(1)).map(move |row| &row[first..]);
        input.zip(self.numbers.iter_mut())
    }

    /// One column through a stream.
    #[inline(always)]
    pub(crate) fn run<S: Stream>(&mut self, channel: usize, stream: &mut S) {
        let first = self.first + channel * S::Input::NUMBERS;
        let (number, flag) = (channel * S::Output::NUMBERS, channel * S::Output::FLAGS);
        let inputs = self.input.chunks_exact(self.width.max(1));
        let inputs = inputs.map(|row| S::Input::read(&row[first..][..S::Input::NUMBERS]));
        let (mut numbers, mut flags) = (self.numbers.iter_mut(), self.flags.iter_mut());
        stream.run(inputs, |output| {
            if let (Some(numbers), Some(flags)) = (numbers.next(), flags.next()) {
                let numbers = &mut numbers[number..][..S::Output::NUMBERS];
                output.write(numbers, &mut flags[flag..][..S::Output::FLAGS]);
            }
        });
    }

    fn range(&mut self, rows: Range<usize>) -> Block<'_> {
        Block {
            input: &self.input[rows.start * self.width..rows.end * self.width],
            width: self.width,
            first: self.first,
            numbers: self.numbers.range(rows.clone()),
            flags: self.flags.range(rows),
        }
    }

    /// The part of the first `channels` channels of `S`, and that of the others.
    #[cfg(feature = "parallel")]
    fn split<S: Stream>(&mut self, channels: usize) -> (Block<'_>, Block<'_>) {
        let (left, right) = self.numbers.split(channels * S::Output::NUMBERS);
        let (left_flags, right_flags) = self.flags.split(channels * S::Output::FLAGS);
        let (input, width, first) = (self.input, self.width, self.first);
        let second = first + channels * S::Input::NUMBERS;
        (
            Block { input, width, first, numbers: left, flags: left_flags },
            Block { input, width, first: second, numbers: right, flags: right_flags },
        )
    }

    /// The whole block through streams, one a channel, a cache's content at a time.
    fn process<S: Stream>(mut self, streams: &mut [S]) {
        let length = if S::abreast() > 1 && streams.len() > 1 { ROWS_ABREAST } else { ROWS };
        let rows = self.len();
        for first in (0..rows).step_by(length) {
            let mut part = self.range(first..rows.min(first + length));
            S::process_block(streams, &mut part);
        }
    }
}

/// One stream a channel; samples come in rows of one a channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bank<S> {
    streams: Vec<S>,
}

impl<S: Clone> Bank<S> {
    /// `channels` copies of `stream`.
    pub fn new(stream: &S, channels: usize) -> Self {
        Self { streams: vec![stream.clone(); channels] }
    }
}

impl<S> Bank<S> {
    /// These streams side by side, one a channel.
    pub fn of(streams: Vec<S>) -> Self {
        Self { streams }
    }

    /// The streams, one a channel.
    pub fn streams(&self) -> &[S] {
        &self.streams
    }

    /// The streams, one a channel, to step one by one.
    pub fn streams_mut(&mut self) -> &mut [S] {
        &mut self.streams
    }
}

impl<S: Stream> Bank<S> {
    /// Takes one row, a sample a channel; fills the numbers and flags of the outputs.
    #[inline]
    pub fn update(&mut self, row: &[f64], numbers: &mut [f64], flags: &mut [bool]) {
        for (c, stream) in self.streams.iter_mut().enumerate() {
            let input = S::Input::read(&row[c * S::Input::NUMBERS..][..S::Input::NUMBERS]);
            stream.update(input).write(
                &mut numbers[c * S::Output::NUMBERS..][..S::Output::NUMBERS],
                &mut flags[c * S::Output::FLAGS..][..S::Output::FLAGS],
            );
        }
    }

    /// Takes rows, one after the other; fills the numbers and flags of their outputs.
    pub fn process(&mut self, rows: &[f64], numbers: &mut [f64], flags: &mut [bool]) {
        let channels = self.streams.len();
        Block::new::<S>(channels, rows, numbers, flags).process(&mut self.streams);
    }

    /// Takes rows; fills the numbers and flags of what each stream knows after each of them.
    pub fn trace(&mut self, rows: &[f64], numbers: &mut [f64], flags: &mut [bool])
    where
        S: Traced,
    {
        let (width, n, f) = (S::Input::NUMBERS, S::Snapshot::NUMBERS, S::Snapshot::FLAGS);
        let channels = self.streams.len();
        for (k, sample) in rows.chunks_exact(width).enumerate() {
            let stream = &mut self.streams[k % channels];
            stream.update(S::Input::read(sample));
            stream.snapshot().write(&mut numbers[k * n..][..n], &mut flags[k * f..][..f]);
        }
    }

    /// Every stream back to before its first sample.
    pub fn reset(&mut self) {
        self.streams.iter_mut().for_each(Stream::reset);
    }
}

#[cfg(feature = "parallel")]
mod on_threads {
    use super::{Bank, Block};
    use crate::stream::threads::on_pool;
    use crate::stream::{Input, Stream};

    /// Samples that make another thread worth its while: some 100 µs of work.
    const SAMPLES_A_THREAD: usize = 1 << 15;

    impl<S: Stream + Send> Bank<S> {
        /// [`process`](Self::process) with the channels spread over up to `threads` threads; the
        /// result is the same to the last bit. No thread takes part that would not pay.
        pub fn process_on_threads(
            &mut self,
            rows: &[f64],
            numbers: &mut [f64],
            flags: &mut [bool],
            threads: usize,
        ) {
            let channels = self.streams.len();
            let worth = rows.len() / S::Input::NUMBERS / SAMPLES_A_THREAD;
            let threads = threads.min(worth).max(1);
            let share = channels.div_ceil(threads).next_multiple_of(S::abreast());
            let block = Block::new::<S>(channels, rows, numbers, flags);
            if share >= channels {
                return block.process(&mut self.streams);
            }
            on_pool(|| spread(&mut self.streams, block, share));
        }
    }

    /// `share` channels a task.
    fn spread<S: Stream + Send>(streams: &mut [S], mut block: Block<'_>, share: usize) {
        if streams.len() <= share {
            return block.process(streams);
        }
        let half = (streams.len().div_ceil(share) / 2) * share;
        let (left, right) = streams.split_at_mut(half);
        let (left_block, right_block) = block.split::<S>(half);
        rayon::join(|| spread(left, left_block, share), || spread(right, right_block, share));
    }
}
