//! The navigation filter under samples and states that nobody should give it.

use crate::common::any_sample;
use crate::forged::{CHECKSUM, HEADER, WORDS, forged};
use proptest::prelude::*;
use zerorate_core::checkpoint;
use zerorate_core::navigation::{
    Adapt, AidParams, Fix, Inertial, Kind, LIMITS, NavigationFilter, NavigationParams, STATES,
    Start, Wheels,
};

/// Of the places in the content, every so manyth is forged in one case.
const STRIDE: usize = 293;
const BYTES: usize = 1 << 13;

pub fn filter(wheeled: bool, adapt: Adapt, kind: Kind) -> NavigationFilter {
    let params = NavigationParams {
        gyro_noise: [1e-6; 3],
        accel_noise: [4e-4; 3],
        gyro_walk: [1e-10; 3],
        accel_walk: [2.5e-7; 3],
        gyro_vibration: 0.0,
        antenna: [0.1, -0.2, -1.0],
        antenna_sigma: [0.0; 3],
        consider_antenna: false,
        wheels: wheeled.then_some(Wheels { axle: [-1.0, 0.0, 1.0], sigma: 0.3, speed_sigma: 0.15 }),
        gate: 50.0,
        adapt,
        covariance_step: 0.1,
        kind,
        aids: AidParams::default(),
        limits: LIMITS,
    };
    let start = Start {
        time: 0.0,
        quaternion: [1.0, 0.0, 0.0, 0.0],
        heading_known: true,
        course: wheeled,
        latitude: 0.8,
        gyro_bias: [1e-3, -1e-3, 0.0],
        accel_bias: [0.0; 3],
        level_sigma: 5e-3,
        heading_sigma: 0.05,
        gyro_bias_sigma: 1e-4,
        accel_bias_sigma: 0.05,
    };
    NavigationFilter::new(start, params).expect("parameters in their ranges")
}

/// A sample at rest and something added to it; every seventh step a fix.
fn step(nav: &mut NavigationFilter, k: usize, more: f64) {
    let time = 0.05 * (k + 1) as f64;
    let (gyro, accel) = ([more, 0.0, -0.5 * more], [0.5 * more, more, -9.81]);
    let sample = Inertial { time, gyro, accel, rest: k % 11 > 5 };
    nav.update(&sample).expect("time goes on");
    if k % 7 == 3 {
        let fix = Fix {
            time: time - 0.3 * (k % 3) as f64,
            position: [0.8 + 1e-7 * more, 3.1, 100.0],
            velocity: [0.1 * more, 0.0, f64::NAN],
            position_sigma: [2.0; 3],
            velocity_sigma: [0.1; 3],
        };
        nav.update_gnss(&fix).expect("deviations are positive");
    }
}

/// Everything told is finite, or NaN because nothing is known; the covariance could be one.
fn is_sane(nav: &NavigationFilter) -> bool {
    let known = nav.snapshot();
    let waits = known.position[0].is_nan();
    let numbers = known.position.iter().chain(&known.velocity).chain(&known.sigma);
    let always = known.quaternion.iter().chain(&known.gyro_bias).chain(&known.accel_bias);
    let p = nav.covariance();
    let pairs = (0..STATES).flat_map(|i| (0..i).map(move |j| (i, j)));
    numbers.copied().all(|x| x.is_finite() != waits)
        && always.copied().all(f64::is_finite)
        && (0..STATES).all(|i| p.at(i, i) >= 0.0)
        && pairs.into_iter().all(|(i, j)| {
            let bound = (p.at(i, i) * p.at(j, j)).sqrt() * (1.0 + 1e-6) + 1e-100;
            p.at(i, j) == p.at(j, i) && p.at(i, j).abs() <= bound
        })
}

fn saved(nav: &NavigationFilter) -> Vec<u8> {
    checkpoint::write(nav, &mut [0; BYTES]).expect("the buffer is large enough").to_vec()
}

fn chosen() -> impl Strategy<Value = NavigationFilter> {
    let adapts = prop::sample::select(vec![Adapt::Inflate, Adapt::Free, Adapt::Fixed]);
    let kinds = prop::sample::select(vec![Kind::Rate, Kind::Increment]);
    (any::<bool>(), adapts, kinds).prop_map(|(wheeled, adapt, kind)| filter(wheeled, adapt, kind))
}

proptest! {
    #[test]
    fn no_sample_makes_it_insane(
        nav in chosen(),
        samples in prop::collection::vec(any_sample(), 150),
        quiet in 0..150usize,
    ) {
        let mut nav = nav;
        for (k, z) in samples.iter().enumerate() {
            step(&mut nav, k, if k < quiet { 1e-3 } else { *z });
            prop_assert!(is_sane(&nav), "after {:e} at {}: {:?}", z, k, nav.snapshot());
            let restored = checkpoint::read::<NavigationFilter>(&saved(&nav));
            // Equal bytes: NaN is not equal to itself.
            let same = restored.is_ok_and(|other| saved(&other) == saved(&nav));
            prop_assert!(same, "refused after {}", k);
        }
    }
}

proptest! {
    // Each of them restores some thousand states.
    #![proptest_config(ProptestConfig {
        cases: ProptestConfig::default().cases / 32,
        ..ProptestConfig::default()
    })]

    #[test]
    fn a_forged_state_is_refused_or_sane(
        nav in chosen(),
        samples in prop::collection::vec(-0.5..0.5_f64, 1..90),
        first in 0..STRIDE,
    ) {
        let mut nav = nav;
        for (k, z) in samples.iter().enumerate() {
            step(&mut nav, k, *z);
        }
        let bytes = saved(&nav);
        let words = WORDS.map(|word| word.to_le_bytes().to_vec());
        let single = [0, 1, 2, 0x7f, 0x80, 0xff].map(|byte| vec![byte]);
        for place in (HEADER + first..bytes.len() - CHECKSUM).step_by(STRIDE) {
            for content in words.iter().chain(&single) {
                let read = checkpoint::read::<NavigationFilter>(&forged(&bytes, place, content));
                let Ok(mut other) = read else { continue };
                for k in samples.len()..samples.len() + 30 {
                    let sample = Inertial {
                        time: other.time().max(0.0) + 0.05,
                        gyro: [0.1; 3],
                        accel: [0.0, 0.3, -9.81],
                        rest: k % 2 == 0,
                    };
                    if other.update(&sample).is_err() {
                        break;
                    }
                    prop_assert!(is_sane(&other), "{:?} at {} is accepted", content, place);
                    let again = checkpoint::read::<NavigationFilter>(&saved(&other));
                    prop_assert!(again.is_ok(), "{:?} at {} refuses itself", content, place);
                }
            }
        }
    }
}
