//! Stationary polynomials by their partial autocorrelations (Monahan 1984; Jones 1980).

use nalgebra::{DMatrix, DVector};

use crate::identification::autoregression::step_up;

/// Bound of the search: partial autocorrelations of 1 - 1e-10.
pub const MAX_COORDINATE: f64 = 12.0;

/// Largest distance of a partial autocorrelation from one that counts as on the unit circle.
const UNIT_CIRCLE_DISTANCE: f64 = 1e-7;

/// `φ` of the autoregression with these partial autocorrelations (Levinson).
fn from_partials(partials: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut phi = Vec::new();
    partials.for_each(|r| step_up(&mut phi, r));
    phi
}

/// Partial autocorrelations of `1 - φ_1 B - … - φ_p B^p`, if all its roots lie outside the unit
/// circle (step-down, Schur-Cohn).
pub fn partials(phi: &[f64]) -> Option<Vec<f64>> {
    let mut phi = phi.to_vec();
    let mut partials = vec![0.0; phi.len()];
    while let Some(r) = phi.pop() {
        if r.is_nan() || r.abs() >= 1.0 {
            return None;
        }
        partials[phi.len()] = r;
        let before = phi.clone();
        let scale = 1.0 / (1.0 - r * r);
        for (phi, mirrored) in phi.iter_mut().zip(before.iter().rev()) {
            *phi = (*phi + r * mirrored) * scale;
        }
    }
    Some(partials)
}

/// `φ` at unbounded coordinates.
pub fn from_free(free: &[f64]) -> Vec<f64> {
    from_partials(free.iter().map(|x| x.tanh()))
}

/// Unbounded coordinates of `φ`, if it is stationary.
fn to_free(phi: &[f64]) -> Option<Vec<f64>> {
    let free = |r: f64| r.atanh().clamp(-MAX_COORDINATE, MAX_COORDINATE);
    Some(partials(phi)?.into_iter().map(free).collect())
}

/// Unbounded coordinates of `φ`, or of the nearest stationary `φ` on the line to zero.
pub fn to_nearest_free(phi: &[f64]) -> Vec<f64> {
    to_free(phi).or_else(|| to_free(&shrink(phi))).unwrap_or_default()
}

/// The nearest `φ` on the line to zero that is stationary with a margin.
fn shrink(phi: &[f64]) -> Vec<f64> {
    let mut phi = phi.to_vec();
    let within = |r: &Vec<f64>| r.iter().all(|r| r.abs() < 0.9999);
    while !partials(&phi).is_some_and(|r| within(&r)) {
        let mut power = 1.0;
        for phi in &mut phi {
            power *= 0.98;
            *phi = if phi.is_finite() { *phi * power } else { 0.0 };
        }
    }
    phi
}

/// The negative coefficients: `θ(B)` and `φ(B)` have opposite signs.
pub fn negated(coefficients: &[f64]) -> Vec<f64> {
    coefficients.iter().map(|x| -x).collect()
}

/// True if a root lies on the unit circle, to the precision of a search.
pub fn on_circle(phi: &[f64]) -> bool {
    partials(phi).is_none_or(|r| r.iter().any(|r| r.abs() > 1.0 - UNIT_CIRCLE_DISTANCE))
}

/// Derivatives of `φ` (rows) by the unbounded coordinates (columns).
pub fn jacobian(free: &[f64]) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(free.len(), free.len());
    for (column, at) in free.iter().enumerate() {
        let r = at.tanh();
        let (mut phi, mut slope): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        for (k, x) in free.iter().enumerate() {
            let turn = if k == column { (1.0 - r) * (1.0 + r) } else { 0.0 };
            let mirror: Vec<_> = phi.iter().copied().zip(slope.iter().copied()).rev().collect();
            for (j, (phi_back, slope_back)) in mirror.into_iter().enumerate() {
                phi[j] -= x.tanh() * phi_back;
                slope[j] -= x.tanh() * slope_back + turn * phi_back;
            }
            phi.push(x.tanh());
            slope.push(turn);
        }
        jacobian.column_mut(column).copy_from_slice(&slope);
    }
    jacobian
}

/// Second derivatives of `weightsᵀ φ` by the unbounded coordinates.
pub fn hessian(free: &[f64], weights: &DVector<f64>) -> DMatrix<f64> {
    // Errors of rounding and of the width squared are below 1e-9, and change only the path of a
    // search.
    const WIDTH: f64 = 1e-5;
    let mut hessian = DMatrix::zeros(free.len(), free.len());
    for row in 0..free.len() {
        let slopes = |step: f64| {
            let mut moved = free.to_vec();
            moved[row] += step;
            jacobian(&moved).tr_mul(weights)
        };
        let column = (slopes(WIDTH) - slopes(-WIDTH)) / (2.0 * WIDTH);
        hessian.row_mut(row).copy_from(&column.transpose());
    }
    hessian.symmetric_part()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn coordinates_lead_back(free in prop::collection::vec(-2.0..2.0_f64, 0..8)) {
            let phi = from_free(&free);
            let back = to_free(&phi).expect("every point is stationary");
            for (x, y) in free.iter().zip(&back) {
                // Each step down divides rounding by 1 - r^2 >= 0.07.
                prop_assert!((x - y).abs() < 1e-16 * 0.07_f64.powi(-8), "{x} {y}");
            }
        }

        #[test]
        fn jacobian_is_that_of_the_map(free in prop::collection::vec(-2.0..2.0_f64, 1..5)) {
            let jacobian = jacobian(&free);
            for column in 0..free.len() {
                let moved = |step: f64| {
                    let mut free = free.clone();
                    free[column] += step;
                    from_free(&free)
                };
                let (up, down) = (moved(1e-5), moved(-1e-5));
                for row in 0..free.len() {
                    // A central difference: 1e-10 times third derivatives of at most 2^5.
                    let difference = (up[row] - down[row]) / 2e-5;
                    prop_assert!((jacobian[(row, column)] - difference).abs() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn roots_on_and_inside_the_circle_are_refused() {
        assert!(partials(&[0.5, 0.3]).is_some());
        for phi in [vec![1.0], vec![-1.5], vec![2.0, -1.0], vec![0.6, 0.5], vec![f64::NAN]] {
            assert!(partials(&phi).is_none(), "{phi:?}");
            assert!(partials(&shrink(&phi)).is_some());
            assert!(on_circle(&phi));
        }
    }
}
