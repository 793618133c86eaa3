//! The wavelets: taps, ranges, and thresholding of details.

use serde::{Deserialize, Serialize};

/// An orthonormal wavelet of Daubechies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Wavelet {
    /// Two taps: differences of means.
    Haar,
    /// Four taps; details of a ramp are zero.
    Db2,
    /// Eight taps; details of a cubic are zero.
    Db4,
    /// Sixteen taps; details of polynomials up to the seventh degree are zero.
    Db8,
}

impl Wavelet {
    /// All wavelets with their names.
    pub const NAMES: [(Self, &'static str); 4] =
        [(Self::Haar, "haar"), (Self::Db2, "db2"), (Self::Db4, "db4"), (Self::Db8, "db8")];

    /// Wavelet with this name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(_, known)| *known == name).map(|(wavelet, _)| *wavelet)
    }

    /// Name of the wavelet.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize].1
    }

    /// Length F of the filters.
    pub fn taps(self) -> usize {
        [2, 4, 8, 16][self as usize]
    }

    /// Largest number of levels of a record of `n` samples: at the last level the filters are as
    /// long as their input.
    pub fn deepest(self, n: usize) -> usize {
        (n / (self.taps() - 1)).checked_ilog2().unwrap_or(0) as usize
    }
}

/// Low-pass taps h_j, and high-pass taps g_j = (-1)^j h_{F-1-j}.
#[derive(Debug)]
pub(super) struct Taps<const F: usize> {
    pub low: [f64; F],
    pub high: [f64; F],
}

impl<const F: usize> Taps<F> {
    const fn new(low: [f64; F]) -> Self {
        let (mut high, mut j) = (low, 0);
        while j < F {
            high[j] = if j.is_multiple_of(2) { low[F - 1 - j] } else { -low[F - 1 - j] };
            j += 1;
        }
        Self { low, high }
    }
}

// Spectral factorisation of minimum phase with sixty digits.
pub(super) static HAAR: Taps<2> = Taps::new([std::f64::consts::FRAC_1_SQRT_2; 2]);
pub(super) static DB2: Taps<4> =
    Taps::new([0.48296291314453416, 0.8365163037378079, 0.2241438680420134, -0.12940952255126037]);
pub(super) static DB4: Taps<8> = Taps::new([
    0.2303778133088965,
    0.7148465705529157,
    0.6308807679298589,
    -0.027983769416859854,
    -0.18703481171909309,
    0.030841381835560764,
    0.0328830116668852,
    -0.010597401785069032,
]);
pub(super) static DB8: Taps<16> = Taps::new([
    0.05441584224310401,
    0.31287159091429995,
    0.6756307362972898,
    0.5853546836542067,
    -0.015829105256349306,
    -0.2840155429615469,
    0.0004724845739132828,
    0.12874742662047847,
    -0.017369301001807547,
    -0.044088253930794755,
    0.013981027917398282,
    0.008746094047405777,
    -0.004870352993451574,
    -0.00039174037337694705,
    0.0006754494064505693,
    -0.00011747678412476953,
]);

/// Calls `$f(&taps, $argument…)` with the taps of a wavelet.
macro_rules! with_taps {
    ($wavelet:expr, $f:path $(, $argument:expr)*) => {
        match $wavelet {
            $crate::denoise::Wavelet::Haar => $f(&$crate::denoise::wavelet::HAAR $(, $argument)*),
            $crate::denoise::Wavelet::Db2 => $f(&$crate::denoise::wavelet::DB2 $(, $argument)*),
            $crate::denoise::Wavelet::Db4 => $f(&$crate::denoise::wavelet::DB4 $(, $argument)*),
            $crate::denoise::Wavelet::Db8 => $f(&$crate::denoise::wavelet::DB8 $(, $argument)*),
        }
    };
}
pub(super) use with_taps;

/// Treatment of details above the threshold; details below it become zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// Details shrink by the threshold.
    Soft,
    /// Details stay.
    Hard,
}

impl Mode {
    /// Mode with this name.
    pub fn of_name(name: &str) -> Option<Self> {
        match name {
            "soft" => Some(Self::Soft),
            "hard" => Some(Self::Hard),
            _ => None,
        }
    }

    /// Name of the mode.
    pub fn name(self) -> &'static str {
        match self {
            Self::Soft => "soft",
            Self::Hard => "hard",
        }
    }

    /// The detail after thresholding.
    #[inline(always)]
    pub(super) fn shrink(self, d: f64, threshold: f64) -> f64 {
        let size = d.abs();
        match self {
            Self::Soft => (size - threshold).max(0.0).copysign(d),
            Self::Hard => {
                if size < threshold {
                    0.0
                } else {
                    d
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{DB2, DB4, DB8, HAAR, Mode, Taps, Wavelet};

    fn check<const F: usize>(taps: &Taps<F>) {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let (h, g) = (&taps.low, &taps.high);
        for shift in (0..F).step_by(2) {
            let one = if shift == 0 { 1.0 } else { 0.0 };
            assert!((product(&h[shift..], h) - one).abs() < 1e-15);
            assert!((product(&g[shift..], g) - one).abs() < 1e-15);
            assert!(product(&h[shift..], g).abs() < 1e-15);
            assert!(product(&g[shift..], h).abs() < 1e-15);
        }
        // The high-pass filter is zero for polynomials of degrees below half of its number of taps.
        let scale = (F - 1) as f64;
        for power in 0..F as i32 / 2 {
            let moment: f64 = (0..F).map(|j| (j as f64 / scale).powi(power) * g[j]).sum();
            assert!(moment.abs() < 1e-15, "{F} {power} {moment}");
        }
    }

    #[test]
    fn filters_are_orthonormal_and_blind_to_polynomials() {
        check(&HAAR);
        check(&DB2);
        check(&DB4);
        check(&DB8);
    }

    #[test]
    fn names_and_depths() {
        for (wavelet, name) in Wavelet::NAMES {
            assert_eq!((Wavelet::of_name(name), wavelet.name()), (Some(wavelet), name));
        }
        assert_eq!(Wavelet::of_name("sym4"), None);
        // As in PyWavelets.
        assert_eq!([13, 14, 27, 28, 1000].map(|n| Wavelet::Db4.deepest(n)), [0, 1, 1, 2, 7]);
        assert_eq!([0, 1, 2, 3, 4].map(|n| Wavelet::Haar.deepest(n)), [0, 0, 1, 1, 2]);
    }

    #[test]
    fn shrinking() {
        let soft = [-3.0, -1.0, 0.5, 1.0, 4.0].map(|d| Mode::Soft.shrink(d, 1.0));
        assert_eq!(soft, [-2.0, 0.0, 0.0, 0.0, 3.0]);
        let hard = [-3.0, -1.0, 0.5, 1.0, 4.0].map(|d| Mode::Hard.shrink(d, 1.0));
        assert_eq!(hard, [-3.0, -1.0, 0.0, 1.0, 4.0]);
    }
}
