//! Several signals side by side, each as if it were alone.

use serde::{Deserialize, Serialize};

use crate::filter::{Filter, SideBySide};

/// Rows that threads work on before they meet.
const THREAD_BLOCK: usize = 1 << 16;

/// One filter a channel; samples come in rows of one value a channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bank<F> {
    filters: Vec<F>,
}

impl<F: Clone> Bank<F> {
    /// `channels` copies of `filter`.
    pub fn new(filter: &F, channels: usize) -> Self {
        Self { filters: vec![filter.clone(); channels] }
    }

    /// These filters side by side, one a channel.
    pub fn of(filters: Vec<F>) -> Self {
        Self { filters }
    }

    /// The filters, one a channel.
    pub fn filters(&self) -> &[F] {
        &self.filters
    }

    /// The filters, one a channel, to step one by one.
    pub fn filters_mut(&mut self) -> &mut [F] {
        &mut self.filters
    }

    /// Replaces every sample of one row by its filter's answer.
    #[inline]
    pub fn update<T: Copy>(&mut self, row: &mut [T])
    where
        F: Filter<T>,
    {
        for (filter, z) in self.filters.iter_mut().zip(row) {
            *z = filter.update(*z);
        }
    }

    /// Replaces every sample of `rows`, row after row, by its filter's answer.
    pub fn process<T: Copy + 'static>(&mut self, rows: &mut [T])
    where
        F: SideBySide<T>,
    {
        F::process_rows(&mut self.filters, rows);
    }

    /// [`process`](Self::process) with the channels spread over `threads` threads; the result is
    /// the same to the last bit.
    pub fn process_on_threads<T: Copy + Send + Sync + 'static>(
        &mut self,
        rows: &mut [T],
        threads: usize,
    ) where
        F: SideBySide<T> + Send,
    {
        let channels = self.filters.len();
        let share = channels.div_ceil(threads).max(F::abreast());
        if share >= channels {
            return self.process(rows);
        }
        let mut parts = vec![Vec::new(); channels.div_ceil(share)];
        for block in rows.chunks_mut(THREAD_BLOCK * channels) {
            take_out(&mut self.filters, share, block, &mut parts);
            put_back(&parts, share, channels, block);
        }
    }

    /// Every filter back to before its first sample.
    pub fn reset<T: Copy>(&mut self)
    where
        F: Filter<T>,
    {
        for filter in &mut self.filters {
            filter.reset();
        }
    }
}

/// Fills each part with `share` columns of `rows` after their filters, on a thread of its own.
fn take_out<T, F>(filters: &mut [F], share: usize, rows: &[T], parts: &mut [Vec<T>])
where
    T: Copy + Send + Sync + 'static,
    F: SideBySide<T> + Send,
{
    let channels = filters.len();
    std::thread::scope(|scope| {
        for (i, (filters, part)) in filters.chunks_mut(share).zip(parts).enumerate() {
            scope.spawn(move || {
                let first = i * share;
                let own = first..first + filters.len();
                part.clear();
                for row in rows.chunks_exact(channels) {
                    part.extend_from_slice(&row[own.clone()]);
                }
                F::process_rows(filters, part);
            });
        }
    });
}

/// Puts the columns back into `rows`, a part of these by each thread.
fn put_back<T: Copy + Send + Sync>(
    parts: &[Vec<T>],
    share: usize,
    channels: usize,
    rows: &mut [T],
) {
    let length = (rows.len() / channels).div_ceil(parts.len());
    std::thread::scope(|scope| {
        for (i, rows) in rows.chunks_mut(length * channels).enumerate() {
            scope.spawn(move || {
                for (k, row) in rows.chunks_exact_mut(channels).enumerate() {
                    for (own, part) in row.chunks_mut(share).zip(parts) {
                        let first = (i * length + k) * own.len();
                        own.copy_from_slice(&part[first..first + own.len()]);
                    }
                }
            });
        }
    });
}
