//! The parts of a record between missing samples.

/// The longest parts of `record` that hold finite values only, in order.
pub fn stretches(record: &[f64]) -> impl Iterator<Item = &[f64]> {
    record.split(|z| !z.is_finite()).filter(|stretch| !stretch.is_empty())
}

#[cfg(test)]
mod tests {
    use super::stretches;

    #[test]
    fn a_record_falls_apart_at_what_is_missing() {
        let record = [f64::NAN, 1.0, 2.0, f64::INFINITY, f64::NAN, 3.0];
        let found: Vec<&[f64]> = stretches(&record).collect();
        assert_eq!(found, [&[1.0, 2.0][..], &[3.0]]);
        assert_eq!(stretches(&[f64::NAN; 3]).count(), 0);
        assert_eq!(stretches(&[]).count(), 0);
    }
}
