//! `StreamingAllan` against the variances of the whole record, and its laws.

use crate::common::{any_sample, restored, white_noise};
use proptest::prelude::*;
use zerorate_core::allan::StreamingAllan;
use zerorate_core::{Error, Stream};

const RATE: f64 = 100.0;

fn new(octaves: usize) -> StreamingAllan {
    StreamingAllan::new(RATE, octaves).expect("the tests' octaves are in range")
}

fn fed(octaves: usize, samples: &[f64]) -> StreamingAllan {
    let mut allan = new(octaves);
    allan.process(samples, &mut vec![(); samples.len()]);
    allan
}

/// Everything that can be read, as bits.
fn readings(allan: &StreamingAllan) -> Vec<(u64, u64)> {
    (0..allan.octaves())
        .flat_map(|j| [allan.allan(j), allan.hadamard(j)])
        .map(|(variance, terms)| (variance.to_bits(), terms))
        .collect()
}

/// Mean square of the phase's differences of `order`, spaced by `m`, and their number.
fn differences(samples: &[f64], m: usize, order: usize) -> (f64, usize) {
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    let mut phase = vec![0.0; samples.len() + 1];
    for (k, z) in samples.iter().enumerate() {
        phase[k + 1] = phase[k] + (z - mean);
    }
    for _ in 0..order {
        phase = phase[m..].iter().zip(&phase).map(|(now, before)| now - before).collect();
    }
    (phase.iter().map(|x| x * x).sum::<f64>() / phase.len() as f64, phase.len())
}

#[test]
fn equals_the_whole_record() {
    let samples = white_noise(10_000, 1);
    let allan = fed(11, &samples);
    for j in 0..11 {
        let m = 1 << j;
        let square = (m * m) as f64;
        for ((got, terms), order, weight) in [(allan.allan(j), 2, 2.0), (allan.hadamard(j), 3, 6.0)]
        {
            let (expected, n) = differences(&samples, m, order);
            assert_eq!(terms, n as u64);
            // The mean is some two deviations off the first sample, rounding as noise of
            // 6e-17 * 1e4 * 2 = 1e-12 deviations on each sample.
            let expected = expected / (weight * square);
            assert!((got / expected - 1.0).abs() < 1e-11, "m = {m}: {got}, expected {expected}");
        }
    }
}

#[test]
fn a_missing_sample_takes_its_terms_away() {
    let mut samples = white_noise(1000, 2);
    samples[300] = f64::NAN;
    let allan = fed(9, &samples);
    for j in 0..9 {
        let count = |order: u64| {
            let length = order << j;
            (300 + 1 - length.min(301)) + (699 + 1 - length.min(700))
        };
        assert_eq!(allan.allan(j).1, count(2));
        assert_eq!(allan.hadamard(j).1, count(3));
    }
}

#[test]
fn octaves_out_of_range_are_refused() {
    for octaves in [0, 25, usize::MAX] {
        let refused = StreamingAllan::new(RATE, octaves).expect_err("out of range");
        assert!(matches!(refused, Error::Parameter { name: "octaves", .. }));
    }
}

#[test]
fn an_octave_that_is_not_there_has_no_term() {
    let allan = fed(3, &white_noise(100, 3));
    let (variance, terms) = allan.allan(3);
    assert!(variance.is_nan() && terms == 0);
}

#[test]
fn the_largest_differences_stay_finite() {
    let samples: Vec<f64> = (0..5000).map(|k| [f64::MAX, f64::MIN][k / 64 % 2]).collect();
    let allan = fed(11, &samples);
    for j in 0..11 {
        assert!(allan.allan(j).0.is_finite() && allan.hadamard(j).0.is_finite());
        assert!(allan.allan(j).0 >= 0.0 && allan.hadamard(j).0 >= 0.0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn batches_samples_and_checkpoints_agree(
        octaves in 1usize..10,
        samples in prop::collection::vec(-10.0..10.0, 2..700),
        spikes in prop::collection::vec((any::<prop::sample::Index>(), any_sample()), 0..6),
        part in 0.0..1.0,
    ) {
        let mut samples = samples;
        for (place, z) in spikes {
            let place = place.index(samples.len());
            samples[place] = z;
        }
        let whole = fed(octaves, &samples);
        let mut single = new(octaves);
        samples.iter().for_each(|z| single.observe(*z));
        let at = (samples.len() as f64 * part) as usize;
        let mut parts = restored(&fed(octaves, &samples[..at]));
        samples[at..].iter().for_each(|z| parts.update(*z));
        prop_assert_eq!(&single, &whole);
        prop_assert_eq!(&parts, &whole);
        prop_assert_eq!(readings(&parts), readings(&whole));
    }

    #[test]
    fn nothing_breaks_it(
        octaves in 1usize..8,
        samples in prop::collection::vec(any_sample(), 1..300),
    ) {
        let mut allan = new(octaves);
        for z in samples {
            allan.observe(z);
            for j in 0..octaves {
                for (variance, terms) in [allan.allan(j), allan.hadamard(j)] {
                    prop_assert_eq!(variance.is_finite(), terms > 0);
                }
            }
        }
    }

    #[test]
    fn a_power_of_two_scales_without_rounding(seed in any::<u64>(), power in -400i32..400) {
        let samples = white_noise(500, seed);
        let scale = 2f64.powi(power);
        let scaled: Vec<f64> = samples.iter().map(|z| z * scale).collect();
        let (plain, scaled) = (fed(7, &samples), fed(7, &scaled));
        for j in 0..7 {
            prop_assert_eq!(plain.allan(j).0 * scale * scale, scaled.allan(j).0);
            prop_assert_eq!(plain.hadamard(j).0 * scale * scale, scaled.hadamard(j).0);
        }
    }
}
