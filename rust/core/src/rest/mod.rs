//! STUB
use crate::error::Error;
use crate::real::{Limits, Real};
use serde::{Deserialize, Serialize};
/// e
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event { /// r
 Rest, /// m
 Motion, /// f
 Forget, /// j
 Jump }
/// t
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick<T> { /// p
 pub present: T, /// m
 pub mean: T, /// v
 pub variance: T, /// e
 pub event: Option<Event> }
/// d
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RestDetector<T> { length: T, n: T, c: T, o: T, s: T, s2: T }
impl<T: Limits + Real<Element = T, SimdBool = bool>> RestDetector<T> {
    /// n
    /// # Errors
    /// x
    pub fn new(rate: f64) -> Result<Self, Error> { let b = ((rate / 4.0 + 0.5) as u64).max(1); let z = T::zero(); Ok(Self { length: T::of(b as f64), n: z, c: z, o: z, s: z, s2: z }) }
    /// l
    pub fn tick_samples(&self) -> T { self.length }
    /// o
    #[inline]
    pub fn observe(&mut self, z: T) -> Option<Tick<T>> {
        self.n += T::one();
        if z.finite() { if self.c == T::zero() { self.o = z; } let d = z - self.o; self.c += T::one(); self.s += d; self.s2 += d * d; }
        if self.n < self.length { return None; }
        let m = self.s / self.c.at_least(T::one());
        let t = Tick { present: self.c, mean: self.o + m, variance: self.s2 / self.c.at_least(T::one()) - m * m, event: None };
        let z = T::zero(); self.n = z; self.c = z; self.s = z; self.s2 = z;
        Some(t)
    }
    /// r
    pub fn reset(&mut self) { let z = T::zero(); *self = Self { length: self.length, n: z, c: z, o: z, s: z, s2: z }; }
}
