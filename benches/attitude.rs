//! Time a sample of `Attitude`: the default filter with six and nine axes, at rates where ticks
//! are frequent and rare; the named methods.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use zerorate_core::attitude::{Attitude, AttitudeParams, Auto, AutoOptions, Frame, Sample};
use zerorate_core::{Bank, Stream};

const N: usize = 1 << 17;

/// A body that turns about all axes.
fn rows(mag: bool) -> Vec<f64> {
    let row = |i: usize| {
        let t = i as f64 * 0.01;
        let field = if mag { 1.0 } else { f64::NAN };
        [
            t.sin(),
            (1.3 * t).cos(),
            (0.7 * t).sin(),
            0.3 * t.sin(),
            0.5 * (2.0 * t).cos(),
            9.81,
            field * 20.0 * t.cos(),
            field * 20.0 * t.sin(),
            field * -40.0,
            f64::NAN,
        ]
    };
    (0..N).flat_map(row).collect()
}

fn filter(rate: f64, mag: bool) -> Attitude<Auto> {
    let (frame, unit) = (Frame::Enu, 1.0);
    let params =
        AttitudeParams { rate, frame, mag, gyro_unit: unit, accel_unit: unit, gyro_range: None };
    let auto = Auto::new(AutoOptions { mag, ..AutoOptions::default() }).expect("the defaults");
    Attitude::new(params, auto).expect("a rate")
}

fn batch(c: &mut Criterion) {
    let mut group = c.benchmark_group("attitude");
    group.throughput(Throughput::Elements(N as u64)).sample_size(10);
    for (axes, mag) in [(6, false), (9, true)] {
        let rows = rows(mag);
        let mut out = vec![0.0; 4 * N];
        for rate in [100.0, 286.0, 8000.0] {
            let mut bank = Bank::of(vec![filter(rate, mag)]);
            let name = BenchmarkId::new(format!("batch, {axes} axes, Hz"), rate);
            group.bench_function(name, |b| {
                b.iter(|| bank.process(black_box(&rows), &mut out, &mut []));
            });
        }
    }
    group.finish();
}

fn one_by_one(c: &mut Criterion) {
    let mut group = c.benchmark_group("attitude");
    group.throughput(Throughput::Elements(N as u64)).sample_size(10);
    let samples: Vec<Sample> =
        rows(true).chunks_exact(10).map(<Sample as zerorate_core::stream::Input>::read).collect();
    let mut attitude = filter(100.0, true);
    group.bench_function("one by one, 9 axes, 100 Hz", |b| {
        b.iter(|| {
            for sample in &samples {
                black_box(attitude.update(*black_box(sample)));
            }
        });
    });
    group.finish();
}

criterion_group!(benches, batch, one_by_one);
criterion_main!(benches);
