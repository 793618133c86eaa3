//! The threads for all work: one pool per process, and a new pool after a fork.

use std::process;
use std::sync::OnceLock;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::work::Current;

/// A pool and the process of its threads; then the pools of processes forked from it.
#[derive(Debug)]
struct Pools {
    /// `None` for a pool if the system refuses threads.
    first: OnceLock<(u32, Option<ThreadPool>)>,
    rest: OnceLock<Box<Pools>>,
}

impl Pools {
    const fn none() -> Self {
        Self { first: OnceLock::new(), rest: OnceLock::new() }
    }
}

static POOLS: Pools = Pools::none();

/// Runs `work` on the pool of this process, where rayon's functions distribute it, or on the
/// calling thread if the system refuses threads. A fork inherits no threads, and a child creates
/// its own pool.
pub fn on_pool<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    let current = Current::here();
    match pool() {
        Some(pool) => pool.install(|| current.run(work)),
        None => work(),
    }
}

fn pool() -> Option<&'static ThreadPool> {
    let process = process::id();
    let mut pools = &POOLS;
    loop {
        if pools.first.get().is_none() {
            // Created before the lock is taken: a fork meanwhile would inherit a lock that is never
            // released. If two pools are created at once, one is dropped.
            let _first = pools.first.set((process, started()));
        }
        match pools.first.get() {
            Some((owner, pool)) if *owner == process => return pool.as_ref(),
            _ => {}
        }
        pools = pools.rest.get_or_init(|| Box::new(Pools::none()));
    }
}

fn started() -> Option<ThreadPool> {
    ThreadPoolBuilder::new().thread_name(|i| format!("zerorate-{i}")).build().ok()
}

/// Runs two functions, in parallel if there is a thread. The functions are not part of the types:
/// rayon's machinery is compiled once and not for every kind of stream.
pub(crate) fn both(one: &mut (dyn FnMut() + Send), other: &mut (dyn FnMut() + Send)) {
    rayon::join(one, other);
}

/// Runs `work`, which is not part of the types, on the caller's pool or by [`on_pool`].
pub(crate) fn started_on_pool(work: &mut (dyn FnMut() + Send)) {
    match rayon::current_thread_index() {
        Some(_) => work(),
        None => on_pool(work),
    }
}
