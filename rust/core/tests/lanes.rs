//! The same step on SIMD lanes and on single numbers.

mod common;

use common::{drifting, white_noise};
use nalgebra::SimdValue;
use simba::simd::WideF64x4;
use zerorate_core::{DriftLoop, Method, Params};

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
            let seen = zerorate_core::Real::finite(y);
            let (estimate, _) = lanes.step(y, seen);
            for (c, filter) in alone.iter_mut().enumerate() {
                let (expected, _) = filter.step(row[c], row[c].is_finite());
                assert_eq!(estimate.extract(c).to_bits(), expected.to_bits(), "{method:?} {k} {c}");
            }
        }
    }
}

#[test]
fn single_precision_filters_too() {
    use zerorate_core::{DriftFilter, Filter};
    let signal = drifting(20_000, 5);
    let mut double = signal.clone();
    let mut single: Vec<f32> = signal.iter().map(|z| *z as f32).collect();
    DriftFilter::<f64, 3, 4>::new(Params::default()).expect("valid").process(&mut double);
    DriftFilter::<f32, 3, 4>::new(Params::default()).expect("valid").process(&mut single);
    let worst =
        double.iter().zip(&single).map(|(a, b)| (a - f64::from(*b)).abs()).fold(0.0, f64::max);
    // A hundredth of the noise of 0.1: single precision with a floor of 1e-6 on the noises.
    assert!(worst < 1e-3, "{worst}");
}
