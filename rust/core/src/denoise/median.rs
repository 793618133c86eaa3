//! Median of the sizes of many numbers.

use crate::work;

/// Smallest number of values for which a sample of them bounds the median.
const MIN_LENGTH: usize = 1 << 14;

/// Size of the sample, and distance of the two bounds from its middle: four times the chance error
/// of the median.
const SAMPLE_COUNT: usize = 1 << 10;
const RANK_MARGIN: usize = SAMPLE_COUNT / 16;

/// Median of the sizes of finite numbers, zero without numbers; for an even count the mean of the
/// middle two.
pub(super) fn median_size(values: &[f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let found = if values.len() < MIN_LENGTH { None } else { among_near(values) };
    found.unwrap_or_else(|| {
        let mut sizes = work::collect(values.iter().map(|x| x.abs()));
        median(&mut sizes, 0, values.len())
    })
}

/// Median of the values near a sample's median, if it is among them.
fn among_near(values: &[f64]) -> Option<f64> {
    let mut sample = [0.0; SAMPLE_COUNT];
    for (i, slot) in sample.iter_mut().enumerate() {
        // Scattered, since the record may be periodic.
        *slot = values[i.wrapping_mul(2_654_435_761) % values.len()].abs();
    }
    sample.sort_unstable_by(f64::total_cmp);
    let (least, most) =
        (sample[SAMPLE_COUNT / 2 - RANK_MARGIN], sample[SAMPLE_COUNT / 2 + RANK_MARGIN]);
    let mut near = work::filled(0.0, values.len() / 4);
    let (mut below, mut held) = (0, 0);
    for x in values {
        let size = x.abs();
        below += usize::from(size < least);
        *near.get_mut(held)? = size;
        held += usize::from(size >= least && size <= most);
    }
    let within = below + 2 <= values.len() / 2 && values.len() / 2 < below + held;
    within.then(|| median(&mut near[..held], below, values.len()))
}

/// Median of `all` sizes; `below` of them are smaller than `sizes`, the others larger.
fn median(sizes: &mut [f64], below: usize, all: usize) -> f64 {
    let (less, upper, _) = sizes.select_nth_unstable_by(all / 2 - below, f64::total_cmp);
    let lower = less.iter().copied().fold(0.0, f64::max);
    if all.is_multiple_of(2) { lower + 0.5 * (*upper - lower) } else { *upper }
}

#[cfg(test)]
mod tests {
    use super::median_size;

    /// Numbers in a scattered order, with both signs.
    fn numbers(n: usize, power: i32) -> Vec<f64> {
        let value = |i: usize| ((i * 7919 % n) as f64 / n as f64).powi(power);
        (0..n).map(|i| if i % 3 == 0 { -value(i) } else { value(i) }).collect()
    }

    fn sorted(values: &[f64]) -> f64 {
        let mut sizes: Vec<f64> = values.iter().map(|x| x.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let n = sizes.len();
        if n.is_multiple_of(2) { 0.5 * (sizes[n / 2 - 1] + sizes[n / 2]) } else { sizes[n / 2] }
    }

    #[test]
    fn it_is_that_of_the_sorted_sizes() {
        for n in [1, 2, 3, 10, 101, 20_000, 20_001, 100_003] {
            for power in [0, 1, 9, 60] {
                let values = numbers(n, power);
                assert_eq!(median_size(&values), sorted(&values), "{n} {power}");
            }
        }
        assert_eq!(median_size(&[]), 0.0);
    }

    #[test]
    fn few_values_many_times() {
        for part in [1, 2, 3, 5] {
            let values: Vec<f64> = (0..30_001).map(|i| f64::from(i % 5 < part)).collect();
            assert_eq!(median_size(&values), sorted(&values));
        }
    }
}
