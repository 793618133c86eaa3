//! Samples of gyro, accelerometer and magnetometer from Python, interleaved.

use std::ops::Range;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use zerorate_core::attitude::Sample;
use zerorate_core::stream::Input;
use zerorate_core::{Error, memory};

use crate::common::arrays::{self, Samples};
use crate::common::elements::three;
use crate::common::errors::NativeError;

/// Numbers in a sample: three for each sensor, and the time since the previous sample.
pub const WIDTH: usize = 10;

/// Instants that are interleaved at once.
const ROWS: usize = 64;

/// Arguments of one call.
#[derive(Debug, Clone, Copy)]
pub struct Given<'a, 'py> {
    pub gyro: &'a Bound<'py, PyAny>,
    pub accel: &'a Bound<'py, PyAny>,
    pub mag: Option<&'a Bound<'py, PyAny>>,
    pub dt: Option<&'a Bound<'py, PyAny>>,
}

/// Gyro, accelerometer, magnetometer and times of a batch; logs and data frames become arrays.
pub fn taken<'py, T>(
    owner: &Bound<'py, T>,
    given: [Option<&Bound<'py, PyAny>>; 4],
) -> PyResult<[Bound<'py, PyAny>; 4]> {
    arrays::taken(owner, ["gyro", "accel", "mag", "dt"], given)
}

impl<'a, 'py> Given<'a, 'py> {
    pub fn of([gyro, accel, mag, dt]: &'a [Bound<'py, PyAny>; 4]) -> Self {
        Self { gyro, accel, mag: arrays::present(mag), dt: arrays::present(dt) }
    }

    /// One sample of a single body, in the form that loops give most often.
    #[inline]
    pub fn usual(&self) -> Option<[f64; WIDTH]> {
        let ([gx, gy, gz], [ax, ay, az]) = (three(self.gyro)?, three(self.accel)?);
        let [mx, my, mz] = self.mag.map_or(Some([f64::NAN; 3]), three)?;
        self.dt.is_none().then_some([gx, gy, gz, ax, ay, az, mx, my, mz, f64::NAN])
    }

    /// One sample of each body.
    pub fn row(&self, channels: Option<usize>) -> PyResult<Vec<f64>> {
        let count = channels.unwrap_or(1);
        let axes: &[usize] = match &channels {
            Some(k) => &[*k, 3],
            None => &[3],
        };
        let mut row = vec![f64::NAN; WIDTH * count];
        for (first, name, given) in self.sensors() {
            let Some(given) = given else { continue };
            let values = arrays::row(given, axes).map_err(|error| named(name, error, given))?;
            for (place, axes) in row.chunks_exact_mut(WIDTH).zip(values.chunks_exact(3)) {
                place[first..first + 3].copy_from_slice(axes);
            }
        }
        if let Some(dt) = self.dt {
            let dt = arrays::sample(dt).map_err(|error| named("dt", error, dt))?;
            row.iter_mut().skip(WIDTH - 1).step_by(WIDTH).for_each(|place| *place = dt);
        }
        Ok(row)
    }

    /// The samples of a batch.
    pub fn batch(&self, channels: Option<usize>) -> PyResult<Batch<'py>> {
        let axes: Vec<usize> = channels.into_iter().chain([3]).collect();
        let read = |name, given: &Bound<'py, PyAny>| {
            arrays::samples(given, &axes).map_err(|error| named(name, error, given))
        };
        let gyro = read("gyro", self.gyro)?;
        let n = gyro.shape()[0];
        let mut sensors = vec![(0, gyro)];
        for (first, name, given) in self.sensors().into_iter().skip(1) {
            let Some(given) = given else { continue };
            let samples = read(name, given)?;
            check_length(name, samples.shape()[0], n)?;
            sensors.push((first, samples));
        }
        let dt = self.dt.map(|dt| steps(dt, n)).transpose()?;
        Ok(Batch { n, channels: channels.unwrap_or(1), sensors, dt })
    }

    fn sensors(&self) -> [(usize, &'static str, Option<&'a Bound<'py, PyAny>>); 3] {
        [(0, "gyro", Some(self.gyro)), (3, "accel", Some(self.accel)), (6, "mag", self.mag)]
    }
}

/// Arrays of a batch, read in place, with the index of each array's first number in a sample.
#[derive(Debug)]
pub struct Batch<'py> {
    pub n: usize,
    channels: usize,
    sensors: Vec<(usize, Samples<'py>)>,
    dt: Option<Vec<f64>>,
}

impl Batch<'_> {
    /// The columns that the work needs.
    pub fn columns(&self) -> PyResult<Columns<'_>> {
        let mut sensors = Vec::with_capacity(self.sensors.len());
        for (first, samples) in &self.sensors {
            sensors.push((*first, samples.values()?.as_chunks::<3>().0));
        }
        Ok(Columns { channels: self.channels, sensors, dt: self.dt.as_deref() })
    }
}

/// The samples of each sensor, three axes each.
#[derive(Debug)]
pub struct Columns<'a> {
    channels: usize,
    sensors: Vec<(usize, &'a [[f64; 3]])>,
    dt: Option<&'a [f64]>,
}

impl Columns<'_> {
    /// Interleaves the sensors' samples of these instants; NaN for missing values.
    pub fn fill(&self, instants: Range<usize>, rows: &mut [f64]) {
        let samples = instants.start * self.channels..instants.end * self.channels;
        let rows = rows.as_chunks_mut::<WIDTH>().0;
        rows.fill([f64::NAN; WIDTH]);
        for (first, sensor) in &self.sensors {
            for (row, axes) in rows.iter_mut().zip(&sensor[samples.clone()]) {
                row[*first..][..3].copy_from_slice(axes);
            }
        }
        if let Some(dt) = self.dt {
            for (rows, dt) in rows.chunks_exact_mut(self.channels).zip(&dt[instants]) {
                rows.iter_mut().for_each(|row| row[WIDTH - 1] = *dt);
            }
        }
    }
}

impl Columns<'_> {
    /// The samples of one body.
    pub fn samples(&self, body: usize, n: usize) -> Result<Vec<Sample>, Error> {
        let mut samples = memory::room(n)?;
        let width = WIDTH * self.channels;
        let mut rows = memory::filled(0.0, ROWS.min(n) * width)?;
        for first in (0..n).step_by(ROWS) {
            let after = n.min(first + ROWS);
            let rows = &mut rows[..(after - first) * width];
            self.fill(first..after, rows);
            let own = rows.chunks_exact(width).map(|row| &row[WIDTH * body..][..WIDTH]);
            samples.extend(own.map(Sample::read));
        }
        Ok(samples)
    }
}

/// Time steps: one for all samples, or one per sample; negative if the clock was set back.
fn steps(dt: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<f64>> {
    match arrays::sample(dt) {
        Ok(one) => Ok(memory::filled(one, n).map_err(NativeError::from)?),
        Err(_) => Ok(arrays::named("dt", dt, &format!("({n},)"), |shape| shape == [n])?.values),
    }
}

/// Time steps as in the function before; a negative step is an error.
pub fn times(dt: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<f64>> {
    let times = steps(dt, n)?;
    times.iter().try_for_each(|dt| checked(*dt).map(|_| ()))?;
    Ok(times)
}

/// Six or nine floats in place of two or three arrays.
pub fn of_floats(
    first: [&Bound<'_, PyAny>; 2],
    mag: Option<&Bound<'_, PyAny>>,
    more: &Bound<'_, PyTuple>,
    dt: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<f64>> {
    let mut row = vec![f64::NAN; WIDTH];
    let count = 2 + usize::from(mag.is_some()) + more.len();
    if count != 6 && count != 9 {
        return Err(PyTypeError::new_err(format!(
            "update takes arrays of three axes, or six or nine floats, got {count} arguments"
        )));
    }
    for (place, given) in row.iter_mut().zip(first.into_iter().chain(mag)) {
        *place = arrays::sample(given)?;
    }
    for (place, given) in row[3..].iter_mut().zip(more) {
        *place = arrays::sample(&given)?;
    }
    if let Some(dt) = dt {
        row[WIDTH - 1] = arrays::sample(dt)?;
    }
    Ok(row)
}

/// A time that must not be negative.
pub fn checked(dt: f64) -> PyResult<f64> {
    match dt < 0.0 {
        false => Ok(dt),
        true => Err(PyValueError::new_err(format!("dt must not be negative, got {dt:?} s"))),
    }
}

fn check_length(name: &str, n: usize, expected: usize) -> PyResult<()> {
    if n == expected {
        return Ok(());
    }
    Err(PyValueError::new_err(format!(
        "{name} must have as many samples as gyro, {expected}, got {n}"
    )))
}

/// The error with the argument's own name.
fn named(name: &str, error: PyErr, given: &Bound<'_, PyAny>) -> PyErr {
    let text = error.value(given.py()).to_string();
    match text.strip_prefix("z must") {
        Some(rest) => PyValueError::new_err(format!("{name} must{rest}")),
        None => error,
    }
}
