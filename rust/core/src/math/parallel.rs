//! Loops on the threads of the process (feature `parallel`), or on the caller's.

/// What `f` returns of each task, in order; with `parallel` on the pool that the caller works on, or
/// on that of the process.
#[cfg(feature = "parallel")]
pub fn map<T: Sync, R: Send>(
    tasks: &[T],
    parallel: bool,
    f: impl Fn(&T) -> R + Sync + Send,
) -> Vec<R> {
    use rayon::prelude::*;
    match parallel {
        true if rayon::current_thread_index().is_some() => tasks.par_iter().map(f).collect(),
        true => crate::stream::threads::on_pool(|| tasks.par_iter().map(f).collect()),
        false => tasks.iter().map(f).collect(),
    }
}

/// What `f` returns of each task, in order.
#[cfg(not(feature = "parallel"))]
pub fn map<T, R>(tasks: &[T], _parallel: bool, f: impl Fn(&T) -> R) -> Vec<R> {
    tasks.iter().map(f).collect()
}
