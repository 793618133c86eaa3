//! The best estimate of a record: what fixes after a sample say of it (Rauch, Tung and Striebel).

use nalgebra::{Cholesky, Const, Matrix3, SMatrix, SVector, Vector3};

use super::covariance::{Covariance, Errors, PHI, STATES, Transition, V};
use super::filter::Witness;
use super::motion::Motion;
use crate::error::Error;
use crate::memory;

type Full = SMatrix<f64, STATES, STATES>;
type Column = SVector<f64, STATES>;

/// Elements of one triangle.
const TRIANGLE: usize = STATES * (STATES + 1) / 2;

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

/// The steps of a filter, for smoothing: 2.8 kB each.
#[derive(Debug, Clone, Default)]
pub struct Record {
    nodes: Vec<Node>,
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

    fn corrected(&mut self, found: &Errors, covariance: &Covariance, motion: &Motion) {
        if let Some(node) = self.nodes.last_mut() {
            node.found.iter_mut().zip(found).for_each(|(all, more)| *all += more);
            (node.after, node.velocity) = (packed(covariance), motion.velocity);
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
        // By doubling, so that a long record is not copied at every step.
        let more =
            if self.nodes.len() == self.nodes.capacity() { self.nodes.len().max(64) } else { 0 };
        if let Err(error) = memory::reserve(&mut self.nodes, more) {
            self.refused = Some(error);
            return;
        }
        let before = packed(covariance);
        let (sample, velocity) = (self.sample, motion.velocity);
        let found = [0.0; STATES];
        self.nodes.push(Node { sample, transition, before, after: before, found, velocity });
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
    pub fn smoothed(&self) -> impl Iterator<Item = Smoothed> {
        let (mut error, mut covariance) = (Column::zeros(), Full::zeros());
        let mut next: Option<&Node> = None;
        self.nodes.iter().rev().map(move |node| {
            let after = unpacked(&node.after);
            let behind = next.replace(node);
            if let Some((next, transition)) = behind.and_then(|n| Some((n, n.transition?))) {
                let before = unpacked(&next.before);
                let gain = gain(&transition, &after, &before);
                error = gain * (Column::from(next.found) + error);
                let change = gain * (covariance - before) * gain.transpose();
                covariance = after + (change + change.transpose()) * 0.5;
            } else {
                (error, covariance) = (Column::zeros(), after);
            }
            Smoothed {
                sample: node.sample,
                begins: node.transition.is_none(),
                before: (Column::from(node.found) + error).into(),
                after: error.into(),
                sigma: sigma(&covariance, &node.velocity),
            }
        })
    }
}

/// P⁺Φᵀ(P⁻)⁻¹, with errors in units of their deviations.
fn gain(transition: &Transition, after: &Full, behind: &Full) -> Full {
    let scale = behind.diagonal().map(|x| if x > 0.0 { 1.0 / x.sqrt() } else { 1.0 });
    let mut scaled = Full::from_fn(|i, j| behind[(i, j)] * scale[i] * scale[j]);
    let mut carried = Full::zeros();
    for (k, column) in after.column_iter().enumerate() {
        let moved = transition.apply(&column.into_owned().into());
        carried.set_column(k, &Column::from(moved).component_mul(&scale));
    }
    // Rounding can cost definiteness where a variance is known far better than another.
    let mut solved = factor(&scaled);
    let mut more = 1e-14;
    while solved.is_none() && more < 1.0 {
        for i in 0..STATES {
            scaled[(i, i)] += more;
        }
        (solved, more) = (factor(&scaled), more * 100.0);
    }
    let solved = solved.map_or(Full::zeros(), |factor| factor.solve(&carried));
    Full::from_fn(|i, j| solved[(j, i)] * scale[j])
}

fn factor(matrix: &Full) -> Option<Cholesky<f64, Const<STATES>>> {
    Cholesky::new(*matrix)
}

/// Standard deviations, the velocity's as its reader takes it.
fn sigma(covariance: &Full, velocity: &Vector3<f64>) -> Errors {
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

fn unpacked(triangle: &[f64; TRIANGLE]) -> Full {
    Full::from_fn(|i, j| {
        let (row, column) = (i.max(j), i.min(j));
        triangle[row * (row + 1) / 2 + column]
    })
}
