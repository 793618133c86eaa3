//! Long work on a record that can end early: on request, or because there is no memory.
//!
//! The computations on a record return no errors. Work that ends early unwinds to the [`Stop::run`]
//! that began it, on all its threads. Without a [`Stop::run`] no request is possible, and missing
//! memory ends the process as usual in Rust.

use std::alloc::{Layout, handle_alloc_error};
use std::any::Any;
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::Error;

/// Requests that work ends.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

thread_local! {
    /// The stop of this thread's work.
    static CURRENT: RefCell<Option<Stop>> = const { RefCell::new(None) };
}

impl Stop {
    /// Requests that the work ends soon.
    pub fn ask(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Runs the work and returns its result.
    ///
    /// # Errors
    /// [`Error::Stopped`] after a request to end, [`Error::Memory`] if there was no memory.
    pub fn run<R>(&self, work: impl FnOnce() -> R) -> Result<R, Error> {
        let inside = || Current(Some(self.clone())).run(work);
        catch_unwind(AssertUnwindSafe(inside)).map_err(|payload| {
            match payload.downcast::<Error>() {
                Ok(error) => *error,
                Err(panic) => resume_unwind(panic),
            }
        })
    }
}

/// The stop of this thread's work, for threads that share the work.
#[derive(Debug, Clone)]
pub struct Current(Option<Stop>);

impl Current {
    /// The stop of this thread.
    pub fn here() -> Self {
        Self(CURRENT.with_borrow(Option::clone))
    }

    /// Does a part of the work, on any thread.
    pub fn run<R>(self, part: impl FnOnce() -> R) -> R {
        struct Before(Option<Stop>);
        impl Drop for Before {
            fn drop(&mut self) {
                CURRENT.set(self.0.take());
            }
        }
        let _before = Before(CURRENT.replace(self.0));
        part()
    }
}

/// Ends the work on request: long loops call it at least every few milliseconds.
#[inline(never)]
pub(crate) fn pause() {
    if is_asked_to_end() {
        end(Error::Stopped);
    }
}

/// True if the work must end on request.
pub(crate) fn is_asked_to_end() -> bool {
    let asked = |stop: &Option<Stop>| stop.as_ref().is_some_and(|s| s.0.load(Ordering::Relaxed));
    CURRENT.with_borrow(asked)
}

/// Unwinds with an error.
pub(crate) fn end(error: Error) -> ! {
    let payload: Box<dyn Any + Send> = Box::new(error);
    resume_unwind(payload)
}

/// Room for this number of elements, or the end of the work.
pub(crate) fn room<T>(length: usize) -> Vec<T> {
    crate::memory::room(length).unwrap_or_else(|error| refuse::<T>(length, error))
}

/// This number of equal elements, or the end of the work.
pub(crate) fn filled<T: Clone>(value: T, length: usize) -> Vec<T> {
    crate::memory::filled(value, length).unwrap_or_else(|error| refuse::<T>(length, error))
}

/// Adds one element, or ends the work.
pub(crate) fn push<T>(values: &mut Vec<T>, value: T) {
    let length = values.len();
    if values.len() == values.capacity() {
        crate::memory::reserve(values, 1).unwrap_or_else(|error| refuse::<T>(length + 1, error));
    }
    values.push(value);
}

/// Collects the values of an iterator, or ends the work.
pub(crate) fn collect<T>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    let values = values.into_iter();
    let mut all = room(values.size_hint().0);
    values.for_each(|value| push(&mut all, value));
    all
}

/// Ends the work if this much memory is not available; for calls that would not return an error.
pub(crate) fn need<T>(length: usize) {
    drop(room::<T>(length));
}

fn refuse<T>(length: usize, error: Error) -> ! {
    if Current::here().0.is_some() {
        end(error);
    }
    handle_alloc_error(Layout::array::<T>(length).unwrap_or(Layout::new::<T>()))
}

#[cfg(test)]
mod tests {
    use super::{Stop, collect, pause, room};
    use crate::error::Error;
    use crate::math::parallel;

    #[test]
    fn work_ends_when_asked_on_every_thread_that_it_spreads_over() {
        let stop = Stop::default();
        let endless = |k: usize| -> usize {
            if k == 0 {
                stop.ask();
            }
            loop {
                pause();
            }
        };
        let found = stop.run(|| parallel::map((0..8).collect(), true, endless));
        assert_eq!(found, Err(Error::Stopped));
        assert_eq!(Stop::default().run(|| collect(0..3)), Ok(vec![0, 1, 2]));
    }

    #[test]
    fn refused_memory_is_an_error_of_the_work() {
        for length in [usize::MAX, usize::MAX / 16] {
            let found = Stop::default().run(|| room::<f64>(length).len());
            assert!(matches!(found, Err(Error::Memory { .. })));
        }
    }

    #[test]
    #[should_panic(expected = "a mistake")]
    fn other_panics_go_on() {
        let _never = Stop::default().run(|| panic!("a mistake"));
    }
}
