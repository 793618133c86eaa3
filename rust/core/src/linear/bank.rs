//! A filter with sizes known at run time: channels, whole records, streaming.
#![allow(non_snake_case)]

use wide::f64x4;

use super::check::{check_matrix, check_state, settle_covariance};
use super::step::{
    Advance, ChannelOutputs, Fixed, FixedRoom, LANES, MAX_ELEMENT, MAX_VARIANCE, Size, Work,
    advance_one, advance_several, correct_covariance, is_known, predict_covariance, product,
};
use crate::error::Error;
use crate::math::Pairs;
use crate::memory;

/// Largest number of states, measurements and inputs.
pub(super) const MAX_SIZE: usize = 256;
/// Standard deviation of an unknown initial state, relative to an estimate from as many samples as
/// states.
const UNKNOWN_SIGMAS: f64 = 1e4;

/// The matrices of a filter, row after row: n states, m measurements, p inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Sizes n, m and p.
    pub sizes: [usize; 3],
    /// n × n.
    pub F: Vec<f64>,
    /// m × n.
    pub H: Vec<f64>,
    /// n × n.
    pub Q: Vec<f64>,
    /// m × m.
    pub R: Vec<f64>,
    /// n × p.
    pub B: Vec<f64>,
}

/// A matrix constant in all steps, or one matrix for each step.
#[derive(Debug, Clone, Copy)]
pub struct Varying<'a> {
    values: &'a [f64],
    size: usize,
    each: bool,
}

impl<'a> Varying<'a> {
    /// One matrix for all steps.
    pub fn same(values: &'a [f64]) -> Self {
        Self { values, size: values.len(), each: false }
    }

    /// One matrix of `size` elements a step.
    pub fn each(values: &'a [f64], size: usize) -> Self {
        Self { values, size, each: true }
    }

    /// The matrix of a step.
    #[inline(always)]
    pub fn at(&self, step: usize) -> &'a [f64] {
        if self.each { &self.values[step * self.size..][..self.size] } else { self.values }
    }

    /// The matrices from a step on.
    pub fn from(&self, step: usize) -> Self {
        let first = if self.each { step * self.size } else { 0 };
        Self { values: &self.values[first..], ..*self }
    }
}

/// Steps of a filter, with the model's matrices unless stated.
#[derive(Debug, Clone, Copy, Default)]
pub struct Batch<'a> {
    /// Number of steps.
    pub steps: usize,
    /// True if each step begins with a prediction.
    pub predicts: bool,
    /// n × n.
    pub F: Option<Varying<'a>>,
    /// n × n.
    pub Q: Option<Varying<'a>>,
    /// n × p.
    pub B: Option<Varying<'a>>,
    /// Inputs, p for each channel and step; empty for none.
    pub u: &'a [f64],
    /// True if each step ends with a correction.
    pub corrects: bool,
    /// m × n.
    pub H: Option<Varying<'a>>,
    /// m × m.
    pub R: Option<Varying<'a>>,
    /// Measurements, m for each channel and step.
    pub z: &'a [f64],
}

/// Results of each step, channel after channel; empty arrays are not filled.
#[derive(Debug)]
pub struct Known<'a> {
    /// States, n per channel.
    pub state: &'a mut [f64],
    /// Covariances, n × n per channel, or once for all channels.
    pub covariance: &'a mut [f64],
    /// Innovations, m per channel.
    pub innovation: &'a mut [f64],
    /// Normalised innovation squared, one per channel.
    pub nis: &'a mut [f64],
    /// Log-likelihood, one per channel.
    pub log_likelihood: &'a mut [f64],
}

impl Known<'_> {
    /// Results that are not stored.
    pub fn nothing() -> Self {
        Self {
            state: &mut [],
            covariance: &mut [],
            innovation: &mut [],
            nis: &mut [],
            log_likelihood: &mut [],
        }
    }
}

/// Several filters of one model.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearBank {
    pub(super) channels: Option<usize>,
    pub(super) model: Model,
    /// Initial states of all channels, and their covariance.
    pub(super) x0: Vec<f64>,
    pub(super) P0: Vec<f64>,
    pub(super) x: Vec<f64>,
    /// Covariances, one per channel; while they are equal, only the first is up to date.
    pub(super) P: Vec<f64>,
    pub(super) shared: bool,
    pub(super) innovation: Vec<f64>,
    pub(super) nis: Vec<f64>,
    pub(super) log_likelihood: Vec<f64>,
    pub(super) room: FreeRoom,
}

impl LinearBank {
    /// Filters before their first sample. `x0` has the states of one channel or of each channel.
    /// Without `P0` the states are unknown.
    ///
    /// # Errors
    /// [`Error::Matrix`] if a matrix is not valid for a filter, [`Error::Memory`] if there is no
    /// memory.
    pub fn new(
        mut model: Model,
        x0: Option<&[f64]>,
        P0: Option<&[f64]>,
        channels: Option<usize>,
    ) -> Result<Self, Error> {
        model.check()?;
        let [n, m, _] = model.sizes;
        let count = channels.unwrap_or(1);
        let x0 = x0.unwrap_or(&[0.0]);
        check_state("x0", x0)?;
        let mut initial = memory::room(count.saturating_mul(n))?;
        initial.extend(x0.iter().cycle().take(count * n));
        let P0 = match P0 {
            Some(P0) => {
                let mut P0 = memory::copied(P0)?;
                settle_covariance("P0", None, n, &mut P0)?;
                P0
            }
            None => model.unknown()?,
        };
        let mut bank = Self {
            channels,
            x: memory::copied(&initial)?,
            x0: initial,
            P: memory::filled(0.0, count.saturating_mul(n * n))?,
            P0,
            shared: true,
            innovation: memory::filled(f64::NAN, count.saturating_mul(m))?,
            nis: memory::filled(f64::NAN, count)?,
            log_likelihood: memory::filled(0.0, count)?,
            room: Self::room(n, m)?,
            model,
        };
        bank.reset();
        Ok(bank)
    }

    /// Resets to the state before the first sample.
    pub fn reset(&mut self) {
        self.x.copy_from_slice(&self.x0);
        self.P[..self.P0.len()].copy_from_slice(&self.P0);
        self.shared = true;
        self.innovation.fill(f64::NAN);
        self.nis.fill(f64::NAN);
        self.log_likelihood.fill(0.0);
    }

    /// An independent bank in the same state.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is no memory.
    pub fn try_clone(&self) -> Result<Self, Error> {
        // Tests that the memory of a clone is available.
        drop(memory::room::<f64>(2 * (self.P.len() + 3 * self.x.len() + self.innovation.len()))?);
        Ok(self.clone())
    }

    /// Matrices of the filters.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Number of channels, `None` for a single filter.
    pub fn channels(&self) -> Option<usize> {
        self.channels
    }

    /// Number of filters.
    pub fn count(&self) -> usize {
        self.nis.len()
    }

    /// States of all channels.
    pub fn state(&self) -> &[f64] {
        &self.x
    }

    /// Covariances of each channel, or one shared by all.
    pub fn covariance(&self) -> &[f64] {
        let size = self.P0.len();
        if self.shared { &self.P[..size] } else { &self.P }
    }

    /// Innovations of the last correction, NaN where a measurement was missing.
    pub fn innovation(&self) -> &[f64] {
        &self.innovation
    }

    /// Normalised innovations squared of the last correction; NaN if all measurements were missing.
    pub fn nis(&self) -> &[f64] {
        &self.nis
    }

    /// Log-likelihoods of the last measurements; 0 if all were missing.
    pub fn log_likelihood(&self) -> &[f64] {
        &self.log_likelihood
    }

    /// Number of covariances for these measurements: one if all channels share it now and
    /// afterwards, else one per channel. [`run`](Self::run) writes this number.
    pub fn covariances(&mut self, z: &[f64]) -> usize {
        let (size, row) = (self.P0.len(), self.innovation.len());
        self.shared = self.shared || self.are_equal();
        let m = self.model.sizes[1];
        if self.shared && z.chunks_exact(row).all(|row| misses_the_same(row, m)) {
            return 1;
        }
        if self.shared {
            self.part();
        }
        self.P.len() / size
    }

    /// True if the covariances of all channels are the same.
    pub(super) fn are_equal(&self) -> bool {
        let (first, others) = self.P.split_at(self.P0.len());
        others.chunks_exact(first.len()).all(|P| P == first)
    }

    /// Processes steps. Batches, parts of batches and single steps give bit-identical results.
    pub fn run(&mut self, batch: &Batch<'_>, known: &mut Known<'_>) {
        match (self.model.sizes[0], self.model.sizes[1]) {
            (1, 1) => self.take_fixed::<1, 1>(batch, known),
            (2, 1) => self.take_fixed::<2, 1>(batch, known),
            (2, 2) => self.take_fixed::<2, 2>(batch, known),
            (3, 1) => self.take_fixed::<3, 1>(batch, known),
            (3, 2) => self.take_fixed::<3, 2>(batch, known),
            (3, 3) => self.take_fixed::<3, 3>(batch, known),
            (4, 1) => self.take_fixed::<4, 1>(batch, known),
            (4, 2) => self.take_fixed::<4, 2>(batch, known),
            (4, 3) => self.take_fixed::<4, 3>(batch, known),
            (4, 4) => self.take_fixed::<4, 4>(batch, known),
            (5, 1) => self.take_fixed::<5, 1>(batch, known),
            (5, 2) => self.take_fixed::<5, 2>(batch, known),
            (5, 3) => self.take_fixed::<5, 3>(batch, known),
            (5, 4) => self.take_fixed::<5, 4>(batch, known),
            (6, 1) => self.take_fixed::<6, 1>(batch, known),
            (6, 2) => self.take_fixed::<6, 2>(batch, known),
            (6, 3) => self.take_fixed::<6, 3>(batch, known),
            (6, 4) => self.take_fixed::<6, 4>(batch, known),
            (7, 1) => self.take_fixed::<7, 1>(batch, known),
            (7, 2) => self.take_fixed::<7, 2>(batch, known),
            (7, 3) => self.take_fixed::<7, 3>(batch, known),
            (7, 4) => self.take_fixed::<7, 4>(batch, known),
            (8, 1) => self.take_fixed::<8, 1>(batch, known),
            (8, 2) => self.take_fixed::<8, 2>(batch, known),
            (8, 3) => self.take_fixed::<8, 3>(batch, known),
            (8, 4) => self.take_fixed::<8, 4>(batch, known),
            (9, m) => self.take_in_room(States::<9> { m }, batch, known),
            (10, m) => self.take_in_room(States::<10> { m }, batch, known),
            (12, m) => self.take_in_room(States::<12> { m }, batch, known),
            (15, m) => self.take_in_room(States::<15> { m }, batch, known),
            (n, m) => self.take_in_room(Free { n, m }, batch, known),
        }
    }

    // One function per size: with all sizes in one function the compiler takes much longer.
    #[inline(never)]
    fn take_fixed<const N: usize, const M: usize>(
        &mut self,
        batch: &Batch<'_>,
        known: &mut Known<'_>,
    ) {
        let mut room = FixedRoom::<N, M>::new();
        self.take(Fixed::<N, M>, batch, known, &mut room.work());
    }

    #[inline(never)]
    fn take_in_room<S: Size>(&mut self, size: S, batch: &Batch<'_>, known: &mut Known<'_>) {
        let mut room = core::mem::take(&mut self.room);
        self.take(size, batch, known, &mut room.work(size.n(), size.m()));
        self.room = room;
    }

    #[inline(always)]
    fn take<S: Size>(
        &mut self,
        size: S,
        batch: &Batch<'_>,
        known: &mut Known<'_>,
        work: &mut Work<'_>,
    ) {
        let (n, m, count) = (size.n(), size.m(), self.nis.len());
        let inputs = batch.u.len() / batch.steps.max(1);
        for step in 0..batch.steps {
            let z = match batch.corrects {
                true => &batch.z[step * count * m..][..count * m],
                false => &[],
            };
            if self.shared && count > 1 && !misses_the_same(z, m) {
                self.part();
            }
            let u = &batch.u[step * inputs..][..inputs];
            let model = &self.model;
            let predict = batch.predicts.then(|| {
                let B = if u.is_empty() { &[] } else { of_step(batch.B, &model.B, step) };
                (of_step(batch.F, &model.F, step), of_step(batch.Q, &model.Q, step), B)
            });
            let correct = batch
                .corrects
                .then(|| (of_step(batch.H, &model.H, step), of_step(batch.R, &model.R, step)));
            let group = if self.shared { count } else { 1 };
            for first in (0..count).step_by(group) {
                let P = &mut self.P[first * n * n..][..n * n];
                if let Some((F, Q, _)) = predict {
                    predict_covariance(size, F, Q, P, work);
                }
                let weighed = correct.and_then(|(H, R)| {
                    let row = &z[first * m..][..m];
                    for j in 0..m {
                        work.counts[j] = is_known(row[j]);
                    }
                    let seen = work.counts.iter().any(|counts| *counts);
                    seen.then(|| correct_covariance(size, H, R, P, work))
                });
                let step = Advance {
                    predict: predict.map(|(F, _, B)| (F, B, u)),
                    correct: correct.map(|(H, _)| (H, z, weighed)),
                };
                let mut outputs = ChannelOutputs {
                    state: &mut self.x,
                    innovation: &mut self.innovation,
                    nis: &mut self.nis,
                    log_likelihood: &mut self.log_likelihood,
                };
                let (rest, end) = (first + group - group % LANES, first + group);
                if first < rest {
                    advance_several(size, first..rest, &step, &mut outputs, work);
                }
                for channel in rest..end {
                    advance_one(size, channel, &step, &mut outputs, work);
                }
            }
            self.keep(step, known);
        }
    }

    /// Writes the state after a step.
    #[inline(always)]
    fn keep(&self, step: usize, known: &mut Known<'_>) {
        let covariances = self.covariance();
        keep(step, &self.x, known.state);
        keep(step, &self.innovation, known.innovation);
        keep(step, &self.nis, known.nis);
        keep(step, &self.log_likelihood, known.log_likelihood);
        keep(step, covariances, known.covariance);
    }

    /// Working memory that steps of these sizes need in addition to the stack.
    pub(super) fn room(n: usize, m: usize) -> Result<FreeRoom, Error> {
        if n <= 8 && m <= n.min(4) { Ok(FreeRoom::default()) } else { FreeRoom::of(n, m) }
    }

    /// Creates a covariance for each channel.
    #[cold]
    fn part(&mut self) {
        let size = self.P0.len();
        let (first, others) = self.P.split_at_mut(size);
        others.chunks_exact_mut(size).for_each(|P| P.copy_from_slice(first));
        self.shared = false;
    }
}

/// The matrix of a step, or the model's matrix.
#[inline(always)]
fn of_step<'a>(given: Option<Varying<'a>>, own: &'a [f64], step: usize) -> &'a [f64] {
    given.map_or(own, |given| given.at(step))
}

/// True if all channels of a row miss the same measurements.
#[inline(always)]
fn misses_the_same(row: &[f64], m: usize) -> bool {
    let (first, others) = row.split_at(m.min(row.len()));
    // Usually nothing is missing, which is tested for several numbers at once.
    if others.is_empty() || row.iter().fold(true, |all, z| all & is_known(*z)) {
        return true;
    }
    let mut same = true;
    for z in others.chunks_exact(m) {
        for j in 0..m {
            same &= is_known(z[j]) == is_known(first[j]);
        }
    }
    same
}

#[inline(always)]
fn keep(step: usize, values: &[f64], outputs: &mut [f64]) {
    if !outputs.is_empty() {
        outputs[step * values.len()..][..values.len()].copy_from_slice(values);
    }
}

impl Model {
    /// Refuses invalid matrices; covariances become symmetric to the bit.
    pub(super) fn check(&mut self) -> Result<(), Error> {
        let [n, m, _] = self.sizes;
        for (name, matrix) in [("F", &self.F), ("H", &self.H), ("B", &self.B)] {
            check_matrix(name, None, matrix)?;
        }
        settle_covariance("Q", None, n, &mut self.Q)?;
        settle_covariance("R", None, m, &mut self.R)
    }

    /// True if the covariances are symmetric to the bit.
    pub(super) fn is_settled(&self) -> bool {
        [(self.sizes[0], &self.Q), (self.sizes[1], &self.R)].iter().all(|(size, matrix)| {
            (0..*size).all(|i| (0..i).all(|j| matrix[i * size + j] == matrix[j * size + i]))
        })
    }

    /// Covariance of unknown states: [`UNKNOWN_SIGMAS`]² times the variance of each state from n
    /// samples. It has the states' units.
    fn unknown(&self) -> Result<Vec<f64>, Error> {
        let [n, m, _] = self.sizes;
        let mut information = memory::filled(0.0, n)?;
        let mut row = memory::filled(0.0, n)?;
        let mut next = memory::filled(0.0, n)?;
        let mut exactly = memory::filled(false, n)?;
        for j in 0..m {
            row.copy_from_slice(&self.H[j * n..][..n]);
            let mut variance = self.R[j * m + j];
            for (i, h) in row.iter().enumerate() {
                let q: f64 = row.iter().zip(&self.Q[i * n..]).map(|(h, q)| h * q).sum();
                variance += h * q;
            }
            for _ in 0..=n {
                for (i, h) in row.iter().enumerate() {
                    information[i] += if variance > 0.0 { h * h / variance } else { 0.0 };
                    exactly[i] |= variance <= 0.0 && *h != 0.0;
                }
                product(Pairs, false, [1, n, n], &row, &self.F, &mut next);
                // Powers of F may overflow.
                let held = next.iter().map(|h| h.clamp(-MAX_ELEMENT, MAX_ELEMENT));
                row.iter_mut().zip(held).for_each(|(row, h)| *row = h);
            }
        }
        let mut P0 = memory::filled(0.0, n * n)?;
        for (i, information) in information.iter().enumerate() {
            if *information <= 0.0 {
                let expected = if exactly[i] {
                    "given: a state is measured without noise, so Q and R tell no size that its \
                     deviation may have"
                } else {
                    "given: of a state the measurements tell nothing in as many samples as there \
                     are states"
                };
                return Err(Error::Matrix { name: "P0", step: None, expected });
            }
            P0[i * n + i] =
                (UNKNOWN_SIGMAS * UNKNOWN_SIGMAS / information).min(MAX_VARIANCE / n as f64);
        }
        Ok(P0)
    }
}

/// Sizes that are known only at run time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Free {
    pub n: usize,
    pub m: usize,
}

impl Size for Free {
    type States = Self;
    type Column<'a, T: Copy + 'a> = &'a mut [T];
    type Row<'a, T: Copy + 'a> = &'a mut [T];
    const IS_SMALL: bool = false;

    fn states(self) -> Self {
        self
    }

    fn n(self) -> usize {
        self.n
    }

    fn m(self) -> usize {
        self.m
    }

    fn column<'a, T: Copy + 'a>(self, _: T, room: &'a mut [T]) -> &'a mut [T] {
        room
    }

    fn row<'a, T: Copy + 'a>(self, _: T, room: &'a mut [T]) -> &'a mut [T] {
        room
    }
}

/// A number of states known to the compiler, and any number of measurements: with many states,
/// measurements need little time.
#[derive(Debug, Clone, Copy)]
struct States<const N: usize> {
    m: usize,
}

impl<const N: usize> Size for States<N> {
    type States = Fixed<N, 1>;
    type Column<'a, T: Copy + 'a> = [T; N];
    type Row<'a, T: Copy + 'a> = &'a mut [T];
    const IS_SMALL: bool = false;

    #[inline(always)]
    fn states(self) -> Fixed<N, 1> {
        Fixed
    }

    #[inline(always)]
    fn n(self) -> usize {
        N
    }

    #[inline(always)]
    fn m(self) -> usize {
        self.m
    }

    #[inline(always)]
    fn column<'a, T: Copy + 'a>(self, zero: T, _: &'a mut [T]) -> [T; N] {
        [zero; N]
    }

    #[inline(always)]
    fn row<'a, T: Copy + 'a>(self, _: T, room: &'a mut [T]) -> &'a mut [T] {
        room
    }
}

/// Working memory of any size; empty if the compiler knows the size.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct FreeRoom {
    numbers: Vec<f64>,
    lanes: Vec<f64x4>,
    counts: Vec<bool>,
}

impl FreeRoom {
    pub fn of(n: usize, m: usize) -> Result<Self, Error> {
        Ok(Self {
            numbers: memory::filled(0.0, 4 * n * n + 5 * m * n + 2 * m * m + 2 * m + 3 * n)?,
            lanes: memory::filled(f64x4::ZERO, 2 * n + m)?,
            counts: memory::filled(false, m)?,
        })
    }

    pub fn work(&mut self, n: usize, m: usize) -> Work<'_> {
        let (numbers, lanes) = (&mut self.numbers[..], &mut self.lanes[..]);
        let (a, numbers) = numbers.split_at_mut(n * n);
        let (b, numbers) = numbers.split_at_mut(n * n);
        let (c, numbers) = numbers.split_at_mut(n * n);
        let (d, numbers) = numbers.split_at_mut(n * n);
        let (hp, numbers) = numbers.split_at_mut(m * n);
        let (v, numbers) = numbers.split_at_mut(m * n);
        let (k, numbers) = numbers.split_at_mut(m * n);
        let (h, numbers) = numbers.split_at_mut(m * n);
        let (rk, numbers) = numbers.split_at_mut(m * n);
        let (l, numbers) = numbers.split_at_mut(m * m);
        let (r, numbers) = numbers.split_at_mut(m * m);
        let (inverse, numbers) = numbers.split_at_mut(m);
        let (before, numbers) = numbers.split_at_mut(n);
        let (x, numbers) = numbers.split_at_mut(n);
        let (next, w) = numbers.split_at_mut(n);
        let (xs, lanes) = lanes.split_at_mut(n);
        let (nexts, ws) = lanes.split_at_mut(n);
        let (one, several) = ([x, next, w], [xs, nexts, ws]);

        let counts = &mut self.counts;
        Work { a, b, c, d, hp, v, k, h, l, r, rk, inverse, counts, before, one, several }
    }
}
