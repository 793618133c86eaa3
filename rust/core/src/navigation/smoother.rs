//! The best estimate of a record: what fixes after a sample say of it (Rauch, Tung and Striebel).

use nalgebra::{Cholesky, Const, Matrix3, SMatrix, SVector, Vector3};

use super::covariance::{
    Beside, CONSTANTS, Constants, Covariance, Errors, PHI, STATES, Transition, V,
};
use super::filter::Witness;
use super::motion::Motion;
use crate::error::Error;
use crate::memory;

type Full<const N: usize> = SMatrix<f64, N, N>;
type Column<const N: usize> = SVector<f64, N>;

/// Elements of one triangle.
const TRIANGLE: usize = STATES * (STATES + 1) / 2;
/// Errors and constants.
const ALL: usize = STATES + CONSTANTS;

/// One step of the covariance.
#[derive(Debug, Clone)]
struct Node {
    /// The sample that it ends at.
    sample: usize,
    /// From the node before; none where the filter began.
    transition: Option<Transition>,
    /// Before and after what was measured there.
    before: [f64; TRIANGLE],
    after: [f64; TRIANGLE],
    /// Taken out there.
    found: Errors,
    velocity: Vector3<f64>,
}

/// What it has of constants, if there are some: before and after what was measured, and taken out.
#[derive(Debug, Clone)]
struct Constant {
    before: Beside,
    after: Beside,
    found: Constants,
}

/// The steps of a filter, for smoothing: 2.8 kB each, and 2.3 kB more where constants are estimated.
#[derive(Debug, Clone, Default)]
pub struct Record {
    nodes: Vec<Node>,
    /// Of the last nodes: constants that are estimated once are so to the end.
    constants: Vec<Constant>,
    /// The sample under way.
    sample: usize,
    refused: Option<Error>,
}

/// What a smoother says of one step: errors of the filter's track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothed {
    /// Index of the sample that it ends at.
    pub sample: usize,
    /// Whether the filter began there: what was before is of another piece.
    pub begins: bool,
    /// Of what the filter knew before the measurements there.
    pub before: Errors,
    /// Of what it knew after them.
    pub after: Errors,
    /// Standard deviations that remain.
    pub sigma: Errors,
}

impl Witness for Record {
    fn sample(&mut self, number: usize) {
        self.sample = number;
    }

    fn stepped(&mut self, transition: &Transition, covariance: &Covariance, motion: &Motion) {
        self.push(Some(*transition), covariance, motion);
    }

    fn told(&mut self, constants: &Constants) {
        if let Some(node) = self.constants.last_mut() {
            node.found.iter_mut().zip(constants).for_each(|(all, more)| *all += more);
        }
    }

    fn corrected(&mut self, found: &Errors, covariance: &Covariance, motion: &Motion) {
        if let Some(node) = self.nodes.last_mut() {
            node.found.iter_mut().zip(found).for_each(|(all, more)| *all += more);
            (node.after, node.velocity) = (packed(covariance), motion.velocity);
        }
        if let (Some(node), Some(beside)) = (self.constants.last_mut(), covariance.1) {
            node.after = beside;
        }
    }

    fn started(&mut self, covariance: &Covariance, motion: &Motion) {
        self.push(None, covariance, motion);
    }
}

impl Record {
    fn push(&mut self, transition: Option<Transition>, covariance: &Covariance, motion: &Motion) {
        if self.refused.is_some() {
            return;
        }
        let before = packed(covariance);
        let (sample, velocity) = (self.sample, motion.velocity);
        let found = [0.0; STATES];
        let node = Node { sample, transition, before, after: before, found, velocity };
        let constant = covariance.1.map(|beside| Constant {
            before: beside,
            after: beside,
            found: [0.0; CONSTANTS],
        });
        let kept = added(&mut self.nodes, node)
            .and_then(|()| constant.map_or(Ok(()), |one| added(&mut self.constants, one)));
        self.refused = kept.err();
    }

    /// Whether memory sufficed so far.
    ///
    /// # Errors
    /// [`Error::Memory`] if it did not.
    pub fn checked(&self) -> Result<(), Error> {
        self.refused.clone().map_or(Ok(()), Err)
    }

    /// Number of steps.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// What all fixes say of each step, from the last to the first.
    pub fn smoothed(&self) -> Box<dyn Iterator<Item = Smoothed> + Send + '_> {
        if self.constants.is_empty() {
            Box::new(self.back::<STATES>())
        } else {
            Box::new(self.back::<ALL>())
        }
    }

    /// The same, with the constants among the errors where N is more than these.
    fn back<const N: usize>(&self) -> impl Iterator<Item = Smoothed> {
        let (mut error, mut covariance) = (Column::<N>::zeros(), Full::<N>::zeros());
        let mut next: Option<usize> = None;
        (0..self.nodes.len()).rev().map(move |k| {
            let node = &self.nodes[k];
            let after = self.covariance::<N>(k, false);
            let behind = next.replace(k);
            let step = behind.and_then(|n| self.nodes[n].transition.map(|move_| (n, move_)));
            if let Some((behind, transition)) = step {
                let before = self.covariance::<N>(behind, true);
                let gain = gain(&transition, &after, &before);
                error = gain * (self.found::<N>(behind) + error);
                let change = gain * (covariance - before) * gain.transpose();
                covariance = after + (change + change.transpose()) * 0.5;
            } else {
                (error, covariance) = (Column::zeros(), after);
            }
            let own = self.found::<N>(k) + error;
            Smoothed {
                sample: node.sample,
                begins: node.transition.is_none(),
                before: core::array::from_fn(|i| own[i]),
                after: core::array::from_fn(|i| error[i]),
                sigma: sigma(&covariance.fixed_view::<STATES, STATES>(0, 0).into(), &node.velocity),
            }
        })
    }

    /// What a node has of constants; of those before the first that does what that began with.
    fn constant(&self, node: usize) -> Option<&Constant> {
        self.constants.get((node + self.constants.len()).checked_sub(self.nodes.len())?)
    }

    fn found<const N: usize>(&self, node: usize) -> Column<N> {
        let constants = self.constant(node).map_or([0.0; CONSTANTS], |one| one.found);
        let errors = &self.nodes[node].found;
        Column::from_fn(|i, _| if i < STATES { errors[i] } else { constants[i - STATES] })
    }

    fn covariance<const N: usize>(&self, node: usize, before: bool) -> Full<N> {
        let Node { before: first, after, .. } = &self.nodes[node];
        let errors = if before { first } else { after };
        let of = |one: &Constant| if before { one.before } else { one.after };
        let prior = || self.constants.first().map_or(Beside::NONE, |one| one.before.alone());
        let beside = self.constant(node).map_or_else(prior, of);
        Full::from_fn(|i, j| match (i < STATES, j < STATES) {
            (true, true) => element(errors, i, j),
            (false, true) => beside.cross[i - STATES][j],
            (true, false) => beside.cross[j - STATES][i],
            (false, false) => beside.own[i - STATES][j - STATES],
        })
    }
}

/// By doubling, so that a long record is not copied at every step.
fn added<T>(all: &mut Vec<T>, one: T) -> Result<(), Error> {
    let more = if all.len() == all.capacity() { all.len().max(64) } else { 0 };
    memory::reserve(all, more)?;
    all.push(one);
    Ok(())
}

/// P⁺Φᵀ(P⁻)⁻¹, with errors in units of their deviations.
fn gain<const N: usize>(transition: &Transition, after: &Full<N>, behind: &Full<N>) -> Full<N> {
    let scale = behind.diagonal().map(|x| if x > 0.0 { 1.0 / x.sqrt() } else { 1.0 });
    let mut scaled = Full::<N>::from_fn(|i, j| behind[(i, j)] * scale[i] * scale[j]);
    // What is known is no part of it.
    (0..N).filter(|i| behind[(*i, *i)] <= 0.0).for_each(|i| scaled[(i, i)] = 1.0);
    let mut carried = Full::<N>::zeros();
    for (k, column) in after.column_iter().enumerate() {
        let errors = core::array::from_fn(|i| column[i]);
        let moved = transition.apply(&errors);
        // Constants stay.
        let all = Column::<N>::from_fn(|i, _| if i < STATES { moved[i] } else { column[i] });
        carried.set_column(k, &all.component_mul(&scale));
    }
    // Rounding can cost definiteness where a variance is known far better than another.
    let mut solved = factor(&scaled);
    let mut more = 1e-14;
    while solved.is_none() && more < 1.0 {
        for i in 0..N {
            scaled[(i, i)] += more;
        }
        (solved, more) = (factor(&scaled), more * 100.0);
    }
    let solved = solved.map_or(Full::zeros(), |factor| factor.solve(&carried));
    Full::from_fn(|i, j| solved[(j, i)] * scale[j])
}

fn factor<const N: usize>(matrix: &Full<N>) -> Option<Cholesky<f64, Const<N>>> {
    Cholesky::new(*matrix)
}

/// Standard deviations, the velocity's as its reader takes it.
fn sigma(covariance: &Full<STATES>, velocity: &Vector3<f64>) -> Errors {
    let block =
        |i: usize, j: usize| -> Matrix3<f64> { covariance.fixed_view::<3, 3>(i, j).into_owned() };
    let skew = velocity.cross_matrix();
    let mixed = skew * block(PHI, V);
    let of_velocity =
        block(V, V) + mixed + mixed.transpose() + skew * block(PHI, PHI) * skew.transpose();
    let mut variances = covariance.diagonal();
    for i in 0..3 {
        variances[V + i] = of_velocity[(i, i)];
    }
    variances.map(|x| x.max(0.0).sqrt()).into()
}

fn packed(covariance: &Covariance) -> [f64; TRIANGLE] {
    let mut triangle = [0.0; TRIANGLE];
    let mut places = triangle.iter_mut();
    for i in 0..STATES {
        for (j, place) in (0..=i).zip(&mut places) {
            *place = covariance.at(i, j);
        }
    }
    triangle
}

fn element(triangle: &[f64; TRIANGLE], i: usize, j: usize) -> f64 {
    let (row, column) = (i.max(j), i.min(j));
    triangle[row * (row + 1) / 2 + column]
}
