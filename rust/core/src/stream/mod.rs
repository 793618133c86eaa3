//! The interface of all types that process samples one by one. Batches, parallel channels, threads,
//! traces and checkpoints follow from this interface.
//!
//! A [`Stream`] defines its input, its output and the effect of one sample. [`Stream::process`] is
//! a loop over [`Stream::update`]. A [`Bank`] has one stream per channel and processes arrays, with
//! threads on request. [`checkpoint`] saves any stream.

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

/// Processes samples one by one and returns an output for each.
pub trait Stream: Sized {
    /// Input for one sample: a number, a vector, or several of them.
    type Input: Input;
    /// Output for one sample: numbers and flags, or nothing.
    type Output: Output;

    /// Processes one sample in constant time, without allocation or panic.
    fn update(&mut self, input: Self::Input) -> Self::Output;

    /// Resets to the state before the first sample, with the same parameters.
    fn reset(&mut self);

    /// An independent stream in the same state.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory.
    #[cfg(feature = "std")]
    fn try_clone(&self) -> Result<Self, Error>
    where
        Self: Clone,
    {
        Ok(self.clone())
    }

    /// Bytes of the stream's state.
    #[cfg(feature = "std")]
    fn bytes(&self) -> usize {
        size_of::<Self>()
    }

    /// Passes the output of each input to `put`; results are bit-identical to
    /// [`update`](Self::update) for each sample.
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

    /// Writes `outputs`, one for each of as many `inputs`.
    fn process(&mut self, inputs: &[Self::Input], outputs: &mut [Self::Output]) {
        let mut outputs = outputs.iter_mut();
        self.run(inputs.iter().copied().take(outputs.len()), |output| {
            if let Some(slot) = outputs.next() {
                *slot = output;
            }
        });
    }

    /// Number of channels that share SIMD registers: together they take hardly longer than one
    /// channel.
    #[cfg(feature = "std")]
    fn lane_count() -> usize {
        1
    }

    /// Processes a block of rows with one stream per channel; results are bit-identical to each
    /// stream alone.
    #[cfg(feature = "std")]
    fn process_block(streams: &mut [Self], block: &mut Block<'_>) {
        for (channel, stream) in streams.iter_mut().enumerate() {
            stream.process_column(channel, block);
        }
    }

    /// Processes one column of a block.
    #[cfg(feature = "std")]
    fn process_column(&mut self, channel: usize, block: &mut Block<'_>) {
        block.run(channel, self);
    }
}

/// A stream that can return all its estimates.
pub trait Traced: Stream {
    /// All estimates, as numbers and flags.
    type Snapshot: Output;

    /// All estimates after the last sample.
    fn snapshot(&self) -> Self::Snapshot;
}
