//! A bank of navigation filters, for Python.

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use zerorate_core::Error;
use zerorate_core::navigation::{
    Adapt, Aid, AidParams, AidReport, Fix, FixCounts, Inertial, Kind, NavigationBank as Core,
    NavigationParams, OUTPUTS, Reading, STATES,
};

use super::aids::{aided, limits_of, of_aids, one_sigma, take_aid};
use super::{
    ACCEL, ADAPTS, Arrays, GYRO, KINDS, Navigator, STATUSES, VERDICTS, begun, choice, degrees,
    densities, lever, named, navigating, radians, sigmas, three, wheels,
};
use crate::common::arrays;
use crate::common::errors::NativeError;
use crate::common::getters::{Object, getters};
use crate::common::rules::{self, Rule};
use crate::common::streaming::{exclusive, reading, streaming};

/// Bank of four navigation filters with different sensor noise; its outputs are from the likeliest.
///
/// One filter has the stated white noise. The other three have three times the gyro's noise, five
/// times the accelerometer's noise, or both. A clone of each filter coasts: for ten seconds it uses
/// no fixes, then a new clone replaces it. After 2, 5 and 10 s the clone's horizontal errors are
/// compared with the fixes. The weight of a filter is the likelihood of these errors, which fades
/// with a time constant of 300 s. Before the first comparison the filter with the stated noise
/// gives the outputs.
///
/// State, standard deviations and counts belong to the filter with the largest weight. A bank takes
/// six times as long as one filter. A bank's track cannot be smoothed.
///
/// Parameters
/// ----------
/// start : Alignment
///     State before the first sample, as returned by ``zr.align``.
/// gyro, accel, gyro_vibration, antenna, antenna_sigma, consider_antenna, vehicle, axle, wheel_sigma, speed_sigma :
///     As in `zerorate.NavigationFilter`. For ``gyro`` and ``accel``, state the smallest noise that
///     the sensors may have.
/// gate, adapt, covariance_step, kind, barometer_sigma, barometer_walk, compass_sigma, compass_walk, baseline, limits :
///     As in `zerorate.NavigationFilter`.
///
/// Raises
/// ------
/// ValueError
///     A parameter is out of range, or the filter does not use it.
///
/// Examples
/// --------
/// >>> import zerorate as zr
/// >>> drive = zr.simulate_drive(duration=120.0, seed=1)
/// >>> start = zr.align(drive.recording(), latitude=48.0, heading="course")
/// >>> bank = zr.navigation.NavigationBank(start)
/// >>> track = bank.process(drive.recording(), drive.fixes)
/// >>> bank.status, bank.noise_factors.tolist()
/// ('navigating', [1.0, 1.0])
#[pyclass(module = "zerorate.navigation")]
#[derive(Debug)]
pub struct NavigationBank {
    shared: Navigator<Core>,
}

impl NavigationBank {
    fn restored(bytes: &[u8]) -> Result<Self, Error> {
        Ok(Self { shared: Navigator::restored(bytes)? })
    }
}

streaming!(NavigationBank);

navigating!(NavigationBank, Core);
aided!(NavigationBank);

#[pymethods]
impl NavigationBank {
    /// Process a recording and the fixes of a receiver, as ``NavigationFilter.process`` does.
    ///
    /// The `Track` has the outputs of the filter with the largest weight at each sample. It cannot
    /// be smoothed: ``keep`` must be "track".
    #[pyo3(
        signature = (
            imu, gnss=None, *, rest=None, wheel_speed=None, time_offset=None, keep="track",
            height=None, pressure=None, heading=None, baseline=None
        ),
        text_signature = "($self, imu, gnss=None, *, rest=None, wheel_speed=None, \
            time_offset=0.0, keep='track', height=None, pressure=None, heading=None, baseline=None)"
    )]
    // The arguments are the same as in the Python method.
    #[allow(clippy::too_many_arguments)]
    fn process<'py>(
        slf: &Bound<'py, Self>,
        imu: &Bound<'py, PyAny>,
        gnss: Option<&Bound<'py, PyAny>>,
        rest: Option<&Bound<'py, PyAny>>,
        wheel_speed: Option<&Bound<'py, PyAny>>,
        time_offset: Option<&Bound<'py, PyAny>>,
        keep: &str,
        height: Option<&Bound<'py, PyAny>>,
        pressure: Option<&Bound<'py, PyAny>>,
        heading: Option<&Bound<'py, PyAny>>,
        baseline: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        choice("keep", keep, &["track"])?;
        let aids = (height, pressure, heading, baseline);
        rules::call(
            slf.py(),
            Rule::Navigate,
            (slf, imu, gnss, (rest, wheel_speed, aids), time_offset, false),
        )
    }

    /// Process arrays, as ``NavigationFilter.process_arrays`` does.
    ///
    /// ``record`` must be False. The second returned value is None.
    #[pyo3(signature = (time, gyro, accel, fixes, rest=None, record=false, wheel_speed=None, aids=None))]
    // The arguments are the same as in the Python method.
    #[allow(clippy::too_many_arguments)]
    fn process_arrays<'py>(
        slf: &Bound<'py, Self>,
        time: &Bound<'py, PyAny>,
        gyro: &Bound<'py, PyAny>,
        accel: &Bound<'py, PyAny>,
        fixes: &Bound<'py, PyAny>,
        rest: Option<&Bound<'py, PyAny>>,
        record: bool,
        wheel_speed: Option<&Bound<'py, PyAny>>,
        aids: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyDict>, Option<Bound<'py, PyAny>>)> {
        if record {
            let text = "record must be False: a bank keeps no steps for the smoother";
            return Err(crate::common::errors::about("record", text.to_owned()));
        }
        let [gyro, accel] = &arrays::taken(slf, ["gyro", "accel"], [Some(gyro), Some(accel)])?;
        let given = Arrays { time, gyro, accel, fixes, rest, wheel_speed, aids };
        let mut this = exclusive(slf)?;
        let outputs =
            given.run(slf.py(), &mut this.shared, |batch, bank, piece, next, known| {
                batch.run(bank, piece, next, known)
            })?;
        Ok((outputs, None))
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        Ok(format!("NavigationBank({})", reading(slf)?.shared.words().join(", ")))
    }
}

getters! { NavigationBank, slf, py, this;
    /// Weights of the filters, with sum one, shape (4,).
    ///
    /// The first filter has the stated noise, the second a larger gyro noise, the third a larger
    /// accelerometer noise, the fourth both.
    weights: Object<'py> = arrays::small(py, &this.shared.bank.weights());
    /// Factors on the white noise of gyro and accelerometer in the likeliest filter, shape (2,).
    noise_factors: Object<'py> = arrays::small(py, &this.shared.bank.noise_factors());
}
