//! A filter accepts every state that it saved; a forged state with a right checksum is refused, or
//! goes on like any other: finite, without a panic.

use crate::common::{any_params, any_sample, saved, some_start};
use proptest::prelude::*;
use zerorate_core::allan::{AllanKind, AllanNoise};
use zerorate_core::attitude::{Attitude, AttitudeParams, Auto, AutoOptions, Frame};
use zerorate_core::calibrate::{
    Correction, ImuCorrector, TemperatureCurve, TemperatureFilter, TemperatureParams,
};
use zerorate_core::checkpoint::{self, Checkpoint};
use zerorate_core::navigation::{Adapt, Kind};
use zerorate_core::stream::{Input, Number, Output};
use zerorate_core::{
    AutoFilter, AutoParams, Behaviour, DriftFilter, Method, Params, RecursiveLeastSquares,
    RestDetector, RestGated, RestLimits, RlsParams, RobustFilter, RobustParams, Stream, Traced,
    Zones,
};

pub const HEADER: usize = 30;
pub const CHECKSUM: usize = 4;

/// Of the places in the content, every so manyth is forged in one case.
const STRIDE: usize = 293;

/// Numbers that no filter computes, or none at that place.
pub const WORDS: [f64; 20] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    1e300,
    -1e300,
    1e150,
    -1e150,
    1e75,
    1e38,
    -1e30,
    1e12,
    -1.0,
    0.0,
    5e-324,
    -1e-310,
    1e-300,
    1e-30,
    -1e-12,
];

/// A state with other bytes in its content, and the checksum that belongs to them.
pub fn forged(bytes: &[u8], place: usize, content: &[u8]) -> Vec<u8> {
    let mut body = bytes[..bytes.len() - CHECKSUM].to_vec();
    let end = body.len().min(place + content.len());
    body[place..end].copy_from_slice(&content[..end - place]);
    body.extend(crc32fast::hash(&body).to_le_bytes());
    body
}

/// All that a state tells, with what it returned last.
type Outputs<S> = fn(&S, <S as Stream>::Output) -> Vec<f64>;

/// Numbers of any output.
fn numbers<O: Output>(output: O) -> Vec<f64> {
    let (mut numbers, mut flags) = (vec![0.0; O::NUMBERS], vec![false; O::FLAGS]);
    output.write(&mut numbers, &mut flags);
    numbers
}

fn traced<S: Traced>(stream: &S, output: S::Output) -> Vec<f64> {
    [numbers(output), numbers(stream.snapshot())].concat()
}

fn returned<S: Stream>(_: &S, output: S::Output) -> Vec<f64> {
    numbers(output)
}

/// As many numbers as a sample has, from the `k`th on.
fn input<S: Stream>(samples: &[f64], k: usize) -> (S::Input, bool) {
    let place = |i: usize| samples[(k + 7 * i) % samples.len()];
    let row: Vec<f64> = (0..S::Input::NUMBERS).map(place).collect();
    (S::Input::read(&row), row.iter().all(|z| z.is_finite()))
}

fn check<S: Stream + Checkpoint>(
    mut stream: S,
    outputs: Outputs<S>,
    samples: &[f64],
    after: &[f64],
    first: usize,
) -> Result<(), TestCaseError> {
    for k in 0..samples.len() {
        stream.update(input::<S>(samples, k).0);
        if k % 7 == 0 {
            let restored = checkpoint::read::<S>(&saved(&stream));
            prop_assert!(restored.is_ok(), "a running state is refused after sample {}", k);
        }
    }
    let bytes = saved(&stream);
    let words = WORDS.map(|word| {
        if is_single::<S>() {
            (word as f32).to_le_bytes().to_vec()
        } else {
            word.to_le_bytes().to_vec()
        }
    });
    let single = [0, 1, 2, 0x7f, 0x80, 0xff].map(|byte| vec![byte]);
    let contents: Vec<&Vec<u8>> = words.iter().chain(&single).collect();
    for place in (HEADER + first % STRIDE..bytes.len() - CHECKSUM).step_by(STRIDE) {
        for content in &contents {
            let Ok(mut other) = checkpoint::read::<S>(&forged(&bytes, place, content)) else {
                continue;
            };
            for k in 0..after.len() {
                let (z, finite) = input::<S>(after, k);
                let output = other.update(z);
                if finite {
                    let outputs = outputs(&other, output);
                    prop_assert!(
                        outputs.iter().all(|x| x.is_finite()),
                        "{:?} at {} is accepted and gives {:?} for {:e}",
                        content,
                        place,
                        outputs,
                        after[k]
                    );
                }
            }
        }
    }
    Ok(())
}

fn is_single<S: Stream>() -> bool {
    size_of::<S::Input>() == size_of::<f32>()
}

fn published<T, const N: usize, const M: usize>(
    params: Params,
    hold_in_motion: bool,
) -> RestGated<T, N, M>
where
    T: zerorate_core::drift::DriftNumber,
{
    let filter = DriftFilter::new(params).expect("valid parameters");
    RestGated::new(filter, Behaviour { hold_in_motion, ..Behaviour::PUBLISHED })
        .expect("a valid rate")
}

fn auto<T: Number>(scale: Option<f64>, hold_in_motion: bool) -> AutoFilter<T> {
    let behaviour = Behaviour { hold_in_motion, ..Behaviour::PUBLISHED };
    AutoFilter::new(AutoParams { rate: 16.0, scale, behaviour, ..AutoParams::default() })
        .expect("valid parameters")
}

fn samples() -> impl Strategy<Value = Vec<f64>> {
    let calm = prop::collection::vec(-1.0..1.0, 0..400);
    let spikes = prop::collection::vec(any_sample(), 0..100);
    (calm, spikes).prop_map(|(calm, spikes)| [calm, spikes].concat())
}

/// Samples of many sizes after which the process noise of three coefficients is all but singular.
#[rustfmt::skip]
const SINGULAR: [f64; 57] = [
    0.0, 0.0, 0.0, 0.0618568901204795, 0.0, 0.0, 0.0, 0.0,
    0.7711163650895846, 0.22975555181225762, 0.0, 0.0, 0.0, 0.25792284837502477, 0.009605448854506362, 0.87701369222827,
    0.19129260252629912, 0.0, 0.0, 0.0, f64::NAN, 4.644521327465089, 9.703405180121782, 0.0,
    9.302015396596445, 0.0, 8.344022303509357, f64::NAN, 0.0, 6.910500637189414, f64::NAN, 7.732472967187351,
    0.0, f64::NAN, 6.354781026585029, 5.728589507565876, -4.628749683531777, 1000000000000.0, -9.149499249617486, 0.0,
    -3.750990458331009, 0.0, 4.745179737214887, 0.0, f64::NAN, 2.9068567078564866, f64::NAN, f64::NAN,
    0.0, -6.8195388956052305, f64::NAN, 0.0, 5.449130801172018, 1.686650421495426e21, 0.0, f64::NAN,
    0.0,
];

#[test]
fn a_process_noise_that_is_all_but_singular() {
    let params = Params {
        rate: 100.0,
        method: Method::Fading,
        fading: 0.01,
        noise: AllanKind::Allan,
        adapt_for: Some(0.0),
        forgetting_factor: 0.5,
        process_noise: 0.4136157407899172,
        process_noise_memory: 429.0851958349029,
        startup: 0.45121569971536873,
        scale: None,
    };
    let mut filter = DriftFilter::<f64, 4, 7>::new(params).expect("valid parameters");
    for (k, z) in SINGULAR.into_iter().enumerate() {
        filter.update(z);
        let restored = checkpoint::read::<DriftFilter<f64, 4, 7>>(&saved(&filter));
        assert!(restored.is_ok(), "refused after sample {k}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn published_filters(
        params in any_params(), samples in samples(), after in prop::collection::vec(any_sample(), 40), first in 0..STRIDE,
    ) {
        check(DriftFilter::<f64, 3, 4>::new(params)?, traced, &samples, &after, first)?;
        check(DriftFilter::<f32, 2, 3>::new(params)?, traced, &samples, &after, first)?;
        check(DriftFilter::<f64, 4, 7>::new(params)?, traced, &samples, &after, first)?;
    }

    #[test]
    fn robust_filters(
        params in any_params(), samples in samples(), after in prop::collection::vec(any_sample(), 40), first in 0..STRIDE,
        damping in 0.0..=1.0, correction in 0.0..=1.0, as_published in any::<bool>(),
    ) {
        let zones = if as_published { Zones::Published } else { Zones::Deviations(3.0, 0.5) };
        let robust = RobustParams { zones, damping, correction };
        let filter = RobustFilter::<f64, 2, 2>::new(params, robust)?;
        check(filter, traced, &samples, &after, first)?;
        check(RobustFilter::<f32, 3, 4>::new(params, robust)?, traced, &samples, &after, first)?;
        let behaviour = Behaviour { hold_in_motion: true, ..Behaviour::PUBLISHED };
        check(RestGated::<f64, 2, 2, _>::new(filter, behaviour)?, traced, &samples, &after, first)?;
    }

    #[test]
    fn started_filters(
        params in any_params(), samples in samples(), after in prop::collection::vec(any_sample(), 40), first in 0..STRIDE,
        seed in any::<u64>(), power in -9..9,
    ) {
        let start = some_start::<3, 4>(seed, 10f64.powi(power));
        if let Ok(filter) = DriftFilter::started(params, start) {
            check(filter, traced, &samples, &after, first)?;
        }
    }

    #[test]
    fn gated_filters(
        params in any_params(), samples in samples(), after in prop::collection::vec(any_sample(), 40), first in 0..STRIDE,
        hold in any::<bool>(),
    ) {
        check(published::<f64, 2, 2>(params, hold), traced, &samples, &after, first)?;
    }

    #[test]
    fn filters_that_tune_themselves(
        samples in samples(), after in prop::collection::vec(any_sample(), 80), first in 0..STRIDE,
        scale in prop::option::of(prop::sample::select(vec![1e-310, 1e-3, 1.0, 1e300, f64::MAX])),
        hold in any::<bool>(),
    ) {
        check(auto::<f64>(scale, hold), traced, &samples, &after, first)?;
    }

    #[test]
    fn models(samples in samples(), after in prop::collection::vec(any_sample(), 40), first in 0..STRIDE, forgetting_factor in 0.5..=1.0) {
        let params = RlsParams { forgetting_factor, startup: 20, scale: None };
        check(RecursiveLeastSquares::<f64, 3, 4>::new(params)?, returned, &samples, &after, first)?;
    }

    #[test]
    fn noises(samples in samples(), after in prop::collection::vec(any_sample(), 40), first in 0..STRIDE, fading in 0.01..=1.0) {
        for kind in [AllanKind::Allan, AllanKind::Hadamard] {
            check(AllanNoise::<f64>::new(fading, kind, 0.0)?, returned, &samples, &after, first)?;
            check(AllanNoise::<f32>::new(fading, kind, 0.0)?, returned, &samples, &after, first)?;
        }
    }

    #[test]
    fn detectors(samples in samples(), after in prop::collection::vec(any_sample(), 80), first in 0..STRIDE) {
        let limits = RestLimits { rest: Some(0.5), bias: None };
        check(RestDetector::<f64>::new(16.0, RestLimits::default())?, returned, &samples, &after, first)?;
        check(RestDetector::<f64>::new(16.0, limits)?, returned, &samples, &after, first)?;
        check(RestDetector::<f32>::new(16.0, limits)?, returned, &samples, &after, first)?;
    }

    #[test]
    fn correctors(samples in samples(), after in prop::collection::vec(any_sample(), 40), first in 0..STRIDE) {
        let curve = TemperatureCurve { reference: 20.0, range: [-5.0, 5.0], coefficients: [[0.5; 4]; 3] };
        let correction = Correction { g_sensitivity: [[0.1; 3]; 3], gyro_bias: [1.0; 3], ..Correction::default() };
        check(ImuCorrector::<3>::new(correction)?, returned, &samples, &after, first)?;
        check(ImuCorrector::<6>::new(correction)?, returned, &samples, &after, first)?;
        let correction = Correction { temperature: Some(curve), ..correction };
        check(ImuCorrector::<7>::new(correction)?, returned, &samples, &after, first)?;
    }

    #[test]
    fn temperature_filters(
        samples in samples(), after in prop::collection::vec(any_sample(), 80), first in 0..STRIDE,
        slope in prop::option::of(-1.0..1.0), walk in prop::option::of(0.0..1.0),
    ) {
        let params = TemperatureParams { rate: 16.0, slope, walk, ..TemperatureParams::default() };
        let outputs: Outputs<TemperatureFilter> = |filter, bias| {
            vec![bias, filter.bias_sigma(), filter.slope(), filter.slope_sigma()]
        };
        check(TemperatureFilter::new(params)?, outputs, &samples, &after, first)?;
    }

    #[cfg(feature = "std")]
    #[test]
    fn wavelets(samples in samples(), after in prop::collection::vec(any_sample(), 80), first in 0..STRIDE) {
        let denoiser = zerorate_core::denoise::WaveletDenoiser::new(crate::wavelet::params())?;
        check(denoiser, returned, &samples, &after, first)?;
    }
}

#[cfg(feature = "std")]
proptest! {
    // So has this one, and three times as many: one case for every change, many at night.
    #![proptest_config(ProptestConfig {
        cases: ProptestConfig::default().cases / 64,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn arrays(
        samples in samples(), after in prop::collection::vec(any_sample(), 40), first in 0..STRIDE,
        limit in prop::sample::select(vec![None, Some(9.0)]),
    ) {
        check(crate::array::Three::new(limit)?, numbers_and_validity, &samples, &after, first)?;
    }
}

/// A tick of which half is there would refuse itself later.
#[cfg(feature = "std")]
#[test]
fn half_a_tick() {
    let mut stream = crate::array::Three::new(None).expect("valid parameters");
    (0..16).for_each(|_| _ = stream.update([0.0, 0.0, 5.0]));
    let bytes = saved(&stream);
    let nan = f64::NAN.to_le_bytes();
    for place in HEADER..bytes.len() - CHECKSUM {
        let Ok(mut other) = checkpoint::read::<crate::array::Three>(&forged(&bytes, place, &nan))
        else {
            continue;
        };
        (0..41).for_each(|_| _ = other.update([0.0; 3]));
        assert!(other.is_valid(), "{place}");
    }
}

proptest! {
    // A state has many numbers, and each is forged into many: a case takes long.
    #![proptest_config(ProptestConfig {
        cases: ProptestConfig::default().cases / 32,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn attitudes(
        samples in samples(), after in prop::collection::vec(any_sample(), 40), first in 0..STRIDE,
        mag in any::<bool>(), rate in prop::sample::select(vec![5.0, 100.0, 1000.0]),
    ) {
        let params = AttitudeParams { rate, frame: Frame::Ned, mag: true, gyro_unit: 1.0, accel_unit: 10.0, gyro_range: None };
        let auto = Auto::new(AutoOptions { mag, ..AutoOptions::default() })?;
        check(Attitude::new(params, auto)?, numbers_and_validity, &samples, &after, first)?;
    }
}

/// A state with any other bytes in its content is refused, or takes samples and is saved again.
fn refused_or_runs<S: Stream + Checkpoint>(
    mut stream: S,
    samples: &[f64],
    after: &[f64],
    changes: &[(prop::sample::Index, u8)],
) {
    (0..samples.len()).for_each(|k| _ = stream.update(input::<S>(samples, k).0));
    let mut bytes = saved(&stream);
    for (place, byte) in changes {
        let at = HEADER + place.index(bytes.len() - HEADER - CHECKSUM);
        bytes = forged(&bytes, at, &[*byte]);
    }
    if let Ok(mut other) = checkpoint::read::<S>(&bytes) {
        (0..after.len()).for_each(|k| _ = other.update(input::<S>(after, k).0));
        saved(&other);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_are_a_stream_or_refused(
        which in 0..5, params in any_params(),
        samples in prop::collection::vec(any_sample(), 1..80),
        after in prop::collection::vec(any_sample(), 20),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..5),
    ) {
        let (samples, after, changes) = (&samples[..], &after[..], &changes[..]);
        match which {
            0 => refused_or_runs(DriftFilter::<f64, 3, 4>::new(params)?, samples, after, changes),
            1 => refused_or_runs(auto::<f64>(None, true), samples, after, changes),
            2 => refused_or_runs(published::<f64, 2, 2>(params, true), samples, after, changes),
            3 => {
                let nav = crate::navigation::filter(true, Adapt::Inflate, Kind::Rate);
                refused_or_runs(nav, samples, after, changes);
            }
            _ => {
                let params = AttitudeParams { rate: 100.0, frame: Frame::Ned, mag: true, gyro_unit: 1.0, accel_unit: 1.0, gyro_range: None };
                let attitude = Attitude::new(params, Auto::new(AutoOptions::default())?)?;
                refused_or_runs(attitude, samples, after, changes);
            }
        }
    }
}

/// The output, and a flag that the state could be saved again: the rest is undefined for a force of
/// zero.
fn numbers_and_validity<S: Stream + Checkpoint>(stream: &S, output: S::Output) -> Vec<f64> {
    let mut outputs = numbers(output);
    outputs.push(if stream.is_valid() { 0.0 } else { f64::NAN });
    outputs
}
