//! Checks of a filter's matrices.

use super::step::{
    MAX_ELEMENT, MAX_STATE, MAX_VARIANCE, MIN_VARIANCE, is_semidefinite, is_settled,
};
use crate::error::Error;
use crate::math::validity::is_within;
use crate::memory;

/// Largest asymmetry, and indefiniteness, of a computed matrix, relative to its variances.
const MAX_ASYMMETRY: f64 = 1e-9;
const MAX_INDEFINITENESS: f64 = 1e-10;

/// Refuses elements that are not finite or too large, in a constant matrix or the matrix of a step.
///
/// # Errors
/// [`Error::Matrix`].
pub fn check_matrix(name: &'static str, step: Option<usize>, matrix: &[f64]) -> Result<(), Error> {
    let expected = "of finite numbers, at most 1e30 in size";
    let fits = matrix.iter().all(|x| is_within(*x, MAX_ELEMENT));
    if fits { Ok(()) } else { Err(Error::Matrix { name, step, expected }) }
}

/// Refuses states that are not finite or too large.
pub(super) fn check_state(name: &'static str, x: &[f64]) -> Result<(), Error> {
    let expected = "of finite numbers, at most 1e150 in size";
    let fits = x.iter().all(|x| is_within(*x, MAX_STATE));
    if fits { Ok(()) } else { Err(Error::Matrix { name, step: None, expected }) }
}

/// Refuses a matrix that is no covariance of `n` numbers to rounding. Makes it symmetric to the
/// bit, and as definite as after a step.
///
/// # Errors
/// [`Error::Matrix`], or [`Error::Memory`] if there is no memory.
pub fn settle_covariance(
    name: &'static str,
    step: Option<usize>,
    n: usize,
    matrix: &mut [f64],
) -> Result<(), Error> {
    let refused = |expected| Err(Error::Matrix { name, step, expected });
    if !matrix.iter().all(|x| is_within(*x, MAX_VARIANCE)) {
        return refused("of finite numbers, at most 1e60 in size");
    }
    for i in 0..n {
        for j in 0..i {
            let (x, y) = (matrix[i * n + j], matrix[j * n + i]);
            let sizes = matrix[i * n + i].abs().sqrt() * matrix[j * n + j].abs().sqrt();
            if (x - y).abs() > MAX_ASYMMETRY * sizes {
                return refused("symmetric");
            }
            let mean = 0.5 * x + 0.5 * y;
            (matrix[i * n + j], matrix[j * n + i]) = (mean, mean);
        }
    }
    without_smallest(n, matrix);
    let mut stack = [0.0; 64];
    let mut heap;
    let room = match stack.get_mut(..n * n) {
        Some(room) => room,
        None => {
            heap = memory::filled(0.0, n * n)?;
            &mut heap[..]
        }
    };
    if !is_semidefinite(n, matrix, MAX_INDEFINITENESS, room) {
        return refused("positive semidefinite");
    }
    if !is_settled(n, matrix, room) {
        let weaker = 1.0 / (1.0 + 2.0 * MAX_INDEFINITENESS);
        let below = (0..n * n).filter(|k| k / n != k % n);
        below.for_each(|k| matrix[k] *= weaker);
    }
    Ok(())
}

/// Sets a variance to zero if it is too small for computations.
fn without_smallest(n: usize, matrix: &mut [f64]) {
    for i in 0..n {
        let variance = matrix[i * n + i];
        let most = |j: usize| MIN_VARIANCE.sqrt() * matrix[j * n + j].abs().sqrt();
        let tiny = (0..n).all(|j| j == i || matrix[i * n + j].abs() <= most(j));
        if (0.0..MIN_VARIANCE).contains(&variance) && tiny {
            for j in 0..n {
                (matrix[i * n + j], matrix[j * n + i]) = (0.0, 0.0);
            }
        }
    }
}
