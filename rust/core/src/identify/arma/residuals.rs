//! Conditional residuals of a given model.

use super::super::stretches;

/// Residuals of `[φ, θ, c]`, at each stretch from its sample number `skip` on (at least p) with
/// zeros before it; NaN where there is none.
pub fn residuals(z: &[f64], phi: &[f64], theta: &[f64], constant: f64, skip: usize) -> Vec<f64> {
    let skip = skip.max(phi.len());
    let mut residuals = Vec::with_capacity(z.len());
    for stretch in stretches(z) {
        let start = (stretch.as_ptr() as usize - z.as_ptr() as usize) / size_of::<f64>();
        residuals.resize(start, f64::NAN);
        residuals.resize((start + skip).min(start + stretch.len()), f64::NAN);
        for t in skip..stretch.len() {
            let regular: f64 =
                phi.iter().enumerate().map(|(i, phi)| phi * stretch[t - 1 - i]).sum();
            let past = residuals[start + skip..].iter().rev();
            let average: f64 = theta.iter().zip(past).map(|(theta, e)| theta * e).sum();
            residuals.push(stretch[t] - constant - regular - average);
        }
    }
    residuals.resize(z.len(), f64::NAN);
    residuals
}

#[cfg(test)]
mod tests {
    use super::residuals;

    #[test]
    fn every_stretch_starts_with_zeros() {
        let z = [1.0, 2.0, 4.0, f64::NAN, 3.0, 5.0];
        let found = residuals(&z, &[0.5], &[0.25], 1.0, 0);
        let expected = [f64::NAN, 0.5, 1.875, f64::NAN, f64::NAN, 2.5];
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        // Sums of few halves: exact.
        assert_eq!(bits(&found), bits(&expected));
        assert!(residuals(&z, &[0.1; 4], &[], 0.0, 0).iter().all(|e| e.is_nan()));
    }
}
