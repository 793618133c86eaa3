//! What holds for the filters that tell rest from motion, whatever the input and the parameters.

mod common;

use common::{any_params, any_sample, drifting};
use proptest::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use zerorate_core::checkpoint::{self, Kind, Label};
use zerorate_core::{
    AutoFilter, AutoParams, Conduct, DriftFilter, Filter, MotionSafe, Params, Snapshot,
};

const AUTO: Label = Label { kind: Kind::AutoFilter, p: 0, q: 0 };
const SAFE: Label = Label { kind: Kind::MotionSafe, p: 2, q: 1 };

fn any_conduct() -> impl Strategy<Value = Conduct> {
    any::<(bool, bool)>().prop_map(|(hold, compensated)| Conduct { hold, compensated })
}

/// At one sample a second a tick is four samples, and a block eight ticks.
fn any_auto() -> impl Strategy<Value = AutoParams> {
    let rate = prop::sample::select(vec![1.0, 62.5, 100.0]);
    (rate, 0.01..2.0, any_conduct()).prop_map(|(rate, startup, conduct)| AutoParams {
        rate,
        startup,
        scale: None,
        conduct,
    })
}

fn auto(params: AutoParams) -> AutoFilter<f64> {
    AutoFilter::new(params).expect("the strategies make valid parameters")
}

fn safe(params: Params, conduct: Conduct) -> MotionSafe<f64, 3, 4> {
    let filter = DriftFilter::new(params).expect("the strategies make valid parameters");
    MotionSafe::new(filter, conduct).expect("and a valid rate")
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Batch, sample by sample, and across a checkpoint: the same bits.
fn splits<F>(new: &F, label: Label, samples: &[f64], at: usize) -> Result<(), TestCaseError>
where
    F: Filter<f64> + Clone + Serialize + DeserializeOwned,
{
    let mut whole = samples.to_vec();
    new.clone().process(&mut whole);
    let mut first = new.clone();
    let mut parts = samples[..at].to_vec();
    first.process(&mut parts);
    let mut buffer = [0; 8192];
    let bytes = checkpoint::write(label, &first, &mut buffer).expect("a filter can be saved");
    let mut second: F = checkpoint::read(label, bytes).expect("and restored");
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

/// The answer is the bias, or the sample without it: missing where the sample is.
fn is_answer(answer: f64, z: f64, bias: f64, compensated: bool) -> bool {
    match (compensated, z.is_finite()) {
        (false, _) => answer.to_bits() == bias.to_bits(),
        (true, true) => {
            answer == (z.clamp(-1e300, 1e300) - bias).clamp(-1e300, 1e300) && answer.is_finite()
        }
        (true, false) => answer.is_nan(),
    }
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
        conduct in any_conduct(),
        samples in prop::collection::vec(any_sample(), 2..300),
        part in 0.0..1.0,
    ) {
        let at = (samples.len() as f64 * part) as usize;
        splits(&auto(params), AUTO, &samples, at)?;
        splits(&safe(published, conduct), SAFE, &samples, at)?;
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
                filter.power_on();
            }
            let answer = filter.update(*z);
            let now = filter.snapshot();
            prop_assert!(valid(&now), "sample {}: {:?}", k, now);
            prop_assert!(is_answer(answer, *z, filter.bias(), params.conduct.compensated));
            prop_assert_eq!(now.missing, !z.is_finite());
        }
    }

    #[test]
    fn nothing_breaks_a_filter_that_holds(
        params in any_params(),
        conduct in any_conduct(),
        samples in prop::collection::vec(any_sample(), 1..300),
    ) {
        let mut filter = safe(params, conduct);
        for (k, z) in samples.iter().enumerate() {
            let answer = filter.update(*z);
            let now = filter.snapshot();
            prop_assert!(valid(&now), "sample {}: {:?}", k, now);
            prop_assert!(is_answer(answer, *z, now.bias, conduct.compensated));
            prop_assert_eq!(now.missing, !z.is_finite());
        }
    }

    #[test]
    fn units_do_not_matter(
        params in any_auto(),
        published in any_params(),
        conduct in any_conduct(),
        seed in any::<u64>(),
        exponent in -300i32..300,
    ) {
        let (samples, factor) = (drifting(400, seed), 2f64.powi(exponent));
        let (mut plain, mut other) = (samples.clone(), scaled(&samples, factor));
        auto(params).process(&mut plain);
        auto(params).process(&mut other);
        prop_assert_eq!(bits(&scaled(&plain, factor)), bits(&other));

        let (mut plain, mut other) = (samples.clone(), scaled(&samples, factor));
        safe(published, conduct).process(&mut plain);
        safe(published, conduct).process(&mut other);
        prop_assert_eq!(bits(&scaled(&plain, factor)), bits(&other));
    }

    #[test]
    fn what_neither_holds_nor_compensates_is_the_filter_inside(
        params in any_params(),
        samples in prop::collection::vec(any_sample(), 1..300),
    ) {
        let mut inside = samples.clone();
        DriftFilter::<f64, 3, 4>::new(params).expect("valid").process(&mut inside);
        let mut got = samples;
        safe(params, Conduct { hold: false, compensated: false }).process(&mut got);
        prop_assert_eq!(bits(&inside), bits(&got));
    }
}

#[test]
fn reset_forgets_everything() {
    let conduct = Conduct { hold: true, compensated: true };
    let mut filter = auto(AutoParams { rate: 100.0, startup: 1.0, scale: None, conduct });
    let mut holding = safe(Params::default(), conduct);
    let mut first = drifting(3000, 7);
    filter.process(&mut first);
    let mut held = drifting(3000, 7);
    holding.process(&mut held);
    filter.power_on();
    filter.reset();
    holding.reset();
    assert!(!filter.ready());
    let mut second = drifting(3000, 7);
    filter.process(&mut second);
    assert_eq!(bits(&first), bits(&second));
    let mut second = drifting(3000, 7);
    holding.process(&mut second);
    assert_eq!(bits(&held), bits(&second));
}
