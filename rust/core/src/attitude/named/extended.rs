//! The extended Kalman filter: derivatives at the mean.
#![allow(non_snake_case)]

use nalgebra::{Matrix3, SVector, Vector3};

use super::kalman::{BIAS, Gauss, Linearised, Step};
use crate::math::rotation::right_jacobian;

/// Largest loss of a difference's variance by rounding, relative to the terms: some operations per
/// element.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Linearisation by first derivatives, with scalar corrections.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extended;

impl Linearised for Extended {
    const METHOD: &'static str = "ekf";
    const TAG: &'static str = "att-ekf";

    #[inline]
    fn predict(state: &mut Gauss, step: &Step) {
        let turn = (step.gyro - state.bias) * step.dt;
        state.body.turn(&turn);
        // An error of the bias rotates in the opposite sense, about axes that move meanwhile.
        let J = right_jacobian(&turn) * -step.dt;
        let columns = [0, 1, 2].map(|i| state.body.in_earth(&J.column(i).into_owned()));
        let A = Matrix3::from_columns(&columns);
        // F P F' with F = [I, A; 0, I].
        let P = state.P;
        let B = Matrix3::from_fn(|i, j| P.at(i, BIAS + j));
        let AD = A * Matrix3::from_fn(|i, j| P.at(BIAS + i, BIAS + j));
        let (AB, ADA) = (A * B.transpose(), AD * A.transpose());
        let rounding = ROUNDING * step.dt * step.dt * (3..6).map(|i| P.at(i, i)).sum::<f64>();
        state.P.assign(|i, j| match (i < BIAS, j < BIAS) {
            (true, true) => P.at(i, j) + AB[(i, j)] + AB[(j, i)] + ADA[(i, j)],
            (true, false) => P.at(i, j) + AD[(i, j - BIAS)],
            _ => P.at(i, j),
        });
        for i in 0..6 {
            let noise = if i < BIAS { step.angle + rounding } else { step.bias };
            state.P.set(i, i, state.P.at(i, i) + noise + ROUNDING * P.at(i, i));
        }
    }

    #[inline]
    fn see_up(state: &mut Gauss, force: &Vector3<f64>, R: f64) {
        // After a rotation by small angles, up has the level components (φ_y, -φ_x).
        let mut found = SVector::zeros();
        see(state, 0, force.y, R, &mut found);
        see(state, 1, -force.x, R, &mut found);
        state.apply(&found);
    }

    #[inline]
    fn see_north(state: &mut Gauss, angle: f64, R: f64) {
        let mut found = SVector::zeros();
        see(state, 2, angle, R, &mut found);
        state.apply(&found);
    }
}

/// Corrects by a measurement of one error; adds to the correction of all errors.
#[inline]
fn see(state: &mut Gauss, i: usize, z: f64, R: f64, found: &mut SVector<f64, 6>) {
    let p = SVector::<f64, 6>::from_fn(|j, _| state.P.at(i, j));
    let S = p[i] + R;
    let K = p / S;
    *found += K * (z - found[i]);
    // (I - K H) P, computed without a difference to keep the digits.
    let P = state.P;
    state.P.assign(|a, b| match (a == i, b == i) {
        (true, _) => p[b] * (R / S),
        (_, true) => p[a] * (R / S),
        _ => P.at(a, b) - K[a] * p[b] + if a == b { ROUNDING * P.at(a, a) } else { 0.0 },
    });
}
