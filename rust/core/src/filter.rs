//! What all streaming filters share.

/// One sample in, one out; a batch is nothing but a loop.
pub trait Filter<T: Copy> {
    /// Takes one sample and answers at once.
    fn update(&mut self, z: T) -> T;

    /// Back to the state before the first sample, with the same parameters.
    fn reset(&mut self);

    /// Replaces every sample by the filter's answer to it, equal to the last bit to calling
    /// [`update`](Self::update) sample by sample.
    fn process(&mut self, samples: &mut [T]) {
        for z in samples {
            *z = self.update(*z);
        }
    }
}
