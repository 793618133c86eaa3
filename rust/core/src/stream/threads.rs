//! The threads that all work is spread over: one pool a process, and a new one after a fork.

use std::process;
use std::sync::OnceLock;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::work::Current;

/// A pool and the process whose threads it has; after it the pools of processes forked from it.
#[derive(Debug)]
struct Pools {
    /// No pool where the system refuses threads.
    first: OnceLock<(u32, Option<ThreadPool>)>,
    rest: OnceLock<Box<Pools>>,
}

impl Pools {
    const fn none() -> Self {
        Self { first: OnceLock::new(), rest: OnceLock::new() }
    }
}

static POOLS: Pools = Pools::none();

/// Does `work` on the pool of this process, where rayon's functions spread it, or on the calling
/// thread if the system refuses more. A fork takes over no threads, so a child makes its own.
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
            // Made before the lock is taken: a fork meanwhile would take over a lock that nobody
            // opens again. Of two that are made at once one is dropped.
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

/// Does both, at once if there is a thread for it. What is done is not part of the types, so that
/// rayon's machinery is compiled once and not for every kind of stream.
pub(crate) fn both(one: &mut (dyn FnMut() + Send), other: &mut (dyn FnMut() + Send)) {
    rayon::join(one, other);
}

/// Does `work`, which is not part of the types, on the pool that the caller is in, or [`on_pool`].
pub(crate) fn started_on_pool(work: &mut (dyn FnMut() + Send)) {
    match rayon::current_thread_index() {
        Some(_) => work(),
        None => on_pool(work),
    }
}
