//! Whatever a constructor takes and samples make, a checkpoint restores, and both continue to the
//! last bit.

use std::any::type_name;
use std::fmt::Debug;

use crate::common::saved;
use crate::draw::{Clock, Draw, count};
use zerorate_core::allan::{AllanKind, AllanNoise};
use zerorate_core::attitude::{
    Attitude, AttitudeParams, Auto, AutoOptions, CONSTANTS, Compass, Complementary, Constant, Ekf,
    Estimator, FieldCorrection, Frame, Learning, Madgwick, Mahony, NamedOptions, TILT_CONSTANTS,
    Tagged, Tilt, TiltConstants, TiltMethod, TiltParams, Ukf,
};
use zerorate_core::calibrate::{
    Correction, ImuCorrector, TemperatureCurve, TemperatureFilter, TemperatureParams,
};
use zerorate_core::checkpoint::{self, Checkpoint};
use zerorate_core::drift::{DriftNumber, PublishedFilter};
use zerorate_core::navigation::foot::{FootFilter, FootParams};
use zerorate_core::navigation::{
    Adapt, AidParams, Kind, LIMITS, NavigationFilter, NavigationParams, Start, Wheels,
};
use zerorate_core::position::{
    POSITION_CONSTANTS, POSITION_METHODS, PositionConstants, PositionFilter, PositionMethod,
    PositionParams,
};
use zerorate_core::stream::{Input, Output};
use zerorate_core::{
    AutoFilter, AutoParams, Behaviour, DriftFilter, Error, Method, MotionDetector, Params,
    RecursiveLeastSquares, RestDetector, RestGated, RestLimits, RlsParams, RobustFilter,
    RobustParams, Stream, Zones,
};

/// Histories of a stream for every change.
const HISTORIES: u64 = 200;

/// The first stream that the constructor takes.
fn made<S>(draw: &mut Draw, make: impl Fn(&mut Draw) -> Result<S, Error>) -> S {
    (0..1000).find_map(|_| make(draw).ok()).expect("half of all parameters are the usual ones")
}

/// Numbers and flags of an output, as bits.
fn bits<O: Output>(output: O) -> (Vec<u64>, Vec<bool>) {
    let (mut numbers, mut flags) = (vec![0.0; O::NUMBERS], vec![false; O::FLAGS]);
    output.write(&mut numbers, &mut flags);
    (numbers.into_iter().map(f64::to_bits).collect(), flags)
}

/// By the bytes of a checkpoint, or by serde alone.
fn copied<S: Checkpoint>(stream: &S, by_serde: bool) -> Result<S, String> {
    if by_serde {
        let bytes = postcard::to_stdvec(stream).map_err(|error| error.to_string())?;
        return postcard::from_bytes(&bytes).map_err(|error| error.to_string());
    }
    checkpoint::read(&saved(stream)).map_err(|error| error.to_string())
}

fn continues<S: Stream + Checkpoint + Debug>(
    clock: Clock,
    make: impl Fn(&mut Draw) -> Result<S, Error>,
) {
    for seed in 0..count(HISTORIES) {
        let mut draw = Draw::new(seed);
        let mut stream = made(&mut draw, &make);
        for (k, block) in draw.history(S::Input::NUMBERS, clock).into_iter().enumerate() {
            let place = || format!("{}, history {seed}, block {k}", type_name::<S>());
            let copy = copied(&stream, k % 2 == 1);
            let mut other = copy.unwrap_or_else(|error| panic!("{}: {error}: {stream:?}", place()));
            for row in &block {
                let outputs =
                    [&mut stream, &mut other].map(|one| bits(one.update(Input::read(row))));
                assert_eq!(outputs[0], outputs[1], "{}", place());
            }
            assert!(saved(&stream) == saved(&other), "{}", place());
        }
        assert!(
            stream.is_valid(),
            "{}, at the end of history {seed}: {stream:?}",
            type_name::<S>()
        );
    }
}

fn params(draw: &mut Draw) -> Params {
    Params {
        rate: draw.number(100.0),
        method: draw.one_of(&[Method::Kf, Method::Akf, Method::Fading]),
        fading: draw.number(0.5),
        noise: draw.one_of(&[AllanKind::Allan, AllanKind::Hadamard]),
        adapt_for: draw.maybe(1.0),
        forgetting_factor: draw.one_of(&[0.5, 0.99, 1.0]),
        process_noise: draw.number(1e-3),
        process_noise_memory: draw.number(100.0),
        startup: draw.one_of(&[0.1, 0.5, 0.01]) * 100.0 / draw.one_of(&[10.0, 100.0, 1e3]),
        scale: draw.maybe(1.0),
    }
}

fn behaviour(draw: &mut Draw) -> Behaviour {
    Behaviour {
        limit: draw.maybe(20.0),
        reject_outliers: draw.flag(),
        hold_in_motion: draw.flag(),
        compensated: draw.flag(),
    }
}

fn limits(draw: &mut Draw) -> RestLimits {
    RestLimits { rest: draw.maybe(0.5), bias: draw.maybe(1.0) }
}

#[test]
fn published_filters() {
    continues(Clock::None, |draw| DriftFilter::<f64, 3, 4>::new(params(draw)));
    continues(Clock::None, |draw| DriftFilter::<f64, 4, 7>::new(params(draw)));
    continues(Clock::None, |draw| DriftFilter::<f32, 2, 3>::new(params(draw)));
    continues(Clock::None, |draw| {
        let seed = draw.below(1 << 40) as u64;
        let start = crate::common::some_start::<3, 4>(seed, draw.number(1.0));
        DriftFilter::<f64, 3, 4>::started(params(draw), start)
    });
}

fn robust<T: DriftNumber>(draw: &mut Draw) -> Result<RobustFilter<T, 3, 4>, Error> {
    let zones = match draw.flag() {
        true => Zones::Published,
        false => Zones::Deviations(draw.number(3.0), draw.number(0.5)),
    };
    let (damping, correction) = (draw.uniform(), draw.uniform());
    RobustFilter::new(params(draw), RobustParams { zones, damping, correction })
}

#[test]
fn robust_filters() {
    continues(Clock::None, robust::<f64>);
    continues(Clock::None, robust::<f32>);
}

fn gated<F>(draw: &mut Draw, filter: F) -> Result<RestGated<f64, 3, 4, F>, Error>
where
    F: PublishedFilter<f64, 3, 4>,
{
    RestGated::new(filter, behaviour(draw))
}

#[test]
fn gated_filters() {
    continues(Clock::None, |draw| {
        let filter = DriftFilter::new(params(draw))?;
        gated(draw, filter)
    });
    continues(Clock::None, |draw| {
        let filter = robust::<f64>(draw)?;
        gated(draw, filter)
    });
}

fn auto<T: DriftNumber>(draw: &mut Draw) -> Result<AutoFilter<T>, Error> {
    AutoFilter::new(AutoParams {
        rate: draw.number(16.0),
        startup: draw.number(1.0),
        scale: draw.maybe(1.0),
        behaviour: behaviour(draw),
        limits: limits(draw),
    })
}

#[test]
fn filters_that_tune_themselves() {
    continues(Clock::None, auto::<f64>);
    continues(Clock::None, auto::<f32>);
}

#[test]
fn models_noises_and_detectors() {
    continues(Clock::None, |draw| {
        RecursiveLeastSquares::<f64, 3, 4>::new(RlsParams {
            forgetting_factor: draw.one_of(&[0.5, 0.9, 1.0]),
            startup: 1 + draw.below(40) as u64,
            scale: draw.maybe(1.0),
        })
    });
    let noise = |draw: &mut Draw| {
        let kind = draw.one_of(&[AllanKind::Allan, AllanKind::Hadamard]);
        (draw.number(0.1), kind, draw.number(0.0))
    };
    continues(Clock::None, |draw| {
        let (fading, kind, initial) = noise(draw);
        AllanNoise::<f64>::new(fading, kind, initial)
    });
    continues(Clock::None, |draw| {
        let (fading, kind, initial) = noise(draw);
        AllanNoise::<f32>::new(fading, kind, initial)
    });
    continues(Clock::None, |draw| RestDetector::<f64>::new(draw.number(16.0), limits(draw)));
    continues(Clock::None, |draw| RestDetector::<f32>::new(draw.number(16.0), limits(draw)));
    continues(Clock::None, |draw| MotionDetector::new(draw.number(16.0)));
}

fn correction(draw: &mut Draw) -> Correction {
    Correction {
        gyro_matrix: [(); 3].map(|()| draw.three(1.0)),
        gyro_bias: draw.three(0.1),
        accel_bias: draw.three(0.1),
        g_sensitivity: [(); 3].map(|()| draw.three(0.1)),
        ..Correction::default()
    }
}

#[test]
fn correctors_and_temperature_filters() {
    continues(Clock::None, |draw| ImuCorrector::<3>::new(correction(draw)));
    continues(Clock::None, |draw| ImuCorrector::<6>::new(correction(draw)));
    continues(Clock::None, |draw| {
        let curve = TemperatureCurve {
            reference: draw.number(20.0),
            range: [-draw.number(5.0), draw.number(50.0)],
            coefficients: [[0.5, draw.number(0.1), 0.0, draw.number(1e-3)]; 3],
        };
        ImuCorrector::<7>::new(Correction { temperature: Some(curve), ..correction(draw) })
    });
    continues(Clock::None, |draw| {
        TemperatureFilter::new(TemperatureParams {
            rate: draw.number(16.0),
            reference: draw.number(25.0),
            slope: draw.maybe(0.1),
            slope_sigma: draw.maybe(0.1),
            walk: draw.maybe(1e-3),
            limits: limits(draw),
        })
    });
}

fn attitude<E: Estimator>(draw: &mut Draw, mag: bool, estimator: E) -> Result<Attitude<E>, Error> {
    let params = AttitudeParams {
        rate: draw.number(100.0),
        frame: draw.one_of(&[Frame::Ned, Frame::Enu]),
        mag,
        gyro_unit: draw.number(1.0),
        accel_unit: draw.number(1.0),
        gyro_range: draw.maybe(35.0),
    };
    Attitude::new(params, estimator)
}

fn auto_attitude(draw: &mut Draw, mag: bool) -> Result<Auto, Error> {
    Auto::new(AutoOptions {
        mag,
        bias: draw.three(1e-3),
        bias_sigma: draw.three(1e-2),
        bias_limit: draw.number(0.1),
        ..AutoOptions::default()
    })
}

fn field_correction(draw: &mut Draw) -> FieldCorrection {
    FieldCorrection { iron: draw.three(0.1), matrix: [(); 3].map(|()| draw.three(1.0)) }
}

/// Each constant at its usual value, at an end of its range, or between.
fn constants<C: Default>(draw: &mut Draw, table: &[Constant<C>]) -> C {
    let mut constants = C::default();
    for constant in table {
        let usual = (constant.get)(&constants);
        match (draw.below(4), usual) {
            (0, _) => (constant.set)(&mut constants, constant.range[0]),
            (1, _) => (constant.set)(&mut constants, constant.range[1]),
            (2, Some(usual)) => (constant.set)(&mut constants, draw.number(usual)),
            _ => {}
        }
    }
    constants
}

fn named<E: Estimator + Tagged + Debug>(new: fn(NamedOptions) -> Result<E, Error>)
where
    Attitude<E>: Checkpoint,
{
    continues(Clock::Step(9), |draw| {
        let mag = draw.flag();
        let constants = constants(draw, CONSTANTS);
        let (bias, bias_sigma) = (draw.three(1e-3), draw.three(1e-2));
        attitude(draw, mag, new(NamedOptions { mag, bias, bias_sigma, constants })?)
    });
}

#[test]
fn attitudes() {
    continues(Clock::Step(9), |draw| {
        let mag = draw.flag();
        let auto = auto_attitude(draw, mag)?;
        attitude(draw, mag, auto)
    });
    continues(Clock::Step(9), |draw| {
        let compass = Compass::new(auto_attitude(draw, true)?, field_correction(draw))?;
        attitude(draw, true, compass)
    });
    continues(Clock::Step(9), |draw| {
        let correction = draw.flag().then(|| field_correction(draw));
        let learning = Learning::new(auto_attitude(draw, true)?, correction)?;
        attitude(draw, true, learning)
    });
}

#[test]
fn named_attitudes() {
    named(Madgwick::new);
    named(Mahony::new);
    named(Complementary::new);
    named(Ekf::new);
    named(Ukf::new);
}

#[test]
fn tilts_and_positions() {
    continues(Clock::Step(2), |draw| {
        Tilt::new(TiltParams {
            rate: draw.number(100.0),
            method: draw.one_of(&[TiltMethod::Complementary, TiltMethod::Kalman]),
            constants: constants::<TiltConstants>(draw, TILT_CONSTANTS),
        })
    });
    continues(Clock::Step(6), |draw| {
        let name = draw.one_of(&POSITION_METHODS);
        PositionFilter::new(PositionParams {
            rate: draw.number(1.0),
            method: PositionMethod::of_name(name).expect("each has a name"),
            constants: constants::<PositionConstants>(draw, POSITION_CONSTANTS),
        })
    });
}

#[test]
fn feet() {
    continues(Clock::None, |draw| {
        let (rate, level) = (draw.one_of(&[48.0, 100.0, 1200.0]), draw.flag());
        FootFilter::new(FootParams { rate, level, gyro_range: draw.maybe(35.0) })
    });
}

fn navigation(draw: &mut Draw) -> Result<NavigationFilter, Error> {
    let axle = [-draw.number(1.0), 0.0, draw.number(1.0)];
    let wheels = Wheels { axle, sigma: draw.number(0.3), speed_sigma: draw.number(0.15) };
    let params = NavigationParams {
        gyro_noise: draw.three(1e-6),
        accel_noise: draw.three(4e-4),
        gyro_walk: draw.three(1e-10),
        accel_walk: draw.three(2.5e-7),
        gyro_vibration: draw.number(0.1),
        antenna: draw.three(0.1),
        antenna_sigma: if draw.flag() { [0.0; 3] } else { draw.three(0.1) },
        consider_antenna: draw.flag(),
        wheels: draw.flag().then_some(wheels),
        gate: draw.number(50.0),
        adapt: draw.one_of(&[Adapt::Inflate, Adapt::Free, Adapt::Fixed]),
        covariance_step: draw.number(0.1),
        kind: draw.one_of(&[Kind::Rate, Kind::Increment]),
        aids: AidParams::default(),
        limits: LIMITS,
    };
    let start = Start {
        time: draw.one_of(&[0.0, -0.01, -1e9, 1e-300]),
        quaternion: [1.0, 0.0, 0.0, 0.0],
        heading_known: draw.flag(),
        course: draw.flag(),
        latitude: draw.one_of(&[0.0, 0.8, -1.5]),
        gyro_bias: draw.three(1e-3),
        accel_bias: draw.three(1e-2),
        level_sigma: draw.number(5e-3),
        heading_sigma: draw.number(0.05),
        gyro_bias_sigma: draw.number(1e-4),
        accel_bias_sigma: draw.number(0.05),
    };
    NavigationFilter::new(start, params)
}

#[test]
fn navigation_filters() {
    continues(Clock::Stamp(1), navigation);
}

#[cfg(feature = "std")]
#[test]
fn streams_with_memory_of_their_own() {
    use zerorate_core::allan::StreamingAllan;
    use zerorate_core::denoise::{Mode, Wavelet, WaveletDenoiser, WaveletParams};

    continues(Clock::None, |draw| StreamingAllan::new(draw.number(100.0), 1 + draw.below(8)));
    continues(Clock::None, |draw| {
        WaveletDenoiser::new(WaveletParams {
            rate: draw.number(100.0),
            wavelet: draw.one_of(&Wavelet::NAMES.map(|(wavelet, _)| wavelet)),
            mode: draw.one_of(&[Mode::Soft, Mode::Hard]),
            level: 1 + draw.below(5),
            threshold: draw.number(4.0),
        })
    });
    continues(Clock::None, |draw| crate::array::Three::new(draw.maybe(9.0)));
}

#[cfg(feature = "std")]
#[test]
fn linear_filters() {
    use zerorate_core::linear::{Batch, Known, LinearBank, Model};

    let square = |draw: &mut Draw| {
        let variances = [draw.number(1.0), draw.number(1.0)];
        // What a person has computed is as definite as that.
        let whole = 1.0 + draw.one_of(&[0.0, 1e-16, 1e-13, 3e-12, 9e-11]);
        let usual = 2.0 * draw.uniform() - 1.0;
        let r = draw.one_of(&[-whole, whole, usual]);
        let covariance = r * variances[0].sqrt() * variances[1].sqrt();
        vec![variances[0], covariance, covariance, variances[1]]
    };
    for seed in 0..count(HISTORIES) {
        let mut draw = Draw::new(seed);
        let mut bank = made(&mut draw, |draw| {
            let model = Model {
                sizes: [2, 2, 0],
                F: vec![draw.number(1.0), draw.number(0.1), draw.number(0.0), draw.number(1.0)],
                H: vec![1.0, 0.0, draw.number(0.5), draw.number(1.0)],
                Q: square(draw),
                R: square(draw),
                B: Vec::new(),
            };
            LinearBank::new(model, None, Some(&square(draw)), None)
        });
        for block in draw.history(2, Clock::None) {
            let saved = bank.save().expect("there is memory");
            let mut other =
                LinearBank::restore(&saved).unwrap_or_else(|e| panic!("history {seed}: {e}"));
            let z = block.concat();
            let steps = block.len();
            let batch = Batch { steps, predicts: true, corrects: true, z: &z, ..Batch::default() };
            for one in [&mut bank, &mut other] {
                one.run(&batch, &mut Known::nothing());
            }
            assert!(bank.save() == other.save(), "history {seed}");
        }
    }
}
