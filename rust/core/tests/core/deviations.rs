//! Deviations of the Allan family against published numbers, and noise types of known noise.

use crate::common::white_noise;
use proptest::prelude::*;
use zerorate_core::Stream;
use zerorate_core::allan::{AllanKind, AllanNoise, Kind, Record, curves};

/// Frequency of NBS Monograph 140, annex 8.E.
const NBS: [f64; 9] = [892.0, 809.0, 823.0, 798.0, 671.0, 644.0, 883.0, 903.0, 677.0];

/// The 1000 numbers of NIST SP 1065, section 12.4.
fn sp1065() -> Vec<f64> {
    let next = |n: &u64| Some(16_807 * n % 2_147_483_647);
    let numbers = std::iter::successors(Some(1_234_567_890), next);
    numbers.take(1000).map(|n| n as f64 / 2_147_483_647.0).collect()
}

fn deviations(samples: &[f64], kind: Kind, factors: &[usize]) -> Vec<Option<f64>> {
    let records = [Record::new(samples.to_vec(), 0)];
    let curve = curves(&records, kind, factors, false).remove(0);
    curve.estimates.iter().map(|estimate| estimate.map(|e| e.deviation)).collect()
}

fn assert_printed(samples: &[f64], kind: Kind, printed: &[(usize, f64)], tolerance: f64) {
    for (m, expected) in printed {
        let found = deviations(samples, kind, &[*m])[0].expect("long enough");
        assert!((found / expected - 1.0).abs() < tolerance, "{kind:?} at {m}: {found}");
    }
}

#[test]
fn nbs_monograph_140() {
    let printed = [
        (Kind::Adev, 91.22945, 115.8082),
        (Kind::Oadev, 91.22945, 85.95287),
        (Kind::Mdev, 91.22945, 74.78849),
        (Kind::Tdev, 52.67135, 86.35831),
        (Kind::Hdev, 70.80607, 116.7980),
        (Kind::Ohdev, 70.80607, 85.61487),
        (Kind::Totdev, 91.22945, 93.90379),
    ];
    for (kind, at_one, at_two) in printed {
        // Seven digits are printed.
        assert_printed(&NBS, kind, &[(1, at_one), (2, at_two)], 1e-6);
    }
    // Five digits are printed.
    assert_printed(&NBS, Kind::Mtotdev, &[(1, 64.509), (2, 64.794)], 1e-4);
    assert_printed(&NBS, Kind::Ttotdev, &[(1, 37.244), (2, 74.818)], 1e-4);
    // Printed with its bias correction.
    assert_printed(&NBS, Kind::Htotdev, &[(2, 91.16396 * 0.995_f64.sqrt())], 1e-6);
}

#[test]
fn sp1065_thousand_points() {
    let printed = [
        (Kind::Adev, [2.922319e-1, 9.965736e-2, 3.897804e-2]),
        (Kind::Oadev, [2.922319e-1, 9.159953e-2, 3.241343e-2]),
        (Kind::Mdev, [2.922319e-1, 6.172376e-2, 2.170921e-2]),
        (Kind::Tdev, [1.687202e-1, 3.563623e-1, 1.253382]),
        (Kind::Hdev, [2.943883e-1, 1.052754e-1, 3.910861e-2]),
        (Kind::Ohdev, [2.943883e-1, 9.581083e-2, 3.237638e-2]),
        (Kind::Totdev, [2.922319e-1, 9.134743e-2, 3.406530e-2]),
    ];
    for (kind, [one, ten, hundred]) in printed {
        // Seven digits are printed.
        assert_printed(&sp1065(), kind, &[(1, one), (10, ten), (100, hundred)], 1e-6);
    }
    let unbiased = 0.995_f64.sqrt();
    let printed = [(1, 2.943883e-1), (10, 9.614787e-2 * unbiased), (100, 3.058103e-2 * unbiased)];
    assert_printed(&sp1065(), Kind::Htotdev, &printed, 1e-6);
}

#[test]
fn sp1065_thousand_points_by_stable32() {
    // Five digits are printed.
    let printed = [(1, 2.0664e-1), (10, 5.5529e-2), (100, 1.9547e-2)];
    assert_printed(&sp1065(), Kind::Mtotdev, &printed, 1e-4);
    let printed = [(1, 1.1930e-1), (10, 3.2060e-1), (100, 1.1285)];
    assert_printed(&sp1065(), Kind::Ttotdev, &printed, 1e-4);
    let printed = [(10, 0.10757), (20, 0.072762), (40, 0.048652), (100, 0.031789)];
    assert_printed(&sp1065(), Kind::Theo1, &printed, 1e-4);
    let printed = [(202, 0.024120), (400, 0.014321), (998, 0.0050234), (1000, 5.0524e-3)];
    assert_printed(&sp1065(), Kind::Theo1, &printed, 1e-4);
}

#[test]
fn sp1065_thousand_points_by_sigma_theta() {
    let printed = [
        (1, 0.292_231_878_106_752),
        (2, 0.214_452_335_642_526),
        (4, 0.156_181_121_586_184),
        (8, 0.117_097_457_454_484),
        (16, 0.069_029_585_189_839),
        (32, 0.049_749_707_730_398),
        (64, 0.038_947_417_330_713),
        (128, 0.030_862_392_741_372),
        (256, 0.012_447_414_341_332),
    ];
    // Fifteen of the digits printed; some thousand roundings of sums on either side.
    assert_printed(&sp1065(), Kind::Pdev, &printed, 1e-11);
}

#[test]
fn equal_weights_give_the_allan_variance_of_the_record() {
    let signal = crate::common::drifting(5000, 3);
    let mut noise = AllanNoise::new(1.0, AllanKind::Allan, 0.0).expect("valid parameters");
    let running = signal.iter().map(|z| noise.update(*z)).last().expect("samples");
    let deviation = deviations(&signal, Kind::Oadev, &[1])[0].expect("long enough");
    // 5000 roundings of a running mean.
    assert!((running / (deviation * deviation) - 1.0).abs() < 1e-12);
}

#[test]
fn deviations_of_a_ramp_and_around_a_gap() {
    let mut ramp: Vec<f64> = (0..1000).map(|k| 1e7 + 0.5 * f64::from(k)).collect();
    // A ramp of slope s: s m / √2 at every averaging time.
    let exact = |m: usize| 0.5 * m as f64 / 2f64.sqrt();
    for m in [1, 2, 7, 64, 500] {
        // Roundings of a phase of 1e5 in differences from 1 on.
        assert_printed(&ramp, Kind::Oadev, &[(m, exact(m))], 1e-9);
    }
    assert_eq!(deviations(&ramp, Kind::Oadev, &[501]), [None]);
    ramp[500] = f64::NAN;
    assert_printed(&ramp, Kind::Oadev, &[(100, exact(100))], 1e-9);
    assert_eq!(deviations(&[f64::NAN; 9], Kind::Oadev, &[1]), [None]);
}

/// The pieces of a record without a gap, as phase, and the mean of its samples taken off.
fn phases(samples: &[f64]) -> Vec<Vec<f64>> {
    let present: Vec<f64> = samples.iter().copied().filter(|z| z.is_finite()).collect();
    let mean = present.iter().sum::<f64>() / present.len().max(1) as f64;
    let phase = |rates: &[f64]| {
        (0..=rates.len()).map(|i| rates[..i].iter().map(|z| z - mean).sum()).collect()
    };
    samples.split(|z| !z.is_finite()).map(phase).collect()
}

/// The terms of one piece, literally, and what their mean is divided by.
fn terms(kind: Kind, x: &[f64], m: usize) -> (Vec<f64>, f64) {
    let n = x.len();
    let square = m as f64 * m as f64;
    let second = |i: usize| x[i + 2 * m] - 2.0 * x[i + m] + x[i];
    let third = |i: usize| x[i + 3 * m] - 3.0 * x[i + 2 * m] + 3.0 * x[i + m] - x[i];
    let all = |spans: usize| 0..n.saturating_sub(spans * m);
    let lever = |k: usize| (m as f64 - 1.0) / 2.0 - k as f64;
    let slope = |i: usize| (0..m).map(|k| lever(k) * (x[i + k] - x[i + k + m])).sum::<f64>();
    let window = |j: usize| (j..j + m).map(second).sum::<f64>();
    let (values, divisor): (Vec<f64>, f64) = match kind {
        Kind::Adev => (all(2).step_by(m).map(second).collect(), 2.0 * square),
        Kind::Oadev => (all(2).map(second).collect(), 2.0 * square),
        Kind::Hdev => (all(3).step_by(m).map(third).collect(), 6.0 * square),
        Kind::Ohdev => (all(3).map(third).collect(), 6.0 * square),
        Kind::Mdev => {
            ((0..(n + 1).saturating_sub(3 * m)).map(window).collect(), 2.0 * square * square)
        }
        Kind::Pdev if m > 1 => (all(2).map(slope).collect(), square * square * square / 72.0),
        _ => unreachable!("the reflected kinds have their oracle in Python"),
    };
    (values.iter().map(|value| value * value).collect(), divisor)
}

fn rate() -> impl Strategy<Value = f64> {
    prop_oneof![12 => -10.0..10.0, 1 => Just(f64::NAN), 1 => Just(f64::INFINITY)]
}

proptest! {
    #[test]
    fn a_record_with_gaps_gives_the_printed_sums(
        samples in prop::collection::vec(rate(), 0..80),
        m in 2_usize..9,
    ) {
        for kind in [Kind::Adev, Kind::Oadev, Kind::Hdev, Kind::Ohdev, Kind::Mdev, Kind::Pdev] {
            let pieces = phases(&samples);
            let parts: Vec<(Vec<f64>, f64)> = pieces.iter().map(|x| terms(kind, x, m)).collect();
            let all: Vec<f64> = parts.iter().flat_map(|(squares, _)| squares.clone()).collect();
            let found = deviations(&samples, kind, &[m])[0];
            prop_assert_eq!(found.is_some(), !all.is_empty());
            if let Some(found) = found {
                let expected = (all.iter().sum::<f64>() / all.len() as f64 / parts[0].1).sqrt();
                // Roundings of a phase of up to some hundred, in terms of a few.
                prop_assert!((found - expected).abs() < 1e-11 * (1.0 + expected));
            }
        }
    }
}

/// Rate noise of a power law S ~ f^α.
fn power_law(n: usize, alpha: i32, seed: u64) -> Vec<f64> {
    let white = white_noise(n, seed);
    let sums = |z: Vec<f64>| -> Vec<f64> {
        z.iter()
            .scan(0.0, |sum, z| {
                *sum += z;
                Some(*sum)
            })
            .collect()
    };
    let differences = |z: Vec<f64>| z.windows(2).map(|pair| pair[1] - pair[0]).collect();
    match alpha {
        2 => differences(white),
        1 => differences(flicker(&white)),
        0 => white,
        -1 => flicker(&white),
        -2 => sums(white),
        _ => sums(power_law(n, alpha + 2, seed)),
    }
}

/// White noise through poles and zeros that alternate twice a decade: 1/f within 0.3 dB.
fn flicker(white: &[f64]) -> Vec<f64> {
    let corner = |i: i32| 10f64.powf(-0.5 * f64::from(i));
    (0..14).fold(white.to_vec(), |z, i| {
        let (pole, zero) = (1.0 - corner(i) * 0.6, 1.0 - corner(i) * 0.6 * 10f64.powf(0.25));
        let (mut before, mut y) = (0.0, 0.0);
        z.iter()
            .map(|z| {
                y = pole * y + z - zero * before;
                before = *z;
                y
            })
            .collect()
    })
}

/// Share of eight records and of all factors with more than thirty averages.
fn recognised(kind: Kind, alpha: i32) -> f64 {
    let records: Vec<Record> =
        (1..9).map(|seed| Record::new(power_law(100_000, alpha, seed), 0)).collect();
    let factors: Vec<usize> = (0..12).map(|i| 1 << i).collect();
    let curves = curves(&records, kind, &factors, false);
    let all: Vec<i32> = curves.into_iter().flat_map(|curve| curve.exponents).collect();
    all.iter().filter(|found| **found == alpha).count() as f64 / all.len() as f64
}

#[test]
fn noise_types_are_recognised() {
    for alpha in -2..=2 {
        for kind in [Kind::Oadev, Kind::Ohdev] {
            let share = recognised(kind, alpha);
            // Of 48 averages, the fewest here, the correlation's standard error is 0.14.
            assert!(share >= 0.9, "{kind:?} {alpha}: {share}");
        }
    }
    for alpha in [-4, -3] {
        let share = recognised(Kind::Ohdev, alpha);
        assert!(share >= 0.9, "{alpha}: {share}");
    }
}
