//! Curvature of a log-likelihood.

use nalgebra::DMatrix;

/// Minus the second differences of `value` about a point, at `steps` in every coordinate.
pub fn curvature(
    value: impl Fn(&[f64]) -> Option<f64>,
    point: &[f64],
    steps: &[f64],
) -> Option<DMatrix<f64>> {
    let at = |moves: &[(usize, f64)]| {
        let mut point = point.to_vec();
        moves.iter().for_each(|(i, sign)| point[*i] += sign * steps[*i]);
        value(&point)
    };
    let middle = at(&[])?;
    let mut curvature = DMatrix::zeros(point.len(), point.len());
    for i in 0..point.len() {
        let straight = at(&[(i, 1.0)])? - 2.0 * middle + at(&[(i, -1.0)])?;
        curvature[(i, i)] = -straight / (steps[i] * steps[i]);
        for j in 0..i {
            let along = at(&[(i, 1.0), (j, 1.0)])? + at(&[(i, -1.0), (j, -1.0)])?;
            let across = at(&[(i, 1.0), (j, -1.0)])? + at(&[(i, -1.0), (j, 1.0)])?;
            curvature[(i, j)] = (across - along) / (4.0 * steps[i] * steps[j]);
            curvature[(j, i)] = curvature[(i, j)];
        }
    }
    Some(curvature)
}

#[cfg(test)]
mod tests {
    use super::curvature;

    #[test]
    fn a_parabola_has_its_own_curvature() {
        let value = |x: &[f64]| Some(-3.0 * x[0] * x[0] + x[0] * x[1] - 2.0 * x[1] * x[1]);
        let found = curvature(value, &[1.0, -0.5], &[0.25, 0.5]).expect("it has values");
        // Sums of few powers of two: exact.
        assert_eq!(found.as_slice(), [6.0, -1.0, -1.0, 4.0]);
    }
}
