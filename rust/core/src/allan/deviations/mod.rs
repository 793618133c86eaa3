//! Deviations of whole records at many averaging factors: the Allan and Hadamard families.

mod differences;
mod kernels;
mod kind;
mod noise_type;
mod record;
mod windows;

use crate::math::parallel;

pub use self::kind::Kind;
pub use self::record::Record;

/// A deviation and its number of terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Deviation in the samples' unit.
    pub deviation: f64,
    /// Number of terms, overlapping ones included.
    pub terms: usize,
}

/// Variances of one record at each averaging factor.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// `None` for a factor without a term.
    pub estimates: Vec<Option<Estimate>>,
    /// α of the rate's power spectral density ~ f^α, from 2 (white phase) to -4. If it cannot be
    /// identified, it is the previous factor's value, or 0 (white rate) at the first.
    pub exponents: Vec<i32>,
}

impl Curve {
    fn of(parts: impl Iterator<Item = Part>) -> Self {
        let (estimates, exponents): (Vec<_>, Vec<_>) = parts.flatten().unzip();
        let known = exponents.into_iter().scan(0, |last, exponent| {
            *last = exponent.unwrap_or(*last);
            Some(*last)
        });
        Self { estimates, exponents: known.collect() }
    }
}

type Part = Vec<(Option<Estimate>, Option<i32>)>;

/// The curve of each record, with `parallel` on the current thread pool (feature `parallel`). The
/// result is bit-identical.
pub fn curves(records: &[Record], kind: Kind, factors: &[usize], parallel: bool) -> Vec<Curve> {
    let groups: Vec<&[usize]> = factors.chunks(kind.group()).collect();
    let tasks: Vec<(&Record, &[usize])> = records
        .iter()
        .flat_map(|record| groups.iter().map(move |group| (record, *group)))
        .collect();
    let parts = parallel::map(tasks, parallel, |(record, group)| part(record, kind, group));
    let mut parts = parts.into_iter();
    records.iter().map(|_| Curve::of(parts.by_ref().take(groups.len()))).collect()
}

fn part(record: &Record, kind: Kind, factors: &[usize]) -> Part {
    let lowest = if kind.is_hadamard() { -4 } else { -2 };
    let exponent = |m: &usize| noise_type::exponent(record, *m, lowest);
    estimates(record, kind, factors).into_iter().zip(factors.iter().map(exponent)).collect()
}

/// Estimates of factors that share one pass.
fn estimates(record: &Record, kind: Kind, factors: &[usize]) -> Vec<Option<Estimate>> {
    let terms = |m: usize| -> usize { record.segments().map(|x| kind.terms(m, x.len())).sum() };
    let counted: Vec<(usize, usize)> = factors.iter().map(|m| (*m, terms(*m))).collect();
    let present = counted.iter().filter(|(_, terms)| *terms > 0).map(|(m, _)| *m);
    let mut sums = kind.sums(record, &present.collect::<Vec<_>>()).into_iter();
    let estimate = |(m, terms): (usize, usize)| {
        let sum = if terms > 0 { sums.next()? } else { return None };
        let deviation = record.unit() * kind.deviation(sum / terms as f64, m);
        Some(Estimate { deviation, terms })
    };
    counted.into_iter().map(estimate).collect()
}
