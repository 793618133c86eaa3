//! Sums of squared differences of the phase at every octave.

use serde::{Deserialize, Serialize};

use super::phases::{BLOCK, Phases, Recent};

/// Of `N` phases each: second differences, of which the Allan variance is made, for three, third
/// ones, of which the Hadamard variance is, for four. Octave j spaces them by `m = 2^j` samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Differences<const N: usize> {
    octaves: Vec<Tally>,
}

/// One octave.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Tally {
    /// Element i sums up the terms at phases whose index is i modulo the length, so that a block
    /// adds to each once, side by side.
    sums: [f64; BLOCK],
    terms: u64,
}

impl<const N: usize> Differences<N> {
    pub(super) fn new(octaves: usize) -> Self {
        Self { octaves: vec![Tally { sums: [0.0; BLOCK], terms: 0 }; octaves] }
    }

    pub(super) fn octaves(&self) -> usize {
        self.octaves.len()
    }

    pub(super) fn reset(&mut self) {
        *self = Self::new(self.octaves());
    }

    /// Adds the term at `x_k`, the last phase, at every octave that the stretch is long enough for.
    #[inline]
    pub(super) fn observe(&mut self, phases: &Phases, k: u64) {
        for (j, tally) in self.octaves.iter_mut().take(Self::active(k)).enumerate() {
            let term = difference::<N>(phases.spaced(k, 1 << j));
            tally.sums[k as usize % BLOCK] += term * term;
            tally.terms += 1;
        }
    }

    /// [`observe`](Self::observe) at each phase of the last block, which starts at `x_k`.
    pub(super) fn observe_block(&mut self, phases: &Phases, recent: &Recent, k: u64) {
        for (j, tally) in self.octaves.iter_mut().take(Self::active(k)).enumerate() {
            add_squares::<N>(&mut tally.sums, phases.spaced_blocks(recent, k, 1 << j));
            tally.terms += BLOCK as u64;
        }
    }

    /// Mean square at octave `j`, NaN without a term, and the number of terms.
    pub(super) fn mean_square(&self, j: usize) -> (f64, u64) {
        self.octaves.get(j).map_or((f64::NAN, 0), |tally| {
            let sum = tally.sums.iter().sum::<f64>().min(f64::MAX);
            match tally.terms {
                0 => (f64::NAN, 0),
                terms => (sum / terms as f64, terms),
            }
        })
    }

    /// Whether this could be after `samples`.
    pub(super) fn is_possible(&self, samples: u64) -> bool {
        self.octaves
            .iter()
            .all(|tally| tally.terms <= samples && tally.sums.iter().all(|sum| *sum >= 0.0))
    }

    /// How many octaves have a term at `x_k`: a block is whole in all of them or in none.
    fn active(k: u64) -> usize {
        let longest = k / (N as u64 - 1);
        longest.checked_ilog2().map_or(0, |octave| octave as usize + 1)
    }
}

/// Apart, so that the compiler knows that nothing overlaps.
#[inline(never)]
fn add_squares<const N: usize>(sums: &mut [f64; BLOCK], phases: [&[f64]; N]) {
    let phases = phases.map(|block| &block[..BLOCK]);
    for i in 0..BLOCK {
        let term = difference(phases.map(|block| block[i]));
        sums[i] += term * term;
    }
}

/// The difference of order N - 1.
#[inline(always)]
fn difference<const N: usize>(mut x: [f64; N]) -> f64 {
    for order in 1..N {
        for i in 0..N - order {
            x[i] -= x[i + 1];
        }
    }
    x[0]
}
