//! Residuals of a given ARMA model.

use crate::math::segments::segment_ranges;
use crate::work;

/// A given ARMA model.
#[derive(Debug, Clone, Copy)]
pub struct Arma<'a> {
    /// Autoregressive coefficients.
    pub phi: &'a [f64],
    /// Moving-average coefficients.
    pub theta: &'a [f64],
    /// Level of the record, subtracted from every sample.
    pub centre: f64,
    /// Constant of the model for centred samples.
    pub constant: f64,
}

impl Arma<'_> {
    /// The conditional residuals `a_k = z_k - Σφ z_{k-i} - Σθ a_{k-j} - c`. They start again at
    /// every segment: before it, samples are assumed to be at the centre and residuals zero. The
    /// first `p` residuals depend on this assumption and are NaN, as for missing samples.
    pub fn residuals(&self, record: &[f64]) -> Vec<f64> {
        let mut residuals = work::filled(f64::NAN, record.len());
        for range in segment_ranges(record) {
            let part = &mut residuals[range.clone()];
            self.autoregress(&record[range], part);
            self.invert(part);
            part.iter_mut().take(self.phi.len()).for_each(|a| *a = f64::NAN);
        }
        residuals
    }

    /// Residuals of the autoregression.
    fn autoregress(&self, segment: &[f64], left: &mut [f64]) {
        for (w, z) in left.iter_mut().zip(segment) {
            *w = z - self.centre - self.constant;
        }
        for (i, phi) in self.phi.iter().enumerate() {
            for (w, z) in left.iter_mut().skip(i + 1).zip(segment) {
                *w -= phi * (z - self.centre);
            }
        }
    }

    /// Computes in place the innovations whose moving average is `left`.
    fn invert(&self, left: &mut [f64]) {
        if self.theta.is_empty() {
            return;
        }
        for k in 0..left.len() {
            let (past, now) = left.split_at_mut(k);
            let newest_first = past.iter().rev();
            now[0] -= self.theta.iter().zip(newest_first).map(|(theta, a)| theta * a).sum::<f64>();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Arma;

    const MODEL: Arma = Arma { phi: &[0.5, 0.25], theta: &[-1.0], centre: 2.0, constant: 1.0 };

    #[test]
    fn every_segment_starts_anew() {
        let record = [2.0, 4.0, 6.0, 2.0, f64::NAN, f64::INFINITY, 6.0, f64::NAN, 2.0, 4.0, 6.0];
        // Centred, the first segment is 0, 2, 4, 0. Its residuals: 0 - 1 = -1, 2 - 1 - 1 = 0,
        // 4 - 1 - 0 - 1 + 0 = 2, then 0 - 2 - 0.5 - 1 + 2.
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
