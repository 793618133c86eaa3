//! Attitudes of every method behind one trait: each type of the core becomes a value here.

use std::any::Any;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use zerorate_core::attitude::{
    Attitude, AttitudeParams, Auto, AutoOptions, Compass, Complementary, Ekf, FieldCorrection,
    LearnedIron, Learning, METHODS, Madgwick, Mahony, Named, NamedOptions, Reading, Smoothed,
    Snapshot, Tagged, Ukf,
};
use zerorate_core::checkpoint;
use zerorate_core::stream::{Output, Parts, sizes};
use zerorate_core::{Bank, Error, memory};

use super::samples::Columns;

use crate::common::errors::NativeError;
use crate::common::streaming::{AnyBank, quoted};

/// Number of rows whose outputs are separated at once.
const RECORDS: usize = 256;

/// A bank of attitudes by one method.
pub trait AttitudeBank: AnyBank {
    fn params(&self) -> &AttitudeParams;
    fn method(&self) -> &'static str;
    fn options(&self) -> NamedOptions;
    /// True if scale and misalignment of the gyro were given.
    fn is_calibrated(&self) -> bool;
    /// Bias limit of the gyro, rad/s, if it is not the default.
    fn bias_limit(&self) -> Option<f64>;
    /// True if a hard iron is subtracted from the magnetometer first.
    fn is_corrected(&self) -> bool;
    /// Hard iron that each body learns for its magnetometer, if it learns.
    fn irons(&self) -> Option<Vec<LearnedIron>>;
    fn readings(&self) -> Vec<Reading>;
    fn samples_seen(&self) -> u64;
    /// Number of each body's rates that were left out.
    fn rates_left_out(&self) -> Vec<u64>;
    fn wrong_gravity(&self) -> Option<f64>;
    /// Writes the state after each sample.
    fn trace(&mut self, rows: &[f64], parts: &mut Parts) -> Result<(), Error>;
    /// The smoothed samples of a record.
    fn smooth(&self, columns: &Columns<'_>, n: usize) -> Result<Parts, Error>;
    /// True if the method has a smoother.
    fn smooths(&self) -> bool;
    fn power_on(&mut self);
    fn align(&mut self, orientations: &[[f64; 4]], tilt_sigma: f64, heading_sigma: f64);
}

impl<E> AttitudeBank for Bank<Attitude<E>>
where
    E: Named + Clone + Send + Sync + 'static,
{
    fn params(&self) -> &AttitudeParams {
        self.streams()[0].params()
    }

    fn method(&self) -> &'static str {
        E::METHOD
    }

    fn options(&self) -> NamedOptions {
        self.streams()[0].estimator().options()
    }

    fn is_calibrated(&self) -> bool {
        self.streams()[0].estimator().is_calibrated()
    }

    fn bias_limit(&self) -> Option<f64> {
        self.streams()[0].estimator().bias_limit()
    }

    fn is_corrected(&self) -> bool {
        self.streams()[0].estimator().correction().is_some()
    }

    fn irons(&self) -> Option<Vec<LearnedIron>> {
        self.streams().iter().map(|body| body.estimator().iron()).collect()
    }

    fn readings(&self) -> Vec<Reading> {
        self.streams().iter().map(Attitude::reading).collect()
    }

    fn samples_seen(&self) -> u64 {
        self.streams()[0].samples_seen()
    }

    fn rates_left_out(&self) -> Vec<u64> {
        self.streams().iter().map(Attitude::rates_left_out).collect()
    }

    fn wrong_gravity(&self) -> Option<f64> {
        self.streams().iter().find_map(Attitude::wrong_gravity)
    }

    fn trace(&mut self, rows: &[f64], parts: &mut Parts) -> Result<(), Error> {
        let (channels, width) = (self.channels(), self.width() * self.channels());
        parts.add_rows(channels, rows, width, |rows, numbers, flags| {
            Bank::trace(self, rows, numbers, flags);
        })
    }

    fn smooth(&self, columns: &Columns<'_>, n: usize) -> Result<Parts, Error> {
        let any: &dyn Any = self;
        let mut bodies: Vec<Smoothed> = memory::room(self.channels())?;
        for k in 0..self.channels() {
            let samples = columns.samples(k, n)?;
            if let Some(bank) = any.downcast_ref::<Bank<Attitude<Auto>>>() {
                bodies.push(bank.streams()[k].smooth(samples)?);
            } else if let Some(bank) = any.downcast_ref::<Bank<Attitude<Compass>>>() {
                bodies.push(bank.streams()[k].smooth(samples)?);
            } else if let Some(bank) = any.downcast_ref::<Bank<Attitude<Learning>>>() {
                bodies.push(bank.streams()[k].smooth(samples)?);
            } else {
                return Parts::new(fields(), 0);
            }
        }
        side_by_side(bodies, n)
    }

    fn smooths(&self) -> bool {
        E::METHOD == METHODS[0]
    }

    fn power_on(&mut self) {
        self.streams_mut().iter_mut().for_each(Attitude::power_on);
    }

    fn align(&mut self, orientations: &[[f64; 4]], tilt_sigma: f64, heading_sigma: f64) {
        for (body, orientation) in self.streams_mut().iter_mut().zip(orientations) {
            body.align(*orientation, tilt_sigma, heading_sigma);
        }
    }
}

/// The parts of the state after a sample.
pub fn fields() -> &'static [zerorate_core::stream::Field] {
    Snapshot::FIELDS
}

/// The smoothed samples of each body, sample by sample.
fn side_by_side(mut bodies: Vec<Smoothed>, n: usize) -> Result<Parts, Error> {
    let (numbers, flags) = sizes(fields());
    let mut parts = Parts::new(fields(), n * bodies.len())?;
    let records = RECORDS.min(n) * bodies.len();
    let (mut all, mut marks) =
        (memory::filled(0.0, records * numbers)?, vec![false; records * flags]);
    for first in (0..n).step_by(RECORDS) {
        let rows = RECORDS.min(n - first);
        let (all, marks) =
            (&mut all[..rows * bodies.len() * numbers], &mut marks[..rows * bodies.len() * flags]);
        let mut places = all.chunks_exact_mut(numbers).zip(marks.chunks_exact_mut(flags));
        for _ in 0..rows {
            let row = bodies.iter_mut().flat_map(Iterator::next);
            row.zip(&mut places).for_each(|(known, (all, marks))| known.write(all, marks));
        }
        parts.add(all, marks);
    }
    Ok(parts)
}

/// A bank of new attitudes.
pub fn new(
    method: &str,
    params: AttitudeParams,
    auto: AutoOptions,
    named: NamedOptions,
    correction: Option<FieldCorrection>,
    learns: bool,
    channels: usize,
) -> PyResult<Box<dyn AttitudeBank>> {
    if learns {
        let learning = Auto::new(auto).and_then(|auto| Learning::new(auto, correction));
        return of(learning, params, channels);
    }
    if let Some(correction) = correction {
        let compass = Auto::new(auto).and_then(|auto| Compass::new(auto, correction));
        return of(compass, params, channels);
    }
    match method {
        Auto::METHOD => of(Auto::new(auto), params, channels),
        Complementary::METHOD => of(Complementary::new(named), params, channels),
        Mahony::METHOD => of(Mahony::new(named), params, channels),
        Madgwick::METHOD => of(Madgwick::new(named), params, channels),
        Ekf::METHOD => of(Ekf::new(named), params, channels),
        Ukf::METHOD => of(Ukf::new(named), params, channels),
        _ => Err(PyValueError::new_err(format!(
            "method must be {}, got '{method}'",
            quoted(&METHODS, "or")
        ))),
    }
}

fn of<E: Named + Clone + Send + Sync + 'static>(
    estimator: Result<E, Error>,
    params: AttitudeParams,
    channels: usize,
) -> PyResult<Box<dyn AttitudeBank>> {
    let attitude = estimator.and_then(|estimator| Attitude::new(params, estimator));
    let bank = attitude.and_then(|attitude| Bank::new(&attitude, channels));
    Ok(Box::new(bank.map_err(NativeError::from)?))
}

type Restored = (Option<usize>, Box<dyn AttitudeBank>);

/// The bank in a checkpoint.
pub fn restored(bytes: &[u8]) -> Result<Restored, Error> {
    match checkpoint::label(bytes)?.tag() {
        Compass::TAG => bank::<Compass>(bytes),
        Learning::TAG => bank::<Learning>(bytes),
        Complementary::TAG => bank::<Complementary>(bytes),
        Mahony::TAG => bank::<Mahony>(bytes),
        Madgwick::TAG => bank::<Madgwick>(bytes),
        Ekf::TAG => bank::<Ekf>(bytes),
        Ukf::TAG => bank::<Ukf>(bytes),
        _ => bank::<Auto>(bytes),
    }
}

fn bank<E>(bytes: &[u8]) -> Result<Restored, Error>
where
    E: Named + Clone + Send + Sync + 'static,
{
    let (channels, bank) = checkpoint::restore::<Attitude<E>>(bytes)?;
    Ok((channels, Box::new(bank)))
}
