//! Long work without the interpreter's lock, which checks for signals and stops at Ctrl-C.

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

/// Number of samples that take no longer than the start of a thread.
const FEW: usize = 1 << 12;

/// Number of samples that any filter processes in some hundredths of a second.
const PIECE: usize = 1 << 17;

/// Bytes of a state that are copied in the time of one sample.
const BYTES_A_SAMPLE: usize = 16;

/// Runs work on this number of samples and returns its result.
///
/// The work runs on its own thread, because only the main thread of Python handles signals.
/// Meanwhile the main thread checks for them.
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

/// Type-erased work, so that this code is compiled once.
type Run<'a> = &'a mut (dyn FnMut() + Send);

fn watched(py: Python<'_>, samples: usize, run: Run<'_>) -> PyResult<()> {
    let stop = Stop::default();
    let mut run = || stop.run(&mut *run);
    py.detach(|| {
        let watched = (samples > FEW).then(|| on_a_thread(&mut run, &stop)).flatten();
        // If no thread can be started, the work runs here, without checks for signals.
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

/// Gives the rows of a batch to `work`, piece by piece. If the work is interrupted or fails, the
/// bank returns to its earlier state. A batch of a few rows is one piece.
pub fn in_pieces<B: AnyBank + ?Sized>(
    py: Python<'_>,
    bank: &mut B,
    rows: usize,
    threads: usize,
    work: impl FnMut(&mut B, Range<usize>) -> Result<(), Error> + Send,
) -> PyResult<()> {
    let (channels, bytes) = (bank.channels(), bank.bytes());
    let at_once = (PIECE * threads.min(channels)).max(bytes / BYTES_A_SAMPLE) / channels;
    // Without memory for a copy the work runs without checks for signals.
    let before = (rows > at_once).then(|| bank.try_clone().ok()).flatten();
    let length = match before {
        Some(_) => (PIECE * threads.min(channels)).div_ceil(channels),
        None => rows.max(1),
    };
    each_piece(py, &mut AtWork { bank, work }, rows, length, before)
}

/// A bank and its work; neither is part of the type.
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
    // An empty batch is one piece: its arguments are checked in the same way.
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
