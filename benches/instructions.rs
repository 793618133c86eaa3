//! Every hot path once, on fixed inputs, for a tool that counts its instructions: benches/ratchet.py.
//!
//! Alone it runs them and prints their names. What is counted happens below [`counted`], after the
//! same work was done once before: finding out what the processor can do is no part of it.
#![allow(non_snake_case)]

use std::hint::black_box;

use nalgebra::{UnitQuaternion, Vector3};
use zerorate_benches::noise;
use zerorate_core::allan::{Kind as Deviation, Record, StreamingAllan, curves};
use zerorate_core::array::{ArrayParams, Fusion, GyroArray, Weights};
use zerorate_core::attitude::{
    Attitude, AttitudeParams, Auto, AutoOptions, Complementary, Ekf, Estimator, Frame, Kalman,
    Learning, Madgwick, Mahony, NamedOptions, Ukf,
};
use zerorate_core::calibrate::{Correction, ImuCorrector};
use zerorate_core::denoise::{Mode, Wavelet, WaveletDenoiser, WaveletParams, decompose};
use zerorate_core::identification::Estimator as Autoregression;
use zerorate_core::linear::{Batch, Known, LinearBank, Model};
use zerorate_core::navigation::foot::{FootFilter, FootParams};
use zerorate_core::navigation::{
    Adapt, Aid, AidParams, Fix, Inertial, Kind, LIMITS, Navigates, NavigationBank,
    NavigationFilter, NavigationParams, Observed, Reading, Record as Steps, Start,
};
use zerorate_core::stream::checkpoint::{self, Checkpoint};
use zerorate_core::stream::{Input, Output};
use zerorate_core::text::{Cell, Form};
use zerorate_core::{
    AutoFilter, AutoParams, Bank, Behaviour, DriftFilter, Method, Params, RestLimits, RobustFilter,
    RobustParams, Stream,
};

/// Samples of a path, shared among its channels.
const SAMPLES: usize = 1 << 14;

/// A path: its name, and what makes its work.
type Path = (String, Box<dyn Fn() -> Work>);
type Work = Box<dyn FnMut()>;

/// The work that is counted.
#[inline(never)]
fn counted(work: &mut Work) {
    work();
}

fn main() {
    for (name, make) in paths() {
        let mut work = make();
        work();
        counted(&mut work);
        println!("{name}");
    }
}

fn paths() -> Vec<Path> {
    let parts = [drift(), deviations(), orders(), attitudes(), navigation(), linear(), others()];
    parts.into_iter().flatten().collect()
}

fn path(name: impl Into<String>, make: impl Fn() -> Work + 'static) -> Path {
    (name.into(), Box::new(make))
}

/// One stream a channel over rows of numbers.
fn stream<S: Stream + Clone + Send + 'static>(stream: &S, channels: usize, rows: Vec<f64>) -> Work {
    let count = rows.len() / S::Input::NUMBERS;
    let mut bank = Bank::new(stream, channels).expect("memory for some channels");
    let mut numbers = vec![0.0; count * S::Output::NUMBERS];
    let mut flags = vec![false; count * S::Output::FLAGS];
    Box::new(move || bank.process(black_box(&rows), &mut numbers, &mut flags))
}

fn drift() -> Vec<Path> {
    let mut paths = Vec::new();
    for (learns, adapt_for) in [("learning", None), ("default", Some(1.0))] {
        for channels in [1, 3, 8, 64] {
            for method in [Method::Kf, Method::Akf, Method::Fading] {
                let filter = Params { method, adapt_for, ..Params::default() };
                let name = format!("{method:?}, {learns}, {}", beside(channels)).to_lowercase();
                paths.push(path(name, move || {
                    let filter = DriftFilter::<f64, 3, 4>::new(filter).expect("valid parameters");
                    stream(&filter, channels, noise(SAMPLES))
                }));
            }
            paths.push(path(format!("robust, {learns}, {}", beside(channels)), move || {
                let params = Params { method: Method::Akf, adapt_for, ..Params::default() };
                let filter = RobustFilter::<f64, 2, 2>::new(params, RobustParams::default());
                stream(&filter.expect("valid parameters"), channels, noise(SAMPLES))
            }));
        }
    }
    for channels in [1, 3, 8, 64] {
        paths.push(path(format!("auto, {}", beside(channels)), move || {
            stream(&auto(), channels, noise(SAMPLES))
        }));
    }
    paths
}

fn beside(channels: usize) -> String {
    if channels == 1 { "one channel".into() } else { format!("{channels} channels") }
}

fn auto() -> AutoFilter<f64> {
    let params = AutoParams { behaviour: Behaviour::default(), ..AutoParams::default() };
    AutoFilter::new(params).expect("valid parameters")
}

fn deviations() -> Vec<Path> {
    let kinds = [
        (Deviation::Oadev, SAMPLES),
        (Deviation::Ohdev, SAMPLES),
        (Deviation::Mdev, SAMPLES),
        (Deviation::Totdev, SAMPLES),
        (Deviation::Pdev, SAMPLES),
        (Deviation::Theo1, SAMPLES / 16),
        (Deviation::Mtotdev, SAMPLES / 16),
        (Deviation::Htotdev, SAMPLES / 16),
    ];
    let record = kinds.map(|(kind, n)| {
        path(format!("{kind:?} of a record").to_lowercase(), move || {
            let record = [Record::new(noise(n), 0)];
            let factors: Vec<usize> = (0..).map(|k| 1 << k).take_while(|m| *m <= n / 4).collect();
            Box::new(move || {
                black_box(curves(black_box(&record), kind, &factors, false));
            })
        })
    });
    let live = path("streaming deviations", || {
        let mut allan = StreamingAllan::new(100.0, 12).expect("the octaves are in range");
        let signal = noise(SAMPLES);
        Box::new(move || allan.run(black_box(&signal).iter().copied(), |()| {}))
    });
    record.into_iter().chain([live]).collect()
}

fn orders() -> Vec<Path> {
    let estimators = Autoregression::NAMES.map(|(estimator, name)| {
        path(format!("order of an autoregression, {name}"), move || {
            let record = noise(SAMPLES);
            Box::new(move || {
                black_box(estimator.variances(black_box(&record), 10, true)).expect("noise");
            })
        })
    });
    estimators.into_iter().collect()
}

/// Rows of a body that turns about all axes: gyro, accelerometer, magnetometer, and no bias.
/// A body that turns about all axes and is shaken, in gravity and in a field of the earth.
fn turning(n: usize, mag: bool) -> Vec<f64> {
    let mut turned = UnitQuaternion::identity();
    let mut row = |i: usize| {
        let t = i as f64 * 0.01;
        let rate = Vector3::new(t.sin(), (1.3 * t).cos(), (0.7 * t).sin());
        turned *= UnitQuaternion::from_scaled_axis(rate * 0.01);
        let force = Vector3::new(0.3 * t.sin(), 0.5 * (2.0 * t).cos(), 9.81);
        let field = Vector3::new(0.0, 20.0, -40.0) * if mag { 1.0 } else { f64::NAN };
        let seen = [rate, turned.inverse() * force, turned.inverse() * field];
        seen.map(<[f64; 3]>::from).into_iter().flatten().chain([f64::NAN])
    };
    (0..n).flat_map(&mut row).collect()
}

fn attitude<E>(name: &str, make: impl Fn(NamedOptions) -> E + Copy + 'static) -> [Path; 2]
where
    E: Estimator + Send + 'static,
    Attitude<E>: Stream + Clone,
{
    [(6, false), (9, true)].map(|(axes, mag)| {
        path(format!("attitude by {name}, {axes} axes"), move || {
            let (frame, unit) = (Frame::Enu, 1.0);
            let params = AttitudeParams {
                rate: 100.0,
                frame,
                mag,
                gyro_unit: unit,
                accel_unit: unit,
                gyro_range: None,
            };
            let estimator = make(NamedOptions { mag, ..NamedOptions::default() });
            let attitude = Attitude::new(params, estimator).expect("a rate");
            stream(&attitude, 1, turning(SAMPLES / 4, mag))
        })
    })
}

fn attitudes() -> Vec<Path> {
    let auto = attitude("auto", |options| {
        let options = AutoOptions { mag: options.mag, ..AutoOptions::default() };
        Auto::new(options).expect("the defaults")
    });
    let [_, learning] = attitude("auto that learns its magnetometer", |options| {
        let options = AutoOptions { mag: options.mag, ..AutoOptions::default() };
        let auto = Auto::new(options).expect("the defaults");
        Learning::new(auto, None).expect("no calibration")
    });
    let named = [
        attitude("complementary", |o| Complementary::new(o).expect("the defaults")),
        attitude("mahony", |o| Mahony::new(o).expect("the defaults")),
        attitude("madgwick", |o| Madgwick::new(o).expect("the defaults")),
        attitude("ekf", |o| Kalman::new(o).map(|it: Ekf| it).expect("the defaults")),
        attitude("ukf", |o| Kalman::new(o).map(|it: Ukf| it).expect("the defaults")),
    ];
    auto.into_iter().chain([learning]).chain(named.into_iter().flatten()).collect()
}

fn navigator() -> (Start, NavigationParams) {
    let params = NavigationParams {
        gyro_noise: [1e-6; 3],
        accel_noise: [4e-4; 3],
        gyro_walk: [1e-10; 3],
        accel_walk: [2.5e-7; 3],
        gyro_vibration: 0.0,
        antenna: [0.1, -0.2, -1.0],
        antenna_sigma: [0.0; 3],
        consider_antenna: false,
        wheels: None,
        gate: 50.0,
        adapt: Adapt::Inflate,
        covariance_step: 0.1,
        kind: Kind::Rate,
        aids: AidParams::default(),
        limits: LIMITS,
    };
    let start = Start {
        time: 0.0,
        quaternion: [1.0, 0.0, 0.0, 0.0],
        heading_known: true,
        course: false,
        latitude: 0.8,
        gyro_bias: [1e-3, -1e-3, 0.0],
        accel_bias: [0.0; 3],
        level_sigma: 5e-3,
        heading_sigma: 0.05,
        gyro_bias_sigma: 1e-4,
        accel_bias_sigma: 0.05,
    };
    (start, params)
}

fn filter() -> NavigationFilter {
    let (start, params) = navigator();
    NavigationFilter::new(start, params).expect("parameters in their ranges")
}

/// Ten samples after `time`, and a fix if there is one.
fn drive(nav: &mut impl Navigates, time: &mut f64, fixed: bool) {
    for _ in 0..10 {
        *time += 0.01;
        let (time, rest) = (*time, false);
        let sample = Inertial { time, gyro: [0.01, 0.0, -0.02], accel: [0.1, 0.0, -9.81], rest };
        nav.take_sample(0, &sample).expect("time goes on");
    }
    if fixed {
        let fix = Fix {
            time: *time,
            position: [0.8, 0.1, 100.0],
            velocity: [0.1, 0.0, 0.0],
            position_sigma: [2.0; 3],
            velocity_sigma: [0.1; 3],
        };
        nav.take_fix(&fix).expect("deviations are positive");
    }
}

/// A sample of a foot at 200 Hz that stands for half of each second, and swings.
fn stride(k: usize) -> [f64; 6] {
    let phase = (k % 200) as f64 / 100.0;
    let swing = if phase < 1.0 { (phase * std::f64::consts::PI).sin() } else { 0.0 };
    let wave = (phase * std::f64::consts::TAU).sin() * swing;
    [0.01, 0.02 + 12.0 * wave, 0.03, 8.0 * wave, 0.01, 9.81 + 6.0 * wave]
}

/// Ten samples after `time`, and a position or the reading of an aid.
fn aided(reading: Option<Reading>) -> impl Fn() -> Work {
    move || -> Work {
        let ((start, params), mut time) = (navigator(), 0.0);
        let mut nav = NavigationFilter::new(start, params).expect("parameters in their ranges");
        let step = move |nav: &mut NavigationFilter, time: &mut f64| {
            drive(nav, time, false);
            let Some(reading) = reading else {
                let (position, velocity) = ([0.8, 0.1, 100.0], [f64::NAN; 3]);
                let [position_sigma, velocity_sigma] = [[2.0; 3], [0.1; 3]];
                let fix = Fix { time: *time, position, velocity, position_sigma, velocity_sigma };
                nav.update_gnss(&fix).expect("deviations are positive");
                return;
            };
            let aid = Aid { time: *time, reading, sigma: [0.2; 3] };
            nav.update_aid(&aid).expect("deviations are positive");
        };
        drive(&mut nav, &mut time, true);
        step(&mut nav, &mut time);
        Box::new(move || (0..100).for_each(|_| step(&mut nav, &mut time)))
    }
}

fn navigation() -> Vec<Path> {
    let driven = |fixed: bool| {
        move || -> Work {
            let (mut filter, mut time) = (filter(), 0.0);
            let mut run = move |fixed: bool| {
                let observer = &mut Steps::default();
                drive(&mut Observed { filter: &mut filter, observer }, &mut time, fixed);
            };
            run(true);
            Box::new(move || (0..100).for_each(|_| run(fixed)))
        }
    };
    vec![
        path("navigation, 1000 samples", driven(false)),
        path("navigation, 1000 samples and 100 fixes", driven(true)),
        path("navigation, 1000 samples and 100 positions", aided(None)),
        path("navigation, 1000 samples and 100 heights", aided(Some(Reading::Height(90.0)))),
        path("navigation, 1000 samples and 100 headings", aided(Some(Reading::Heading(0.01)))),
        path(
            "navigation, 1000 samples and 100 baselines",
            aided(Some(Reading::Baseline([1.0, 0.0, 0.0], Some([1.0, 0.0, 0.0])))),
        ),
        path("navigation bank, 1000 samples and 100 fixes", || {
            let (start, params) = navigator();
            let mut bank = NavigationBank::new(start, params).expect("parameters in their ranges");
            let mut time = 0.0;
            Box::new(move || (0..100).for_each(|_| drive(&mut bank, &mut time, true)))
        }),
        path("foot, live, 1000 samples", || {
            let params = FootParams { rate: 200.0, level: true, gyro_range: Some(9.0) };
            let mut foot = FootFilter::new(params).expect("a foot");
            let strides: Vec<[f64; 6]> = (0..1000).map(stride).collect();
            Box::new(move || {
                for sample in black_box(&strides) {
                    black_box(foot.update(*sample));
                }
            })
        }),
        path("navigation, 100 steps of the smoother", || {
            let (mut filter, mut time, mut steps) = (filter(), 0.0, Steps::default());
            (0..100).for_each(|_| {
                let mut observed = Observed { filter: &mut filter, observer: &mut steps };
                drive(&mut observed, &mut time, true);
            });
            Box::new(move || {
                let all = black_box(&steps).smoothed(true);
                black_box(all.map(|step| step.sample).sum::<usize>());
            })
        }),
    ]
}

/// n states that pass on to each other, of which the first m are measured.
fn model(n: usize, m: usize) -> Model {
    let matrix = |rows: usize, columns: usize, element: fn(usize, usize) -> f64| -> Vec<f64> {
        (0..rows * columns).map(|place| element(place / columns, place % columns)).collect()
    };
    Model {
        sizes: [n, m, 0],
        F: matrix(n, n, |i, j| if i == j { 0.9 } else { 0.01 }),
        H: matrix(m, n, |i, j| if i == j { 1.0 } else { 0.0 }),
        Q: matrix(n, n, |i, j| if i == j { 0.01 } else { 0.0 }),
        R: matrix(m, m, |i, j| if i == j { 1.0 } else { 0.1 }),
        B: Vec::new(),
    }
}

fn linear() -> Vec<Path> {
    let sizes = [(2, 1), (4, 2), (6, 3), (9, 3), (10, 5)].map(|(n, m)| {
        path(format!("linear, {n} states, {m} measurements"), move || {
            let bank = LinearBank::new(model(n, m), None, None, None);
            let (mut bank, steps) = (bank.expect("a model"), 1000);
            let z = noise(steps * m);
            Box::new(move || {
                let z = black_box(&z);
                let batch = Batch { steps, predicts: true, corrects: true, z, ..Batch::default() };
                bank.run(&batch, &mut Known::nothing());
            })
        })
    });
    sizes.into_iter().collect()
}

fn array_of_eight() -> GyroArray<3> {
    let params = ArrayParams {
        rate: 100.0,
        sensors: 8,
        labels: (0..8).map(|i| i.to_string()).collect(),
        rotations: None,
        corrections: None,
        limit: None,
        limits: RestLimits::default(),
        weights: Weights::Auto,
        scale_error: 0.01,
        fusion: Fusion::Voted,
    };
    GyroArray::new(params).expect("valid parameters")
}

fn others() -> Vec<Path> {
    vec![
        path("2000 rows of seven numbers as text", || {
            let row =
                |row: &[f64]| row.iter().map(|z| format!("{z:.5}")).collect::<Vec<_>>().join(",");
            let rows: Vec<String> = noise(7 * 2000).chunks(7).map(row).collect();
            let (text, mut out) = (rows.join("\n"), vec![vec![0.0; 2000]; 7]);
            let cells = (0..7).map(Cell::Double).collect();
            let form = Form { delimiter: Some(b','), point: b'.', cells, missing: Vec::new() };
            Box::new(move || {
                let columns = out.iter_mut().map(Vec::as_mut_slice).collect();
                assert!(form.read(black_box(text.as_bytes()), columns, false));
            })
        }),
        path("array of eight gyros", || {
            let (mut array, rows) = (array_of_eight(), noise(24 * SAMPLES / 8));
            Box::new(move || {
                let mut rate = [0.0; 3];
                for row in black_box(&rows).chunks_exact(24) {
                    array.update(row, &mut rate);
                    black_box(rate);
                }
            })
        }),
        path("calibration of six axes", || {
            let correction = Correction { g_sensitivity: [[1e-3; 3]; 3], ..Correction::default() };
            let corrector = ImuCorrector::<6>::new(correction).expect("finite numbers");
            stream(&corrector, 1, noise(6 * SAMPLES))
        }),
        path("wavelets, live", || {
            let (wavelet, mode) = (Wavelet::Db4, Mode::Hard);
            let params = WaveletParams { rate: 100.0, wavelet, level: 5, mode, threshold: 4.0 };
            let denoiser = WaveletDenoiser::new(params).expect("valid parameters");
            stream(&denoiser, 1, noise(SAMPLES))
        }),
        path("wavelets of a record", || {
            let record = noise(SAMPLES);
            Box::new(move || {
                black_box(decompose(black_box(&record), Wavelet::Db4, 5));
            })
        }),
        path("checkpoint of 64 channels", || {
            let bank = Bank::new(&auto(), 64).expect("memory for some channels");
            Box::new(move || saved_and_restored(&bank))
        }),
    ]
}

fn saved_and_restored<S: Checkpoint>(bank: &Bank<S>) {
    let bytes = checkpoint::save(Some(bank.streams().len()), bank).expect("memory for some states");
    black_box(checkpoint::restore::<S>(&bytes)).expect("what was saved");
}
