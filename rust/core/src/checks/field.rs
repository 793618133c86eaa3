//! Costs of a magnetometer's axis senses, compared with the gyro.

use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};

use super::cost::average;
use super::gyro::Record;
use super::ticks::TICK;
use super::window::windows;
use super::{ROTATIONS, Sense};
use crate::math::parallel;
use crate::math::rotation::{exponential, turned};
use crate::work::{collect, filled, pause};

/// Number of ticks in a window, with constant field and hard iron, and in each mean.
const WINDOW_TICKS: usize = 1200;
const MEAN_TICKS: usize = 25;
/// Largest number of windows.
const MAX_WINDOWS: usize = 60;
/// Regularisation of the hard iron, in units of the field.
const RIDGE: f64 = 1e-3;
/// Standard deviation of the gyro's bias, rad/s.
const BIAS_SIGMA_RAD_S: f64 = 0.05;
const ROUNDS: usize = 3;
/// Root of the smallest cost that is distinguished.
const COST_FLOOR: f64 = 0.05;
const MAX_COST: f64 = 4.0;

/// Costs of the hypotheses on a magnetometer.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldCosts {
    /// First tick of each window.
    pub starts: Vec<usize>,
    /// Number of ticks in a window.
    pub length: usize,
    /// Costs by rotation and window. A sense and its negative cannot be distinguished.
    pub costs: Vec<f64>,
    /// Costs of the fields without any rotation, by window.
    pub null: Vec<f64>,
}

/// Tests the rotations from ticks of a gyro, rad/s and without bias, and of a magnetometer, with a
/// median field of 1.
pub fn field_costs(rates: &[[f64; 3]], fields: &[[f64; 3]]) -> FieldCosts {
    let record = Record::of(rates, fields);
    let starts = windows(&record.rates, &record.forces, WINDOW_TICKS, MAX_WINDOWS);
    let all = collect(starts.iter().map(|first| {
        pause();
        let part = *first..*first + WINDOW_TICKS;
        Window::of(&record.rates[part.clone()], &record.forces[part])
    }));
    let senses = collect(Sense::rotations());
    let costs = parallel::map(senses, true, |sense| costs(&all, &sense));
    FieldCosts {
        length: WINDOW_TICKS,
        costs: collect(costs.into_iter().flatten()),
        null: collect(
            starts.iter().map(|first| scatter(&record.forces[*first..*first + WINDOW_TICKS])),
        ),
        starts,
    }
}

/// Means of a window's blocks, rotated into a frame that does not turn.
struct Window {
    /// Element `(i, j)` of matrix `c` is the mean of R_ij m_c.
    tensors: Vec<[Matrix3<f64>; 3]>,
    /// Means of R, and of its integral from the middle of the window.
    rotations: Vec<Matrix3<f64>>,
    integrals: Vec<Matrix3<f64>>,
    /// (AᵀA + ridge)⁻¹ for the field and the hard iron.
    inverse: SMatrix<f64, 6, 6>,
}

impl Window {
    fn of(rates: &[Vector3<f64>], fields: &[Vector3<f64>]) -> Self {
        let (mut rotation, mut integral) = (UnitQuaternion::identity(), Matrix3::zeros());
        let mut own = Self {
            tensors: filled([Matrix3::zeros(); 3], WINDOW_TICKS / MEAN_TICKS),
            rotations: filled(Matrix3::zeros(), WINDOW_TICKS / MEAN_TICKS),
            integrals: filled(Matrix3::zeros(), WINDOW_TICKS / MEAN_TICKS),
            inverse: SMatrix::zeros(),
        };
        let (mut middle, part) = (Matrix3::zeros(), 1.0 / MEAN_TICKS as f64);
        for (k, (rate, field)) in rates.iter().zip(fields).enumerate() {
            if k == WINDOW_TICKS / 2 {
                middle = integral;
            }
            rotation = turned(&rotation, &(rate * (TICK / 2.0)));
            let turn = rotation.to_rotation_matrix().into_inner();
            for c in 0..3 {
                own.tensors[k / MEAN_TICKS][c] += turn * (field[c] * part);
            }
            own.rotations[k / MEAN_TICKS] += turn * part;
            own.integrals[k / MEAN_TICKS] += (integral + turn * (TICK / 2.0)) * part;
            integral += turn * TICK;
            rotation = turned(&rotation, &(rate * (TICK / 2.0)));
        }
        own.integrals.iter_mut().for_each(|psi| *psi -= middle);
        own.inverse = own.normal().try_inverse().unwrap_or_else(SMatrix::zeros);
        own
    }

    fn normal(&self) -> SMatrix<f64, 6, 6> {
        let mut normal = SMatrix::<f64, 6, 6>::zeros();
        let number = self.rotations.len() as f64;
        normal.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(number);
        for turn in &self.rotations {
            let mut across = normal.fixed_view_mut::<3, 3>(0, 3);
            across += turn;
            let mut own = normal.fixed_view_mut::<3, 3>(3, 3);
            own += turn.transpose() * turn;
        }
        let across = normal.fixed_view::<3, 3>(0, 3).transpose();
        normal.fixed_view_mut::<3, 3>(3, 0).copy_from(&across);
        for k in 3..6 {
            normal[(k, k)] += RIDGE;
        }
        normal
    }

    /// Removes field and hard iron from the columns of each block.
    fn left<const N: usize>(&self, columns: &mut [SMatrix<f64, 3, N>]) {
        let mut right = SMatrix::<f64, 6, N>::zeros();
        for (turn, column) in self.rotations.iter().zip(columns.iter()) {
            let mut field = right.fixed_view_mut::<3, N>(0, 0);
            field += column;
            let mut iron = right.fixed_view_mut::<3, N>(3, 0);
            iron += turn.transpose() * column;
        }
        let found = self.inverse * right;
        for (turn, column) in self.rotations.iter().zip(columns) {
            *column -= found.fixed_view::<3, N>(0, 0) + turn * found.fixed_view::<3, N>(3, 0);
        }
    }
}

/// Costs of a sense in all windows, with the best bias of the gyro.
fn costs(windows: &[Window], sense: &Sense) -> Vec<f64> {
    let fields = collect(
        windows.iter().map(|window| collect(window.tensors.iter().map(|tensor| sense.of(tensor)))),
    );
    let (mut bias, mut best) = (Vector3::zeros(), collect([]));
    for round in 0..=ROUNDS {
        pause();
        let prior = 1.0 / (BIAS_SIGMA_RAD_S * BIAS_SIGMA_RAD_S);
        let (mut normal, mut right) = (Matrix3::identity() * prior, bias * -prior);
        let now = collect(windows.iter().zip(&fields).map(|(window, fields)| {
            let mut all = moved(window, fields, &bias);
            window.left(&mut all);
            let number = all.len() as f64;
            let cost = all.iter().map(|x| x.column(0).norm_squared()).sum::<f64>() / number;
            let cost = if cost < MAX_COST { cost } else { MAX_COST };
            let weight = 1.0 / ((cost + COST_FLOOR * COST_FLOOR) * number);
            for x in &all {
                let jacobian = x.fixed_columns::<3>(1).into_owned();
                normal += jacobian.transpose() * jacobian * weight;
                right -= jacobian.transpose() * x.column(0) * weight;
            }
            cost
        }));
        if best.is_empty() || average(&now) < average(&best) {
            best = now;
        }
        let step = normal.cholesky().map(|normal| normal.solve(&right));
        match step.filter(|step| round < ROUNDS && step.iter().all(|x| x.is_finite())) {
            Some(step) => bias += step,
            None => break,
        }
    }
    best
}

/// Fields of a window's blocks with a bias of the gyro, and their derivatives by the bias.
fn moved(
    window: &Window,
    fields: &[Vector3<f64>],
    bias: &SVector<f64, 3>,
) -> Vec<SMatrix<f64, 3, 4>> {
    collect(fields.iter().zip(&window.integrals).map(|(field, psi)| {
        let field = exponential(&(psi * -bias)) * field;
        let jacobian = field.cross_matrix() * psi;
        SMatrix::from_columns(&[
            field,
            jacobian.column(0).into(),
            jacobian.column(1).into(),
            jacobian.column(2).into(),
        ])
    }))
}

/// Variance of the means of blocks.
fn scatter(fields: &[Vector3<f64>]) -> f64 {
    let mean = |part: &[Vector3<f64>]| part.iter().sum::<Vector3<f64>>() / part.len() as f64;
    let means = collect(fields.chunks(MEAN_TICKS).map(mean));
    let centre = mean(&means);
    means.iter().map(|m| (m - centre).norm_squared()).sum::<f64>() / means.len() as f64
}

const _: () = assert!(ROTATIONS == 24 && WINDOW_TICKS.is_multiple_of(MEAN_TICKS));
