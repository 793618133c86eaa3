//! The last phases of a piece without missing samples.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::memory;
use crate::stream::checkpoint::decode;

/// Number of phases that are processed together.
pub(super) const BLOCK: usize = 32;

/// Start of the first block in which an octave has a term at all phases or at none.
pub(super) const FIRST_BLOCK: u64 = 3 * BLOCK as u64;

/// Largest distance from the first sample: the square of a sum of 2²⁵ of them is finite.
const MAX_DISTANCE: f64 = 1e140;

/// Phases `x_0 = 0, x_1, …`: running sums of the samples' distances from the piece's first sample.
/// An offset reduces no precision.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Phases {
    origin: f64,
    count: u64,
    /// Ring: `x_k` is at `k` modulo the capacity.
    ring: Vec<f64>,
    capacity: usize,
}

impl Phases {
    /// A ring that can look back by `distance` phases from each phase of a block.
    pub(super) fn new(distance: usize) -> Result<Self, Error> {
        Self { origin: 0.0, count: 0, ring: Vec::new(), capacity: capacity(distance) }
            .with_reserve()
    }

    /// Reads a value from the start of `bytes`; memory grows with the bytes that are there.
    pub(super) fn take(bytes: &[u8]) -> Result<(Self, &[u8]), Error> {
        let ((origin, count, length), mut bytes) = decode::<(f64, u64, usize)>(bytes)?;
        let mut ring = memory::room(length.min(bytes.len() / size_of::<f64>()))?;
        for _ in 0..length {
            let (x, rest) = decode::<f64>(bytes)?;
            ring.push(x);
            bytes = rest;
        }
        let (capacity, bytes) = decode(bytes)?;
        Ok((Self { origin, count, ring, capacity }, bytes))
    }

    /// The same phases, with the same capacity.
    pub(super) fn try_clone(&self) -> Result<Self, Error> {
        let mut ring = memory::room(self.capacity)?;
        ring.extend_from_slice(&self.ring);
        Ok(Self { ring, ..*self })
    }

    /// The phases with memory for the whole ring: no step allocates.
    pub(super) fn with_reserve(mut self) -> Result<Self, Error> {
        let missing = self.capacity - self.ring.len();
        memory::reserve(&mut self.ring, missing)?;
        Ok(self)
    }

    /// True if [`new`](Self::new) with this distance can lead to this state.
    pub(super) fn is_valid(&self, distance: usize) -> bool {
        let most = self.count as f64 * MAX_DISTANCE;
        self.capacity == capacity(distance)
            && self.count != 1
            && self.ring.len() as u64 == self.count.min(self.capacity as u64)
            && self.origin.is_finite()
            && self.ring.iter().all(|x| x.abs() <= most)
    }

    /// Bytes of the ring.
    pub(super) fn bytes(&self) -> usize {
        self.capacity * size_of::<f64>()
    }

    /// Number of phases, `x_0` included; the piece has one sample less.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// Notes a missing sample: the next sample starts another piece.
    pub(super) fn clear(&mut self) {
        self.origin = 0.0;
        self.count = 0;
        self.ring.clear();
    }

    /// Adds the phase after sample `z`; returns its index.
    #[inline]
    pub(super) fn push(&mut self, z: f64) -> u64 {
        if self.count == 0 {
            self.origin = z;
            self.store(0.0);
        }
        self.store(self.at(self.count - 1) + self.distance(z));
        self.count - 1
    }

    /// The phases before `x_k`.
    #[inline]
    pub(super) fn look_back(&self, k: u64) -> LookBack<'_> {
        LookBack { ring: &self.ring, mask: self.capacity - 1, k: k as usize }
    }

    /// The phases of the incomplete block, from the first block on that waits for completion.
    pub(super) fn pending(&self) -> Range<u64> {
        let start = self.count - self.count % BLOCK as u64;
        start.max(FIRST_BLOCK).min(self.count)..self.count
    }

    /// The last four blocks, if the last block is complete.
    pub(super) fn recent(&self) -> Recent {
        let mut recent = [0.0; 4 * BLOCK];
        for (i, block) in recent.chunks_exact_mut(BLOCK).enumerate() {
            block.copy_from_slice(self.block(self.count - ((4 - i) * BLOCK) as u64));
        }
        recent
    }

    /// The blocks that start at `x_k, x_{k-m}, x_{k-2m}, …`, where `x_k` is the start of the last
    /// block and `m` a power of two.
    #[inline]
    pub(super) fn spaced_blocks<'a, const N: usize>(
        &'a self,
        recent: &'a Recent,
        k: u64,
        m: u64,
    ) -> [&'a [f64]; N] {
        std::array::from_fn(|i| {
            let distance = i as u64 * m;
            match distance <= 3 * BLOCK as u64 {
                true => &recent[3 * BLOCK - distance as usize..][..BLOCK],
                false => self.block(k - distance),
            }
        })
    }

    /// The block that starts at `x_k`; `k` is a multiple of its length, and the block never wraps.
    fn block(&self, k: u64) -> &[f64] {
        &self.ring[self.index(k)..][..BLOCK]
    }

    fn distance(&self, z: f64) -> f64 {
        (z - self.origin).clamp(-MAX_DISTANCE, MAX_DISTANCE)
    }

    fn at(&self, k: u64) -> f64 {
        self.ring[self.index(k)]
    }

    fn index(&self, k: u64) -> usize {
        k as usize & (self.capacity - 1)
    }

    /// Adds a phase to the ring, or overwrites the oldest phase.
    fn store(&mut self, x: f64) {
        let index = self.index(self.count);
        match self.ring.get_mut(index) {
            Some(oldest) => *oldest = x,
            None => self.ring.push(x),
        }
        self.count += 1;
    }
}

/// The last four blocks of phases.
pub(super) type Recent = [f64; 4 * BLOCK];

impl Clone for Phases {
    /// With the same capacity: a vector's own clone has no spare capacity.
    fn clone(&self) -> Self {
        let mut ring = Vec::with_capacity(self.capacity);
        ring.extend_from_slice(&self.ring);
        Self { ring, ..*self }
    }
}

fn capacity(distance: usize) -> usize {
    (distance + 1).max(4 * BLOCK).next_power_of_two()
}

/// The phases before a phase.
#[derive(Clone, Copy)]
pub(super) struct LookBack<'a> {
    ring: &'a [f64],
    mask: usize,
    k: usize,
}

impl LookBack<'_> {
    /// The phases `x_k, x_{k-m}, x_{k-2m}, …`.
    #[inline(always)]
    pub(super) fn spaced<const N: usize>(&self, m: usize) -> [f64; N] {
        std::array::from_fn(|i| self.ring[self.k.wrapping_sub(i * m) & self.mask])
    }
}
