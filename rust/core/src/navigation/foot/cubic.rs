//! Prediction from the flanks of a clipped run: a cubic through the neighbouring samples with their
//! slopes.

/// Largest ratio of a restored rate to the limit, and its error as shares of the added rate and of
/// the limit.
pub(super) const MAX_RATE_RATIO: f64 = 2.0;
const RATE_ERROR_SHARES: [f64; 2] = [0.5, 0.05];

/// A cubic over a run; steps count from the sample before the run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cubic {
    steps: f64,
    ends: [f64; 2],
    slopes: [f64; 2],
}

impl Cubic {
    /// The cubic over `count` samples, from two samples before and two samples after the run.
    pub fn over(count: usize, before: [f64; 2], after: [f64; 2]) -> Self {
        let (rise, fall) = (before[1] - before[0], after[1] - after[0]);
        Self {
            steps: (count + 1) as f64,
            ends: [before[1], after[0]],
            slopes: [if rise > 0.0 { rise } else { 0.0 }, if fall < 0.0 { fall } else { 0.0 }],
        }
    }

    /// Value at the sample with this index in the run.
    pub fn at(&self, k: usize) -> f64 {
        let s = (k + 1) as f64 / self.steps;
        let (s2, s3) = (s * s, s * s * s);
        let [from, to] = self.ends;
        let [rise, fall] = self.slopes.map(|slope| slope * self.steps);
        (2.0 * s3 - 3.0 * s2 + 1.0) * from
            + (s3 - 2.0 * s2 + s) * rise
            + (3.0 * s2 - 2.0 * s3) * to
            + (s3 - s2) * fall
    }
}

/// Density of a white noise, rad²/s, for rates with one constant error during `seconds`. `added` is
/// the mean rate that was restored.
pub(super) fn density(added: f64, limit: f64, seconds: f64) -> f64 {
    let wrong = RATE_ERROR_SHARES[0] * added + RATE_ERROR_SHARES[1] * limit;
    wrong * wrong * seconds
}
