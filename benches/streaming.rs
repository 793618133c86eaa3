//! Time a sample of `StreamingAllan` by octaves, a batch, which takes blocks, and one by one; and of
//! `RestDetector`, the ends of ticks included.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use zerorate_benches::noise;
use zerorate_core::allan::StreamingAllan;
use zerorate_core::{RestDetector, RestLimits, Stream};

const N: usize = 1 << 20;

/// Times `take` on white noise, with a ring that is full already.
fn streaming(c: &mut Criterion, name: &str, octaves: usize, take: fn(&mut StreamingAllan, &[f64])) {
    let signal = noise(N);
    let mut allan = StreamingAllan::new(100.0, octaves).expect("the octaves are in range");
    batch(&mut allan, &signal);
    let mut group = c.benchmark_group("streaming");
    group.throughput(Throughput::Elements(N as u64)).sample_size(10);
    group.bench_function(BenchmarkId::new(name, octaves), |b| {
        b.iter(|| take(&mut allan, black_box(&signal)));
    });
    group.finish();
}

fn batch(allan: &mut StreamingAllan, signal: &[f64]) {
    allan.run(signal.iter().copied(), |()| {});
}

fn octaves(c: &mut Criterion) {
    for octaves in [8, 12, 16, 20] {
        streaming(c, "batch, octaves", octaves, batch);
    }
    streaming(c, "one by one, octaves", 16, |allan, signal| {
        for z in signal {
            allan.observe(*z);
        }
    });
}

fn rest(c: &mut Criterion) {
    let signal = noise(N);
    let mut group = c.benchmark_group("rest");
    group.throughput(Throughput::Elements(N as u64)).sample_size(10);
    for rate in [100.0, 1000.0] {
        let mut detector = RestDetector::new(rate, RestLimits::default()).expect("a rate");
        group.bench_function(BenchmarkId::new("one by one, Hz", rate), |b| {
            b.iter(|| {
                for z in black_box(&signal) {
                    black_box(detector.observe(*z));
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, octaves, rest);
criterion_main!(benches);
