//! The deviations: names, terms, and lengths of record that they need.

use super::record::Record;
use super::{differences, windows};

/// A deviation of the Allan family (NIST SP 1065, section 5; PDEV: Vernotte et al. 2016).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Allan, adjacent clusters.
    Adev,
    /// Allan, every cluster.
    Oadev,
    /// Modified Allan.
    Mdev,
    /// Time deviation: the modified Allan deviation times m/√3.
    Tdev,
    /// Hadamard, adjacent clusters.
    Hdev,
    /// Hadamard, every cluster.
    Ohdev,
    /// Total deviation: the record is reflected at its ends.
    Totdev,
    /// Modified total.
    Mtotdev,
    /// Time total deviation: the modified total deviation times m/√3.
    Ttotdev,
    /// Hadamard total.
    Htotdev,
    /// Theo1, for even m of at least 10; its averaging time is 0.75 m.
    Theo1,
    /// Parabolic.
    Pdev,
}

impl Kind {
    /// Every kind with its name.
    pub const NAMES: [(Self, &'static str); 12] = [
        (Self::Adev, "adev"),
        (Self::Oadev, "oadev"),
        (Self::Mdev, "mdev"),
        (Self::Tdev, "tdev"),
        (Self::Hdev, "hdev"),
        (Self::Ohdev, "ohdev"),
        (Self::Totdev, "totdev"),
        (Self::Mtotdev, "mtotdev"),
        (Self::Ttotdev, "ttotdev"),
        (Self::Htotdev, "htotdev"),
        (Self::Theo1, "theo1"),
        (Self::Pdev, "pdev"),
    ];

    /// Kind with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(_, known)| *known == name).map(|(kind, _)| *kind)
    }

    /// True if it uses third differences, which a ramp of the rate does not change.
    pub fn is_hadamard(self) -> bool {
        matches!(self, Self::Hdev | Self::Ohdev | Self::Htotdev)
    }

    /// Smallest number of samples without a gap for a term at averaging factor `m`; `None` if no
    /// number is enough.
    pub fn needs(self, m: usize) -> Option<usize> {
        let samples = match self {
            Self::Adev | Self::Oadev | Self::Pdev => m.checked_mul(2),
            Self::Mdev | Self::Tdev | Self::Mtotdev | Self::Ttotdev => {
                m.checked_mul(3)?.checked_sub(1)
            }
            Self::Hdev | Self::Ohdev | Self::Htotdev => m.checked_mul(3),
            Self::Totdev => Some(m.max(2)),
            Self::Theo1 => (m >= 10 && m.is_multiple_of(2)).then_some(m),
        };
        samples.filter(|_| m > 0)
    }

    /// Largest averaging factor with a term in `samples` samples without a gap, 0 if there is none.
    pub fn longest(self, samples: usize) -> usize {
        let m = match self {
            Self::Adev | Self::Oadev | Self::Pdev => samples / 2,
            Self::Mdev | Self::Tdev | Self::Mtotdev | Self::Ttotdev => {
                samples.saturating_add(1) / 3
            }
            Self::Hdev | Self::Ohdev | Self::Htotdev => samples / 3,
            Self::Totdev => samples,
            Self::Theo1 => samples / 2 * 2,
        };
        if self.needs(m).is_some_and(|needed| needed <= samples) { m } else { 0 }
    }

    /// Number of terms in a segment of `points` phase points.
    pub(super) fn terms(self, m: usize, points: usize) -> usize {
        if self.needs(m).is_none_or(|needed| points <= needed) {
            return 0;
        }
        match self {
            Self::Adev => (points - 1 - 2 * m) / m + 1,
            Self::Hdev => (points - 1 - 3 * m) / m + 1,
            // For the parabolic kind one more term would fit, which its authors leave out.
            Self::Oadev | Self::Pdev => points - 2 * m,
            Self::Ohdev | Self::Htotdev => points - 3 * m,
            Self::Mdev | Self::Tdev | Self::Mtotdev | Self::Ttotdev => points - 3 * m + 1,
            Self::Totdev => points - 2,
            Self::Theo1 => points - m,
        }
    }

    /// Number of factors whose sums share one pass over the record.
    pub(super) fn group(self) -> usize {
        match self {
            Self::Oadev | Self::Ohdev | Self::Totdev => differences::GROUP,
            Self::Mdev | Self::Tdev => windows::GROUP,
            _ => 1,
        }
    }

    /// Sums of all terms of a record, one for each factor; undefined for a factor without a term.
    pub(super) fn sums(self, record: &Record, factors: &[usize]) -> Vec<f64> {
        match self {
            Self::Adev => differences::separate::<3>(record, factors),
            Self::Hdev => differences::separate::<4>(record, factors),
            Self::Oadev => differences::overlapping::<3>(record, factors),
            Self::Ohdev => differences::overlapping::<4>(record, factors),
            Self::Mdev | Self::Tdev => windows::modified(record, factors),
            Self::Totdev => differences::total(record, factors),
            Self::Mtotdev | Self::Ttotdev => windows::modified_total(record, factors),
            Self::Htotdev => windows::hadamard_total(record, factors),
            Self::Theo1 => differences::theo1(record, factors),
            Self::Pdev => windows::parabolic(record, factors),
        }
    }

    /// Deviation for a mean of the terms at `m`.
    pub(super) fn deviation(self, mean: f64, m: usize) -> f64 {
        let m = m as f64;
        match self {
            Self::Adev | Self::Oadev | Self::Totdev | Self::Mtotdev => (mean / 2.0).sqrt() / m,
            Self::Ttotdev => (mean / 6.0).sqrt(),
            Self::Mdev => (mean / 2.0).sqrt() / (m * m),
            Self::Tdev => (mean / 6.0).sqrt() / m,
            Self::Hdev | Self::Ohdev => (mean / 6.0).sqrt() / m,
            Self::Htotdev => (mean / 6.0).sqrt(),
            Self::Theo1 => (mean / 0.75).sqrt() / m,
            Self::Pdev if m == 1.0 => (mean / 2.0).sqrt(),
            Self::Pdev => (72.0 * mean).sqrt() / (m * m * m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Kind;

    #[test]
    fn the_longest_factor_is_the_last_with_a_term() {
        for (kind, name) in Kind::NAMES {
            for samples in 0..60 {
                let has_term = |m: &usize| kind.terms(*m, samples + 1) > 0;
                let expected = (1..200).rev().find(has_term).unwrap_or(0);
                assert_eq!(kind.longest(samples), expected, "{name} of {samples}");
            }
        }
    }

    #[test]
    fn a_name_leads_back_to_its_kind() {
        for (kind, name) in Kind::NAMES {
            assert_eq!(Kind::from_name(name), Some(kind));
        }
        assert_eq!(Kind::from_name("OADEV"), None);
    }

    #[test]
    fn huge_factors_have_no_term() {
        for (kind, _) in Kind::NAMES {
            assert_eq!(kind.terms(usize::MAX, 1000), 0);
            assert_eq!(kind.terms(0, 1000), 0);
        }
    }
}
