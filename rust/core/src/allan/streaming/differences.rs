//! Sums of squared differences of the phase at every octave.

use serde::{Deserialize, Serialize};

use super::phases::{BLOCK, Phases};

/// Second differences for the Allan variance, and third differences for the Hadamard variance.
/// Octave j takes them from phases `m = 2^j` samples apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Differences {
    second: Vec<Squares>,
    third: Vec<Squares>,
}

/// A sum of squares.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Squares {
    /// Element i sums the terms at phases with an index of i modulo the length: a block adds once
    /// to each element, in parallel.
    sums: [f64; BLOCK],
    terms: u64,
}

impl Differences {
    pub(super) fn new(octaves: usize) -> Self {
        let none = vec![Squares { sums: [0.0; BLOCK], terms: 0 }; octaves];
        Self { second: none.clone(), third: none }
    }

    pub(super) fn octaves(&self) -> usize {
        self.second.len()
    }

    pub(super) fn reset(&mut self) {
        *self = Self::new(self.octaves());
    }

    pub(super) fn second(&self, octave: usize) -> Option<&Squares> {
        self.second.get(octave)
    }

    pub(super) fn third(&self, octave: usize) -> Option<&Squares> {
        self.third.get(octave)
    }

    /// Adds the terms at `x_k`, the last phase, at every octave for which the piece is long enough.
    #[inline]
    pub(super) fn observe(&mut self, phases: &Phases, k: u64) {
        let both = octaves_within(k / 3).min(self.octaves());
        let look = phases.look_back(k);
        let lane = k as usize % BLOCK;
        let (second, rest) = self.second.split_at_mut(both);
        let mut m = 1;
        for (second, third) in second.iter_mut().zip(&mut self.third) {
            let x = look.spaced(m);
            let (allan, hadamard) = (second_difference(x[0], x[1], x[2]), third_difference(x));
            second.sums[lane] += allan * allan;
            third.sums[lane] += hadamard * hadamard;
            second.terms += 1;
            third.terms += 1;
            m *= 2;
        }
        let long = octaves_within(k / 2) - both;
        for second in rest.iter_mut().take(long) {
            let x: [f64; 3] = look.spaced(m);
            second.add(k, second_difference(x[0], x[1], x[2]));
            m *= 2;
        }
    }

    /// [`observe`](Self::observe) at each phase of the last block, which starts at `x_k`.
    pub(super) fn observe_block(&mut self, phases: &Phases, k: u64) {
        let (recent, both) = (phases.recent(), octaves_within(k / 3));
        for (j, (second, third)) in
            self.second.iter_mut().zip(&mut self.third).take(both).enumerate()
        {
            add_blocks(&mut second.sums, &mut third.sums, phases.spaced_blocks(&recent, k, 1 << j));
            second.terms += BLOCK as u64;
            third.terms += BLOCK as u64;
        }
        for (j, second) in self.second.iter_mut().enumerate().take(octaves_within(k / 2)).skip(both)
        {
            add_block(&mut second.sums, phases.spaced_blocks(&recent, k, 1 << j));
            second.terms += BLOCK as u64;
        }
    }

    /// [`observe`](Self::observe) at each phase of the incomplete block.
    pub(super) fn settle(&mut self, phases: &Phases) {
        for k in phases.pending() {
            self.observe(phases, k);
        }
    }

    /// True if this state is possible after `samples` samples.
    pub(super) fn is_possible(&self, samples: u64) -> bool {
        self.second.len() == self.third.len()
            && self.second.iter().chain(&self.third).all(|squares| {
                squares.terms <= samples && squares.sums.iter().all(|sum| *sum >= 0.0)
            })
    }
}

impl Squares {
    #[inline(always)]
    fn add(&mut self, k: u64, term: f64) {
        self.sums[k as usize % BLOCK] += term * term;
        self.terms += 1;
    }

    /// Mean square, NaN without a term, and number of terms.
    pub(super) fn mean(&self) -> (f64, u64) {
        match self.terms {
            0 => (f64::NAN, 0),
            terms => (self.sums.iter().sum::<f64>().min(f64::MAX) / terms as f64, terms),
        }
    }
}

/// Number of octaves with an averaging time of at most `m` samples.
fn octaves_within(m: u64) -> usize {
    m.checked_ilog2().map_or(0, |octave| octave as usize + 1)
}

/// In its own function, so that the compiler knows that nothing overlaps.
#[inline(never)]
fn add_blocks(second: &mut [f64; BLOCK], third: &mut [f64; BLOCK], phases: [&[f64]; 4]) {
    let phases = phases.map(|block| &block[..BLOCK]);
    for i in 0..BLOCK {
        let x = phases.map(|block| block[i]);
        let (allan, hadamard) = (second_difference(x[0], x[1], x[2]), third_difference(x));
        second[i] += allan * allan;
        third[i] += hadamard * hadamard;
    }
}

fn add_block(second: &mut [f64; BLOCK], phases: [&[f64]; 3]) {
    for (i, sum) in second.iter_mut().enumerate() {
        let term = second_difference(phases[0][i], phases[1][i], phases[2][i]);
        *sum += term * term;
    }
}

#[inline(always)]
fn second_difference(now: f64, before: f64, earlier: f64) -> f64 {
    (now - before) - (before - earlier)
}

#[inline(always)]
fn third_difference([a, b, c, d]: [f64; 4]) -> f64 {
    second_difference(a, b, c) - second_difference(b, c, d)
}
