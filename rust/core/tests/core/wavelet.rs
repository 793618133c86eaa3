//! `WaveletDenoiser`: its laws, its delay, and what is refused; records as a user of the core has
//! them.

use crate::common::{any_sample, processed, restored, saved, white_noise};
use proptest::prelude::*;
use zerorate_core::denoise::{
    Denoised, LevelRule, Mode, Shrinkage, Wavelet, WaveletDenoiser, WaveletParams, decompose,
};
use zerorate_core::{Error, Stream};

/// Parameters as most tests have them.
pub fn params() -> WaveletParams {
    WaveletParams { rate: 100.0, wavelet: Wavelet::Db2, level: 3, mode: Mode::Hard, threshold: 4.0 }
}

fn any_wavelet_params() -> impl Strategy<Value = WaveletParams> {
    let wavelet = prop::sample::select(Wavelet::NAMES.map(|(wavelet, _)| wavelet).to_vec());
    let mode = prop::sample::select(vec![Mode::Soft, Mode::Hard]);
    let threshold = prop::sample::select(vec![0.0, 0.5, 4.0, f64::MAX]);
    (wavelet, mode, threshold, 1usize..6, 0.1..1000.0).prop_map(
        |(wavelet, mode, threshold, level, rate)| WaveletParams {
            rate,
            wavelet,
            level,
            mode,
            threshold,
        },
    )
}

/// Nothing of a record is missing.
fn any_finite_sample() -> impl Strategy<Value = f64> {
    any_sample().prop_map(|z| if z.is_finite() { z } else { 0.0 })
}

fn new(params: WaveletParams) -> WaveletDenoiser {
    WaveletDenoiser::new(params).expect("the tests' parameters are in range")
}

fn denoised(how: Shrinkage, z: &[f64]) -> (Vec<f64>, Denoised) {
    let (mut signal, mut room) = (vec![0.0; z.len()], vec![0.0; how.room(z.len())]);
    let found = how.denoise(z, &mut signal, &mut room);
    (signal, found)
}

#[test]
fn without_threshold_it_is_a_delay() {
    for (wavelet, name) in Wavelet::NAMES {
        for level in [1, 2, 5] {
            let mut denoiser = new(WaveletParams { wavelet, level, threshold: 0.0, ..params() });
            let delay = denoiser.delay() as usize;
            assert_eq!(delay, ((1 << level) - 1) * (wavelet.taps() - 1) + 1);
            let samples = white_noise(delay + 500, 1);
            let outputs = processed(&mut denoiser, &samples);
            for (late, z) in outputs[delay..].iter().zip(&samples) {
                assert!((late - z).abs() < 1e-14, "{name} {level}");
            }
        }
    }
}

#[test]
fn parameters_out_of_range_are_refused_by_name() {
    let bad = [
        ("rate", WaveletParams { rate: 0.0, ..params() }),
        ("level", WaveletParams { level: 0, ..params() }),
        ("level", WaveletParams { level: 11, ..params() }),
        ("threshold", WaveletParams { threshold: f64::NAN, ..params() }),
    ];
    for (expected, params) in bad {
        let refused = WaveletDenoiser::new(params).expect_err(expected);
        assert!(matches!(refused, Error::Parameter { name, .. } if name == expected));
    }
}

#[test]
fn noise_is_taken_off_a_record() {
    let (n, wavelet) = (20_000, Wavelet::Db4);
    let truth = |k: usize| 7.0 + (k as f64 / 3000.0).sin();
    let z: Vec<f64> =
        white_noise(n, 4).iter().enumerate().map(|(k, e)| truth(k) + 0.1 * e).collect();
    let how =
        Shrinkage { wavelet, level: LevelRule::Noise, mode: Mode::Soft, approximation: false };
    let (signal, found) = denoised(how, &z);
    assert!(found.level >= 6 && found.level <= wavelet.deepest(n));
    assert!((found.sigma - 0.1).abs() < 0.005);
    let square: f64 = signal.iter().enumerate().map(|(k, x)| (x - truth(k)).powi(2)).sum();
    assert!((square / n as f64).sqrt() < 0.02);
    let parts = decompose(&z, wavelet, 3);
    assert_eq!(parts.len(), 4);
    assert!(parts[3].len() == n / 2 + 3 && parts[0].len() == parts[1].len());
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn batches_samples_and_checkpoints_agree(
        params in any_wavelet_params(),
        seed in any::<u64>(),
        spikes in prop::collection::vec((any::<prop::sample::Index>(), any_sample()), 0..6),
        part in 0.0..1.0,
    ) {
        let mut samples = white_noise(700, seed);
        for (place, z) in spikes {
            let place = place.index(samples.len());
            samples[place] = z;
        }
        let at = (samples.len() as f64 * part) as usize;
        let mut whole = new(params);
        let expected = processed(&mut whole, &samples);
        let mut parts = new(params);
        let mut outputs = processed(&mut parts, &samples[..at]);
        let mut parts = restored(&parts);
        outputs.extend(samples[at..].iter().map(|z| parts.update(*z)));
        let bits = |outputs: &[f64]| outputs.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!(bits(&outputs), bits(&expected));
        prop_assert_eq!(saved(&parts), saved(&whole));
        whole.reset();
        prop_assert_eq!(saved(&whole), saved(&new(params)));
    }

    #[test]
    fn nothing_breaks_it(
        params in any_wavelet_params(),
        samples in prop::collection::vec(any_sample(), 1..400),
    ) {
        let mut denoiser = new(params);
        let mut begun = false;
        for z in samples {
            begun |= z.is_finite();
            let x = denoiser.update(z);
            prop_assert_eq!(x.is_finite(), begun);
            prop_assert!(denoiser.sigma().is_finite() && denoiser.sigma() >= 0.0);
        }
    }

    #[test]
    fn no_record_breaks_it(
        wavelet in prop::sample::select(Wavelet::NAMES.map(|(wavelet, _)| wavelet).to_vec()),
        samples in prop::collection::vec(any_finite_sample(), 30..400),
        approximation in any::<bool>(),
    ) {
        let rules =
            [LevelRule::Fixed(1), LevelRule::PeakToSum(0.2), LevelRule::PeakToSumOverNoise(1.5), LevelRule::Noise];
        for level in rules {
            for mode in [Mode::Soft, Mode::Hard] {
                let how = Shrinkage { wavelet, level, mode, approximation };
                let (signal, found) = denoised(how, &samples);
                prop_assert!(signal.iter().all(|x| x.is_finite()));
                prop_assert!(found.sigma.is_finite() && found.threshold.is_finite());
            }
        }
    }
}
