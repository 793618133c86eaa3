//! Fit of bias, scale, misalignment and delay of a gyro: gravity becomes most constant.

use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};

use super::cost::{BIAS_SIGMA_RAD_S, Means, average, costs, mean, weight};
use super::gyro::Record;
use super::ticks::TICK;
use super::window::MEANS;
use crate::math::rotation::{exponential, turned};
use crate::work::{collect, pause};

/// Number of unknowns: bias, nine elements of the matrix by rows, delay.
const SIZE: usize = 13;
const ROUNDS: usize = 4;
/// Standard deviations of the matrix elements from the identity, and of the delay, s.
const MATRIX_SIGMA: f64 = 0.1;
const DELAY_SIGMA_S: f64 = 0.05;
/// Root of the smallest cost of any model.
const COST_FLOOR: f64 = 0.01;

type Numbers = SVector<f64, SIZE>;
type Rows = SMatrix<f64, 3, SIZE>;

/// Best fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Cost of each window.
    pub costs: Vec<f64>,
    /// Bias, rad/s; matrix of the rate without bias, minus 1, by rows; delay, s.
    pub numbers: [f64; SIZE],
    /// Standard deviations of `numbers`.
    pub sigmas: [f64; SIZE],
}

/// Weighting of a window's scatter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trust {
    /// Weighting as in the fit of a bias: another gyro's axes must not look like errors of this
    /// gyro.
    Little,
    /// Weighting by the scatter of three means and axes, for a gyro that fits: the standard
    /// deviations are then correct.
    Full,
}

impl Trust {
    fn weight(self, cost: f64, g: f64) -> f64 {
        match self {
            Self::Little => weight(cost, g),
            Self::Full => 3.0 / ((cost + COST_FLOOR * COST_FLOOR) * (g * g).max(f64::MIN_POSITIVE)),
        }
    }
}

/// Fits the stated gyro, `(1 + E) (gyro - bias)`, `delay` earlier, in windows of ticks.
pub fn fit(
    rates: &[[f64; 3]],
    forces: &[[f64; 3]],
    starts: &[usize],
    length: usize,
    bias: &[f64; 3],
    trust: Trust,
) -> Fit {
    let record = Record::of(rates, forces);
    let mut numbers = Numbers::zeros();
    numbers.fixed_rows_mut::<3>(0).copy_from_slice(bias);
    let nothing = [f64::NAN; SIZE];
    let mut best = Fit { costs: collect([]), numbers: nothing, sigmas: nothing };
    for _ in 0..ROUNDS {
        let windows = collect(starts.iter().map(|first| {
            pause();
            let part = *first..*first + length;
            sensitive(&record.rates[part.clone()], &record.forces[part], &numbers)
        }));
        let (costs, g) = costs(&collect(windows.iter().map(|window| window.means)));
        let (normal, right) = normal_equations(&windows, &costs, g, &numbers, trust);
        let Some(normal) = normal.cholesky() else { break };
        if best.costs.is_empty() || average(&costs) < average(&best.costs) {
            let sigmas = normal.inverse().diagonal().map(f64::sqrt);
            best = Fit { costs, numbers: numbers.into(), sigmas: sigmas.into() };
        }
        numbers += normal.solve(&right);
        if !numbers.iter().all(|x| x.is_finite()) {
            break;
        }
    }
    best
}

fn normal_equations(
    windows: &[Sensitive],
    costs: &[f64],
    g: f64,
    numbers: &Numbers,
    trust: Trust,
) -> (SMatrix<f64, SIZE, SIZE>, Numbers) {
    let deviation = |k: usize| {
        if k < 3 {
            BIAS_SIGMA_RAD_S
        } else if k < 12 {
            MATRIX_SIGMA
        } else {
            DELAY_SIGMA_S
        }
    };
    let prior = Numbers::from_fn(|k, _| deviation(k).powi(-2));
    let (mut normal, mut right) = (SMatrix::from_diagonal(&prior), -prior.component_mul(numbers));
    for (window, cost) in windows.iter().zip(costs) {
        let (centre, weight) = (mean(&window.means), trust.weight(*cost, g));
        let middle = window.rows.iter().sum::<Rows>() / MEANS as f64;
        for (f, rows) in window.means.iter().zip(&window.rows) {
            let rows = rows - middle;
            normal += rows.transpose() * rows * weight;
            right -= rows.transpose() * (f - centre) * weight;
        }
    }
    (normal, right)
}

/// Triangular means of a window, and their derivatives.
#[derive(Debug, Clone)]
struct Sensitive {
    means: Means,
    rows: [Rows; MEANS],
}

fn sensitive(rates: &[Vector3<f64>], forces: &[Vector3<f64>], numbers: &Numbers) -> Sensitive {
    let bias = numbers.fixed_rows::<3>(0).into_owned();
    let matrix = Matrix3::identity() + Matrix3::from_row_slice(&numbers.as_slice()[3..12]);
    let delay = numbers[12];
    let block = rates.len() / (MEANS + 1);
    let mut found = Sensitive { means: [Vector3::zeros(); MEANS], rows: [Rows::zeros(); MEANS] };
    let (mut rotation, mut theta) = (UnitQuaternion::identity(), Rows::zeros());
    for (k, (rate, force)) in rates.iter().zip(forces).enumerate() {
        let raw = rate - bias;
        let rate = matrix * raw;
        rotation = turned(&rotation, &(rate * (TICK / 2.0)));
        let turn = rotation.to_rotation_matrix().into_inner();
        let step = by_numbers(&turn, &matrix, &raw);
        let mut now = theta + step * (TICK / 2.0);
        now.set_column(12, &(turn * rate));
        theta += step * TICK;
        let force = turn * (exponential(&(rate * delay)) * force);
        let columns = force.cross_matrix() * -now;
        let (b, part) = (k / block, ((k % block) as f64 + 0.5) / block as f64);
        for (mean, part) in [(b, part), (b.wrapping_sub(1), 1.0 - part)] {
            if mean < MEANS {
                found.means[mean] += force * (part / block as f64);
                found.rows[mean] += columns * (part / block as f64);
            }
        }
        rotation = turned(&rotation, &(rate * (TICK / 2.0)));
    }
    found
}

/// Derivatives of the frame's rotation per second by each unknown except the delay.
fn by_numbers(turn: &Matrix3<f64>, matrix: &Matrix3<f64>, raw: &Vector3<f64>) -> Rows {
    let mut step = Rows::zeros();
    step.fixed_columns_mut::<3>(0).copy_from(&(turn * -matrix));
    for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
        step.set_column(3 + 3 * i + j, &(turn.column(i) * raw[j]));
    }
    step
}
