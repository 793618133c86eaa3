//! The contract of everything that takes samples one by one, and what follows from it: batches,
//! channels side by side, threads, traces, checkpoints.
//!
//! A [`Stream`] says what it takes, what it returns and how one sample changes it. The rest comes
//! from here: [`Stream::process`] is a loop over [`Stream::update`], a [`Bank`] holds one stream a
//! channel and works on arrays, with threads if asked, and [`checkpoint`] saves any of them.

#[cfg(feature = "std")]
mod bank;
pub mod checkpoint;
#[cfg(feature = "std")]
mod parts;
mod sample;
mod scaling;
mod sketch;
#[cfg(feature = "parallel")]
pub(crate) mod threads;
mod watch;

#[cfg(feature = "std")]
use crate::error::Error;
#[cfg(feature = "std")]
pub use bank::{Bank, Block};
#[cfg(feature = "std")]
pub use parts::{Parts, Values};
pub use sample::{Field, Input, Number, Output, Shape, sizes};
pub use scaling::{Scaling, Startup};
pub(crate) use sketch::Sketch;
#[cfg(feature = "parallel")]
pub use threads::on_pool;
pub(crate) use watch::Watch;

/// Something that takes samples one by one and returns something for each.
pub trait Stream: Sized {
    /// Its input: a number, a vector, several of them.
    type Input: Input;
    /// Its output for each: numbers and flags, or nothing.
    type Output: Output;

    /// Takes one sample: constant work, no allocation, no panic.
    fn update(&mut self, input: Self::Input) -> Self::Output;

    /// Back to the state before the first sample, with the same parameters.
    fn reset(&mut self);

    /// An independent stream in the same state.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is none for it.
    #[cfg(feature = "std")]
    fn try_clone(&self) -> Result<Self, Error>
    where
        Self: Clone,
    {
        Ok(self.clone())
    }

    /// Bytes of its state.
    #[cfg(feature = "std")]
    fn bytes(&self) -> usize {
        size_of::<Self>()
    }

    /// Hands each input's output to `put`, equal to the last bit to calling
    /// [`update`](Self::update) sample by sample.
    #[inline]
    fn run(
        &mut self,
        inputs: impl Iterator<Item = Self::Input>,
        mut put: impl FnMut(Self::Output),
    ) {
        for input in inputs {
            put(self.update(input));
        }
    }

    /// Fills `outputs`, one for each of as many `inputs`.
    fn process(&mut self, inputs: &[Self::Input], outputs: &mut [Self::Output]) {
        let mut outputs = outputs.iter_mut();
        self.run(inputs.iter().copied().take(outputs.len()), |output| {
            if let Some(slot) = outputs.next() {
                *slot = output;
            }
        });
    }

    /// The number of channels that take hardly longer than one, because they share SIMD registers.
    #[cfg(feature = "std")]
    fn lane_count() -> usize {
        1
    }

    /// Fills a block of rows with one stream a channel, equal to the last bit to each stream alone
    /// on its own column.
    #[cfg(feature = "std")]
    fn process_block(streams: &mut [Self], block: &mut Block<'_>) {
        for (channel, stream) in streams.iter_mut().enumerate() {
            stream.process_column(channel, block);
        }
    }

    /// Fills one column of a block.
    #[cfg(feature = "std")]
    fn process_column(&mut self, channel: usize, block: &mut Block<'_>) {
        block.run(channel, self);
    }
}

/// A stream that can tell everything that it knows.
pub trait Traced: Stream {
    /// All that is known, as numbers and flags.
    type Snapshot: Output;

    /// All estimates after the last sample.
    fn snapshot(&self) -> Self::Snapshot;
}
