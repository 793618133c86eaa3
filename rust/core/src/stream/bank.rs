//! Parallel streams, one per channel, on arrays of rows.

use serde::{Deserialize, Serialize};

use super::{Input, Output, Stream, Traced};
use crate::error::Error;
use crate::memory;

/// Number of rows that channels with shared registers process before the next channels. Packing and
/// unpacking of their states takes as long as about thirty rows.
const ROWS_IN_LANES: usize = 1 << 10;

/// Number of rows that a single channel processes before the next channel: they stay in the
/// first-level cache.
const ROWS: usize = 1 << 8;

/// Rows of samples and of their outputs, one sample per channel.
#[derive(Debug)]
pub struct Block<'a> {
    channels: usize,
    input: &'a [f64],
    numbers: &'a mut [f64],
    flags: &'a mut [bool],
}

impl<'a> Block<'a> {
    /// Rows of `channels` samples, with room for each of their outputs.
    pub(crate) fn new(
        channels: usize,
        input: &'a [f64],
        numbers: &'a mut [f64],
        flags: &'a mut [bool],
    ) -> Self {
        Self { channels, input, numbers, flags }
    }

    /// Number of rows, for streams with the input `S::Input`.
    pub fn n_rows<S: Stream>(&self) -> usize {
        self.input.len() / (self.channels * S::Input::NUMBERS).max(1)
    }

    /// Samples of one number, and the numbers of their outputs, row after row.
    #[inline(always)]
    pub(crate) fn rows(&mut self) -> impl Iterator<Item = (&[f64], &mut [f64])> {
        let input = self.input.chunks_exact(self.channels);
        input.zip(self.numbers.chunks_exact_mut(self.channels))
    }

    /// The block after `rows` rows of one number each.
    pub(crate) fn after(&mut self, rows: usize) -> Block<'_> {
        let (channels, done) = (self.channels, rows * self.channels);
        Block::new(channels, &self.input[done..], &mut self.numbers[done..], self.flags)
    }

    /// The block after `rows` rows; it takes this block.
    pub(crate) fn skip(self, rows: usize) -> Self {
        let (channels, done) = (self.channels, rows * self.channels);
        let (_, numbers) = self.numbers.split_at_mut(done);
        Self { channels, input: &self.input[done..], numbers, flags: self.flags }
    }

    /// `rows` rows, beginning with row `first`.
    pub(crate) fn part(&mut self, first: usize, rows: usize) -> Block<'_> {
        let own = first * self.channels..(first + rows) * self.channels;
        Block::new(self.channels, &self.input[own.clone()], &mut self.numbers[own], self.flags)
    }

    /// Processes one column by a stream.
    #[inline(always)]
    pub(crate) fn run<S: Stream>(&mut self, channel: usize, stream: &mut S) {
        let (channels, first) = (self.channels, channel * S::Input::NUMBERS);
        let inputs = self.input.chunks_exact(channels * S::Input::NUMBERS);
        let inputs = inputs.map(|row| S::Input::read(&row[first..][..S::Input::NUMBERS]));
        let (numbers, flags) = (&mut *self.numbers, &mut *self.flags);
        let mut index = channel;
        stream.run(inputs, |output| {
            output.write(
                &mut numbers[index * S::Output::NUMBERS..][..S::Output::NUMBERS],
                &mut flags[index * S::Output::FLAGS..][..S::Output::FLAGS],
            );
            index += channels;
        });
    }
}

/// One stream per channel; a row of samples has one sample per channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bank<S> {
    streams: Vec<S>,
}

impl<S: Stream + Clone> Bank<S> {
    /// `channels` streams in the state of `stream`.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory for this number of streams.
    pub fn new(stream: &S, channels: usize) -> Result<Self, Error> {
        let mut streams = memory::room(channels)?;
        for _ in 0..channels {
            streams.push(stream.try_clone()?);
        }
        Ok(Self { streams })
    }

    /// An independent bank in the same state.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory.
    pub fn try_clone(&self) -> Result<Self, Error> {
        let mut streams = memory::room(self.streams.len())?;
        for stream in &self.streams {
            streams.push(stream.try_clone()?);
        }
        Ok(Self { streams })
    }
}

impl<S> Bank<S> {
    /// A bank of these streams, one per channel.
    pub fn of(streams: Vec<S>) -> Self {
        Self { streams }
    }

    /// The streams, one per channel.
    pub fn streams(&self) -> &[S] {
        &self.streams
    }

    /// The streams, one per channel, for single steps.
    pub fn streams_mut(&mut self) -> &mut [S] {
        &mut self.streams
    }
}

impl<S: Stream> Bank<S> {
    /// Processes one row, one sample per channel; writes the numbers and flags of the outputs.
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

    /// Bytes of all states.
    pub fn bytes(&self) -> usize {
        self.streams.iter().map(Stream::bytes).sum()
    }

    /// Resets every stream to the state before its first sample.
    pub fn reset(&mut self) {
        self.streams.iter_mut().for_each(Stream::reset);
    }
}

impl<S: Stream + Send> Bank<S> {
    /// Processes rows in order; writes the numbers and flags of their outputs.
    pub fn process(&mut self, rows: &[f64], numbers: &mut [f64], flags: &mut [bool]) {
        let layout = Layout::of::<S>(self.streams.len());
        process(&mut &mut *self.streams, &layout, rows, numbers, flags);
    }

    /// Processes rows; writes the numbers and flags of each stream's snapshot after each row.
    pub fn trace(&mut self, rows: &[f64], numbers: &mut [f64], flags: &mut [bool])
    where
        S: Traced,
    {
        let layout = Layout::of::<S>(self.streams.len());
        let (n, f) = (S::Snapshot::NUMBERS, S::Snapshot::FLAGS);
        // The loop for batches is used: a step may be large, and is not compiled again here.
        let mut returned = vec![0.0; layout.channels * layout.numbers];
        let mut marks = vec![false; layout.channels * layout.flags];
        let mut indices = 0..;
        for row in rows.chunks_exact((layout.channels * layout.input).max(1)) {
            process(&mut &mut *self.streams, &layout, row, &mut returned, &mut marks);
            for (stream, k) in self.streams.iter().zip(&mut indices) {
                stream.snapshot().write(&mut numbers[k * n..][..n], &mut flags[k * f..][..f]);
            }
        }
    }
}

/// Parallel streams of any type. The code that cuts rows into blocks and distributes them to
/// threads is compiled once, not for each of about eighty types.
trait Channels: Send {
    fn process_block(&mut self, block: &mut Block<'_>);
    /// The streams before this one, and the other streams.
    #[cfg(feature = "parallel")]
    fn halves(&mut self, first: usize) -> (Box<dyn Channels + '_>, Box<dyn Channels + '_>);
}

impl<S: Stream + Send> Channels for &mut [S] {
    fn process_block(&mut self, block: &mut Block<'_>) {
        S::process_block(self, block);
    }

    #[cfg(feature = "parallel")]
    fn halves(&mut self, first: usize) -> (Box<dyn Channels + '_>, Box<dyn Channels + '_>) {
        let (ours, theirs) = self.split_at_mut(first);
        (Box::new(ours), Box::new(theirs))
    }
}

/// Numbers per row and channel, and number of rows in one pass.
#[derive(Debug, Clone, Copy)]
struct Layout {
    channels: usize,
    /// Numbers in a sample.
    input: usize,
    /// Numbers and flags in an output.
    numbers: usize,
    flags: usize,
    /// Number of rows that streams process before the next rows.
    block: usize,
}

impl Layout {
    fn of<S: Stream>(channels: usize) -> Self {
        let (input, numbers, flags) = (S::Input::NUMBERS, S::Output::NUMBERS, S::Output::FLAGS);
        let block = if S::lane_count() > 1 && channels > 1 { ROWS_IN_LANES } else { ROWS };
        Self { channels, input, numbers, flags, block }
    }

    fn n_rows(&self, rows: &[f64]) -> usize {
        rows.len() / (self.channels * self.input).max(1)
    }
}

fn process(
    streams: &mut dyn Channels,
    layout: &Layout,
    rows: &[f64],
    numbers: &mut [f64],
    flags: &mut [bool],
) {
    let (channels, count) = (layout.channels, layout.n_rows(rows));
    for first in (0..count).step_by(layout.block) {
        let after = count.min(first + layout.block);
        let own = |width: usize| first * channels * width..after * channels * width;
        let (numbers, flags) = (&mut numbers[own(layout.numbers)], &mut flags[own(layout.flags)]);
        let input = &rows[own(layout.input)];
        streams.process_block(&mut Block::new(channels, input, numbers, flags));
    }
}

#[cfg(feature = "parallel")]
mod on_threads {
    use nalgebra::{Dyn, MatrixViewMut, Scalar, U1};

    use super::{Bank, Block, Channels, Layout, process};
    use crate::error::Error;
    use crate::memory;
    use crate::stream::Stream;
    use crate::stream::threads::{both, started_on_pool};

    /// Smallest number of samples for another thread: some 100 µs of work.
    const MIN_SAMPLES_PER_THREAD: usize = 1 << 15;

    impl<S: Stream + Send> Bank<S> {
        /// [`process`](Self::process) with the channels distributed to up to `threads` threads; the
        /// result is bit-identical. A thread is used only if it saves time.
        ///
        /// # Errors
        /// [`Error::Memory`] if there is no memory for some rows, before any row is processed.
        pub fn process_on_threads(
            &mut self,
            rows: &[f64],
            numbers: &mut [f64],
            flags: &mut [bool],
            threads: usize,
        ) -> Result<(), Error> {
            let layout = Layout::of::<S>(self.streams.len());
            let streams = &mut &mut *self.streams;
            spread(streams, S::lane_count(), &layout, rows, numbers, flags, threads)
        }
    }

    fn spread(
        streams: &mut dyn Channels,
        lane_count: usize,
        layout: &Layout,
        rows: &[f64],
        numbers: &mut [f64],
        flags: &mut [bool],
        threads: usize,
    ) -> Result<(), Error> {
        let channels = layout.channels;
        let worth = rows.len() / layout.input / MIN_SAMPLES_PER_THREAD;
        let threads = threads.min(worth).max(1);
        let share = channels.div_ceil(threads).next_multiple_of(lane_count);
        if share >= channels {
            process(streams, layout, rows, numbers, flags);
            return Ok(());
        }
        let count = layout.n_rows(rows);
        let layout = Layout { block: layout.block.min(count), ..*layout };
        // Memory that all threads need.
        let numbers_a_row = channels * (layout.input + layout.numbers + layout.flags);
        drop(memory::room::<f64>(layout.block.saturating_mul(numbers_a_row))?);
        let part = Part {
            rows,
            width: channels * layout.input,
            first: 0,
            numbers: columns(numbers, channels * layout.numbers, count),
            flags: columns(flags, channels * layout.flags, count),
            layout,
        };
        let mut part = Some(part);
        started_on_pool(&mut || {
            if let Some(part) = part.take() {
                part.spread(streams, share);
            }
        });
        Ok(())
    }

    /// The rows of an array as columns of a view, which can be split along the rows.
    type Columns<'a, T> = MatrixViewMut<'a, T, Dyn, Dyn, U1, Dyn>;

    fn columns<T: Scalar>(elements: &mut [T], width: usize, rows: usize) -> Columns<'_, T> {
        let (width, rows) = (Dyn(width), Dyn(rows));
        MatrixViewMut::from_slice_with_strides_generic(elements, width, rows, U1, width)
    }

    /// The part of each row that belongs to some channels.
    struct Part<'a> {
        /// Whole rows of samples, including other channels.
        rows: &'a [f64],
        /// Numbers in a row of samples.
        width: usize,
        /// Index of the first own number in a row.
        first: usize,
        numbers: Columns<'a, f64>,
        flags: Columns<'a, bool>,
        /// Layout of these channels.
        layout: Layout,
    }

    impl Part<'_> {
        /// Distributes `share` channels per task.
        fn spread(mut self, streams: &mut dyn Channels, share: usize) {
            let channels = self.layout.channels;
            if channels <= share {
                return self.process(streams);
            }
            let half = (channels.div_ceil(share) / 2) * share;
            let (mut ours, mut theirs) = streams.halves(half);
            let (left, right) = self.split(half);
            let (mut left, mut right) = (Some(left), Some(right));
            both(
                &mut || {
                    if let Some(part) = left.take() {
                        part.spread(&mut *ours, share);
                    }
                },
                &mut || {
                    if let Some(part) = right.take() {
                        part.spread(&mut *theirs, share);
                    }
                },
            );
        }

        fn split(&mut self, channels: usize) -> (Part<'_>, Part<'_>) {
            let (rows, width, first, layout) = (self.rows, self.width, self.first, self.layout);
            let at = channels * layout.numbers;
            let (ours, theirs) = self.numbers.rows_range_pair_mut(..at, at..);
            let at = channels * layout.flags;
            let (our_flags, their_flags) = self.flags.rows_range_pair_mut(..at, at..);
            let others = Layout { channels: layout.channels - channels, ..layout };
            let (layout, second) = (Layout { channels, ..layout }, first + channels * layout.input);
            (
                Part { rows, width, first, numbers: ours, flags: our_flags, layout },
                Part {
                    rows,
                    width,
                    first: second,
                    numbers: theirs,
                    flags: their_flags,
                    layout: others,
                },
            )
        }

        /// Processes block by block through buffers that stay in the cache of this thread.
        fn process(mut self, streams: &mut dyn Channels) {
            let Layout { channels, block: length, .. } = self.layout;
            let own = channels * self.layout.input;
            let (n, f) = (self.numbers.nrows(), self.flags.nrows());
            let mut input = Vec::with_capacity(length * own);
            let (mut numbers, mut flags) = (vec![0.0; length * n], vec![false; length * f]);
            for (block, rows) in self.rows.chunks(length * self.width).enumerate() {
                let count = rows.len() / self.width;
                input.clear();
                for row in rows.chunks_exact(self.width) {
                    input.extend_from_slice(&row[self.first..][..own]);
                }
                let (numbers, flags) = (&mut numbers[..count * n], &mut flags[..count * f]);
                streams.process_block(&mut Block::new(channels, &input, numbers, flags));
                for i in 0..count {
                    let row = block * length + i;
                    copy(&numbers[i * n..][..n], self.numbers.column_mut(row).as_mut_slice());
                    copy(&flags[i * f..][..f], self.flags.column_mut(row).as_mut_slice());
                }
            }
        }
    }

    #[inline(always)]
    fn copy<T: Copy>(from: &[T], to: &mut [T]) {
        if !from.is_empty() {
            to.copy_from_slice(from);
        }
    }
}
