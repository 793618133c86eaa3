//! Laws of the filters that tell rest from motion, over any input and parameters.

use crate::common::{any_params, any_sample, drifting, processed, restored};
use proptest::prelude::*;
use zerorate_core::checkpoint::Checkpoint;
use zerorate_core::drift::Snapshot;
use zerorate_core::{
    AutoFilter, AutoParams, Behaviour, DriftFilter, DriftStream, Params, RestGated, RestLimits,
    Stream, Traced,
};

fn any_behaviour() -> impl Strategy<Value = Behaviour> {
    let limit = prop::option::of(0.1..1e3);
    (any::<(bool, bool, bool)>(), limit).prop_map(|(chosen, limit)| {
        let (hold_in_motion, compensated, reject_outliers) = chosen;
        Behaviour { limit, reject_outliers, hold_in_motion, compensated }
    })
}

fn any_limits() -> impl Strategy<Value = RestLimits> {
    let limit = || prop::option::of(0.1..1e3);
    (limit(), limit()).prop_map(|(rest, bias)| RestLimits { rest, bias })
}

/// At one sample a second a tick is four samples, and a block eight ticks.
fn any_auto() -> impl Strategy<Value = AutoParams> {
    let rate = prop::sample::select(vec![1.0, 62.5, 100.0]);
    (rate, 0.01..2.0, any_behaviour(), any_limits()).prop_map(
        |(rate, startup, behaviour, limits)| AutoParams {
            rate,
            startup,
            scale: None,
            behaviour,
            limits,
        },
    )
}

fn auto(params: AutoParams) -> AutoFilter<f64> {
    AutoFilter::new(params).expect("the strategies make valid parameters")
}

fn gated(params: Params, behaviour: Behaviour) -> RestGated<f64, 3, 4> {
    let filter = DriftFilter::new(params).expect("the strategies make valid parameters");
    RestGated::new(filter, behaviour).expect("and a valid rate")
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Batch, sample by sample, and across a checkpoint: the same bits.
fn splits<F>(new: &F, samples: &[f64], at: usize) -> Result<(), TestCaseError>
where
    F: Stream<Input = f64, Output = f64> + Checkpoint + Clone,
{
    let whole = processed(&mut new.clone(), samples);
    let mut first = new.clone();
    let mut parts = processed(&mut first, &samples[..at]);
    let mut second = restored(&first);
    parts.extend(samples[at..].iter().map(|z| second.update(*z)));
    prop_assert_eq!(bits(&whole), bits(&parts));
    Ok(())
}

fn valid<const N: usize, const M: usize>(now: &Snapshot<f64, N, M>) -> bool {
    let numbers = [now.estimate, now.innovation, now.bias];
    let variances = [now.innovation_variance, now.measurement_noise, now.bias_sigma];
    numbers.iter().chain(&now.gain).chain(&now.coefficients).all(|x| x.is_finite())
        && variances.iter().all(|v| v.is_finite() && *v >= 0.0)
        && now.process_noise.iter().chain(now.covariance.iter()).all(|x| x.is_finite())
        && now.process_noise.diagonal().iter().all(|v| *v >= 0.0)
        && now.covariance.diagonal().iter().all(|v| *v >= 0.0)
}

/// The output is the bias, or the sample without it: missing where the sample is.
fn is_output(output: f64, z: f64, bias: f64, compensated: bool) -> bool {
    match (compensated, z.is_finite()) {
        (false, _) => output.to_bits() == bias.to_bits(),
        (true, true) => {
            output == (z.clamp(-1e300, 1e300) - bias).clamp(-1e300, 1e300) && output.is_finite()
        }
        (true, false) => output.is_nan(),
    }
}

/// The sample, missing if it is at the end of the sensor's range.
fn within_range(z: f64, behaviour: Behaviour) -> f64 {
    if behaviour.limit.is_some_and(|limit| z.abs() >= limit) { f64::NAN } else { z }
}

/// The same in a unit of which one has so many.
fn in_unit(behaviour: Behaviour, factor: f64) -> Behaviour {
    Behaviour { limit: behaviour.limit.map(|limit| limit * factor), ..behaviour }
}

fn scaled(samples: &[f64], factor: f64) -> Vec<f64> {
    samples.iter().map(|z| z * factor).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn batches_samples_and_checkpoints_agree(
        params in any_auto(),
        published in any_params(),
        behaviour in any_behaviour(),
        samples in prop::collection::vec(any_sample(), 2..300),
        part in 0.0..1.0,
    ) {
        let at = (samples.len() as f64 * part) as usize;
        splits(&auto(params), &samples, at)?;
        splits(&gated(published, behaviour), &samples, at)?;
    }

    #[test]
    fn nothing_breaks_the_filter_that_tunes_itself(
        params in any_auto(),
        samples in prop::collection::vec(any_sample(), 1..300),
        again in prop::option::of(0usize..300),
    ) {
        let mut filter = auto(params);
        for (k, z) in samples.iter().enumerate() {
            if again == Some(k) {
                filter.switch_on();
            }
            let output = filter.update(*z);
            let now = filter.snapshot();
            prop_assert!(valid(&now), "sample {}: {:?}", k, now);
            let z = within_range(*z, params.behaviour);
            prop_assert!(is_output(output, z, filter.bias(), params.behaviour.compensated));
            prop_assert_eq!(now.missing, !z.is_finite());
        }
    }

    #[test]
    fn nothing_breaks_a_filter_that_holds(
        params in any_params(),
        behaviour in any_behaviour(),
        samples in prop::collection::vec(any_sample(), 1..300),
    ) {
        let mut filter = gated(params, behaviour);
        for (k, z) in samples.iter().enumerate() {
            let output = filter.update(*z);
            let now = filter.snapshot();
            prop_assert!(valid(&now), "sample {}: {:?}", k, now);
            let z = within_range(*z, behaviour);
            prop_assert!(is_output(output, z, now.bias, behaviour.compensated));
            prop_assert_eq!(now.missing, !z.is_finite());
        }
    }

    #[test]
    fn units_do_not_matter(
        params in any_auto(),
        published in any_params(),
        behaviour in any_behaviour(),
        seed in any::<u64>(),
        exponent in -300i32..300,
    ) {
        let (samples, factor) = (drifting(400, seed), 2f64.powi(exponent));
        let plain = processed(&mut auto(params), &samples);
        let in_unit = AutoParams {
            behaviour: self::in_unit(params.behaviour, factor),
            limits: RestLimits {
                rest: params.limits.rest.map(|limit| limit * factor),
                bias: params.limits.bias.map(|limit| limit * factor),
            },
            ..params
        };
        let other = processed(&mut auto(in_unit), &scaled(&samples, factor));
        prop_assert!(bits(&scaled(&plain, factor)) == bits(&other));

        let plain = processed(&mut gated(published, behaviour), &samples);
        let scaled_samples = scaled(&samples, factor);
        let other =
            processed(&mut gated(published, self::in_unit(behaviour, factor)), &scaled_samples);
        prop_assert!(bits(&scaled(&plain, factor)) == bits(&other));
    }

    #[test]
    fn what_neither_holds_nor_compensates_is_the_filter_inside(
        params in any_params(),
        samples in prop::collection::vec(any_sample(), 1..300),
    ) {
        let mut plain = DriftFilter::<f64, 3, 4>::new(params).expect("valid");
        let inside = processed(&mut plain, &samples);
        let behaviour = Behaviour::PUBLISHED;
        let got = processed(&mut gated(params, behaviour), &samples);
        prop_assert_eq!(bits(&inside), bits(&got));
    }
}

#[test]
fn reset_forgets_everything() {
    let behaviour = Behaviour { hold_in_motion: true, compensated: true, ..Behaviour::PUBLISHED };
    let mut filter = auto(AutoParams { behaviour, ..AutoParams::default() });
    let mut holding = gated(Params::default(), behaviour);
    let first = processed(&mut filter, &drifting(3000, 7));
    let held = processed(&mut holding, &drifting(3000, 7));
    filter.switch_on();
    filter.reset();
    holding.reset();
    assert!(!filter.ready());
    let second = processed(&mut filter, &drifting(3000, 7));
    assert_eq!(bits(&first), bits(&second));
    let second = processed(&mut holding, &drifting(3000, 7));
    assert_eq!(bits(&held), bits(&second));
}
