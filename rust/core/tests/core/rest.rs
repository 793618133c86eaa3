//! `RestDetector`: its laws, and what it tells at the ends of ticks.

use crate::common::{any_sample, processed_to, restored, saved, white_noise};
use proptest::prelude::*;
use zerorate_core::{Error, Event, RestDetector, RestLimits, Stream, Tick};

const RATE: f64 = 100.0;

fn new(rate: f64) -> RestDetector<f64> {
    RestDetector::new(rate, RestLimits::default()).expect("the tests' rates are positive")
}

/// The events, and their samples.
fn events(samples: &[f64]) -> Vec<(usize, Event)> {
    let mut detector = new(RATE);
    let mut changes = Vec::new();
    for (k, z) in samples.iter().enumerate() {
        if let Some(Tick { event: Some(event), .. }) = detector.observe(*z) {
            changes.push((k + 1, event));
        }
    }
    changes
}

/// Noise of unit deviation, with `rate` added from one sample to another.
fn turned(n: usize, from: usize, to: usize, rate: f64) -> Vec<f64> {
    let mut samples = white_noise(n, 1);
    samples[from..to].iter_mut().for_each(|z| *z += rate);
    samples
}

#[test]
fn rest_motion_and_rest_again() {
    let expected = [(150, Event::Rest), (6025, Event::Motion), (6650, Event::Rest)];
    assert_eq!(events(&turned(12_000, 6_000, 6_500, 5.0)), expected);
}

#[test]
fn a_rest_believed_in_too_early_is_to_be_forgotten() {
    let changes = events(&turned(12_000, 500, 12_000, 50.0));
    // The tick that ends it is the first of ten seconds.
    let expected = [(150, Event::Rest), (525, Event::Restart), (1500, Event::Rest)];
    assert_eq!(changes, expected);
}

#[test]
fn a_level_that_stays_is_a_restart_and_so_is_the_way_back() {
    let expected = [
        (150, Event::Rest),
        (10_025, Event::Motion),
        (16_000, Event::Restart),
        (20_025, Event::Motion),
        (20_150, Event::Restart),
    ];
    assert_eq!(events(&turned(30_000, 10_000, 20_000, 50.0)), expected);
}

#[test]
fn a_tick_tells_the_mean_of_the_samples_present_and_few_wait_for_more() {
    let mut detector = new(16.0);
    let mut ticks = [1e7, f64::NAN, 1e7 + 2.0, f64::INFINITY, 1e7, 1e7 + 2.0, f64::NAN, f64::NAN]
        .into_iter()
        .filter_map(|z| detector.observe(z));
    let few = ticks.next().expect("a tick of two samples");
    assert_eq!((few.count, few.calm, few.event), (0, false, None));
    let deviation = (4.0 / 3.0_f64).sqrt();
    let expected = Tick {
        count: 4,
        mean: 1e7 + 1.0,
        deviation,
        calm: false,
        event: None,
        outliers: 0,
        stuck: 0,
    };
    assert_eq!(ticks.next(), Some(expected));
}

#[test]
fn three_samples_far_from_all_others_are_outliers_when_more_arrive() {
    let mut detector = new(RATE);
    let quiet = white_noise(6000, 2);
    let mut samples = quiet[..3000].to_vec();
    samples.extend([350.0, 350.5, 351.0]);
    samples.extend([f64::NAN; 122]);
    samples.extend(&quiet[3000..]);
    let ticks: Vec<_> = samples.iter().filter_map(|z| detector.observe(*z)).collect();
    let after = &ticks[120..];
    assert!(after[..5].iter().all(|tick| tick.count == 0 && tick.event.is_none()));
    assert_eq!((after[5].outliers, after[5].count), (3, 25));
    assert!(after.iter().all(|tick| tick.mean.abs() < 1.0 || tick.count == 0));
}

#[test]
fn a_stuck_sensor_tells_nothing() {
    let mut detector = new(RATE);
    let mut samples = white_noise(6000, 3);
    samples[3000..4000].fill(0.0);
    let ticks: Vec<_> = samples.iter().filter_map(|z| detector.observe(*z)).collect();
    let (before, during) = (&ticks[..120], &ticks[120..160]);
    assert!(before.iter().all(|tick| tick.stuck == 0));
    assert!(during.iter().all(|tick| (tick.stuck, tick.count) == (25, 0)));
    assert!(!detector.is_stuck() && detector.at_rest());
}

#[test]
fn an_output_that_stands_still_for_its_coarse_steps_is_not_stuck() {
    let mut detector = new(RATE);
    // A step of seven deviations: runs of thousands of samples, left by one step.
    let samples = white_noise(300_000, 4);
    let mut ticks = samples.iter().filter_map(|z| detector.observe(7.0 * (z / 7.0).round()));
    assert!(ticks.all(|tick| tick.stuck == 0));
    assert!(detector.at_rest());
}

#[test]
fn nothing_beyond_the_limits_is_rest() {
    let limits = RestLimits { rest: Some(10.0), bias: Some(20.0) };
    let refused = |limits| RestDetector::<f64>::new(RATE, limits).expect_err("no limit");
    assert!(matches!(
        refused(RestLimits { rest: Some(0.0), ..limits }),
        Error::Parameter { name: "rest_limit", .. }
    ));
    assert!(matches!(
        refused(RestLimits { bias: Some(f64::NAN), ..limits }),
        Error::Parameter { name: "bias_limit", .. }
    ));
    let rests = |samples: Vec<f64>| {
        let mut detector = RestDetector::new(RATE, limits).expect("valid limits");
        samples.iter().map(|z| detector.update(*z)).filter(|at_rest| *at_rest).count()
    };
    let noise = white_noise(30_000, 5);
    let turned = |rate: f64| noise.iter().map(|z| z + rate).collect::<Vec<_>>();
    assert_eq!(rests(turned(0.0)), 30_000 - 224);
    assert_eq!(rests(turned(19.0)), 30_000 - 224);
    assert_eq!(rests(turned(21.0)), 0);
    assert_eq!(rests(noise.iter().map(|z| 11.0 * z).collect()), 0);
    // Motors shake samples, and their means hardly.
    assert!(rests(noise.iter().map(|z| 4.0 * z).collect()) > 25_000);
    // A minute of turning back and forth: the means of ticks move by far more than three.
    let swung = |(i, z): (usize, &f64)| z + 15.0 * (i as f64 / 100.0).sin();
    assert_eq!(rests(noise.iter().enumerate().map(swung).collect()), 0);
}

#[test]
fn a_quieter_level_is_believed_over_one_that_nothing_has_proven() {
    let mut detector = new(RATE);
    let noise = white_noise(6000, 6);
    let samples: Vec<f64> = noise
        .iter()
        .enumerate()
        .map(|(i, z)| if i < 2000 { 30.0 + 20.0 * z } else { *z })
        .collect();
    let mut events = Vec::new();
    for (i, z) in samples.iter().enumerate() {
        let provisional = detector.is_provisional();
        if let Some(Tick { event: Some(event), .. }) = detector.observe(*z) {
            events.push((i + 1, event, provisional));
        }
    }
    assert_eq!(events[0], (150, Event::Rest, true));
    assert_eq!(&events[1..], [(2025, Event::Motion, true), (2300, Event::Restart, true)]);
    assert!(!detector.is_provisional() && detector.at_rest());
}

#[test]
fn a_tick_is_calm_if_it_belongs_to_a_rest() {
    let mut detector = new(RATE);
    for z in turned(12_000, 6_000, 6_500, 5.0) {
        if let Some(tick) = detector.observe(z) {
            assert_eq!(tick.calm, detector.at_rest());
        }
    }
    assert!(detector.at_rest());
    let blank = (0..25).find_map(|_| detector.observe(f64::NAN)).expect("a whole tick");
    assert_eq!((blank.count, blank.calm, detector.at_rest()), (0, false, true));
}

#[test]
fn a_rate_that_is_none_is_refused() {
    for rate in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = RestDetector::<f64>::new(rate, RestLimits::default()).expect_err("no rate");
        assert!(matches!(refused, Error::Parameter { name: "rate", .. }));
    }
}

#[test]
fn single_precision_tells_the_same() {
    let mut detector = RestDetector::<f32>::new(RATE, RestLimits::default()).expect("a rate");
    let changes: Vec<(usize, Event)> = turned(30_000, 10_000, 20_000, 50.0)
        .iter()
        .enumerate()
        .filter_map(|(k, z)| Some((k + 1, detector.observe(*z as f32)?.event?)))
        .collect();
    assert_eq!(changes, events(&turned(30_000, 10_000, 20_000, 50.0)));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn batches_samples_and_checkpoints_agree(
        seed in any::<u64>(),
        spikes in prop::collection::vec((any::<prop::sample::Index>(), any_sample()), 0..6),
        part in 0.0..1.0,
    ) {
        let mut samples = white_noise(2000, seed);
        for (place, z) in spikes {
            let place = place.index(samples.len());
            samples[place] = z;
        }
        let at = (samples.len() as f64 * part) as usize;
        let mut whole = new(20.0);
        samples.iter().for_each(|z| { whole.observe(*z); });
        let mut parts = new(20.0);
        let mut at_rest = processed_to::<bool, _>(&mut parts, &samples[..at]);
        let mut parts = restored(&parts);
        at_rest.extend(processed_to::<bool, _>(&mut parts, &samples[at..]));
        prop_assert_eq!(saved(&parts), saved(&whole));
        prop_assert_eq!(at_rest.last(), Some(&whole.at_rest()));
        whole.reset();
        prop_assert_eq!(saved(&whole), saved(&new(20.0)));
    }

    #[test]
    fn nothing_breaks_it(
        rate in prop::sample::select(vec![1.0, 10.0, 100.0]),
        samples in prop::collection::vec(any_sample(), 1..400),
    ) {
        let mut double = new(rate);
        let mut single = RestDetector::<f32>::new(rate, RestLimits::default()).expect("a rate");
        for z in samples {
            if let Some(tick) = double.observe(z) {
                prop_assert!(tick.mean.is_finite() || tick.count == 0);
            }
            if let Some(tick) = single.observe(z as f32) {
                prop_assert!(tick.mean.is_finite() || tick.count == 0);
            }
        }
    }
}
