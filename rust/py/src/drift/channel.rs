//! The filter of one channel, whichever it is.
#![allow(non_snake_case)]

use serde::Serialize;
use serde::de::DeserializeOwned;
use zerorate_core::checkpoint::{Kind, Label};
use zerorate_core::{AutoFilter, DriftFilter, MotionSafe, SideBySide, Snapshot, Status};

use super::any::label;
use super::settings::Settings;
use super::start::Known;
use super::trace::{Readings, Record};

/// What the bindings ask of a filter besides samples.
pub trait Channel:
    SideBySide<f64> + Clone + Send + Sync + Serialize + DeserializeOwned + std::fmt::Debug + 'static
{
    /// What it is called in a checkpoint.
    fn label() -> Label;
    fn settings(&self) -> Settings;
    fn samples_seen(&self) -> u64;
    fn guard_count(&self) -> u64;
    fn ready(&self) -> bool;
    fn status(&self) -> &'static str;
    fn readings(&self) -> Readings;
    /// Densities of the white noise and of the drift's walk, NaN where they are not known.
    fn densities(&self) -> [f64; 2];
    fn record(&self, record: &mut Record);
    /// What it was started with, if it did not learn that itself.
    fn start(&self) -> Option<Known> {
        None
    }
    /// Forgets the drift but not the noise; false if it can't.
    fn power_on(&mut self) -> bool {
        false
    }
}

impl<const N: usize, const M: usize> Channel for DriftFilter<f64, N, M> {
    fn label() -> Label {
        label(Kind::DriftFilter, N, M)
    }

    fn settings(&self) -> Settings {
        let conduct = zerorate_core::Conduct { hold: false, compensated: false };
        Settings::Published { order: (N - 1, M - N), params: *self.params(), conduct }
    }

    fn samples_seen(&self) -> u64 {
        self.samples_seen()
    }

    fn guard_count(&self) -> u64 {
        self.guard_count()
    }

    fn ready(&self) -> bool {
        self.ready()
    }

    fn status(&self) -> &'static str {
        published_status(self.ready(), true)
    }

    fn densities(&self) -> [f64; 2] {
        published_densities(self)
    }

    fn readings(&self) -> Readings {
        Readings::of(&self.snapshot())
    }

    fn record(&self, record: &mut Record) {
        record.push(&self.snapshot());
    }

    fn start(&self) -> Option<Known> {
        self.start().map(Known::from)
    }
}

impl<const N: usize, const M: usize> Channel for MotionSafe<f64, N, M> {
    fn label() -> Label {
        label(Kind::MotionSafe, N, M)
    }

    fn settings(&self) -> Settings {
        let params = *self.filter().params();
        Settings::Published { order: (N - 1, M - N), params, conduct: self.conduct() }
    }

    fn samples_seen(&self) -> u64 {
        self.samples_seen()
    }

    fn guard_count(&self) -> u64 {
        self.filter().guard_count()
    }

    fn ready(&self) -> bool {
        self.filter().ready()
    }

    fn status(&self) -> &'static str {
        published_status(self.ready(), self.snapshot().at_rest)
    }

    fn densities(&self) -> [f64; 2] {
        published_densities(self.filter())
    }

    fn readings(&self) -> Readings {
        Readings::of(&self.snapshot())
    }

    fn record(&self, record: &mut Record) {
        record.push(&self.snapshot());
    }

    fn start(&self) -> Option<Known> {
        self.filter().start().map(Known::from)
    }
}

impl Channel for AutoFilter<f64> {
    fn label() -> Label {
        Label { kind: Kind::AutoFilter, p: 0, q: 0 }
    }

    fn settings(&self) -> Settings {
        Settings::Auto(*self.params())
    }

    fn samples_seen(&self) -> u64 {
        self.samples_seen()
    }

    fn guard_count(&self) -> u64 {
        0
    }

    fn ready(&self) -> bool {
        self.ready()
    }

    fn status(&self) -> &'static str {
        match self.status() {
            Status::Starting => "starting",
            Status::AtRest => "at rest",
            Status::InMotion => "in motion",
            Status::NoRestYet => "no rest yet",
        }
    }

    fn densities(&self) -> [f64; 2] {
        let rate = self.params().rate;
        self.noise().map_or([f64::NAN; 2], |(R, G)| [(R / rate).sqrt(), (G * rate).sqrt()])
    }

    fn readings(&self) -> Readings {
        Readings::of(&self.snapshot())
    }

    fn record(&self, record: &mut Record) {
        record.push::<1, 1>(&self.snapshot());
    }

    fn power_on(&mut self) -> bool {
        self.power_on();
        true
    }
}

/// R is the white noise; the drift is no walk.
fn published_densities<const N: usize, const M: usize>(
    filter: &DriftFilter<f64, N, M>,
) -> [f64; 2] {
    let ready = filter.ready();
    let R = if ready { filter.snapshot().measurement_noise } else { f64::NAN };
    [(R / filter.params().rate).sqrt(), f64::NAN]
}

fn published_status(ready: bool, at_rest: bool) -> &'static str {
    match (at_rest, ready) {
        (true, true) => "at rest",
        (true, false) => "starting",
        (false, true) => "in motion",
        (false, false) => "no rest yet",
    }
}

impl Readings {
    fn of<const N: usize, const M: usize>(now: &Snapshot<f64, N, M>) -> Self {
        // Column after column equals row after row: the matrices are symmetric.
        Self {
            estimate: now.estimate,
            innovation: now.innovation,
            innovation_variance: now.innovation_variance,
            measurement_noise: now.measurement_noise,
            bias: now.bias,
            bias_sigma: now.bias_sigma,
            at_rest: now.at_rest,
            gain: now.gain.as_slice().to_vec(),
            process_noise: now.process_noise.as_slice().to_vec(),
            coefficients: now.coefficients.as_slice().to_vec(),
            covariance: now.covariance.as_slice().to_vec(),
        }
    }
}
