//! The unscented Kalman filter: sigma points with the mean and the covariance.
#![allow(non_snake_case)]

use core::array::from_fn;

use nalgebra::{Quaternion, RealField, SMatrix, SVector, Vector3};

use super::kalman::{BIAS, Gauss, Linearised, Step};
use crate::math::Real;
use crate::math::rotation::exponential;

/// Number of states, and λ: the weights of centre and points are λ/(n + λ) and 1/(2(n + λ)).
const N: usize = 6;
const LAMBDA: f64 = 1.0;
const SCALE: f64 = N as f64 + LAMBDA;
const CENTRE: f64 = LAMBDA / SCALE;
const WEIGHT: f64 = 0.5 / SCALE;

type States = SVector<f64, N>;

/// Linearisation by the sigma points of J. L. Crassidis and F. L. Markley, *J. Guidance, Control,
/// and Dynamics* 26(4), 2003, with λ = 1 as there. The error of the attitude is a rotation vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unscented;

impl Linearised for Unscented {
    const METHOD: &'static str = "ukf";
    const TAG: &'static str = "att-ukf";

    fn predict(state: &mut Gauss, step: &Step) {
        let before = state.body.orientation;
        let turn = (step.gyro - state.bias) * step.dt;
        state.body.turn(&turn);
        let back = state.body.orientation.conjugate();
        let points = points(state).map(|x| {
            let turned = exponential(&(turn - bias(&x) * step.dt)).into_inner();
            let error = exponential(&angles(&x)).into_inner() * before * turned * back;
            let mut next = x;
            next.fixed_rows_mut::<3>(0).copy_from(&logarithm(&error));
            next
        });
        let mean = points.iter().sum::<States>() * WEIGHT;
        let mut P = mean * mean.transpose() * CENTRE;
        for x in &points {
            let off = x - mean;
            P += off * off.transpose() * WEIGHT;
        }
        state.P.assign(|i, j| P[(i, j)]);
        for i in 0..N {
            let noise = if i < BIAS { step.angle } else { step.bias };
            state.P.set(i, i, state.P.at(i, i) + noise);
        }
        state.apply(&mean);
    }

    fn see_up(state: &mut Gauss, force: &Vector3<f64>, R: f64) {
        // Up, if the orientation has this error.
        let expected = |x: &States| {
            let turned = exponential(&-angles(x)) * Vector3::z();
            SVector::from(turned)
        };
        see(state, expected, force, R);
    }

    fn see_north(state: &mut Gauss, angle: f64, R: f64) {
        // The part of the rotation about the vertical.
        let expected = |x: &States| {
            let error = exponential(&angles(x));
            SVector::<f64, 1>::new(2.0 * RealField::atan2(error.k, error.w))
        };
        see(state, expected, &SVector::<f64, 1>::new(angle), R);
    }
}

fn angles(x: &States) -> Vector3<f64> {
    x.fixed_rows::<3>(0).into_owned()
}

fn bias(x: &States) -> Vector3<f64> {
    x.fixed_rows::<3>(BIAS).into_owned()
}

/// All points except the centre: ± √(n + λ) times each column of the covariance's root.
fn points(state: &Gauss) -> [States; 2 * N] {
    let L = root(state) * SCALE.simd_sqrt();
    from_fn(|i| if i < N { L.column(i).into_owned() } else { -L.column(i - N) })
}

/// Cholesky's lower factor; a variance lost by rounding counts as zero.
fn root(state: &Gauss) -> SMatrix<f64, N, N> {
    let (P, mut L) = (&state.P, SMatrix::<f64, N, N>::zeros());
    for j in 0..N {
        let rest = P.at(j, j) - (0..j).map(|k| L[(j, k)] * L[(j, k)]).sum::<f64>();
        if rest <= 1e-14 * P.at(j, j) {
            continue;
        }
        L[(j, j)] = rest.simd_sqrt();
        for i in j + 1..N {
            let rest = P.at(i, j) - (0..j).map(|k| L[(i, k)] * L[(j, k)]).sum::<f64>();
            L[(i, j)] = rest / L[(j, j)];
        }
    }
    L
}

/// Corrects by a measurement; `expected` gives the measurement for each error.
fn see<const M: usize>(
    state: &mut Gauss,
    expected: impl Fn(&States) -> SVector<f64, M>,
    z: &SVector<f64, M>,
    R: f64,
) {
    let points = points(state);
    let (centre, shown) = (expected(&States::zeros()), points.map(|x| expected(&x)));
    let mean = centre * CENTRE + shown.iter().sum::<SVector<f64, M>>() * WEIGHT;
    let off = centre - mean;
    let mut S = off * off.transpose() * CENTRE + SMatrix::<f64, M, M>::identity() * R;
    let mut C = SMatrix::<f64, N, M>::zeros();
    for (x, y) in points.iter().zip(&shown) {
        let off = y - mean;
        S += off * off.transpose() * WEIGHT;
        C += x * off.transpose() * WEIGHT;
    }
    let Some(inverse) = S.cholesky().map(|root| root.inverse()) else { return };
    let K = C * inverse;
    // P - K S K' as a sum of squares, which rounding cannot make negative.
    let left = K * off;
    let mut P = left * left.transpose() * CENTRE + K * K.transpose() * R;
    for (x, y) in points.iter().zip(&shown) {
        let left = x - K * (y - mean);
        P += left * left.transpose() * WEIGHT;
    }
    state.P.assign(|i, j| P[(i, j)]);
    state.apply(&(K * (z - mean)));
}

/// Rotation vector of a rotation by at most half a turn.
fn logarithm(q: &Quaternion<f64>) -> Vector3<f64> {
    let (w, v) = if q.w < 0.0 { (-q.w, -q.imag()) } else { (q.w, q.imag()) };
    let sine = v.norm();
    let scale = if sine > 0.0 { 2.0 * RealField::atan2(sine, w) / sine } else { 2.0 };
    v * scale
}
