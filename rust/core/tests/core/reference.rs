//! Against closed forms.

use crate::common::{drifting, processed, white_noise};
use zerorate_core::allan::{AllanKind, AllanNoise};
use zerorate_core::{
    DriftFilter, Method, Params, RecursiveLeastSquares, RlsParams, Stream, Traced,
};

#[test]
fn second_differences_ignore_a_ramp() {
    let mut allan = AllanNoise::new(0.9, AllanKind::Allan, 0.0).expect("valid parameters");
    let mut hadamard = AllanNoise::new(0.9, AllanKind::Hadamard, 0.0).expect("valid parameters");
    for k in 0..100 {
        let z = 0.5 * f64::from(k);
        allan.update(z);
        hadamard.update(z);
    }
    assert_eq!(hadamard.variance(), 0.0);
    assert!((allan.variance() - 0.125).abs() < 1e-15);
}

#[test]
fn both_variances_agree_on_white_noise() {
    for kind in [AllanKind::Allan, AllanKind::Hadamard] {
        let mut noise = AllanNoise::new(1.0, kind, 0.0).expect("valid parameters");
        white_noise(100_000, 9).iter().for_each(|z| noise.observe(*z));
        // Relative deviation of the estimate: about sqrt(3 / 100 000).
        assert!((noise.variance() - 1.0_f64).abs() < 0.025, "{kind:?} {}", noise.variance());
    }
}

#[test]
fn a_known_model_is_found() {
    let (phi, theta) = (0.8, 0.4);
    let noise = white_noise(200_000, 11);
    let (mut y, mut before) = (0.0, 0.0);
    let params = RlsParams { startup: 1000, ..RlsParams::default() };
    let mut model = RecursiveLeastSquares::<f64, 2, 3>::new(params).expect("valid parameters");
    for e in noise {
        y = phi * y + e + theta * before;
        before = e;
        model.update(y + 5.0);
    }
    let found = model.coefficients();
    // Three standard errors, sqrt((1 - φ²)/n) and sqrt((1 - θ²)/n) widened by their correlation.
    assert!((found[0] - phi).abs() < 0.01, "{found}");
    assert!((found[1] - theta).abs() < 0.01, "{found}");
    assert!((found[2] - 5.0 * (1.0 - phi)).abs() < 0.06, "{found}");
}

#[test]
fn a_constant_comes_out_as_it_went_in() {
    for value in [0.0, 1.0, -0.3, 1e150, 5e-324] {
        let mut filter = DriftFilter::<f64, 3, 4>::new(Params::default()).expect("valid");
        for _ in 0..2000 {
            assert_eq!(filter.update(value), value);
        }
        assert!(!filter.ready(), "a constant shows no noise");
    }
}

#[test]
fn a_gap_is_predicted_and_then_left() {
    let mut filter =
        DriftFilter::<f64, 3, 4>::new(Params { method: Method::Kf, ..Params::default() })
            .expect("valid");
    processed(&mut filter, &drifting(3000, 2));
    let before = filter.snapshot();
    assert!(filter.update(f64::NAN).is_finite());
    let after = filter.snapshot();
    assert!(after.missing && after.innovation == 0.0 && after.gain.iter().all(|k| *k == 0.0));
    assert_eq!(before.coefficients, after.coefficients);
    assert_eq!(before.process_noise, after.process_noise);
    assert!(after.covariance[(0, 0)] > before.covariance[(0, 0)]);
}

#[test]
fn parameters_out_of_range_are_refused_by_name() {
    let bad = [
        ("rate", Params { rate: 0.0, ..Params::default() }),
        ("rate", Params { rate: f64::NAN, ..Params::default() }),
        ("fading", Params { fading: 1.5, ..Params::default() }),
        ("forgetting_factor", Params { forgetting_factor: 0.0, ..Params::default() }),
        ("adapt_for", Params { adapt_for: Some(-1.0), ..Params::default() }),
        ("process_noise", Params { process_noise: f64::INFINITY, ..Params::default() }),
        ("startup", Params { startup: 0.0, ..Params::default() }),
        ("scale", Params { scale: Some(0.0), ..Params::default() }),
    ];
    for (name, params) in bad {
        let error = DriftFilter::<f64, 3, 4>::new(params).expect_err(name);
        assert!(error.to_string().starts_with(name), "{error}");
    }
}
