//! Variation of gravity in windows, and the bias that minimises it.

use nalgebra::{Matrix3, Vector3};

use super::ticks::median;
use super::window::MEANS;
use crate::math::rotation::exponential;
use crate::work::{collect, filled};

/// Largest cost of a window.
const MAX_COST: f64 = 4.0;
/// Largest difference of gravity's size, as a share: a sensor is not calibrated.
const MAX_GRAVITY_ERROR: f64 = 0.05;
/// Smallest gravity as a share of the median force. A hypothesis whose means vanish has no smaller
/// value.
const MIN_GRAVITY_SHARE: f64 = 0.6;
/// Root of the smallest cost that is distinguished.
const COST_FLOOR: f64 = 0.05;
/// Standard deviation of the whole bias, rad/s.
pub(super) const BIAS_SIGMA_RAD_S: f64 = 0.1;
const ROUNDS: usize = 2;

/// Means of a window.
pub(super) type Means = [Vector3<f64>; MEANS];

/// Costs of the windows, and gravity.
pub(super) fn costs(windows: &[Means]) -> (Vec<f64>, f64) {
    let sizes = collect(windows.iter().map(|f| mean(f).norm()));
    let g = median(sizes).unwrap_or(0.0);
    let square = (g * g).max(f64::MIN_POSITIVE);
    let lost = (MIN_GRAVITY_SHARE - g).max(0.0).powi(2);
    let cost = |f: &Means| {
        let centre = mean(f);
        let scatter = f.iter().map(|f| (f - centre).norm_squared()).sum::<f64>() / MEANS as f64;
        let off = ((centre.norm() - g).abs() - MAX_GRAVITY_ERROR * g).max(0.0).powi(2);
        let cost = (scatter + off + lost) / square;
        // NaN gets the largest cost.
        if cost < MAX_COST { cost } else { MAX_COST }
    };
    (collect(windows.iter().map(cost)), g)
}

/// Weight of a window's scatter in a fit.
pub(super) fn weight(cost: f64, g: f64) -> f64 {
    1.0 / ((cost + COST_FLOOR * COST_FLOOR) * MEANS as f64 * (g * g).max(f64::MIN_POSITIVE))
}

pub(super) fn mean(f: &Means) -> Vector3<f64> {
    f.iter().sum::<Vector3<f64>>() / MEANS as f64
}

pub(super) fn average(costs: &[f64]) -> f64 {
    costs.iter().sum::<f64>() / costs.len() as f64
}

/// Costs with the best bias, added to the bias with which the windows were propagated.
pub(super) fn with_bias(
    windows: &[Means],
    integrals: &[[Matrix3<f64>; MEANS]],
    propagated: &Vector3<f64>,
) -> (Vec<f64>, Vector3<f64>) {
    let (mut now, mut g) = costs(windows);
    let (mut best, mut bias) = (collect(now.iter().copied()), Vector3::zeros());
    let (mut beta, mut moved) = (Vector3::zeros(), collect(windows.iter().copied()));
    for _ in 0..ROUNDS {
        let Some(step) = better(&moved, integrals, &now, g, &(beta + propagated)) else { break };
        beta += step;
        for ((moved, f), psi) in moved.iter_mut().zip(windows).zip(integrals) {
            *moved = core::array::from_fn(|k| exponential(&(psi[k] * -beta)) * f[k]);
        }
        (now, g) = costs(&moved);
        if average(&now) < average(&best) {
            best.clone_from(&now);
            bias = beta;
        }
    }
    (best, bias)
}

/// Gauss-Newton step of a bias whose total is `bias`.
fn better(
    windows: &[Means],
    integrals: &[[Matrix3<f64>; MEANS]],
    costs: &[f64],
    g: f64,
    bias: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let prior = 1.0 / (BIAS_SIGMA_RAD_S * BIAS_SIGMA_RAD_S);
    let (mut normal, mut right) = (Matrix3::identity() * prior, bias * -prior);
    for ((f, psi), cost) in windows.iter().zip(integrals).zip(costs) {
        let jacobian: [_; MEANS] = core::array::from_fn(|k| f[k].cross_matrix() * psi[k]);
        let middle = jacobian.iter().sum::<Matrix3<f64>>() / MEANS as f64;
        let (centre, weight) = (mean(f), weight(*cost, g));
        for k in 0..MEANS {
            let j = (jacobian[k] - middle).transpose() * weight;
            normal += j * (jacobian[k] - middle);
            right -= j * (f[k] - centre);
        }
    }
    let step = normal.cholesky()?.solve(&right);
    step.iter().all(|x| x.is_finite()).then_some(step)
}

/// Costs of forces without any rotation.
pub(super) fn null(forces: &[Vector3<f64>], starts: &[usize], length: usize) -> Vec<f64> {
    let of =
        |first: &usize| super::propagation::average_unrotated(&forces[*first..*first + length]);
    let windows = collect(starts.iter().map(of));
    if windows.is_empty() { filled(0.0, 0) } else { costs(&windows).0 }
}
