//! Reversals of a record: pairs of values with the larger value first.

use crate::work;

/// Largest number of values that are sorted by insertion.
const BLOCK: usize = 16;

/// Smallest number of values in a sort that checks for a stop.
const VALUES_PER_CHECK: usize = 1 << 14;

/// Numbers of reversals and ties in the order of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reversals {
    /// Pairs i < j with y_i > y_j.
    pub count: u64,
    /// Pairs of equal values.
    pub ties: u64,
    /// Sum of t (t - 1) (2 t + 5) over groups of t equal values: correction of the variance.
    pub tie_weight: f64,
}

/// Counts the reversals of `values` in O(n log n); no value may be NaN.
///
/// In a merge of two sorted halves, a value of the right half that comes first is smaller than all
/// remaining values of the left half.
pub fn reversals(values: Vec<f64>) -> Reversals {
    let mut keys: Vec<i64> = values.into_iter().map(key).collect();
    let mut scratch = work::filled(0, keys.len() / 2);
    let count = sort(&mut keys, &mut scratch);
    let groups = keys.chunk_by(|a, b| a == b).map(|group| group.len() as u64);
    let (ties, tie_weight) = groups.filter(|t| *t > 1).fold((0, 0.0), |(ties, weight), t| {
        let pairs = t * (t - 1) / 2;
        (ties + pairs, weight + 2.0 * pairs as f64 * (2 * t + 5) as f64)
    });
    Reversals { count, ties, tie_weight }
}

/// A whole number with the order of the float; its comparison takes half the time.
fn key(z: f64) -> i64 {
    // 0.0 and -0.0 are equal.
    let bits = (z + 0.0).to_bits() as i64;
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

fn sort(values: &mut [i64], scratch: &mut [i64]) -> u64 {
    if values.len() <= BLOCK {
        return insert(values);
    }
    if values.len() > VALUES_PER_CHECK {
        work::pause();
    }
    let (left, right) = values.split_at_mut(values.len() / 2);
    let within = sort(left, scratch) + sort(right, scratch);
    let middle = left.len();
    within + merge(values, &mut scratch[..middle])
}

fn insert(values: &mut [i64]) -> u64 {
    let mut count = 0;
    for k in 1..values.len() {
        let value = values[k];
        let mut index = k;
        while index > 0 && values[index - 1] > value {
            values[index] = values[index - 1];
            index -= 1;
        }
        values[index] = value;
        count += k - index;
    }
    count as u64
}

/// Merges the sorted halves of `values`; `left` is scratch space for the first.
fn merge(values: &mut [i64], left: &mut [i64]) -> u64 {
    let middle = left.len();
    if values[middle - 1] <= values[middle] {
        return 0;
    }
    left.copy_from_slice(&values[..middle]);
    let (mut i, mut j, mut count) = (0, middle, 0);
    while i < middle && j < values.len() {
        let (earlier, later) = (left[i], values[j]);
        let reversed = later < earlier;
        // Masks instead of branches: the next half is unpredictable.
        let mask = -i64::from(reversed);
        values[i + j - middle] = earlier ^ ((earlier ^ later) & mask);
        count += (middle - i) & mask as usize;
        i += usize::from(!reversed);
        j += usize::from(reversed);
    }
    let rest = &left[i..];
    values[i + j - middle..][..rest.len()].copy_from_slice(rest);
    count as u64
}

#[cfg(test)]
mod tests {
    use super::{Reversals, reversals};
    use proptest::prelude::*;

    fn by_pairs(values: &[f64]) -> (u64, u64) {
        let pairs = || (0..values.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
        let count = pairs().filter(|(i, j)| values[*i] > values[*j]).count();
        let ties = pairs().filter(|(i, j)| values[*i] == values[*j]).count();
        (count as u64, ties as u64)
    }

    proptest! {
        #[test]
        fn equals_the_count_of_all_pairs(
            values in prop::collection::vec((-40_i8..40).prop_map(f64::from), 0..400),
        ) {
            let found = reversals(values.clone());
            prop_assert_eq!((found.count, found.ties), by_pairs(&values));
        }
    }

    #[test]
    fn ordered_and_reversed_and_equal_values() {
        let n = 1000_u64;
        let rising: Vec<f64> = (0..n).map(|k| k as f64 - 500.0).collect();
        let falling: Vec<f64> = rising.iter().rev().copied().collect();
        let none = Reversals { count: 0, ties: 0, tie_weight: 0.0 };
        assert_eq!(reversals(rising), none);
        assert_eq!(reversals(falling), Reversals { count: n * (n - 1) / 2, ..none });
        let equal = reversals(vec![3.0; 5]);
        assert_eq!(equal, Reversals { count: 0, ties: 10, tie_weight: 5.0 * 4.0 * 15.0 });
        assert_eq!(reversals(vec![]), none);
        assert_eq!(reversals(vec![0.0, -0.0]), Reversals { ties: 1, tie_weight: 18.0, ..none });
    }
}
