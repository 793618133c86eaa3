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

/// Methods and properties of aids, for filters and banks.
macro_rules! aided {
    ($class:ident) => {
        #[pymethods]
        impl $class {
            /// Process a barometric height and return "used", "rejected" or "refused".
            ///
            /// Arguments are the time, s, the height, m, and its standard deviation, m, by default
            /// ``barometer_sigma``. The height may have any reference. The filter estimates it
            /// (``height_reference``). A reading that disagrees with the filter is rejected. After
            /// a disturbance, readings are rejected until they agree for a second. If they disagree
            /// by a constant amount for three seconds, the filter learns a new reference. A reading
            /// is refused in four cases:
            ///
            /// - It is more than a second older than the last sample.
            /// - It is more than a tenth of a second newer than the last sample.
            /// - It is not later than the previous reading.
            /// - It is missing.
            ///
            /// A ValueError is raised if ``sigma`` is not positive.
            #[pyo3(signature = (t, height, sigma=None))]
            fn update_height(
                slf: &Bound<'_, Self>,
                t: f64,
                height: Option<f64>,
                sigma: Option<f64>,
            ) -> PyResult<&'static str> {
                take_aid!(slf, t, Reading::Height(height.unwrap_or(f64::NAN)), one_sigma(sigma))
            }

            /// Convert a pressure, Pa, to a height of the standard atmosphere, and process this
            /// height.
            ///
            /// The height is processed as by ``update_height``. The standard deviation is in Pa. A
            /// pressure below 5474.89 Pa or above 115000 Pa is refused; this refuses values in hPa
            /// or kPa.
            #[pyo3(signature = (t, pressure, sigma=None))]
            fn update_pressure(
                slf: &Bound<'_, Self>,
                t: f64,
                pressure: Option<f64>,
                sigma: Option<f64>,
            ) -> PyResult<&'static str> {
                take_aid!(slf, t, Reading::Pressure(pressure.unwrap_or(f64::NAN)), one_sigma(sigma))
            }

            /// Process the heading of the body's forward axis from a compass.
            ///
            /// Arguments are the time, s, the heading from true north over east, rad, and its
            /// standard deviation, rad. The filter estimates the constant offset of the compass
            /// (``compass_offset``). If no heading is known before the first fix, the filter takes
            /// the reading as heading. A reading that disagrees with the filter is rejected. After
            /// a disturbance, readings are rejected until they agree for two seconds. If they
            /// disagree by a constant amount for ten seconds, the filter learns a new offset. A
            /// compass that repeats one value for two seconds of motion is frozen. The verdict is
            /// returned as by ``update_height``. A heading beyond 4 pi is refused. A heading is
            /// also refused if the forward axis is within 10 deg of the vertical.
            #[pyo3(signature = (t, heading, sigma=None), text_signature = "($self, t, heading, sigma=0.05)")]
            fn update_heading(
                slf: &Bound<'_, Self>,
                t: f64,
                heading: Option<f64>,
                sigma: Option<f64>,
            ) -> PyResult<&'static str> {
                take_aid!(slf, t, Reading::Heading(heading.unwrap_or(f64::NAN)), one_sigma(sigma))
            }

            /// Process the vector from the first to the second antenna.
            ///
            /// Arguments are the time, s; the vector north, east, down, m, (3,); the vector in body
            /// axes, m, (3,), by default ``baseline`` of the constructor; and the standard
            /// deviation, m, one for all axes or three. The vector is rejected if its length
            /// differs from the length of ``baseline``. It is also rejected if this vector, or the
            /// average of the last vectors, disagrees with the filter. After a disturbance, vectors
            /// are rejected until they agree for two seconds. The verdict is returned as by
            /// ``update_height``. A ValueError is raised if no baseline is given.
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
            /// Barometric height minus ellipsoidal height, m; NaN before the first reading.
            height_reference: f64 = this.shared.filter().height_reference()[0];
            /// Standard deviation of ``height_reference``.
            height_reference_sigma: f64 = this.shared.filter().height_reference()[1];
            /// Reading of the compass minus the true heading, rad; NaN before the first reading.
            compass_offset: f64 = this.shared.filter().compass_offset()[0];
            /// Standard deviation of ``compass_offset``.
            compass_offset_sigma: f64 = this.shared.filter().compass_offset()[1];
            /// Number of readings to date for each aid and verdict.
            ///
            /// Aids are "barometer", "compass" and "baseline". Verdicts are "used", "rejected" and
            /// "refused".
            aid_count: Bound<'py, PyDict> = {
                let counts = |report: &AidReport| {
                    let [used, rejected, refused] = report.counts;
                    let [one, two, three] = VERDICTS;
                    named(py, [(one, used), (two, rejected), (three, refused)])
                };
                of_aids(py, this.shared.filter(), counts)?
            };
            /// Normalised innovation squared of the last reading of each aid.
            ///
            /// On average it is 1, for a baseline 3. It is NaN before the first reading.
            aid_nis: Bound<'py, PyDict> = of_aids(py, this.shared.filter(), |report| Ok(report.nis))?;
            /// Standard deviation of each aid, learned from its innovations.
            ///
            /// The units are m for the barometer, rad for the compass and m for the baseline. NaN
            /// before ten pairs of readings.
            aid_sigma: Bound<'py, PyDict> = of_aids(py, this.shared.filter(), |report| Ok(report.sigma))?;
            /// True for each aid that is disturbed: its readings are rejected until they agree
            /// again.
            aid_disturbed: Bound<'py, PyDict> = of_aids(py, this.shared.filter(), |report| Ok(report.disturbed))?;
            /// True for each output with a standard deviation within its limit.
            ///
            /// After the standard deviation has exceeded the limit, the output is usable again when
            /// the standard deviation is below 0.7 times the limit.
            usable: Bound<'py, PyDict> = {
                let bits = this.shared.filter().usable();
                named(py, core::array::from_fn::<_, 5, _>(|k| (OUTPUTS[k], bits >> k & 1 == 1)))?
            };
            /// Largest standard deviation at which each output is usable.
            limits: Bound<'py, PyDict> = {
                let limits = this.shared.filter().params().limits;
                named(py, core::array::from_fn::<_, 5, _>(|k| (OUTPUTS[k], limits[k])))?
            };
        }
    };
}
pub(crate) use aided;

/// One value per aid.
pub fn of_aids<'py, T: IntoPyObject<'py>>(
    py: Python<'py>,
    filter: &Core,
    of: impl Fn(&AidReport) -> PyResult<T>,
) -> PyResult<Bound<'py, PyDict>> {
    let [one, two, three] = filter.aids();
    let [first, second, third] = AID_SENSORS;
    named(py, [(first, of(&one)?), (second, of(&two)?), (third, of(&three)?)])
}

/// NaN for a standard deviation that is not given; a stated NaN is refused.
pub fn one_sigma(given: Option<f64>) -> [f64; 3] {
    [given.map_or(f64::NAN, |sigma| if sigma.is_nan() { 0.0 } else { sigma }); 3]
}

/// The default limits, or the stated limits.
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
