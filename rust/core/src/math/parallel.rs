//! A loop over tasks on the threads of a pool (feature `parallel`), or on the caller's.

/// What `f` returns of each task, in order: with `parallel` on the pool that the caller is in, or
/// on that of the process.
#[cfg(feature = "parallel")]
pub fn map<T: Send, R: Send>(
    tasks: Vec<T>,
    parallel: bool,
    f: impl Fn(T) -> R + Sync + Send,
) -> Vec<R> {
    use crate::error::Error;
    use crate::stream::threads::on_pool;
    use crate::work::{Current, end, is_asked_to_end};
    use rayon::prelude::*;

    if !parallel {
        return tasks.into_iter().map(f).collect();
    }
    let work = Current::here();
    // Of a million tasks not each is to unwind.
    let task = |task| work.clone().run(|| (!is_asked_to_end()).then(|| f(task)));
    let spread = || tasks.into_par_iter().map(task).collect::<Option<Vec<R>>>();
    let found = match rayon::current_thread_index() {
        Some(_) => spread(),
        None => on_pool(spread),
    };
    found.unwrap_or_else(|| end(Error::Stopped))
}

/// What `f` returns of each task, in order.
#[cfg(not(feature = "parallel"))]
pub fn map<T, R>(tasks: Vec<T>, _parallel: bool, f: impl Fn(T) -> R) -> Vec<R> {
    tasks.into_iter().map(f).collect()
}
