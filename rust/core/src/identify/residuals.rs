//! Residuals of a given ARMA model.

/// An ARMA model that is applied, not estimated.
#[derive(Debug, Clone, Copy)]
pub struct Arma<'a> {
    /// Autoregressive coefficients.
    pub phi: &'a [f64],
    /// Moving-average coefficients.
    pub theta: &'a [f64],
    /// Subtracted from every sample, so that a large offset costs no digits.
    pub centre: f64,
    /// Constant of the centred samples.
    pub constant: f64,
}

impl Arma<'_> {
    /// The conditional residuals `a_k = z_k - Σφ z_{k-i} - Σθ a_{k-j} - c`.
    ///
    /// Every stretch starts anew: its first `p` samples have no residual (NaN, as for missing
    /// samples), and what their residuals were is taken as zero.
    pub fn residuals(&self, record: &[f64]) -> Vec<f64> {
        let mut residuals = Vec::with_capacity(record.len() + 1);
        for stretch in record.split(|z| !z.is_finite()) {
            self.extend(&mut residuals, stretch);
            // The missing sample that ended the stretch.
            residuals.push(f64::NAN);
        }
        residuals.pop();
        residuals
    }

    fn extend(&self, residuals: &mut Vec<f64>, stretch: &[f64]) {
        let p = self.phi.len();
        let first = residuals.len() + p;
        residuals.extend(stretch.iter().take(p).map(|_| f64::NAN));
        for k in p..stretch.len() {
            let innovation = stretch[k] - self.centre - self.predicted(&stretch[..k]);
            let past = residuals[first..].iter().rev();
            let moving: f64 = self.theta.iter().zip(past).map(|(theta, a)| theta * a).sum();
            residuals.push(innovation - moving);
        }
    }

    /// The constant and the autoregressive part.
    fn predicted(&self, past: &[f64]) -> f64 {
        let newest_first = past.iter().rev().map(|z| z - self.centre);
        self.phi.iter().zip(newest_first).map(|(phi, y)| phi * y).sum::<f64>() + self.constant
    }
}

#[cfg(test)]
mod tests {
    use super::Arma;

    const MODEL: Arma = Arma { phi: &[0.5, 0.25], theta: &[-1.0], centre: 2.0, constant: 1.0 };

    #[test]
    fn every_stretch_starts_anew() {
        let record = [2.0, 4.0, 6.0, 2.0, f64::NAN, f64::INFINITY, 6.0, f64::NAN, 2.0, 4.0, 6.0];
        // Centred, the first stretch is 0, 2, 4, 0: 4 - 1 - 0 - 1 = 2, then 0 - 2 - 0.5 + 2 - 1.
        let expected =
            [None, None, Some(2.0), Some(-1.5), None, None, None, None, None, None, Some(2.0)];
        let found = MODEL.residuals(&record).into_iter().map(|a| (!a.is_nan()).then_some(a));
        assert!(found.eq(expected));
    }

    #[test]
    fn nothing_comes_of_nothing() {
        assert!(MODEL.residuals(&[]).is_empty());
        assert!(MODEL.residuals(&[f64::NAN; 2]).iter().all(|a| a.is_nan()));
    }
}
