//! The same step on SIMD lanes and on single numbers.

use crate::common::{any_params, any_sample, drifting, processed, saved, white_noise};
use nalgebra::SimdValue;
use proptest::prelude::*;
use simba::simd::WideF64x4;
use zerorate_core::drift::DriftLoop;
use zerorate_core::math::Real;
use zerorate_core::{Bank, DriftFilter, Method, Params, Stream};

/// Four normalised signals with missing samples at different places.
fn signals() -> [Vec<f64>; 4] {
    [1, 2, 3, 4].map(|seed| {
        let mut signal = white_noise(3000, seed);
        for k in (0..3000).filter(|k| k % (37 * seed as usize) == 5) {
            signal[k] = f64::NAN;
        }
        signal
    })
}

#[test]
fn four_lanes_equal_four_filters() {
    for method in [Method::Kf, Method::Akf, Method::Fading] {
        let params = Params { method, adapt_for: Some(20.0), ..Params::default() };
        let signals = signals();
        let mut lanes = DriftLoop::<WideF64x4, 3, 4>::new(&params).expect("valid parameters");
        let mut alone =
            [(); 4].map(|()| DriftLoop::<f64, 3, 4>::new(&params).expect("valid parameters"));
        for k in 0..3000 {
            let row = [0, 1, 2, 3].map(|c: usize| signals[c][k]);
            let y = WideF64x4::from(row);
            let seen = Real::finite(y);
            let (estimate, _) = lanes.step(y, seen);
            for (c, filter) in alone.iter_mut().enumerate() {
                let (expected, _) = filter.step(row[c], row[c].is_finite());
                assert_eq!(estimate.extract(c).to_bits(), expected.to_bits(), "{method:?} {k} {c}");
            }
        }
    }
}

/// Outputs and state, the checkpoint, of every filter.
type Outcome = Vec<(Vec<u64>, Vec<u8>)>;

fn outcome<const N: usize, const M: usize>(
    filters: &[DriftFilter<f64, N, M>],
    rows: &[f64],
) -> Outcome {
    let column = |c| rows.iter().skip(c).step_by(filters.len()).map(|y| y.to_bits()).collect();
    filters.iter().enumerate().map(|(c, filter)| (column(c), saved(filter))).collect()
}

/// Rows in pieces of any length, and each channel alone, sample by sample.
fn together_and_alone<const N: usize, const M: usize>(
    params: &[Params],
    rows: &[f64],
    pieces: usize,
    threads: usize,
) -> (Outcome, Outcome) {
    let filters: Vec<_> = params
        .iter()
        .map(|params| DriftFilter::<f64, N, M>::new(*params).expect("valid parameters"))
        .collect();
    let channels = filters.len();
    let (mut bank, mut outputs) = (Bank::of(filters.clone()), vec![0.0; rows.len()]);
    let length = pieces * channels;
    for (rows, outputs) in rows.chunks(length).zip(outputs.chunks_mut(length)) {
        bank.process_on_threads(rows, outputs, &mut [], threads).expect("memory for some rows");
    }
    let (mut alone, mut expected) = (filters, rows.to_vec());
    for (i, z) in expected.iter_mut().enumerate() {
        *z = alone[i % channels].update(*z);
    }
    assert!(expected.iter().all(|output| output.is_finite()));
    (outcome(bank.streams(), &outputs), outcome(&alone, &expected))
}

proptest! {
    /// Channels of different methods, learning times and start-ups, with missing and hostile
    /// samples anywhere: lanes come and go, and nothing differs.
    #[test]
    fn channels_side_by_side_equal_each_alone(
        params in prop::collection::vec(any_params(), 1..10),
        samples in prop::collection::vec(any_sample(), 900),
        pieces in 1usize..400,
        threads in 1usize..4,
    ) {
        let rows = &samples[..samples.len() / params.len() * params.len()];
        let (together, alone) = together_and_alone::<3, 4>(&params, rows, pieces, threads);
        prop_assert_eq!(together, alone);
        let (together, alone) = together_and_alone::<2, 2>(&params, rows, pieces, threads);
        prop_assert_eq!(together, alone);
        let (together, alone) = together_and_alone::<4, 7>(&params, rows, pieces, threads);
        prop_assert_eq!(together, alone);
    }
}

/// Long enough for every channel to be in a lane, through the end of learning and a burst far off.
#[test]
fn long_channels_side_by_side_equal_each_alone() {
    let channels = 9;
    let mut rows = vec![0.0; 6000 * channels];
    for c in 0..channels {
        for (k, z) in drifting(6000, c as u64).into_iter().enumerate() {
            rows[k * channels + c] = match k {
                _ if c == 4 => f64::NAN,
                2000..3000 if c == 2 => 500.0 * z,
                _ if k % (50 + 7 * c) == 3 => f64::NAN,
                _ => z,
            };
        }
    }
    for method in [Method::Kf, Method::Akf, Method::Fading] {
        let params = Params { method, adapt_for: Some(30.0), ..Params::default() };
        let (together, alone) =
            together_and_alone::<3, 4>(&vec![params; channels], &rows, usize::MAX / channels, 2);
        assert_eq!(together, alone, "{method:?}");
    }
}

#[test]
fn single_precision_filters_too() {
    let signal = drifting(20_000, 5);
    let single: Vec<f32> = signal.iter().map(|z| *z as f32).collect();
    let mut filter = DriftFilter::<f64, 3, 4>::new(Params::default()).expect("valid");
    let double = processed(&mut filter, &signal);
    let mut filter = DriftFilter::<f32, 3, 4>::new(Params::default()).expect("valid");
    let single = processed(&mut filter, &single);
    let worst =
        double.iter().zip(&single).map(|(a, b)| (a - f64::from(*b)).abs()).fold(0.0, f64::max);
    // A hundredth of the noise of 0.1: single precision with a floor of 1e-6 on the noises.
    assert!(worst < 1e-3, "{worst}");
}
