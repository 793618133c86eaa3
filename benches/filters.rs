//! Time a sample of every filter of the core, on white noise at rest. A run on one second, one hour
//! and one day at 100 Hz shows that the cost a sample does not grow.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use zerorate_benches::noise;
use zerorate_core::allan::{AllanKind, AllanNoise};
use zerorate_core::{
    Bank, DriftFilter, Method, Params, RecursiveLeastSquares, RlsParams, RobustFilter,
    RobustParams, Stream,
};

const HOUR: usize = 360_000;

fn always_learning(method: Method) -> Params {
    Params { method, adapt_for: None, ..Params::default() }
}

/// Times `process` of a fresh copy of `filter` on `n` samples.
fn process<F>(c: &mut Criterion, group: &str, name: &str, filter: F, n: usize)
where
    F: Stream<Input = f64, Output = f64> + Copy,
{
    let signal = noise(n);
    let mut group = c.benchmark_group(group);
    group.throughput(Throughput::Elements(n as u64)).sample_size(10);
    group.bench_function(BenchmarkId::new(name, n), |b| {
        let mut outputs = vec![0.0; n];
        b.iter(|| {
            let mut filter = filter;
            filter.process(black_box(&signal), black_box(&mut outputs));
        });
    });
    group.finish();
}

fn drift<const N: usize, const M: usize>(params: Params) -> DriftFilter<f64, N, M> {
    DriftFilter::new(params).expect("valid parameters")
}

fn lengths(c: &mut Criterion) {
    for n in [100, HOUR, 24 * HOUR] {
        process(c, "default", "fading (2,1)", drift::<3, 4>(Params::default()), n);
    }
}

fn methods_and_orders(c: &mut Criterion) {
    for method in [Method::Kf, Method::Akf, Method::Fading] {
        let name = format!("{method:?} (2,1)");
        process(c, "learning", &name, drift::<3, 4>(always_learning(method)), HOUR);
    }
    let params = always_learning(Method::Fading);
    process(c, "learning", "Fading (1,0)", drift::<2, 2>(params), HOUR);
    process(c, "learning", "Fading (1,1)", drift::<2, 3>(params), HOUR);
    process(c, "learning", "Fading (3,3)", drift::<4, 7>(params), HOUR);
}

fn robust(c: &mut Criterion) {
    let params = always_learning(Method::Akf);
    let filter = RobustFilter::<f64, 2, 2>::new(params, RobustParams::default());
    process(c, "robust", "Akf (1,0)", drift::<2, 2>(params), HOUR);
    process(c, "robust", "robust (1,0)", filter.expect("valid parameters"), HOUR);
}

fn parts(c: &mut Criterion) {
    let allan = AllanNoise::new(0.97, AllanKind::Allan, 0.0).expect("valid parameters");
    process(c, "parts", "Allan noise", allan, HOUR);
    let model =
        RecursiveLeastSquares::<f64, 3, 4>::new(RlsParams::default()).expect("valid parameters");
    process(c, "parts", "least squares (2,1)", model, HOUR);
}

fn channels(c: &mut Criterion) {
    let signal = noise(3 * HOUR);
    let mut group = c.benchmark_group("channels");
    group.throughput(Throughput::Elements(HOUR as u64)).sample_size(10);
    for k in [1, 3] {
        group.bench_function(BenchmarkId::new("rows of", k), |b| {
            let rows = &signal[..k * HOUR];
            let mut outputs = vec![0.0; rows.len()];
            let fresh =
                Bank::new(&drift::<3, 4>(Params::default()), k).expect("memory for some channels");
            b.iter(|| fresh.clone().process(black_box(rows), black_box(&mut outputs), &mut []));
        });
    }
    group.finish();
}

criterion_group!(benches, lengths, methods_and_orders, robust, parts, channels);
criterion_main!(benches);
