//! Choice of the most informative windows of a record, and the triangular means in one.

use nalgebra::Vector3;

use super::ticks::median_of_some;
use crate::work::{collect, filled, pause};

/// Number of triangular means in a window; each covers half of it and overlaps the next by half.
pub(super) const MEANS: usize = 3;

/// Number of parts of a window whose means show the rotation of the force.
const PARTS: usize = 8;

/// First ticks of windows without missing ticks, half a window apart. If there are more than
/// `most`, the windows with the largest variation of `vectors` are kept; a third of them is chosen
/// for the largest rotation by the gyro.
pub(super) fn windows(
    rates: &[Vector3<f64>],
    vectors: &[Vector3<f64>],
    length: usize,
    most: usize,
) -> Vec<usize> {
    let whole = whole_windows(rates, vectors, length);
    if whole.len() <= most {
        return whole;
    }
    let centre = Vector3::from(
        [0, 1, 2]
            .map(|i| median_of_some(rates.iter().map(|rate| rate[i]), rates.len()).unwrap_or(0.0)),
    );
    let varied = collect(whole.iter().map(|first| {
        pause();
        variance(&vectors[*first..*first + length])
    }));
    let turned = collect(whole.iter().map(|first| {
        let part = &rates[*first..*first + length];
        part.iter().map(|rate| (rate - centre).map(f64::abs).sum()).sum::<f64>()
    }));
    let mut chosen = filled(false, whole.len());
    for (scores, total) in [(&varied, most * 2 / 3), (&turned, most)] {
        let mut left = collect((0..whole.len()).filter(|k| !chosen[*k]));
        left.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]));
        let already = whole.len() - left.len();
        left.iter().take(total - already).for_each(|k| chosen[*k] = true);
    }
    collect(whole.iter().zip(&chosen).filter(|(_, chosen)| **chosen).map(|(first, _)| *first))
}

fn whole_windows(rates: &[Vector3<f64>], vectors: &[Vector3<f64>], length: usize) -> Vec<usize> {
    let is_whole = |v: &Vector3<f64>| v.iter().all(|x| x.is_finite());
    let n = rates.len().min(vectors.len());
    let mut since = 0;
    let mut found = collect([]);
    for k in 0..n {
        if !(is_whole(&rates[k]) && is_whole(&vectors[k])) {
            since = k + 1;
        }
        // The window that ends here.
        let first = (k + 1).wrapping_sub(length);
        if k + 1 >= length && first.is_multiple_of(length / 2) && since <= first {
            crate::work::push(&mut found, first);
        }
    }
    found
}

/// Variance of the means of a window's parts, summed over axes.
fn variance(window: &[Vector3<f64>]) -> f64 {
    let mean = |part: &[Vector3<f64>]| part.iter().sum::<Vector3<f64>>() / part.len() as f64;
    let length = window.len() / PARTS;
    let means: [_; PARTS] = core::array::from_fn(|k| mean(&window[k * length..(k + 1) * length]));
    let all = mean(&means);
    means.iter().map(|m| (m - all).norm_squared()).sum::<f64>() / PARTS as f64
}

#[cfg(test)]
mod tests {
    use super::windows;
    use nalgebra::Vector3;

    #[test]
    fn windows_that_tell_most_are_kept_and_none_that_misses_a_tick() {
        let mut rates = vec![Vector3::zeros(); 400];
        let forces: Vec<_> = (0..400).map(|k| Vector3::new(0.0, 0.0, f64::from(k / 200))).collect();
        assert_eq!(windows(&rates, &forces, 80, 20), (0..9).map(|k| 40 * k).collect::<Vec<_>>());
        rates[100] = Vector3::new(f64::NAN, 0.0, 0.0);
        assert_eq!(windows(&rates, &forces, 80, 20), [0, 120, 160, 200, 240, 280, 320]);
        rates[350] = Vector3::new(9.0, 0.0, 0.0);
        // Among equal windows the first is kept.
        assert_eq!(windows(&rates, &forces, 80, 3), [0, 160, 280]);
    }
}
