//! A bank of navigation filters: rows of samples and fixes of several vehicles.

use crate::navigation::filter;
use zerorate_core::navigation::{Adapt, Kind, NavigationFilter, Snapshot};
use zerorate_core::stream::Output;
use zerorate_core::{Bank, checkpoint};

/// The numbers of an event: a fix after every seventh sample.
fn event(k: usize, more: f64) -> [f64; 14] {
    let (time, nan) = (0.05 * (k / 8 * 7 + (k % 8).min(6) + 1) as f64, f64::NAN);
    if k % 8 == 7 {
        let place = [0.8 + 1e-7 * more, 3.1, 100.0, 0.1 * more, 0.0, nan];
        let [n, e, h, north, east, down] = place;
        return [1.0, time, n, e, h, north, east, down, 2.0, 2.0, 2.0, 0.1, 0.1, 0.1];
    }
    let still = f64::from(u8::from(k % 11 > 5));
    [0.0, time, more, 0.0, -0.5 * more, 0.5 * more, more, -9.81, still, nan, nan, nan, nan, nan]
}

/// The answers of a bank to rows of events of two vehicles.
fn answers(bank: &mut Bank<NavigationFilter>, rows: &[f64]) -> Vec<u64> {
    let mut numbers = vec![0.0; rows.len() / 14 * Snapshot::NUMBERS];
    bank.process(rows, &mut numbers, &mut []);
    numbers.iter().map(|x: &f64| x.to_bits()).collect()
}

#[test]
fn a_bank_takes_samples_and_fixes() {
    let rows: Vec<f64> = (0..400).flat_map(|k| [event(k, 0.1), event(k, -0.2)]).flatten().collect();
    let new = filter(false, Adapt::Inflate, Kind::Rate);
    let mut whole = Bank::new(&new, 2).expect("there is memory for two");
    let expected = answers(&mut whole, &rows);
    let counts = whole.streams()[0].fixes();
    assert_eq!(counts.used + counts.rejected + counts.refused, 50);
    assert_ne!(whole.streams()[0], whole.streams()[1]);
    // In two parts, saved between, and each alone.
    let mut parts = Bank::new(&new, 2).expect("there is memory for two");
    let (first, second) = rows.split_at(2 * 14 * 151);
    let mut got = answers(&mut parts, first);
    let bytes = checkpoint::save(Some(2), &parts).expect("a bank can be saved");
    let (_, mut parts) = checkpoint::restore(&bytes).expect("and restored");
    got.extend(answers(&mut parts, second));
    assert!(got == expected);
    for channel in 0..2 {
        let own: Vec<f64> = rows.chunks(14).skip(channel).step_by(2).flatten().copied().collect();
        let mut alone = Bank::new(&new, 1).expect("there is memory for one");
        let expected: Vec<u64> = expected
            .chunks(Snapshot::NUMBERS)
            .skip(channel)
            .step_by(2)
            .flatten()
            .copied()
            .collect();
        assert!(answers(&mut alone, &own) == expected);
    }
    whole.reset();
    assert_eq!(answers(&mut whole, &rows), expected);
}
