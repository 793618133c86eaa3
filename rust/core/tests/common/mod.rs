//! Signals and a call for every order, shared by the tests.
#![allow(dead_code)]

use proptest::prelude::*;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use zerorate_core::allan::AllanKind;
use zerorate_core::{Method, Params};

/// White noise of unit deviation.
pub fn white_noise(n: usize, seed: u64) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(seed);
    (0..n).map(|_| StandardNormal.sample(&mut random)).collect()
}

/// Noise on an offset, on a slow walk, some of it quantised.
pub fn drifting(n: usize, seed: u64) -> Vec<f64> {
    let walk = white_noise(n, seed ^ 1).into_iter().scan(3.0, |sum, step| {
        *sum += 1e-3 * step;
        Some(*sum)
    });
    white_noise(n, seed)
        .into_iter()
        .zip(walk)
        .map(|(e, w)| ((w + 0.1 * e) / 0.05).round() * 0.05)
        .collect()
}

/// Any sample: ordinary, huge, tiny, or missing.
pub fn any_sample() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -10.0..10.0,
        1 => prop::num::f64::ANY,
        1 => Just(f64::NAN),
        1 => prop::sample::select(vec![0.0, 1e12, -1e12, 1e150, -1e150, 1e300, f64::MAX, f64::MIN, 5e-324, f64::INFINITY]),
    ]
}

/// Any valid parameters with a short start-up.
pub fn any_params() -> impl Strategy<Value = Params> {
    let method = prop::sample::select(vec![Method::Kf, Method::Akf, Method::Fading]);
    let noise = prop::sample::select(vec![AllanKind::Allan, AllanKind::Hadamard]);
    let adapt_for = prop_oneof![Just(None), (0.0..3.0).prop_map(Some)];
    let numbers = (0.01..=1.0, 0.5..=1.0, 1e-9..2.0, 0.0..1e3, 0.1..0.5);
    (method, noise, adapt_for, numbers).prop_map(|(method, noise, adapt_for, numbers)| {
        let (fading, forgetting_factor, process_noise, process_noise_memory, startup) = numbers;
        Params {
            rate: 100.0,
            method,
            fading,
            noise,
            adapt_for,
            forgetting_factor,
            process_noise,
            process_noise_memory,
            startup,
            scale: None,
        }
    })
}

/// Calls `$check::<N, M>` with the arguments for every order.
#[macro_export]
macro_rules! every_order {
    ($check:ident($($argument:expr),*)) => {
        $check::<2, 2>($($argument),*)?;
        $check::<2, 3>($($argument),*)?;
        $check::<2, 4>($($argument),*)?;
        $check::<2, 5>($($argument),*)?;
        $check::<3, 3>($($argument),*)?;
        $check::<3, 4>($($argument),*)?;
        $check::<3, 5>($($argument),*)?;
        $check::<3, 6>($($argument),*)?;
        $check::<4, 4>($($argument),*)?;
        $check::<4, 5>($($argument),*)?;
        $check::<4, 6>($($argument),*)?;
        $check::<4, 7>($($argument),*)?;
    };
}
