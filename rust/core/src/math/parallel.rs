//! A loop over tasks on the threads of a pool (feature `parallel`), or on the caller's.

/// Results of `f` for each task, in order. With `parallel` they run on the caller's pool, or on the
/// process's pool.
#[cfg(feature = "parallel")]
pub fn map<T: Send, R: Send>(
    tasks: Vec<T>,
    parallel: bool,
    f: impl Fn(T) -> R + Sync + Send,
) -> Vec<R> {
    use crate::error::Error;
    use crate::stream::threads::started_on_pool;
    use crate::work::{Current, end, is_asked_to_end};

    if !parallel {
        return tasks.into_iter().map(f).collect();
    }
    let work = Current::here();
    // Not every one of a million tasks unwinds.
    let fill = |(task, result): &mut (Option<T>, Option<R>)| {
        let task = task.take();
        *result = work.clone().run(|| task.filter(|_| !is_asked_to_end()).map(&f));
    };
    let mut slots: Vec<_> = tasks.into_iter().map(|task| (Some(task), None)).collect();
    started_on_pool(&mut || each(&mut slots, &fill));
    let results = slots.into_iter().map(|(_, result)| result);
    results.collect::<Option<_>>().unwrap_or_else(|| end(Error::Stopped))
}

/// Runs `work` at each index; halves run in parallel if a thread is free.
#[cfg(feature = "parallel")]
fn each<P: Send>(slots: &mut [P], work: &(impl Fn(&mut P) + Sync)) {
    use crate::stream::threads::both;

    if let [slot] = slots {
        work(slot);
    } else if !slots.is_empty() {
        let (one, other) = slots.split_at_mut(slots.len() / 2);
        both(&mut || each(one, work), &mut || each(other, work));
    }
}

/// The results of `f` for each task, in order.
#[cfg(not(feature = "parallel"))]
pub fn map<T, R>(tasks: Vec<T>, _parallel: bool, f: impl Fn(T) -> R) -> Vec<R> {
    tasks.into_iter().map(f).collect()
}
