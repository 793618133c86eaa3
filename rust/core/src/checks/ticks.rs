//! Means of a sensor's samples over ticks, without missing and clipped samples.

use crate::work::{collect, filled, pause, room};

/// Duration of a tick, s.
pub const TICK: f64 = 0.02;

/// Longest time without a sample that is bridged, in addition to the period, s.
const MAX_BRIDGED_S: f64 = 0.05;
/// Largest value of a sensor, or of a time.
const MAX_VALUE: f64 = 1e30;
/// Number of samples for a median.
const MEDIAN_SAMPLES: usize = 20_000;
/// Number of samples between two checks for a stop.
const SAMPLES_PER_CHECK: usize = 1 << 14;

/// Means over `count` ticks from `start` on, of samples at increasing times; NaN if half of a tick
/// or more is missing. A sample that is not finite or at the end of the range is missing.
pub fn ticks(time: &[f64], values: &[[f64; 3]], start: f64, count: usize) -> Vec<[f64; 3]> {
    let mut means = Means::of(start, count);
    let period = median(collect(time.windows(2).map(|t| t[1] - t[0]))).unwrap_or(TICK);
    let full = find_clipped(values);
    let is_there = |k: usize| !full[k] && values[k].iter().all(|x| x.is_finite());
    let mut there = (0..time.len().min(values.len())).filter(|k| is_there(*k));
    let Some(mut k) = there.next() else { return means.sums };
    let mut left = time[k] - period / 2.0;
    for next in there.by_ref() {
        if next.is_multiple_of(SAMPLES_PER_CHECK) {
            pause();
        }
        let step = time[next] - time[k];
        // The middle between two samples, or half a period from each.
        let half = if step - period <= MAX_BRIDGED_S + 1e-9 { step / 2.0 } else { period / 2.0 };
        means.add(left, time[k] + half, &values[k]);
        left = time[next] - half;
        k = next;
    }
    means.add(left, time[k] + period / 2.0, &values[k]);
    means.finish()
}

/// Sums over ticks, and their durations, s.
struct Means {
    start: f64,
    sums: Vec<[f64; 3]>,
    held: Vec<f64>,
}

impl Means {
    fn of(start: f64, count: usize) -> Self {
        Self { start, sums: filled([f64::NAN; 3], count), held: filled(0.0, count) }
    }

    /// Adds a value from one time to another.
    fn add(&mut self, from: f64, to: f64, value: &[f64; 3]) {
        let count = self.held.len() as f64;
        let (from, to) = ((from - self.start) / TICK, (to - self.start) / TICK);
        let (from, to) = (from.clamp(0.0, count), to.clamp(0.0, count));
        // NaN gives no tick.
        for k in from as usize..(to.ceil() as usize).min(self.held.len()) {
            let part = (to.min(k as f64 + 1.0) - from.max(k as f64)).max(0.0);
            if part > 0.0 {
                let sum = &mut self.sums[k];
                let before = if self.held[k] > 0.0 { *sum } else { [0.0; 3] };
                *sum = core::array::from_fn(|i| {
                    before[i] + part * value[i].clamp(-MAX_VALUE, MAX_VALUE)
                });
                self.held[k] += part;
            }
        }
    }

    fn finish(mut self) -> Vec<[f64; 3]> {
        for (sum, held) in self.sums.iter_mut().zip(&self.held) {
            *sum = if *held >= 0.5 { sum.map(|x| x / held) } else { [f64::NAN; 3] };
        }
        self.sums
    }
}

/// Mask of samples at the end of the range: several successive samples are there, and rarely.
fn find_clipped(values: &[[f64; 3]]) -> Vec<bool> {
    let mut full = filled(false, values.len());
    for axis in 0..3 {
        let at = |k: usize| Some(values[k][axis]).filter(|x| x.is_finite());
        let all = || (0..values.len()).filter_map(at);
        let step = values.len().div_ceil(MEDIAN_SAMPLES).max(1);
        let Some(middle) = median(collect((0..values.len()).step_by(step).filter_map(at))) else {
            continue;
        };
        let off = |x: f64| (x - middle).abs();
        let some = collect((0..values.len()).step_by(step).filter_map(at).map(off));
        let spread = median(some).unwrap_or(0.0);
        let ends = [all().fold(f64::MIN, f64::max), all().fold(f64::MAX, f64::min)];
        for end in ends {
            let is_hit = |x: f64| (x - end).abs() <= 1e-3 * end.abs();
            if off(end) > 20.0 * spread && is_end(values, axis, is_hit) {
                for (full, value) in full.iter_mut().zip(values) {
                    *full |= is_hit(value[axis]);
                }
            }
        }
    }
    full
}

/// True if as many samples are hit as at the end of a range.
fn is_end(values: &[[f64; 3]], axis: usize, is_hit: impl Fn(f64) -> bool) -> bool {
    let (mut hits, mut there, mut run, mut most) = (0_usize, 0_usize, 0_usize, 0_usize);
    for value in values {
        let hit = is_hit(value[axis]);
        there += usize::from(value[axis].is_finite());
        hits += usize::from(hit);
        run = if hit { run + 1 } else { 0 };
        most = most.max(run);
    }
    hits >= 5 && 10 * hits < there && most >= 3
}

/// Median of a part of the values, evenly spaced, to save time.
pub(super) fn median_of_some(values: impl Iterator<Item = f64>, length: usize) -> Option<f64> {
    let step = length.div_ceil(MEDIAN_SAMPLES).max(1);
    let mut some = room(length.div_ceil(step));
    some.extend(values.step_by(step).filter(|x| x.is_finite()).take(length.div_ceil(step)));
    median(some)
}

/// Median; for an even number the mean of the middle two.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    let n = values.len();
    if n == 0 {
        return None;
    }
    let (below, upper, _) = values.select_nth_unstable_by(n / 2, f64::total_cmp);
    let upper = *upper;
    let lower = below.iter().copied().fold(f64::MIN, f64::max);
    Some(if n.is_multiple_of(2) { lower + (upper - lower) / 2.0 } else { upper })
}

#[cfg(test)]
mod tests {
    use super::{TICK, find_clipped, median, ticks};

    fn times(n: usize, rate: f64) -> Vec<f64> {
        (0..n).map(|k| (k as f64 + 0.5) / rate).collect()
    }

    #[test]
    fn a_tick_is_the_mean_of_its_samples() {
        let values: Vec<_> = (0..8).map(|k| [f64::from(k), 1.0, -2.0]).collect();
        let found = ticks(&times(8, 100.0), &values, 0.0, 4);
        for (k, mean) in found.iter().enumerate() {
            // A rounding of times.
            assert!((mean[0] - (2.0 * k as f64 + 0.5)).abs() < 1e-12);
            assert_eq!(mean[1], 1.0);
        }
    }

    #[test]
    fn short_gaps_are_bridged_and_long_ones_missing() {
        let mut values = vec![[1.0; 3]; 200];
        values[50..54].fill([f64::NAN; 3]);
        values[100..120].fill([f64::INFINITY; 3]);
        let found = ticks(&times(200, 100.0), &values, 0.0, 100);
        let missing = |k: usize| found[k][0].is_nan();
        assert!((0..50).all(|k| !missing(k)) && (50..60).all(missing));
        assert!((60..100).all(|k| !missing(k)) && TICK == 0.02);
    }

    #[test]
    fn no_times_are_not_ticks() {
        for outlier in [f64::NAN, f64::INFINITY, -1e300, 1e300] {
            assert_eq!(ticks(&[0.0, outlier], &[[1.0; 3]; 2], 0.0, 2).len(), 2);
        }
        assert!(ticks(&[], &[], 0.0, 2)[0][0].is_nan());
    }

    #[test]
    fn an_end_is_hit_again_and_again() {
        let mut values: Vec<_> = (0..1000).map(|k| [f64::from(k % 7), 0.0, 0.0]).collect();
        values[400..410].fill([500.0, 0.0, 0.0]);
        assert_eq!(find_clipped(&values).iter().filter(|full| **full).count(), 10);
        values[404] = [600.0, 0.0, 0.0];
        assert!(!find_clipped(&values).contains(&true));
    }

    #[test]
    fn medians() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(vec![]), None);
    }
}
