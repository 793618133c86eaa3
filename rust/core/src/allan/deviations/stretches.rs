//! Where a record has samples, and short gaps that a line closes.

use std::ops::Range;

/// The stretches of finite samples with room for a difference, in order.
pub fn stretches(samples: &[f64]) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut start = 0;
    while start < samples.len() {
        let here = &samples[start..];
        let length = here.iter().position(|z| !z.is_finite()).unwrap_or(here.len());
        if length > 1 {
            found.push(start..start + length);
        }
        start += length + 1;
    }
    found
}

/// Puts a line across every gap of at most `longest` samples between two finite ones.
pub fn bridge(samples: &mut [f64], longest: usize) {
    let mut last = None;
    for i in 0..samples.len() {
        if !samples[i].is_finite() {
            continue;
        }
        if let Some(before) =
            last.filter(|before| (2..=longest.saturating_add(1)).contains(&(i - before)))
        {
            draw_line(&mut samples[before..=i]);
        }
        last = Some(i);
    }
}

fn draw_line(samples: &mut [f64]) {
    let last = samples.len() - 1;
    let (from, to) = (samples[0], samples[last]);
    for (k, z) in samples.iter_mut().enumerate().take(last).skip(1) {
        let fraction = k as f64 / last as f64;
        *z = from * (1.0 - fraction) + to * fraction;
    }
}

#[cfg(test)]
mod tests {
    use super::{bridge, stretches};

    const N: f64 = f64::NAN;

    #[test]
    fn single_samples_are_no_stretch() {
        assert_eq!(stretches(&[N, 1.0, N, 1.0, 2.0, N, N, 1.0, 1.0, 1.0]), [3..5, 7..10]);
        assert_eq!(stretches(&[f64::INFINITY, 1.0]), []);
        assert_eq!(stretches(&[]), []);
    }

    #[test]
    fn a_line_closes_gaps_up_to_the_longest() {
        let mut z = [N, 0.0, N, N, N, 4.0, N, N, N, N, 9.0, N];
        bridge(&mut z, 3);
        assert_eq!(z[1..6], [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert!(z[0].is_nan() && z[6..10].iter().all(|z| z.is_nan()) && z[11].is_nan());
        bridge(&mut z, usize::MAX);
        assert_eq!(z[5..11], [4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    }
}
