//! The self-tuning filter in single precision, and in motion.

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use zerorate_core::drift::DriftNumber;
use zerorate_core::{AutoFilter, AutoParams, Behaviour, Status, Stream};

const RATE: f64 = 100.0;
const NOISE: f64 = 0.1;

fn auto<T: DriftNumber>(compensated: bool) -> AutoFilter<T> {
    let behaviour = Behaviour { hold_in_motion: true, compensated, ..Behaviour::PUBLISHED };
    AutoFilter::new(AutoParams { rate: RATE, behaviour, ..AutoParams::default() })
        .expect("valid parameters")
}

fn noise(n: usize) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(3);
    (0..n)
        .map(|_| {
            let z: f64 = StandardNormal.sample(&mut random);
            NOISE * z
        })
        .collect()
}

#[test]
fn single_precision_finds_the_same_drift() {
    let signal: Vec<f64> = noise(60_000).iter().map(|z| 2.0 + z).collect();
    let (mut single, mut double) = (auto::<f32>(false), auto::<f64>(false));
    for z in &signal {
        double.update(*z);
        single.update(*z as f32);
    }
    let difference = f64::from(single.bias()) - double.bias();
    // A sample of 2 is known to 1e-7, of which a tick's mean leaves some; sigma is 4e-4.
    assert!(difference.abs() < 1e-5, "{difference}");
    let ratio = f64::from(single.bias_sigma()) / double.bias_sigma();
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
}

#[test]
fn single_precision_stays_finite_whatever_comes() {
    for largest in [1e-38_f32, 1.0, 1e30, f32::MAX] {
        let mut filter = auto::<f32>(false);
        for (k, z) in noise(4_000).iter().enumerate() {
            let outlier = if k % 777 == 776 { largest } else { 0.0 };
            assert!(filter.update(*z as f32 + outlier).is_finite());
            assert!(filter.bias_sigma().is_finite() && filter.bias_sigma() >= 0.0);
        }
    }
}

#[test]
fn a_turn_is_left_as_it_is() {
    let mut filter = auto::<f64>(true);
    let noise = noise(12_000);
    for z in &noise[..9_000] {
        filter.update(1.0 + z);
    }
    let (bias, sigma) = (filter.bias(), filter.bias_sigma());
    for (k, z) in noise[9_000..].iter().enumerate() {
        let rate = 20.0 * (0.05 * k as f64).sin();
        let output = filter.update(1.0 + rate + z);
        // Until the turn is seen, within two ticks, fifty samples may pull at the bias, each by no
        // more than four deviations times a gain of about 1/9000.
        let most = 50.0 * 4.0 * NOISE / 9_000.0 + 3.0 * sigma;
        assert!((output - (rate + z) - (1.0 - bias)).abs() < most);
    }
    assert_eq!(filter.status(), Status::InMotion);
    assert!(filter.bias_sigma() > sigma);
}
