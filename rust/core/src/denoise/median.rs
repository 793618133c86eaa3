//! The median size of many numbers.

use crate::work;

/// The median of the sizes of finite numbers, zero of none; of an even count the mean of the two
/// in the middle.
pub(super) fn median_size(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = work::gathered(values.iter().map(|x| x.abs()));
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return 0.0;
    }
    let even = sizes.len().is_multiple_of(2);
    let (below, upper, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    let lower = below.iter().copied().fold(0.0, f64::max);
    if even { lower + 0.5 * (*upper - lower) } else { *upper }
}
