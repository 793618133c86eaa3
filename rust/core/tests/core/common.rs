//! Signals and a call for every order, shared by the tests.
#![allow(dead_code)]

use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use zerorate_core::allan::AllanKind;
use zerorate_core::checkpoint::{self, Checkpoint};
use zerorate_core::{Method, Params, Start, Stream};

/// White noise of unit deviation.
pub fn white_noise(n: usize, seed: u64) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(seed);
    (0..n).map(|_| StandardNormal.sample(&mut random)).collect()
}

/// The outputs of a filter.
pub fn processed<T: Copy + Default, S: Stream<Input = T, Output = T>>(
    stream: &mut S,
    samples: &[T],
) -> Vec<T> {
    processed_to::<T, S>(stream, samples)
}

/// The outputs of a stream.
pub fn processed_to<O: Copy + Default, S: Stream<Output = O>>(
    stream: &mut S,
    samples: &[S::Input],
) -> Vec<O> {
    let mut outputs = vec![O::default(); samples.len()];
    stream.process(samples, &mut outputs);
    outputs
}

/// A stream through a checkpoint.
pub fn restored<S: Checkpoint>(stream: &S) -> S {
    let mut buffer = vec![0; 1 << 16];
    let bytes = checkpoint::write(stream, &mut buffer).expect("a stream can be saved");
    checkpoint::read(bytes).expect("and restored")
}

/// The bytes of a checkpoint.
pub fn saved<S: Checkpoint>(stream: &S) -> Vec<u8> {
    let mut buffer = vec![0; 1 << 16];
    checkpoint::write(stream, &mut buffer).expect("a stream can be saved").to_vec()
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

/// A start of a signal in some unit, from nearly certain to ignorant, some of it singular.
pub fn some_start<const N: usize, const M: usize>(seed: u64, unit: f64) -> Start<f64, N, M> {
    let numbers = white_noise(200, seed);
    let size = |i: usize| 10f64.powi((seed >> (4 * i)) as i32 % 5 - 4);
    let mut coefficients = SVector::from_iterator(numbers.iter().copied());
    coefficients[M - 1] *= unit;
    Start {
        offset: 3.0 * numbers[20] * unit,
        scale: (0.01 + numbers[21].abs()) * unit,
        coefficients,
        covariance: semidefinite(&numbers[30..]) * size(1),
        measurement_noise: size(2) * unit * unit,
        process_noise: size(3) * unit * unit,
        state_covariance: semidefinite(&numbers[120..]) * (size(4) * unit * unit),
    }
}

/// `A Aᵀ`, symmetric to the bit, with one direction that has no variance in some.
fn semidefinite<const K: usize>(numbers: &[f64]) -> SMatrix<f64, K, K> {
    let mut root = SMatrix::<f64, K, K>::from_iterator(numbers.iter().copied());
    if numbers[K * K] > 0.0 {
        root.row_mut(K - 1).fill(0.0);
    }
    let product = root * root.transpose();
    SMatrix::from_fn(|i, j| product[(i.min(j), i.max(j))])
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

/// True if [`every_order`] takes all twelve, as the package's laws do for every change: `make nightly`
/// sets it. What is compiled for an order differs by its numbers alone.
pub const EVERY_ORDER: bool = option_env!("ZR_EVERY_ORDER").is_some();

/// Calls `$check::<N, M>` with the arguments for every order, or for the corners and one between.
macro_rules! every_order {
    ($check:ident($($argument:expr),*)) => {
        $check::<2, 2>($($argument),*)?;
        $check::<2, 5>($($argument),*)?;
        $check::<3, 4>($($argument),*)?;
        $check::<4, 4>($($argument),*)?;
        $check::<4, 7>($($argument),*)?;
        if $crate::common::EVERY_ORDER {
            $check::<2, 3>($($argument),*)?;
            $check::<2, 4>($($argument),*)?;
            $check::<3, 3>($($argument),*)?;
            $check::<3, 5>($($argument),*)?;
            $check::<3, 6>($($argument),*)?;
            $check::<4, 5>($($argument),*)?;
            $check::<4, 6>($($argument),*)?;
        }
    };
}
