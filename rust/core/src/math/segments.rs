//! Segments of a record: the runs of finite samples between missing ones.

use std::ops::Range;

/// The segments of `record`, in order.
pub fn segments(record: &[f64]) -> impl Iterator<Item = &[f64]> {
    record.split(|z| !z.is_finite()).filter(|segment| !segment.is_empty())
}

/// The ranges of the segments of `record`, in order.
pub fn segment_ranges(record: &[f64]) -> impl Iterator<Item = Range<usize>> {
    let mut start = 0;
    let ranges = record.split(|z| !z.is_finite()).map(move |part| {
        let range = start..start + part.len();
        start = range.end + 1;
        range
    });
    ranges.filter(|range| !range.is_empty())
}

#[cfg(test)]
mod tests {
    use super::{segment_ranges, segments};

    #[test]
    fn missing_samples_divide_a_record() {
        let record = [f64::NAN, 1.0, 2.0, f64::INFINITY, f64::NAN, 3.0];
        assert_eq!(segments(&record).collect::<Vec<_>>(), [&[1.0, 2.0][..], &[3.0]]);
        assert_eq!(segment_ranges(&record).collect::<Vec<_>>(), [1..3, 5..6]);
        for empty in [&[f64::NAN; 3][..], &[]] {
            assert_eq!(segments(empty).count(), 0);
            assert_eq!(segment_ranges(empty).count(), 0);
        }
    }
}
