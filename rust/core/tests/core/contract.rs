//! The contract of a stream, shown on a filter of three axes that returns rates and a flag: what it
//! has for the lines that it takes.

use crate::common::{any_sample, drifting, restored};
use proptest::prelude::*;
use serde::{Deserialize, Serialize};
use zerorate_core::checkpoint::{self, Checkpoint};
use zerorate_core::stream::{Field, Output, Shape, Traced};
use zerorate_core::{Bank, Error, Stream};

// From here to the next such line: the filter, whole.

/// Rates without the mean of the samples to date, and whether the body turns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Centred {
    threshold: f64,
    samples: u32,
    mean: [f64; 3],
    turning: bool,
}

/// Three rates and a flag.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Rates {
    rates: [f64; 3],
    turning: bool,
}

impl Output for Rates {
    const FIELDS: &'static [Field] = &[
        Field { name: "rates", shape: Shape::Vector(3) },
        Field { name: "turning", shape: Shape::Flag },
    ];

    fn write(self, numbers: &mut [f64], flags: &mut [bool]) {
        numbers.copy_from_slice(&self.rates);
        flags[0] = self.turning;
    }
}

impl Stream for Centred {
    type Input = [f64; 3];
    type Output = Rates;

    fn update(&mut self, z: [f64; 3]) -> Rates {
        if z.iter().all(|rate| rate.is_finite()) {
            self.samples = self.samples.saturating_add(1);
            let share = 1.0 / f64::from(self.samples);
            self.mean = [0, 1, 2].map(|i| self.mean[i] + (z[i] - self.mean[i]) * share);
        }
        let rates = [0, 1, 2].map(|i| z[i] - self.mean[i]);
        self.turning = rates.iter().any(|rate| rate.abs() > self.threshold);
        Rates { rates, turning: self.turning }
    }

    fn reset(&mut self) {
        *self = Self { samples: 0, mean: [0.0; 3], turning: false, ..*self };
    }
}

impl Checkpoint for Centred {
    const TAG: &'static str = "test-centred";
    const VERSION: u16 = 1;

    fn is_valid(&self) -> bool {
        self.threshold >= 0.0
    }
}

// Its end.

impl Traced for Centred {
    type Snapshot = [f64; 3];

    fn snapshot(&self) -> [f64; 3] {
        self.mean
    }
}

fn new() -> Centred {
    Centred { threshold: 1.0, samples: 0, mean: [0.0; 3], turning: false }
}

fn bank(channels: usize) -> Bank<Centred> {
    Bank::new(&new(), channels).expect("memory for some channels")
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_bits()).collect()
}

/// Rows through a bank: numbers and flags.
fn through(bank: &mut Bank<Centred>, rows: &[f64], threads: usize) -> (Vec<f64>, Vec<bool>) {
    let (mut numbers, mut flags) = (vec![0.0; rows.len()], vec![false; rows.len() / 3]);
    bank.process_on_threads(rows, &mut numbers, &mut flags, threads).expect("memory for some rows");
    (numbers, flags)
}

/// Every sample through streams of their own, one after the other.
fn one_by_one(channels: usize, rows: &[f64]) -> (Vec<f64>, Vec<bool>) {
    let mut streams = vec![new(); channels];
    let samples = rows.as_chunks::<3>().0.iter().enumerate();
    let outputs: Vec<Rates> = samples.map(|(i, z)| streams[i % channels].update(*z)).collect();
    (
        outputs.iter().flat_map(|output| output.rates).collect(),
        outputs.iter().map(|output| output.turning).collect(),
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn pieces_channels_and_checkpoints_agree(
        samples in prop::collection::vec(any_sample(), 600),
        channels in 1usize..5,
        part in 0.0..1.0,
    ) {
        let rows = &samples[..600 / (3 * channels) * 3 * channels];
        let expected = one_by_one(channels, rows);
        let at = (rows.len() as f64 * part) as usize / (3 * channels) * 3 * channels;
        let mut first = bank(channels);
        let (mut numbers, mut flags) = through(&mut first, &rows[..at], 1);
        let bytes = checkpoint::save(Some(channels), &first).expect("a bank can be saved");
        let (_, mut second) = checkpoint::restore::<Centred>(&bytes).expect("and restored");
        let rest = through(&mut second, &rows[at..], 1);
        numbers.extend(rest.0);
        flags.extend(rest.1);
        prop_assert_eq!(bits(&numbers), bits(&expected.0));
        prop_assert_eq!(flags, expected.1);
    }
}

/// Enough samples for threads to be worth their while.
#[test]
fn threads_give_the_same() {
    let rows = drifting(5 * 3 * 40_000, 3);
    let alone = through(&mut bank(5), &rows, 1);
    assert_eq!(bits(&alone.0), bits(&one_by_one(5, &rows).0));
    for threads in [2, 3, 64] {
        let spread = through(&mut bank(5), &rows, threads);
        assert_eq!(bits(&spread.0), bits(&alone.0));
        assert_eq!(spread.1, alone.1);
    }
}

#[test]
fn batches_traces_and_resets_come_with_it() {
    let samples: Vec<[f64; 3]> = drifting(300, 1).as_chunks::<3>().0.to_vec();
    let (mut stream, mut outputs) = (new(), vec![Rates::default(); samples.len()]);
    stream.process(&samples, &mut outputs);
    assert_eq!(outputs.last().map(|output| output.turning), Some(stream.turning));
    assert_eq!(restored(&stream), stream);

    let mut bank = bank(1);
    let mut means = vec![0.0; 300];
    bank.trace(samples.as_flattened(), &mut means, &mut []);
    assert_eq!(means[297..], stream.mean);
    bank.reset();
    assert_eq!(bank.streams(), [new()]);
}

#[test]
fn more_channels_than_memory_are_an_error() {
    for channels in [1 << 44, 1 << 62, usize::MAX] {
        let refused = Bank::new(&new(), channels).map(|_| ());
        assert!(matches!(refused, Err(Error::Memory { .. })));
    }
}

#[test]
fn another_type_is_refused_by_name() {
    let error = checkpoint::restore::<zerorate_core::RestDetector<f64>>(
        &checkpoint::save(None, &bank(1)).expect("a bank can be saved"),
    );
    let text = error.expect_err("another type").to_string();
    assert_eq!(
        text,
        "checkpoint holds 'test-centred' version 1, expected 'rest-detector' version 4"
    );
}
