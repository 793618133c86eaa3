//! Several signals side by side, each as if it were alone.

use serde::{Deserialize, Serialize};

use crate::filter::Filter;

/// Rows that a channel works on before the next one.
const BLOCK: usize = 1 << 10;

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
    ///
    /// Channel by channel over a block of rows at a time: one state stays close, and so do the
    /// rows.
    pub fn process<T: Copy + 'static>(&mut self, rows: &mut [T])
    where
        F: Filter<T>,
    {
        let channels = self.filters.len();
        for block in rows.chunks_mut(BLOCK * channels.max(1)) {
            for (c, filter) in self.filters.iter_mut().enumerate() {
                filter.process_each(block.iter_mut().skip(c).step_by(channels));
            }
        }
    }

    /// [`process`](Self::process) with the channels spread over `threads` threads; the result is
    /// the same to the last bit.
    pub fn process_on_threads<T: Copy + Send + 'static>(&mut self, rows: &mut [T], threads: usize)
    where
        F: Filter<T> + Send,
    {
        let channels = self.filters.len();
        if threads < 2 || channels < 2 {
            return self.process(rows);
        }
        let share = channels.div_ceil(threads);
        for block in rows.chunks_mut(THREAD_BLOCK * channels) {
            let mut columns: Vec<Vec<T>> = (0..channels)
                .map(|c| block.iter().skip(c).step_by(channels).copied().collect())
                .collect();
            std::thread::scope(|scope| {
                for (filters, columns) in
                    self.filters.chunks_mut(share).zip(columns.chunks_mut(share))
                {
                    scope.spawn(move || {
                        for (filter, column) in filters.iter_mut().zip(columns) {
                            filter.process(column);
                        }
                    });
                }
            });
            for (c, column) in columns.iter().enumerate() {
                for (z, value) in block.iter_mut().skip(c).step_by(channels).zip(column) {
                    *z = *value;
                }
            }
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
