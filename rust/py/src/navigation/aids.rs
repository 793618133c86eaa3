//! Readings of barometer, compass and baseline, and usable outputs, for Python.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use zerorate_core::navigation::{
    AID_SENSORS, Aid, AidReport, LIMITS, Limits, NavigationFilter as Core, OUTPUTS, Reading,
    WHEELED_LIMITS,
};

use zerorate_core::memory;

use super::{choice, named};
use crate::common::arrays;
use crate::common::errors::NativeError;

/// Give a reading to an object's navigator.
macro_rules! take_aid {
    ($slf:expr, $time:expr, $reading:expr, $sigma:expr) => {{
        let mut this = exclusive($slf)?;
        let aid = Aid { time: $time, reading: $reading, sigma: $sigma };
        Ok(VERDICTS[this.shared.bank.update_aid(&aid).map_err(NativeError::from)? as usize])
    }};
}
pub(crate) use take_aid;

/// Calls of aids, and what is shown of them, of filters and banks.
macro_rules! aided {
    ($class:ident) => {
        #[pymethods]
        impl $class {
            /// Takes a barometric height above any reference, which is estimated (``height_reference``): when,
            /// s, m, and its standard deviation, m, by default ``barometer_sigma``. Returns "used", "rejected"
            /// or "refused". A reading that disagrees with the filter is rejected, and so are those after a
            /// disturbance until they agree for a second; if they disagree by a constant amount for three, the
            /// reference has changed. One is refused if it is over a second old, a tenth of a second ahead of the
            /// sensors, not later than the one before, or missing. ValueError if ``sigma`` is not positive.
            #[pyo3(signature = (t, height, sigma=None))]
            fn update_height(
                slf: &Bound<'_, Self>,
                t: f64,
                height: Option<f64>,
                sigma: Option<f64>,
            ) -> PyResult<&'static str> {
                take_aid!(slf, t, Reading::Height(height.unwrap_or(f64::NAN)), one_sigma(sigma))
            }

            /// Takes a pressure, Pa, as a height of the standard atmosphere, and as ``update_height`` does; its
            /// standard deviation is in Pa. One below 5474.89 or above 115000 Pa is refused: hPa and kPa are.
            #[pyo3(signature = (t, pressure, sigma=None))]
            fn update_pressure(
                slf: &Bound<'_, Self>,
                t: f64,
                pressure: Option<f64>,
                sigma: Option<f64>,
            ) -> PyResult<&'static str> {
                take_aid!(slf, t, Reading::Pressure(pressure.unwrap_or(f64::NAN)), one_sigma(sigma))
            }

            /// Takes the heading of the body's forward axis from a compass: when, s, true north over east, rad,
            /// and its standard deviation, rad. Its constant offset is estimated (``compass_offset``). Before
            /// the first fix it is the heading if none is known. A reading that disagrees with the filter is
            /// rejected, and so are those after a disturbance until they agree for two seconds; if they
            /// disagree by a constant amount for ten, the offset has changed. A value that stays the same to the
            /// bit for two seconds while the vehicle moves is that of a frozen compass. Returns as
            /// ``update_height``; a heading beyond 4 pi, or of a forward axis within 10 deg of the vertical, is
            /// refused.
            #[pyo3(signature = (t, heading, sigma=None), text_signature = "($self, t, heading, sigma=0.05)")]
            fn update_heading(
                slf: &Bound<'_, Self>,
                t: f64,
                heading: Option<f64>,
                sigma: Option<f64>,
            ) -> PyResult<&'static str> {
                take_aid!(slf, t, Reading::Heading(heading.unwrap_or(f64::NAN)), one_sigma(sigma))
            }

            /// Takes the vector from the first to the second antenna: when, s, north, east, down, m, (3,); the
            /// same in body axes, m, (3,), by default that of the constructor; its standard deviation, m, one or
            /// three axes. It is rejected unless it is as long as ``baseline``, and agrees with the filter, also
            /// on average; after a disturbance it must agree for two seconds. Returns as ``update_height``. ValueError if no baseline is given.
            #[pyo3(signature = (t, vector, baseline=None, sigma=None),
                text_signature = "($self, t, vector, baseline=None, sigma=0.02)")]
            fn update_baseline<'py>(
                slf: &Bound<'py, Self>,
                t: f64,
                vector: &Bound<'py, PyAny>,
                baseline: Option<&Bound<'py, PyAny>>,
                sigma: Option<&Bound<'py, PyAny>>,
            ) -> PyResult<&'static str> {
                let vector = three("vector", vector)?;
                let baseline = baseline.map(|given| three("baseline", given)).transpose()?;
                let sigma = sigmas("sigma", sigma, f64::NAN)?;
                take_aid!(slf, t, Reading::Baseline(vector, baseline), sigma)
            }
        }

        getters! { $class, slf, py, this;
            /// Barometric less ellipsoidal height, m; NaN before the first reading.
            height_reference: f64 = this.shared.filter().height_reference()[0];
            /// Standard deviation of ``height_reference``.
            height_reference_sigma: f64 = this.shared.filter().height_reference()[1];
            /// Reading of the compass minus the true heading, rad; NaN before the first reading.
            compass_offset: f64 = this.shared.filter().compass_offset()[0];
            /// Standard deviation of ``compass_offset``.
            compass_offset_sigma: f64 = this.shared.filter().compass_offset()[1];
            /// Readings to date of "barometer", "compass" and "baseline" by what became of them: "used",
            /// "rejected", "refused".
            aid_count: Bound<'py, PyDict> = {
                let counts = |report: &AidReport| {
                    let [used, rejected, refused] = report.counts;
                    let [one, two, three] = VERDICTS;
                    named(py, [(one, used), (two, rejected), (three, refused)])
                };
                of_aids(py, this.shared.filter(), counts)?
            };
            /// Normalised innovation squared of the last reading of each aid, 1 on average, 3 of a baseline;
            /// NaN before the first.
            aid_nis: Bound<'py, PyDict> = of_aids(py, this.shared.filter(), |report| Ok(report.nis))?;
            /// Standard deviation of each aid that the innovations show, m, rad and m; NaN until ten pairs
            /// of readings were seen.
            aid_sigma: Bound<'py, PyDict> = of_aids(py, this.shared.filter(), |report| Ok(report.sigma))?;
            /// True for each aid whose readings are rejected until they agree with the filter again.
            aid_disturbed: Bound<'py, PyDict> = of_aids(py, this.shared.filter(), |report| Ok(report.disturbed))?;
            /// True for each output whose standard deviation is within its limit; once lost, from 0.7 of it.
            usable: Bound<'py, PyDict> = {
                let bits = this.shared.filter().usable();
                named(py, core::array::from_fn::<_, 5, _>(|k| (OUTPUTS[k], bits >> k & 1 == 1)))?
            };
            /// Standard deviations up to which outputs are usable.
            limits: Bound<'py, PyDict> = {
                let limits = this.shared.filter().params().limits;
                named(py, core::array::from_fn::<_, 5, _>(|k| (OUTPUTS[k], limits[k])))?
            };
        }
    };
}
pub(crate) use aided;

/// One value for each aid.
pub fn of_aids<'py, T: IntoPyObject<'py>>(
    py: Python<'py>,
    filter: &Core,
    of: impl Fn(&AidReport) -> PyResult<T>,
) -> PyResult<Bound<'py, PyDict>> {
    let [one, two, three] = filter.aids();
    let [first, second, third] = AID_SENSORS;
    named(py, [(first, of(&one)?), (second, of(&two)?), (third, of(&three)?)])
}

/// NaN for a standard deviation that is not given; one that is NaN is no number.
pub fn one_sigma(given: Option<f64>) -> [f64; 3] {
    [given.map_or(f64::NAN, |sigma| if sigma.is_nan() { 0.0 } else { sigma }); 3]
}

/// The usual limits, or those given.
pub fn limits_of(given: Option<&Bound<'_, PyDict>>, wheeled: bool) -> PyResult<Limits> {
    let mut limits = if wheeled { WHEELED_LIMITS } else { LIMITS };
    for (name, limit) in given.into_iter().flatten() {
        let name: String = name.extract()?;
        limits[choice("limits", &name, &OUTPUTS)?] = limit.extract()?;
    }
    Ok(limits)
}

/// Numbers of a reading: kind, time, values and standard deviations.
pub const AID: usize = 8;

pub fn aids_of(given: &Bound<'_, PyAny>) -> PyResult<Vec<Aid>> {
    let fits = |found: &[usize]| found.len() == 2 && found[1] == AID;
    let rows = arrays::named("aids", given, "(a, 8)", fits)?.values;
    let rows = rows.as_chunks::<AID>().0;
    let mut aids = memory::room(rows.len()).map_err(NativeError::from)?;
    for [kind, time, x, y, z, sigma @ ..] in rows {
        let reading = match *kind as u8 {
            0 => Reading::Height(*x),
            1 => Reading::Pressure(*x),
            2 => Reading::Heading(*x),
            _ => Reading::Baseline([*x, *y, *z], None),
        };
        aids.push(Aid { time: *time, reading, sigma: *sigma });
    }
    Ok(aids)
}
