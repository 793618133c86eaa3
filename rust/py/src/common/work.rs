//! Long work that Ctrl-C ends: without the interpreter's lock, looking now and then for signals.

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

/// How often signals are looked for.
const BETWEEN: Duration = Duration::from_millis(50);

/// Samples whose work takes no longer than a thread to start.
const FEW: usize = 1 << 12;

/// Samples that any filter takes in some hundredths of a second.
const PIECE: usize = 1 << 17;

/// Bytes of a state that are copied in the time of one sample.
const BYTES_A_SAMPLE: usize = 16;

/// What the work on so many samples returns.
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

/// What is done is not part of the type, so that all this is compiled once.
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
    mut work: impl FnMut(&mut B, Range<usize>) -> Result<(), Error> + Send,
) -> PyResult<()> {
    let channels = bank.channels();
    let at_once = (PIECE * threads.min(channels)).max(bank.bytes() / BYTES_A_SAMPLE) / channels;
    // Without memory for a copy it is done all the same, and no signal looked for.
    let Some(before) = (rows > at_once).then(|| bank.twin().ok()).flatten() else {
        return detached(py, &mut || work(bank, 0..rows));
    };
    let length = (PIECE * threads.min(channels)).div_ceil(channels);
    for first in (0..rows).step_by(length) {
        let piece = first..rows.min(first + length);
        let done = detached(py, &mut || work(bank, piece.clone()));
        if let Err(error) = done.and_then(|()| py.check_signals()) {
            bank.become_twin(before);
            return Err(error);
        }
    }
    Ok(())
}

fn detached(py: Python<'_>, work: &mut (dyn FnMut() -> Result<(), Error> + Send)) -> PyResult<()> {
    Ok(py.detach(work).map_err(NativeError::from)?)
}
