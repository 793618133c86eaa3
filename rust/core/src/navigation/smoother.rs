//! Smoother: the best estimate of a record, with fixes after each sample.
//!
//! It has the form of Bryson and Frazier. The information of later scalars propagates backwards as
//! a vector and a matrix. The covariance of each step converts them to errors, without an inverse
//! (G. J. Bierman, *International Journal of Control* 18(1), 1973). In exact arithmetic the result
//! equals the smoother of Rauch, Tung and Striebel.

use nalgebra::{Cholesky, Const, SMatrix, SVector, Vector3};

use super::covariance::{
    CONSTANTS, CONSTANTS_WITHOUT_AIDS, Constants, ConstantsCovariance, Covariance, Errors, PHI,
    STATES, Scalar, Transition, V,
};
use super::filter::Observer;
use super::motion::Motion;
use crate::error::Error;
use crate::math::{Fours, OnRows, widest};
use crate::memory;

type Full<const N: usize> = SMatrix<f64, N, N>;
type Column<const N: usize> = SVector<f64, N>;
/// Rows of a matrix, with additional places to fill registers.
type Rows<const N: usize, const W: usize> = [[f64; W]; N];
type Triangle = [f64; STATES * (STATES + 1) / 2];

/// Numbers of errors and constants in a filter without barometer and compass, and in a filter with
/// them. A product uses three rows at a time: the last number has one more row, zero.
const WITHOUT_AIDS: usize = STATES + CONSTANTS_WITHOUT_AIDS;
const ALL: usize = (STATES + CONSTANTS).next_multiple_of(3);

/// One step of the covariance.
#[derive(Debug, Clone)]
struct Node {
    /// Index of the sample at its end.
    sample: usize,
    /// Transition from the previous node; `None` if the filter began here.
    transition: Option<Transition>,
    /// Covariance after the measurements at the node.
    after: Triangle,
    /// Errors subtracted at the node.
    found: Errors,
    velocity: Vector3<f64>,
    /// Number of scalars to the end of the step.
    scalars: usize,
    /// Index of the prior covariances, if they do not follow from the scalars.
    prior: Option<usize>,
}

/// A node before its measurements, and the subtracted errors of constants.
#[derive(Debug, Clone)]
struct Prior {
    errors: Triangle,
    found: Constants,
}

/// The steps of a filter, for smoothing: 1.9 kB each, 0.4 kB for each scalar, and 1.7 kB more with
/// estimated constants.
#[derive(Debug, Clone, Default)]
pub struct Record {
    nodes: Vec<Node>,
    /// Constants of the last nodes: once a constant is estimated, it is estimated to the end.
    constants: Vec<ConstantsCovariance>,
    scalars: Vec<Scalar>,
    priors: Vec<Prior>,
    /// Constants of the last priors.
    prior_constants: Vec<ConstantsCovariance>,
    /// Prior of the last node.
    prior: Option<(Prior, Option<ConstantsCovariance>)>,
    widened: bool,
    /// Index of the present sample.
    sample: usize,
    refused: Option<Error>,
}

/// Smoothed step: errors of the filter's track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothed {
    /// Index of the sample at its end.
    pub sample: usize,
    /// True if the filter began there: earlier samples belong to another piece.
    pub begins: bool,
    /// Errors of the state before the measurements there.
    pub before: Errors,
    /// Errors of the state after the measurements.
    pub after: Errors,
    /// Standard deviations of the smoothed state.
    pub sigma: Errors,
}

impl Observer for Record {
    fn sample(&mut self, number: usize) {
        self.sample = number;
    }

    fn record_step(&mut self, transition: &Transition, covariance: &Covariance, motion: &Motion) {
        self.push(Some(*transition), covariance, motion);
    }

    fn record_scalar(&mut self, scalar: &Scalar) {
        if self.refused.is_none() {
            self.refused = try_push(&mut self.scalars, *scalar).err();
        }
    }

    fn drop_scalars(&mut self, scalars: usize) {
        self.scalars.truncate(self.scalars.len().saturating_sub(scalars));
    }

    fn mark_widened(&mut self) {
        self.widened = true;
    }

    fn record_constants(&mut self, constants: &Constants) {
        let kept = self.nodes.last().and_then(|node| node.prior);
        let kept = kept.and_then(|index| self.priors.get_mut(index));
        for prior in self.prior.iter_mut().map(|(prior, _)| prior).chain(kept) {
            prior.found.iter_mut().zip(constants).for_each(|(all, more)| *all += more);
        }
    }

    fn record_correction(&mut self, found: &Errors, covariance: &Covariance, motion: &Motion) {
        let Some(node) = self.nodes.last_mut().filter(|_| self.refused.is_none()) else { return };
        node.found.iter_mut().zip(found).for_each(|(all, more)| *all += more);
        (node.after, node.velocity) = (pack(covariance), motion.velocity);
        match (self.constants.last_mut(), covariance.1) {
            (Some(constants), Some(extra)) => *constants = extra,
            (None, Some(extra)) => self.refused = try_push(&mut self.constants, extra).err(),
            _ => {}
        }
        let unexplained = self.scalars.len() == node.scalars || self.widened;
        node.scalars = self.scalars.len();
        self.widened = false;
        if (unexplained || node.prior.is_some())
            && let Some((prior, extra)) = &self.prior
        {
            if node.prior.is_none() {
                node.prior = Some(self.priors.len());
                let extra = extra.map_or(Ok(()), |one| try_push(&mut self.prior_constants, one));
                self.refused = extra.and(try_push(&mut self.priors, prior.clone())).err();
            }
            self.forget_scalars();
        }
    }

    fn record_start(&mut self, covariance: &Covariance, motion: &Motion) {
        self.push(None, covariance, motion);
    }
}

impl Record {
    fn push(&mut self, transition: Option<Transition>, covariance: &Covariance, motion: &Motion) {
        if self.refused.is_some() {
            return;
        }
        // Remove the scalars of a filter that restarts because of them.
        let scalars = self.nodes.last().map_or(0, |node| node.scalars);
        self.scalars.truncate(scalars);
        self.widened = false;
        let (sample, velocity, found) = (self.sample, motion.velocity, [0.0; STATES]);
        let after = pack(covariance);
        let extra = covariance.1;
        self.prior = Some((Prior { errors: after, found: [0.0; CONSTANTS] }, extra));
        let node = Node { sample, transition, after, found, velocity, scalars, prior: None };
        let kept = try_push(&mut self.nodes, node)
            .and_then(|()| extra.map_or(Ok(()), |one| try_push(&mut self.constants, one)));
        self.refused = kept.err();
    }

    /// Removes the scalars of the last node, which has a prior instead.
    fn forget_scalars(&mut self) {
        let before = self.nodes.len().checked_sub(2).map_or(0, |k| self.nodes[k].scalars);
        self.scalars.truncate(before);
        if let Some(node) = self.nodes.last_mut() {
            node.scalars = before;
        }
    }

    /// Returns an error if memory ran out.
    ///
    /// # Errors
    /// [`Error::Memory`] if it ran out.
    pub fn validate(&self) -> Result<(), Error> {
        self.refused.clone().map_or(Ok(()), Err)
    }

    /// Number of steps.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// True if there are no steps.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The smoothed steps, from the last to the first. Standard deviations take a multiple of the
    /// time; without them they are NaN.
    pub fn smoothed(&self, deviations: bool) -> Box<dyn Iterator<Item = Smoothed> + Send + '_> {
        let aided = self.constants.last().map(|last| last.aided);
        match (aided, deviations) {
            (None, true) => Box::new(self.back::<STATES, 16, true>()),
            (None, false) => Box::new(self.back::<STATES, 16, false>()),
            (Some(false), true) => Box::new(self.back::<WITHOUT_AIDS, 24, true>()),
            (Some(false), false) => Box::new(self.back::<WITHOUT_AIDS, 24, false>()),
            (Some(true), true) => Box::new(self.back::<ALL, 24, true>()),
            (Some(true), false) => Box::new(self.back::<ALL, 24, false>()),
        }
    }

    /// The smoothed steps, with constants among the errors if N is larger than the number of
    /// errors, and with standard deviations if D is true.
    fn back<const N: usize, const W: usize, const D: bool>(
        &self,
    ) -> impl Iterator<Item = Smoothed> {
        let mut later = Later::<N, W, D>::nothing();
        let back = move |k| widest(Back { record: self, k, later: &mut later });
        (0..self.nodes.len()).rev().map(back)
    }
}

/// One step back.
struct Back<'a, const N: usize, const W: usize, const D: bool> {
    record: &'a Record,
    /// Index of the node that the step reaches.
    k: usize,
    /// Information of all later steps, then including this step.
    later: &'a mut Later<N, W, D>,
}

impl<const N: usize, const W: usize, const D: bool> OnRows for Back<'_, N, W, D> {
    type Output = Smoothed;

    #[inline(always)]
    fn run<F: Fours>(self, fours: F) -> Smoothed {
        let Self { record, k, later } = self;
        let (nodes, node) = (&record.nodes, &record.nodes[k]);
        match nodes.get(k + 1).and_then(|next| next.transition) {
            Some(transition) => later.propagate_back(fours, &transition),
            None => *later = Later::nothing(),
        }
        let after = rows::<N, W>(&node.after, of_last(&record.constants, k, nodes.len()));
        let error = fours.sum([0.0; W], &later.vector, &after);
        let smoothed = Smoothed {
            sample: node.sample,
            begins: node.transition.is_none(),
            before: core::array::from_fn(|i| node.found[i] + error[i]),
            after: core::array::from_fn(|i| error[i]),
            sigma: later.sigma(fours, &after, &node.velocity),
        };
        if let Some(index) = node.prior {
            let prior = &record.priors[index];
            let extra = of_last(&record.prior_constants, index, record.priors.len());
            let before = rows::<N, W>(&prior.errors, extra);
            later.add_change(&before, &after, &node.found, &prior.found);
        } else {
            let first = k.checked_sub(1).map_or(0, |before| nodes[before].scalars);
            let own = &record.scalars[first..node.scalars];
            for scalar in own.iter().rev() {
                later.add(fours, scalar);
            }
        }
        smoothed
    }
}

/// Covariance of the constants in step k of n: `None` before the first step with constants.
fn of_last(constants: &[ConstantsCovariance], k: usize, n: usize) -> Option<&ConstantsCovariance> {
    constants.get((k + constants.len()).checked_sub(n)?)
}

/// Information of all later measurements for a step. Its errors are the covariance times `vector`.
/// With D, the covariance decreases by covariance times `matrix` times covariance.
#[derive(Debug, Clone)]
struct Later<const N: usize, const W: usize, const D: bool> {
    vector: [f64; W],
    matrix: Rows<N, W>,
}

impl<const N: usize, const W: usize, const D: bool> Later<N, W, D> {
    fn nothing() -> Self {
        Self { vector: [0.0; W], matrix: [[0.0; W]; N] }
    }

    /// Goes back over a step of the covariance: Φᵀλ and ΦᵀΛΦ.
    #[inline(always)]
    fn propagate_back<F: Fours>(&mut self, fours: F, transition: &Transition) {
        let mut errors = [0.0; STATES];
        errors.copy_from_slice(&self.vector[..STATES]);
        self.vector[..STATES].copy_from_slice(&transition.apply_transposed(&errors));
        if !D {
            return;
        }
        transition.transposed_times(fours, &mut self.matrix);
        self.transpose();
        transition.transposed_times(fours, &mut self.matrix);
        self.even_out();
    }

    #[inline(always)]
    fn transpose(&mut self) {
        for i in 0..N {
            for j in 0..i {
                let upper = self.matrix[j][i];
                self.matrix[j][i] = self.matrix[i][j];
                self.matrix[i][j] = upper;
            }
        }
    }

    /// Mean of the upper and lower triangle.
    #[inline(always)]
    fn even_out(&mut self) {
        for i in 0..N {
            for j in 0..i {
                let mean = 0.5 * (self.matrix[i][j] + self.matrix[j][i]);
                self.matrix[i][j] = mean;
                self.matrix[j][i] = mean;
            }
        }
    }

    /// Goes back over a scalar with gain K: λ + h (ε/S - Kᵀλ), and (I - Kh)ᵀΛ(I - Kh) + hᵀh/S.
    #[inline(always)]
    fn add<F: Fours>(&mut self, fours: F, scalar: &Scalar) {
        let inverse = 1.0 / scalar.new.variance;
        let h = all::<N, W>(&scalar.h, &scalar.hw);
        let gain = all::<N, W>(&scalar.gain, &scalar.own).map(|x| x * inverse);
        let dot = |x: &[f64; W]| gain.iter().zip(x).map(|(k, x)| k * x).sum::<f64>();
        let new = scalar.new.value * inverse - dot(&self.vector);
        self.vector = core::array::from_fn(|i| self.vector[i] + h[i] * new);
        if !D {
            return;
        }
        let moved = fours.sum([0.0; W], &gain, &self.matrix);
        let half = 0.5 * (dot(&moved) + inverse);
        // Λ - hᵀt - tᵀh with t = KᵀΛ - h (KᵀΛK + 1/S)/2 is exactly symmetric.
        let t: [f64; W] = core::array::from_fn(|i| moved[i] - half * h[i]);
        for (i, row) in self.matrix.iter_mut().enumerate() {
            let (own, other) = (fours.splat(h[i]), fours.splat(t[i]));
            for k in 0..W / 4 {
                let of_own = fours.multiply(own, fours.take(&t, k));
                let less = fours.add(of_own, fours.multiply(other, fours.take(&h, k)));
                fours.put(fours.subtract(fours.take(row, k), less), row, k);
            }
        }
    }

    /// Goes back over a correction by the covariances before and after it, without scalars.
    #[cold]
    fn add_change(
        &mut self,
        before: &Rows<N, W>,
        after: &Rows<N, W>,
        found: &Errors,
        constants: &Constants,
    ) {
        let (before, after) = (full(before), full(after));
        let vector = Column::<N>::from_fn(|i, _| self.vector[i]);
        let matrix = full(&self.matrix);
        let found = Column::<N>::from_fn(|i, _| match i.checked_sub(STATES) {
            Some(k) => constants.get(k).copied().unwrap_or(0.0),
            None => found[i],
        });
        let inverse = inverse(&before);
        let vector = inverse * (found + after * vector);
        self.vector[..N].copy_from_slice(vector.as_slice());
        if !D {
            return;
        }
        let change = before - after + after * matrix * after;
        let matrix = inverse * change * inverse;
        for i in 0..N {
            for j in 0..N {
                self.matrix[i][j] = 0.5 * (matrix[(i, j)] + matrix[(j, i)]);
            }
        }
    }

    /// `matrix` times rows, three at a time, which fill the registers of every x86-64.
    #[inline(always)]
    fn times<F: Fours>(&self, fours: F, rows: &Rows<N, 16>) -> Rows<N, 16> {
        let mut product = [[0.0; 16]; N];
        let threes = product.as_chunks_mut::<3>().0.iter_mut().zip(self.matrix.as_chunks::<3>().0);
        for ([a, b, c], [of_a, of_b, of_c]) in threes {
            for pair in 0..2 {
                let [left, right] = [2 * pair, 2 * pair + 1];
                let [mut a1, mut a2, mut b1, mut b2, mut c1, mut c2] = [fours.splat(0.0); 6];
                for (j, row) in rows.iter().enumerate() {
                    let (x, y) = (fours.take(row, left), fours.take(row, right));
                    let by = fours.splat(of_a[j]);
                    a1 = fours.add_product(a1, by, x);
                    a2 = fours.add_product(a2, by, y);
                    let by = fours.splat(of_b[j]);
                    b1 = fours.add_product(b1, by, x);
                    b2 = fours.add_product(b2, by, y);
                    let by = fours.splat(of_c[j]);
                    c1 = fours.add_product(c1, by, x);
                    c2 = fours.add_product(c2, by, y);
                }
                for (rows, x, y) in [(&mut *a, a1, a2), (&mut *b, b1, b2), (&mut *c, c1, c2)] {
                    fours.put(x, rows, left);
                    fours.put(y, rows, right);
                }
            }
        }
        product
    }

    /// Standard deviations of the smoothed state; the velocity's error is converted to true axes.
    #[inline(always)]
    fn sigma<F: Fours>(
        &self,
        fours: F,
        covariance: &Rows<N, W>,
        velocity: &Vector3<f64>,
    ) -> Errors {
        if !D {
            return [f64::NAN; STATES];
        }
        let mut errors = [[0.0; 16]; N];
        for (row, whole) in errors.iter_mut().zip(covariance) {
            row.copy_from_slice(&whole[..16]);
        }
        let products = self.times(fours, &errors);
        let mut less = [0.0; 16];
        for (row, product) in errors.iter().zip(&products) {
            (0..16).for_each(|j| less[j] += row[j] * product[j]);
        }
        let skew = velocity.cross_matrix();
        let of = |i: usize, row: &[f64; 16]| {
            row[V + i] + (0..3).map(|k| skew[(i, k)] * row[PHI + k]).sum::<f64>()
        };
        core::array::from_fn(|j| {
            let variance = if (V..PHI).contains(&j) {
                let i = j - V;
                let own = of(i, &errors[V + i])
                    + (0..3).map(|k| skew[(i, k)] * of(i, &errors[PHI + k])).sum::<f64>();
                own - errors.iter().zip(&products).map(|(a, b)| of(i, a) * of(i, b)).sum::<f64>()
            } else {
                errors[j][j] - less[j]
            };
            variance.max(0.0).sqrt()
        })
    }
}

/// Values of the errors, and of the constants if N is larger than the number of errors.
#[inline(always)]
fn all<const N: usize, const W: usize>(errors: &[f64; 16], constants: &Constants) -> [f64; W] {
    let mut row = [0.0; W];
    row[..STATES].copy_from_slice(&errors[..STATES]);
    let count = CONSTANTS.min(N - STATES);
    row[STATES..STATES + count].copy_from_slice(&constants[..count]);
    row
}

/// Covariance of the errors, and of the constants.
#[inline(always)]
fn rows<const N: usize, const W: usize>(
    errors: &Triangle,
    extra: Option<&ConstantsCovariance>,
) -> Rows<N, W> {
    let mut rows = [[0.0; W]; N];
    let mut slots = errors.iter();
    for i in 0..STATES {
        for (j, slot) in (0..=i).zip(&mut slots) {
            (rows[i][j], rows[j][i]) = (*slot, *slot);
        }
    }
    if let Some(extra) = extra {
        let count = CONSTANTS.min(N - STATES);
        for i in STATES..STATES + count {
            for j in 0..STATES {
                let cross = extra.cross[i - STATES][j];
                (rows[i][j], rows[j][i]) = (cross, cross);
            }
            rows[i][STATES..STATES + count].copy_from_slice(&extra.own[i - STATES][..count]);
        }
    }
    rows
}

fn full<const N: usize, const W: usize>(rows: &Rows<N, W>) -> Full<N> {
    Full::from_fn(|i, j| rows[i][j])
}

/// Inverse of a covariance, with errors in units of their standard deviations. Known constants are
/// no part of it.
fn inverse<const N: usize>(covariance: &Full<N>) -> Full<N> {
    let scale = covariance.diagonal().map(|x| if x > 0.0 { 1.0 / x.sqrt() } else { 0.0 });
    let mut scaled = Full::<N>::from_fn(|i, j| covariance[(i, j)] * scale[i] * scale[j]);
    (0..N).filter(|i| scale[*i] == 0.0).for_each(|i| scaled[(i, i)] = 1.0);
    // If one variance is much smaller than another, rounding can make the matrix indefinite.
    let mut solved = factor(&scaled);
    let mut more = 1e-14;
    while solved.is_none() && more < 1.0 {
        for i in 0..N {
            scaled[(i, i)] += more;
        }
        (solved, more) = (factor(&scaled), more * 100.0);
    }
    let found = solved.map_or(Full::zeros(), |factor| factor.inverse());
    Full::from_fn(|i, j| found[(i, j)] * scale[i] * scale[j])
}

fn factor<const N: usize>(matrix: &Full<N>) -> Option<Cholesky<f64, Const<N>>> {
    Cholesky::new(*matrix)
}

/// Adds an element and doubles the room if needed: a long record is not copied at every step.
fn try_push<T>(all: &mut Vec<T>, one: T) -> Result<(), Error> {
    let more = if all.len() == all.capacity() { all.len().max(64) } else { 0 };
    memory::reserve(all, more)?;
    all.push(one);
    Ok(())
}

fn pack(covariance: &Covariance) -> Triangle {
    let mut triangle = [0.0; STATES * (STATES + 1) / 2];
    let mut slots = triangle.iter_mut();
    for i in 0..STATES {
        for (j, slot) in (0..=i).zip(&mut slots) {
            *slot = covariance.at(i, j);
        }
    }
    triangle
}

#[cfg(test)]
mod tests {
    use super::{
        ALL, CONSTANTS, Column, Full, Observer, Record, STATES, Scalar, Transition, V, inverse,
    };
    use crate::navigation::covariance::{Constants, Covariance, Errors, PHI};
    use crate::navigation::{
        Adapt, Aid, AidParams, Fix, Inertial, Kind, LIMITS, Motion, NavigationFilter,
        NavigationParams, Reading, Start,
    };
    use nalgebra::Vector3;

    type Matrix = Full<ALL>;

    struct Step {
        transition: Option<Transition>,
        covariances: [Matrix; 2],
        found: Column<ALL>,
        velocity: Vector3<f64>,
    }

    /// A record, with all data for the smoother of Rauch, Tung and Striebel.
    #[derive(Default)]
    struct Watched {
        record: Record,
        steps: Vec<Step>,
        widened: usize,
    }

    fn matrix(covariance: &Covariance) -> Matrix {
        Matrix::from_fn(|i, j| match (i < STATES, j < STATES, &covariance.1) {
            (true, true, _) => covariance.at(i, j),
            (_, _, None) => 0.0,
            _ if i.max(j) >= STATES + CONSTANTS => 0.0,
            (true, false, Some(extra)) => extra.cross[j - STATES][i],
            (false, true, Some(extra)) => extra.cross[i - STATES][j],
            (false, false, Some(extra)) => extra.own[i - STATES][j - STATES],
        })
    }

    impl Watched {
        fn push(&mut self, transition: Option<&Transition>, now: &Covariance, motion: &Motion) {
            self.steps.push(Step {
                transition: transition.copied(),
                covariances: [matrix(now); 2],
                found: Column::zeros(),
                velocity: motion.velocity,
            });
        }

        /// Errors after the measurements of each step, and the smoothed covariances.
        fn smoothed(&self) -> Vec<(Column<ALL>, Matrix)> {
            let last = self.steps.last().expect("a step");
            let mut all = vec![(Column::zeros(), last.covariances[1])];
            for pair in self.steps.windows(2).rev() {
                let [now, next] = pair else { continue };
                let after = now.covariances[1];
                let Some(transition) = next.transition else {
                    all.push((Column::zeros(), after));
                    continue;
                };
                let mut propagated = Matrix::zeros();
                for (k, column) in after.column_iter().enumerate() {
                    let errors = transition.apply(&core::array::from_fn(|i| column[i]));
                    let of = |i: usize| if i < STATES { errors[i] } else { column[i] };
                    propagated.set_column(k, &Column::from_fn(|i, _| of(i)));
                }
                let gain = propagated.transpose() * inverse(&next.covariances[0]);
                let (error, covariance) = &all[all.len() - 1];
                let change = gain * (covariance - next.covariances[0]) * gain.transpose();
                all.push((gain * (next.found + error), after + change));
            }
            all.reverse();
            all
        }
    }

    impl Observer for Watched {
        fn sample(&mut self, number: usize) {
            self.record.sample(number);
        }
        fn record_scalar(&mut self, scalar: &Scalar) {
            self.record.record_scalar(scalar);
        }
        fn drop_scalars(&mut self, scalars: usize) {
            self.record.drop_scalars(scalars);
        }
        fn mark_widened(&mut self) {
            self.widened += 1;
            self.record.mark_widened();
        }
        fn record_step(&mut self, transition: &Transition, now: &Covariance, motion: &Motion) {
            self.push(Some(transition), now, motion);
            self.record.record_step(transition, now, motion);
        }
        fn record_constants(&mut self, constants: &Constants) {
            let step = self.steps.last_mut().expect("a step");
            constants.iter().enumerate().for_each(|(k, more)| step.found[STATES + k] += more);
            self.record.record_constants(constants);
        }
        fn record_correction(&mut self, found: &Errors, now: &Covariance, motion: &Motion) {
            let step = self.steps.last_mut().expect("a step");
            found.iter().enumerate().for_each(|(k, more)| step.found[k] += more);
            (step.covariances[1], step.velocity) = (matrix(now), motion.velocity);
            self.record.record_correction(found, now, motion);
        }
        fn record_start(&mut self, now: &Covariance, motion: &Motion) {
            self.push(None, now, motion);
            self.record.record_start(now, motion);
        }
    }

    /// A body that sways about a place for 40 s. Fixes come four times a second, with an outage and
    /// one rejected fix. From 30 s on they are far off, and the filter moves to them.
    fn observe_run(antenna_sigma: f64, consider_antenna: bool, aided: bool) -> Watched {
        let start = Start {
            quaternion: [1.0, 0.0, 0.0, 0.0],
            heading_known: true,
            course: false,
            time: 1.0,
            latitude: 0.8,
            gyro_bias: [0.0; 3],
            accel_bias: [0.0; 3],
            level_sigma: 0.02,
            heading_sigma: 0.1,
            gyro_bias_sigma: 1e-3,
            accel_bias_sigma: 0.05,
        };
        let params = NavigationParams {
            gyro_noise: [1e-6; 3],
            accel_noise: [4e-4; 3],
            gyro_walk: [1e-10; 3],
            accel_walk: [2.5e-7; 3],
            gyro_vibration: 0.0,
            antenna: [0.5, 0.0, -1.0],
            antenna_sigma: [antenna_sigma; 3],
            consider_antenna,
            wheels: None,
            gate: 50.0,
            adapt: Adapt::Fixed,
            covariance_step: 0.1,
            kind: Kind::Rate,
            aids: AidParams::default(),
            limits: LIMITS,
        };
        let mut filter = NavigationFilter::new(start, params).expect("parameters");
        let mut watched = Watched::default();
        for k in 0..2000_u32 {
            let time = 0.02 * f64::from(k);
            let sway = (0.7 * time).sin();
            let (gyro, accel) = ([0.05 * sway, 0.02, 0.1], [0.8 * sway, 0.3, -9.81]);
            watched.sample(k as usize);
            let sample = Inertial { time, gyro, accel, rest: false };
            filter.update_before(&sample, &mut watched).expect("in order");
            if aided && k % 10 == 3 {
                take_aids(&mut filter, time, &mut watched);
            }
            if k % 12 == 0 && !(12.0..19.0).contains(&time) {
                let far = if k == 600 - 24 || time > 30.0 { 1e-4 } else { 0.0 };
                let noise = 1e-8 * f64::from(k * 7919 % 13);
                let fix = Fix {
                    time,
                    position: [0.8 + far + noise, 0.1 - noise, 100.0],
                    velocity: [f64::NAN; 3],
                    position_sigma: [0.5; 3],
                    velocity_sigma: [0.1; 3],
                };
                filter.update_gnss_before(&fix, &mut watched).expect("a fix");
            }
        }
        assert!(filter.fixes().rejected > 10 && filter.fixes().moved > 0);
        assert!(watched.widened > 0 && watched.record.priors.len() > 1);
        watched
    }

    /// Readings of a barometer and a compass, which are disturbed for a while, and of two antennas.
    fn take_aids(filter: &mut NavigationFilter, time: f64, watched: &mut Watched) {
        let wave = (13.0 * time).sin();
        let step = if (20.0..36.0).contains(&time) { 1.0 } else { 0.0 };
        let height = 130.0 + 0.5 * wave + 9.0 * step;
        let heading = filter.motion.heading() + 0.02 * wave + step;
        let (sin, cos) = filter.motion.heading().sin_cos();
        let readings = [
            Reading::Height(height),
            Reading::Heading(heading),
            Reading::Baseline([cos, sin, 0.01 * wave], Some([1.0, 0.0, 0.0])),
        ];
        for reading in readings {
            let aid = Aid { time, reading, sigma: [0.05; 3] };
            filter.update_aid_before(&aid, watched).expect("a reading");
        }
    }

    #[test]
    fn it_says_what_rauch_tung_and_striebel_say() {
        let cases = [(0.0, false), (0.1, false), (0.1, true)];
        let all = cases.into_iter().flat_map(|case| [(case, false), (case, true)]);
        for ((antenna_sigma, considered), aided) in all {
            let watched = observe_run(antenna_sigma, considered, aided);
            let smoothed = watched.smoothed();
            let found: Vec<_> = watched.record.smoothed(true).collect();
            assert_eq!(found.len(), smoothed.len());
            for ((own, (error, covariance)), step) in
                found.iter().rev().zip(&smoothed).zip(&watched.steps)
            {
                let skew = step.velocity.cross_matrix();
                for i in (0..STATES).filter(|i| !(V..PHI).contains(i)) {
                    let sigma = covariance[(i, i)].max(0.0).sqrt();
                    assert!((own.sigma[i] / sigma - 1.0).abs() < 1e-4, "{} {i}", own.sample);
                    let off = own.after[i] - error[i];
                    assert!(off.abs() < 1e-6 * sigma, "{} {i}: {off}, {sigma}", own.sample);
                    assert!((own.before[i] - error[i] - step.found[i]).abs() < 1e-6 * sigma);
                }
                for i in 0..3 {
                    let mut h = Column::<ALL>::zeros();
                    h[V + i] = 1.0;
                    (0..3).for_each(|k| h[PHI + k] = skew[(i, k)]);
                    let sigma = (h.transpose() * covariance * h)[0].max(0.0).sqrt();
                    assert!((own.sigma[V + i] / sigma - 1.0).abs() < 1e-4, "{} {i}", own.sample);
                    assert!((own.after[V + i] - error[V + i]).abs() < 1e-6 * sigma);
                }
            }
        }
    }

    #[test]
    fn errors_are_the_same_without_deviations() {
        let watched = observe_run(0.1, false, true);
        let [with, without] = [true, false].map(|deviations| watched.record.smoothed(deviations));
        for (one, other) in with.zip(without) {
            assert_eq!((one.before, one.after), (other.before, other.after));
            assert!(other.sigma.iter().all(|sigma| sigma.is_nan()));
        }
    }
}
