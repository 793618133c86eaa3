//! Searches for the coefficients of ARMA models.

use zerorate_core::identification::arma::{Method, Series, fit};

/// Uniform noise by a linear congruential generator.
fn noise(seed: u64, n: usize) -> Vec<f64> {
    let next = |state: &u64| {
        Some(state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407))
    };
    let states = std::iter::successors(Some(seed), next).skip(1).take(n);
    states.map(|state| ((state >> 33) % 1000) as f64 / 500.0 - 1.0).collect()
}

/// Rounding leaves some points at the edge of the stationary region outside of it.
#[test]
fn short_records_lead_no_search_out_of_the_stationary_region() {
    let cases = [(24, 2, 3), (24, 36, 3), (24, 42, 2), (30, 2, 2), (40, 42, 3), (40, 44, 3)];
    for (n, seed, p) in cases {
        let series = Series::new(noise(seed, n), true);
        let found = fit(&series, p, 1, true, Method::Exact, None);
        assert!(found.log_likelihood.is_finite(), "{found:?}");
        let conditional = fit(&series, p, 1, true, Method::Conditional, None);
        assert!(found.sigma2 < 2.0 * conditional.sigma2, "{found:?} {conditional:?}");
    }
}
