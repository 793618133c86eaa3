//! Laws of the published filter and of least squares, over any input and parameters.
#![allow(non_snake_case)]

use crate::common::{any_params, any_sample, drifting, processed, restored, some_start};
use nalgebra::SMatrix;
use proptest::prelude::*;
use zerorate_core::drift::Snapshot;
use zerorate_core::{DriftFilter, Params, RecursiveLeastSquares, RlsParams, Start, Stream, Traced};

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// A filter that learns its start or, with a seed, one that is given it.
fn filter<const N: usize, const M: usize>(
    params: Params,
    start: Option<u64>,
) -> DriftFilter<f64, N, M> {
    filter_in_unit(params, start, 1.0)
}

fn filter_in_unit<const N: usize, const M: usize>(
    params: Params,
    start: Option<u64>,
    unit: f64,
) -> DriftFilter<f64, N, M> {
    match start {
        None => DriftFilter::new(params),
        Some(seed) => DriftFilter::started(params, some_start(seed, unit)),
    }
    .expect("the strategies make valid parameters")
}

fn one_by_one<F: Stream<Input = f64, Output = f64>>(filter: &mut F, samples: &[f64]) -> Vec<f64> {
    samples.iter().map(|z| filter.update(*z)).collect()
}

/// Of two filters, one learns its start.
fn any_start() -> impl Strategy<Value = Option<u64>> {
    prop::option::of(any::<u64>())
}

/// Batch, two batches, sample by sample, and across a checkpoint: the same bits.
fn splits<const N: usize, const M: usize>(
    params: Params,
    start: Option<u64>,
    samples: &[f64],
    at: usize,
) -> Result<(), TestCaseError> {
    let whole = processed(&mut filter::<N, M>(params, start), samples);

    let mut first = filter::<N, M>(params, start);
    let mut head = processed(&mut first, &samples[..at]);
    head.extend(one_by_one(&mut restored(&first), &samples[at..]));

    prop_assert_eq!(bits(&whole), bits(&head));
    Ok(())
}

fn finite<const N: usize, const M: usize>(now: &Snapshot<f64, N, M>) -> bool {
    let numbers = [now.estimate, now.innovation, now.innovation_variance, now.measurement_noise];
    numbers.iter().all(|x| x.is_finite())
        && now.gain.iter().all(|x| x.is_finite())
        && now.coefficients.iter().all(|x| x.is_finite())
        && now.process_noise.iter().chain(now.covariance.iter()).all(|x| x.is_finite())
}

/// Symmetric, and no eigenvalue below zero by more than the factorisation's own rounding.
fn semidefinite<const N: usize>(covariance: &SMatrix<f64, N, N>) -> bool {
    let size = covariance.amax();
    if size == 0.0 {
        return true;
    }
    let rounding = SMatrix::<f64, N, N>::identity() * (4.0 * N as f64 * f64::EPSILON);
    *covariance == covariance.transpose() && (covariance / size + rounding).cholesky().is_some()
}

/// Nothing that goes in makes anything that comes out invalid.
fn stays_valid<const N: usize, const M: usize>(
    params: Params,
    start: Option<u64>,
    samples: &[f64],
) -> Result<(), TestCaseError> {
    let mut filter = filter::<N, M>(params, start);
    for (k, z) in samples.iter().enumerate() {
        let estimate = filter.update(*z);
        let now = filter.snapshot();
        prop_assert!(estimate.is_finite() && finite(&now), "sample {k}: {now:?}");
        prop_assert!(semidefinite(&now.process_noise), "sample {k}: G {:?}", now.process_noise);
        prop_assert!(semidefinite(&now.covariance), "sample {k}: P {:?}", now.covariance);
        prop_assert_eq!(now.missing, !z.is_finite());
    }
    Ok(())
}

/// A power of two in, the same power out, to the last bit.
fn scales<const N: usize, const M: usize>(
    params: Params,
    start: Option<u64>,
    samples: &[f64],
    factor: f64,
) -> Result<(), TestCaseError> {
    let plain = processed(&mut filter::<N, M>(params, start), samples);
    let scaled: Vec<f64> = samples.iter().map(|z| z * factor).collect();
    let scaled = processed(&mut filter_in_unit::<N, M>(params, start, factor), &scaled);
    let plain: Vec<f64> = plain.iter().map(|z| z * factor).collect();
    prop_assert_eq!(bits(&plain), bits(&scaled));
    Ok(())
}

fn least_squares_valid<const N: usize, const M: usize>(
    forgetting_factor: f64,
    samples: &[f64],
) -> Result<(), TestCaseError> {
    let params = RlsParams { forgetting_factor, startup: 10, scale: None };
    let mut model = RecursiveLeastSquares::<f64, N, M>::new(params).expect("valid parameters");
    for z in samples {
        prop_assert!(model.update(*z).is_finite());
        prop_assert!(model.coefficients().iter().all(|c| c.is_finite()));
        let covariance = model.covariance();
        prop_assert!(covariance.iter().all(|p| p.is_finite()));
        prop_assert!(covariance.diagonal().iter().all(|p| *p >= 0.0));
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn batches_samples_and_checkpoints_agree(
        params in any_params(),
        start in any_start(),
        samples in prop::collection::vec(any_sample(), 2..300),
        part in 0.0..1.0,
    ) {
        let at = (samples.len() as f64 * part) as usize;
        every_order!(splits(params, start, &samples, at));
    }

    #[test]
    fn nothing_breaks_a_filter(
        params in any_params(),
        start in any_start(),
        samples in prop::collection::vec(any_sample(), 1..300),
    ) {
        every_order!(stays_valid(params, start, &samples));
    }

    #[test]
    fn units_do_not_matter(
        params in any_params(),
        start in any_start(),
        seed in any::<u64>(),
        exponent in -300i32..300,
    ) {
        every_order!(scales(params, start, &drifting(400, seed), 2f64.powi(exponent)));
    }

    #[test]
    fn nothing_breaks_least_squares(
        forgetting_factor in 0.5..=1.0,
        samples in prop::collection::vec(any_sample(), 1..300),
    ) {
        every_order!(least_squares_valid(forgetting_factor, &samples));
    }

    #[cfg(feature = "parallel")]
    #[test]
    fn channels_do_not_mix(params in any_params(), seed in any::<u64>(), threads in 1usize..5) {
        let signals: Vec<Vec<f64>> = (0..3).map(|c| drifting(500, seed ^ c)).collect();
        let rows: Vec<f64> =
            (0..500).flat_map(|k| signals.iter().map(move |signal| signal[k])).collect();
        let mut outputs = vec![0.0; rows.len()];
        zerorate_core::Bank::new(&filter::<3, 4>(params, None), 3)
            .and_then(|mut bank| bank.process_on_threads(&rows, &mut outputs, &mut [], threads))
            .expect("memory for some rows");
        for (c, signal) in signals.iter().enumerate() {
            let alone = processed(&mut filter::<3, 4>(params, None), signal);
            let together: Vec<f64> = outputs.iter().skip(c).step_by(3).copied().collect();
            prop_assert_eq!(bits(&alone), bits(&together));
        }
    }
}

#[test]
fn reset_forgets_everything() {
    for start in [None, Some(5)] {
        let mut filter = filter::<3, 4>(Params::default(), start);
        let first = processed(&mut filter, &drifting(1000, 7));
        filter.reset();
        assert_eq!(filter.ready(), start.is_some());
        let second = processed(&mut filter, &drifting(1000, 7));
        assert_eq!(bits(&first), bits(&second));
    }
}

#[test]
fn a_start_that_is_none_is_refused() {
    let refused = |change: fn(&mut Start<f64, 3, 4>), name: &str| {
        let mut start = some_start(1, 1.0);
        change(&mut start);
        let error = DriftFilter::started(Params::default(), start).err().map(|e| e.to_string());
        assert!(error.is_some_and(|text| text.starts_with(name)), "{name}");
    };
    refused(|start| start.offset = f64::NAN, "offset must be");
    refused(|start| start.scale = 0.0, "scale must be");
    refused(|start| start.coefficients[1] = f64::INFINITY, "coefficients must be");
    refused(|start| start.measurement_noise = -1.0, "measurement_noise must be");
    refused(|start| start.process_noise = f64::NAN, "process_noise must be");
    refused(|start| start.covariance[(2, 2)] = -1.0, "covariance must be");
    refused(|start| start.covariance[(0, 1)] += 1.0, "covariance must be");
    refused(|start| start.state_covariance[(0, 0)] = f64::INFINITY, "state_covariance must be");
}
