//! Long work that Ctrl-C ends: without the interpreter's lock, looking now and then for signals.

use std::any::Any;
use std::ops::Range;
use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::{Builder, ScopedJoinHandle, scope};
use std::time::Duration;

use pyo3::prelude::*;
use zerorate_core::Error;
use zerorate_core::work::Stop;

use super::errors::NativeError;
use super::streaming::AnyBank;

/// Interval between checks for signals.
const BETWEEN: Duration = Duration::from_millis(50);

/// Samples whose work takes no longer than a thread to start.
const FEW: usize = 1 << 12;

/// Samples that any filter takes in some hundredths of a second.
const PIECE: usize = 1 << 17;

/// Bytes of a state that are copied in the time of one sample.
const BYTES_A_SAMPLE: usize = 16;

/// Runs work on so many samples and returns its result.
///
/// It is done on a thread of its own: Python handles signals on the main thread alone, which looks
/// for them meanwhile.
pub fn interruptible<R: Send>(
    py: Python<'_>,
    samples: usize,
    work: impl FnOnce() -> R + Send,
) -> PyResult<R> {
    let (mut work, mut found) = (Some(work), None);
    let mut run = || found = work.take().map(|work| work());
    watched(py, samples, &mut run)?;
    Ok(found.ok_or(Error::Stopped).map_err(NativeError::from)?)
}

/// Type-erased work, so that all this is compiled once.
type Run<'a> = &'a mut (dyn FnMut() + Send);

fn watched(py: Python<'_>, samples: usize, run: Run<'_>) -> PyResult<()> {
    let stop = Stop::default();
    let mut run = || stop.run(&mut *run);
    py.detach(|| {
        let watched = (samples > FEW).then(|| on_a_thread(&mut run, &stop)).flatten();
        // Where no thread is to be had it is done here, and no signal looked for.
        watched.unwrap_or_else(|| Ok(run().map_err(NativeError::from)?))
    })
}

fn on_a_thread(
    run: &mut (dyn FnMut() -> Result<(), Error> + Send),
    stop: &Stop,
) -> Option<PyResult<()>> {
    scope(|scope| {
        let (done, ended) = channel::<()>();
        let worker = Builder::new().spawn_scoped(scope, move || {
            let _until_here = done;
            run()
        });
        worker.ok().map(|worker| wait(worker, &ended, stop))
    })
}

fn wait(
    worker: ScopedJoinHandle<'_, Result<(), Error>>,
    ended: &Receiver<()>,
    stop: &Stop,
) -> PyResult<()> {
    let mut interrupted = Ok(());
    while ended.recv_timeout(BETWEEN) == Err(RecvTimeoutError::Timeout) {
        if interrupted.is_ok() {
            interrupted = Python::attach(|py| py.check_signals());
        }
        if interrupted.is_err() {
            stop.ask();
        }
    }
    let done = worker.join().unwrap_or_else(|panic| resume_unwind(panic));
    interrupted?;
    Ok(done.map_err(NativeError::from)?)
}

/// Hands `work` the rows of a batch, piece by piece; if it is interrupted or fails, the bank is as
/// it was before. A batch of a few rows is one piece.
pub fn in_pieces<B: AnyBank + ?Sized>(
    py: Python<'_>,
    bank: &mut B,
    rows: usize,
    threads: usize,
    work: impl FnMut(&mut B, Range<usize>) -> Result<(), Error> + Send,
) -> PyResult<()> {
    let (channels, bytes) = (bank.channels(), bank.bytes());
    let at_once = (PIECE * threads.min(channels)).max(bytes / BYTES_A_SAMPLE) / channels;
    // Without memory for a copy it is done all the same, and no signal looked for.
    let before = (rows > at_once).then(|| bank.try_clone().ok()).flatten();
    let length = match before {
        Some(_) => (PIECE * threads.min(channels)).div_ceil(channels),
        None => rows.max(1),
    };
    each_piece(py, &mut AtWork { bank, work }, rows, length, before)
}

/// A bank and what is done with it, neither of them part of the type.
trait Pieces: Send {
    fn take(&mut self, rows: Range<usize>) -> Result<(), Error>;
    fn replace_with(&mut self, other: Box<dyn Any + Send>);
}

struct AtWork<'a, B: ?Sized, W> {
    bank: &'a mut B,
    work: W,
}

impl<B, W> Pieces for AtWork<'_, B, W>
where
    B: AnyBank + ?Sized,
    W: FnMut(&mut B, Range<usize>) -> Result<(), Error> + Send,
{
    fn take(&mut self, rows: Range<usize>) -> Result<(), Error> {
        (self.work)(self.bank, rows)
    }

    fn replace_with(&mut self, other: Box<dyn Any + Send>) {
        self.bank.replace_with(other);
    }
}

fn each_piece(
    py: Python<'_>,
    pieces: &mut dyn Pieces,
    rows: usize,
    length: usize,
    before: Option<Box<dyn Any + Send>>,
) -> PyResult<()> {
    // No row is a piece too: its requests are refused in the same way.
    for first in (0..rows.max(1)).step_by(length) {
        let piece = first..rows.min(first + length);
        let done =
            py.detach(|| pieces.take(piece)).map_err(|error| NativeError::from(error).into());
        let done = done.and_then(|()| if before.is_some() { py.check_signals() } else { Ok(()) });
        if let Err(error) = done {
            if let Some(before) = before {
                pieces.replace_with(before);
            }
            return Err(error);
        }
    }
    Ok(())
}
