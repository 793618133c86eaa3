//! Allan deviation of a record.

/// Overlapping Allan deviation of a rate record at an averaging time of `m` samples, or `None` if
/// no three clusters of `m` samples without a gap fit (IEEE Std 952-1997, annex C).
///
/// A sample that is not finite is missing: every term that needs it is left out.
pub fn overlapping_allan_deviation(rate: &[f64], m: usize) -> Option<f64> {
    if m == 0 || rate.len() < 2 * m {
        return None;
    }
    let origin = rate.iter().copied().find(|z| z.is_finite())?;
    let value = |z: f64| if z.is_finite() { z - origin } else { 0.0 };
    let gap = |z: f64| usize::from(!z.is_finite());
    // Sliding sum of the second cluster less the first.
    let mut difference = 0.0;
    let mut gaps = 0;
    for (first, second) in rate[..m].iter().zip(&rate[m..2 * m]) {
        difference += value(*second) - value(*first);
        gaps += gap(*first) + gap(*second);
    }
    let mut terms = 0u64;
    let mut sum = 0.0;
    for i in 0..=rate.len() - 2 * m {
        if gaps == 0 {
            sum += difference * difference;
            terms += 1;
        }
        if i + 2 * m < rate.len() {
            let (leaving, middle, coming) = (rate[i], rate[i + m], rate[i + 2 * m]);
            difference += value(coming) - 2.0 * value(middle) + value(leaving);
            gaps = gaps + gap(coming) - gap(leaving);
        }
    }
    let size = m as f64;
    (terms > 0).then(|| (sum / (2.0 * terms as f64)).sqrt() / size)
}
