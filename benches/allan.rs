//! Time a sample of deviations of a record at averaging factors an octave apart.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use zerorate_benches::noise;
use zerorate_core::allan::{Kind, Record, curves};

const N: usize = 1_000_000;

fn octaves(longest: usize) -> Vec<usize> {
    std::iter::successors(Some(1), |m| Some(2 * m)).take_while(|m| *m <= longest).collect()
}

fn deviations(c: &mut Criterion, kind: Kind, n: usize) {
    let record = Record::new(noise(n), 0);
    let factors = octaves(n / 4);
    let mut group = c.benchmark_group("deviations");
    group.throughput(Throughput::Elements(n as u64)).sample_size(10);
    group.bench_function(BenchmarkId::new(format!("{kind:?}"), n), |b| {
        b.iter(|| curves(black_box(std::slice::from_ref(&record)), kind, &factors, false));
    });
    group.finish();
}

fn record(c: &mut Criterion) {
    let samples = noise(N);
    c.bench_function("phase of a record", |b| {
        b.iter(|| Record::new(black_box(samples.clone()), 0));
    });
}

fn kinds(c: &mut Criterion) {
    for kind in [Kind::Oadev, Kind::Ohdev, Kind::Mdev, Kind::Totdev, Kind::Pdev] {
        deviations(c, kind, N);
    }
    for kind in [Kind::Theo1, Kind::Mtotdev, Kind::Htotdev] {
        deviations(c, kind, N / 100);
    }
}

criterion_group!(benches, record, kinds);
criterion_main!(benches);
