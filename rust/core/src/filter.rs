//! What all streaming filters share.

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
