//! What all streaming filters share.

/// Rows that a channel works on before the next one: one state stays close, and so do the rows.
pub(crate) const BLOCK: usize = 1 << 10;

/// One sample in, one out; a batch is nothing but a loop.
pub trait Filter<T: Copy> {
    /// Takes one sample and answers at once.
    fn update(&mut self, z: T) -> T;

    /// Back to the state before the first sample, with the same parameters.
    fn reset(&mut self);

    /// Replaces every sample by the filter's answer to it, equal to the last bit to calling
    /// [`update`](Self::update) sample by sample.
    fn process(&mut self, samples: &mut [T])
    where
        T: 'static,
    {
        self.process_each(samples.iter_mut());
    }

    /// [`process`](Self::process) for samples that do not lie side by side.
    fn process_each<'a>(&mut self, samples: impl Iterator<Item = &'a mut T>)
    where
        T: 'static,
    {
        for z in samples {
            *z = self.update(*z);
        }
    }
}

/// A filter of which several, one a channel, work side by side.
pub trait SideBySide<T: Copy + 'static>: Filter<T> + Sized {
    /// How many of them take hardly longer than one.
    fn abreast() -> usize {
        1
    }

    /// Replaces every sample of `rows`, which have one a filter, by that filter's answer, equal to
    /// the last bit to each filter alone on its column.
    fn process_rows(filters: &mut [Self], rows: &mut [T]) {
        let channels = filters.len();
        for block in rows.chunks_mut(BLOCK * channels.max(1)) {
            for (c, filter) in filters.iter_mut().enumerate() {
                filter.process_column(c, channels, block);
            }
        }
    }

    /// Replaces every sample of one column of `rows` by the answer.
    fn process_column(&mut self, column: usize, channels: usize, rows: &mut [T]) {
        self.process_each(rows.iter_mut().skip(column).step_by(channels));
    }
}
