"""Calibration of IMUs and magnetometers, and its application: ``zerorate calibrate``."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final, Literal, TypeAlias, Unpack

import numpy as np
import numpy.typing as npt

from zerorate.calibration.calibrate import calibrate as fitted
from zerorate.calibration.calibration import Calibration
from zerorate.calibration.choice import find_sensors
from zerorate.calibration.comparison import CalibrationComparison, compare_calibrations
from zerorate.calibration.errors import CalibrationError
from zerorate.calibration.fit.priors import PriorName
from zerorate.calibration.fit.sensors import choose_logs
from zerorate.calibration.fit.solution import GSensitivity
from zerorate.calibration.magnet.calibrate import calibrate_magnetometer as iron_of
from zerorate.calibration.magnetometer import MagnetometerCalibration
from zerorate.calibration.parameters import GYRO_MATRIX, Frame
from zerorate.calibration.record import Rest
from zerorate.checks.preparation import AXES, CLIPPED, FROZEN, Choices, PreparedRecording, prepare
from zerorate.faults import bare_argument, make_sentence
from zerorate.io.writing import write_log
from zerorate.progress import Progress, choose_reporter
from zerorate.record.log import Log
from zerorate.record.recording import Recording, notes_on
from zerorate.tasks.corrections import calibration_of
from zerorate.tasks.saving import Files, Writer, figure_writer, text_writer
from zerorate.tasks.source import (
    ReadingArguments,
    Source,
    name_source_in_errors,
    one_imu_of,
    recording_of,
)
from zerorate.views import Result

Path_: TypeAlias = str | os.PathLike[str]
Sensor: TypeAlias = str | Log | npt.ArrayLike | None
"""Name of a sensor in the recording, or its samples."""

EXPORTS: Final[Mapping[str, tuple[str, ...]]] = {
    "kalibr": ("-kalibr.yaml",),
    "imu_tk": ("-imu_tk_acc.calib", "-imu_tk_gyro.calib"),
    "px4": ("-px4.params",),
    "ardupilot": ("-ardupilot.param",),
    "json": (),
}
"""File name endings of exports for other programs; the JSON is always written."""

MAGNETOMETER_EXPORTS: Final = ("json", "px4", "ardupilot")
"""Exports of a magnetometer's calibration."""


def calibrate(
    source: Source | None = None,
    *,
    gyro: Sensor = None,
    accel: Sensor = None,
    gravity: float | None = None,
    frame: Frame = "x",
    g_sensitivity: GSensitivity = "auto",
    prior: PriorName = "datasheet",
    saturation: float | None = None,
    rests: Iterable[Rest | tuple[float, float]] | None = None,
    temperature: bool = False,
    fix: bool = False,
    progress: Progress | None = None,
    **reading: Unpack[ReadingArguments],
) -> Calibration:
    """Calibrate a gyroscope and an accelerometer from poses at rest and rotations by hand.

    The recording is checked first. ``zerorate calibrate`` does the same.

    Parameters
    ----------
    source : Recording, path, data frame or mapping of arrays, optional
        Recording with a gyro and an accelerometer, each on its own clock. NaN marks missing
        samples.
    gyro, accel : str, Log or array_like, shape (n, 3), optional
        Names of the logs, if the recording has several; or arrays of samples, with `rate`. Gravity
        and the rotations determine the unit of arrays. Corrected samples are in rad/s and m/s^2.
    gravity : float, optional
        Local gravity, m/s^2. Default 9.80665. It can be wrong by 0.3 %, and the accelerometer's
        scale then has the same error.
    frame : {"x", "z", "symmetric"}
        Axes of the body, as in `Calibration`.
    g_sensitivity : {"auto", True, False}
        True: estimate the g-sensitivity from the static intervals, and subtract it in rotations.
        "auto": subtract it only if one of its elements differs from zero by three standard errors.
        False: do not estimate it.
    prior : {"datasheet", "wide"}
        Prior, as in `zerorate.calibration.calibrate`.
    saturation : float, optional
        End of the gyro's range, in the raw unit. Default: the largest or smallest value of an axis,
        if this value occurs ten times.
    rests : iterable of Rest or (start, stop), optional
        Static intervals of the sensor, s. Default: found from the samples.
    temperature : bool
        Also model the gyro's bias by temperature, from the static intervals of the recording.
    fix : bool
        Correct the gyro's unit or axes if the motion clearly contradicts them.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.
    **reading
        Arguments of `zerorate.read_recording`, if the source is a file.

    Returns
    -------
    Calibration
        Calibration. Check `valid` first: if it is False, ``problems`` lists the reasons and
        ``advice`` the remedies. The methods are `table`, `plot` and `save`; `save` accepts
        ``exports=("px4",)``.

    Raises
    ------
    CalibrationError
        If there are too few rests and rotations for an estimate.
    LogError
        If a sensor is missing, does not have three axes, or has a wrong unit. Also if gravity is
        absent.
    ValueError, TypeError
        If an argument is not as described.

    Examples
    --------
    >>> import zerorate as zr
    >>> calibration = zr.calibrate(zr.simulation.simulate_session(20, seed=3).recording)
    >>> calibration.valid, calibration.gyro.scale[0].identifiable, calibration.advice
    (True, True, ())
    """
    report = choose_reporter(progress)
    report("reading", 0.0)
    sensors: dict[str, Any] = {"gyro": gyro, "accel": accel}
    recording = _load_recording(source, sensors, reading)
    names = _sensor_names(sensors)
    with name_source_in_errors(recording.source):
        prepared = prepare(
            recording, Choices(names["gyro"], names["accel"], fix=fix, skip=(CLIPPED,))
        )
    with name_source_in_errors(recording.source, prepared.alarms):
        report("fitting", 0.3)
        options: dict[str, Any] = {
            "gravity": gravity, "frame": frame, "g_sensitivity": g_sensitivity, "prior": prior,
            "saturation": saturation, "rests": rests,
        }  # fmt: skip
        calibration = _fit(prepared.recording, {**sensors, **options})
        used_recording = _select_sensors(prepared.recording, names)
        calibration = calibration.with_temperature(used_recording) if temperature else calibration
    alarms = prepared.alarms_except(AXES) if _has_other_axes(calibration) else prepared.alarms
    return replace(calibration, alarms=alarms, recording=used_recording)


def _load_recording(
    source: Source | None, sensors: dict[str, Any], reading: ReadingArguments
) -> Recording:
    """Return the recording to calibrate, with its sensors replaced by given samples."""
    chosen = ["given" for sensor in sensors.values() if sensor is not None]
    recording = None if source is None else one_imu_of(source, reading, *chosen)
    if recording is not None and all(
        sensor is None or isinstance(sensor, str) for sensor in sensors.values()
    ):
        return recording
    logs = choose_logs(recording, sensors["gyro"], sensors["accel"], reading.get("rate"))
    sensors.update(gyro=None, accel=None)
    given_logs = dict(zip(("gyro", "accel"), logs, strict=True))
    other_logs = {} if recording is None or recording.temperature is None else recording.logs
    temperature_logs = {name: log for name, log in other_logs.items() if name == "temperature"}
    return Recording(
        {**given_logs, **temperature_logs}, "the samples" if recording is None else recording.source
    )


def _sensor_names(sensors: Mapping[str, str | None]) -> dict[str, str]:
    """Return the names of both sensors; by default both are of the same device."""
    gyro, accel = sensors["gyro"], sensors["accel"]
    device = (gyro or "").removeprefix("gyro") or (accel or "").removeprefix("accel")
    return {"gyro": gyro or f"gyro{device}", "accel": accel or f"accel{device}"}


def _select_sensors(recording: Recording, names: Mapping[str, str]) -> Recording:
    """Return a recording with only two sensors and the temperature."""
    source_names = {**names, "temperature": "temperature"}
    logs = {
        name: recording[source_name]
        for name, source_name in source_names.items()
        if source_name in recording
    }
    return Recording(logs, recording.source, notes=recording.notes)


def _fit(recording: Recording, options: Mapping[str, Any]) -> Calibration:
    """Return the calibration; too little data gives an invalid one."""
    try:
        return fitted(recording, **options)
    except CalibrationError as error:
        if error.calibration is None:
            raise
        return error.calibration


def _has_other_axes(calibration: Calibration) -> bool:
    """Return True if the calibration's gyro matrix shows exchanged or inverted axes."""
    matrix = calibration.values[GYRO_MATRIX].reshape(3, 3)
    largest = np.abs(matrix).max(axis=1)
    return not bool((np.diagonal(matrix) > 0.5 * largest).all())


def calibrate_magnetometer(
    source: Source,
    *,
    gyro: str | None = None,
    one: bool = False,
    field: float | None = None,
    dip: float | None = None,
    place: tuple[float, ...] | None = None,
    progress: Progress | None = None,
    **reading: Unpack[ReadingArguments],
) -> MagnetometerCalibration:
    """Calibrate a magnetometer from ordinary motion, using the rotation that the gyro measures.

    The recording is checked and corrected first. ``zerorate calibrate --magnetometer`` does the
    same.

    Parameters
    ----------
    source : Recording, path, data frame or mapping of arrays
        Recording with gyro, accelerometer and a magnetometer in any unit. Without a gyro, a sphere
        is fitted, and a note says so. This needs samples in all directions and a constant field.
    gyro : str
        Name of the gyro, if there are several; default the first.
    one : bool
        Fit one hard iron to the whole recording. By default, several hard irons are fitted if they
        clearly reduce the scatter, for example if a magnet was near for a while.
    field, dip : float, optional
        Strength of the local field, uT, and its angle below the horizontal, rad. A calibration that
        contradicts them is not valid.
    place : tuple of float, optional
        Latitude and longitude (deg) and optionally height (m). `zerorate.geometry.earth_field`
        computes field and dip from them. Default: the recording's position, if it has one and
        pygeomag is installed.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.
    **reading
        Arguments of `zerorate.read_recording`, if the source is a file.

    Returns
    -------
    MagnetometerCalibration
        Calibration. `applied` is True if the correction more than halves the scatter of samples
        that the fit did not use. The methods are `table`, `plot` and `save`; `save` accepts
        ``exports=("px4",)``.

    Raises
    ------
    LogError
        If there is no magnetometer, or less than ten seconds of data. Also if there is a gyro, but
        no accelerometer.
    ValueError
        If ``field`` or ``dip`` cannot occur on earth, or ``place`` is no position on earth.
    ImportError
        If ``place`` is given and pygeomag is not installed.

    Examples
    --------
    >>> import zerorate as zr
    >>> motion = zr.simulate_motion("hand", duration=40.0, seed=3)
    >>> zr.calibrate_magnetometer(motion.recording()).applied
    False
    """
    report = choose_reporter(progress)
    report("reading", 0.0)
    recording = one_imu_of(source, reading, gyro)
    gyro = gyro or "gyro"
    choices = Choices(gyro, gravity=gyro in recording)
    with name_source_in_errors(recording.source):
        prepared = prepare(recording, choices)
    with name_source_in_errors(recording.source, prepared.alarms):
        report("fitting", 0.3)
        fit_recording = _restore_frozen_mag(prepared, recording, choices.mag_name(recording))
        calibration = iron_of(fit_recording, gyro=gyro, one=one, field=field, dip=dip, place=place)
    preparation_notes = (remark.text for remark in prepared.remarks if not remark.alarm)
    notes = tuple(dict.fromkeys((*calibration.notes, *preparation_notes)))
    return replace(calibration, notes=notes, alarms=prepared.alarms)


def _restore_frozen_mag(prepared: PreparedRecording, raw: Recording, name: str) -> Recording:
    """Return the prepared recording, with a completely frozen magnetometer kept."""
    is_frozen = name in raw and any(remark.check == FROZEN for remark in prepared.remarks)
    if not is_frozen or name in prepared.recording:
        return prepared.recording
    return replace(prepared.recording, logs={**prepared.recording, name: raw[name]})


@dataclass(frozen=True, eq=False)
class Corrected(Result):
    """Recording corrected by a calibration, as `zerorate.correct` returns it.

    Parameters
    ----------
    recording : Recording
        The recording with corrected gyro and accelerometer.
    alarms : tuple of str
        Contradictions in the recording, one sentence each.

    Examples
    --------
    >>> import zerorate as zr
    >>> session = zr.simulation.simulate_session(12, seed=3)
    >>> found = zr.correct(session.recording, session.truth)
    >>> found.recording.gyro.unit, found.to_log().names[:2]
    ('deg/s', ('gyro_x_dps', 'gyro_y_dps'))
    """

    recording: Recording
    alarms: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """Name of the recording."""
        return self.recording.source

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on the recording and its logs."""
        return notes_on(self.recording)

    def to_log(self) -> Log:
        """Return all logs on the clock of the first log, as one log."""
        return next(iter(self.tables().values()))

    def tables(self) -> dict[str, Log]:
        """Return the logs by the ending of the file name; logs on one clock share a table."""
        groups: dict[str, list[Log]] = {}
        for name, log in self.recording.items():
            candidates = (group for group in groups.values() if _has_clock_of(group, log))
            group = next(candidates, None)
            if group is None:
                groups[f"-{name}" if groups else ""] = [log]
            else:
                group.append(log)
        return {ending: _join_logs(group) for ending, group in groups.items()}


def _has_clock_of(group: Sequence[Log], log: Log) -> bool:
    first, group_names = group[0], {name for member in group for name in member.names}
    return np.array_equal(first.sampled, log.sampled) and group_names.isdisjoint(log.names)


def _join_logs(group: Sequence[Log]) -> Log:
    first = group[0]
    data = np.hstack([log.data for log in group])
    names = tuple(name for log in group for name in log.names)
    units = tuple(unit for log in group for unit in log.units)
    return replace(first, data=data, names=names, unit=units)  # type: ignore[arg-type]


def correct(
    source: Source,
    calibration: Calibration | Path_,
    *,
    gyro: str | None = None,
    accel: str | None = None,
    **reading: Unpack[ReadingArguments],
) -> Corrected:
    """Correct a recording with a calibration, as ``zerorate calibrate --apply`` does.

    Clipped rates are not changed, and acceleration without gravity is accepted.

    Parameters
    ----------
    source : Recording, path, data frame or mapping of arrays
        Recording with a gyro, an accelerometer or both, raw as in the calibration.
    calibration : Calibration or path
        Calibration to apply.
    gyro, accel : str, optional
        Names of the two logs. Default: the sensors with the column names of the calibration, or
        else the first sensors.
    **reading
        Arguments of `zerorate.read_recording`, if the source is a file.

    Returns
    -------
    Corrected
        The corrected recording. The result has the methods `to_log`, `table`, `plot` and `save`.

    Raises
    ------
    LogError
        If both sensors are missing.
    ValueError
        If the units differ from the calibration's.

    Examples
    --------
    >>> import zerorate as zr
    >>> session = zr.simulation.simulate_session(12, seed=3)
    >>> found = zr.correct(session.recording, session.truth)
    >>> found.recording.accel.unit, found.alarms
    ('g', ())
    """
    loaded = calibration_of(calibration)
    recording = recording_of(source, reading)
    chosen_by_name = gyro is not None or accel is not None
    names = (
        _sensor_names({"gyro": gyro, "accel": accel})
        if chosen_by_name
        else find_sensors(recording, loaded)
    )
    choices = Choices(
        names["gyro"],
        names["accel"],
        gravity=False,
        skip=(CLIPPED,),
        correct=lambda one: loaded.apply(one, **names),
    )
    with name_source_in_errors(recording.source):
        prepared = prepare(recording, choices)
    return Corrected(prepared.recording, prepared.alarms)


def compare_with_earlier(
    calibration: Calibration, earlier: Calibration | Path_
) -> CalibrationComparison:
    """Return the change of each parameter since `old`, the earlier calibration."""
    old = calibration_of(earlier)
    units = {"gyro": calibration.gyro_units[0], "accel": calibration.accel_units[0]}
    return compare_calibrations(old.to_frame(calibration.frame).in_units(**units), calibration)


def files_of(
    calibration: Calibration,
    *,
    exports: Sequence[str] = (),
    doubtful: bool = False,
    panels: Literal["usual", "all"] = "usual",
) -> Files:
    """Return the files of a calibration: JSON, exports for other programs, figures.

    An invalid calibration is exported only with `doubtful`.
    """
    check_exports(exports, tuple(EXPORTS))
    written_exports = [export for export in exports if calibration.valid or doubtful]
    texts = [
        text for export in written_exports for text in _export_texts(calibration, export, doubtful)
    ]
    data = [text_writer(text) for text in (calibration.to_json(), *texts)]
    endings = [ending for export in written_exports for ending in EXPORTS[export]]
    figures: dict[str, Writer] = {"": figure_writer(lambda: calibration.plot(panels=panels))}
    if calibration.temperature_model is not None:
        figures["-temperature"] = figure_writer(calibration.temperature_model.plot)
    return Files("-zerorate-calibration", ".json", data, endings, figures)


def check_exports(exports: Sequence[str], supported: Sequence[str]) -> None:
    """Raise ValueError for a program without an export."""
    for export in exports:
        if export not in supported:
            raise ValueError(
                make_sentence(
                    bare_argument("export"), f" is one of {', '.join(supported)}, got {export}"
                )
            )


def unusable(calibration: MagnetometerCalibration) -> Sequence[str]:
    """Return the reason why a magnetometer's calibration is useless; empty if it is useful."""
    if calibration.problems:
        return calibration.problems[:1]
    if not calibration.applied and not any(one.identifiable for one in calibration.hard_iron):
        advice = "; ".join(calibration.advice) or "rotate the sensor about two different axes"
        return (f"the log does not show the hard iron: {advice}",)
    return ()


def _export_texts(calibration: Calibration, export: str, doubtful: bool) -> Sequence[str]:
    """Return the texts of an export's files."""
    if export == "json":
        return ()
    if export == "imu_tk":
        return calibration.to_imu_tk(doubtful=doubtful)
    exporters = {
        "kalibr": calibration.to_kalibr,
        "px4": calibration.to_px4,
        "ardupilot": calibration.to_ardupilot,
    }
    return (exporters[export](doubtful=doubtful),)


def magnetometer_files(
    calibration: MagnetometerCalibration, *, exports: Sequence[str] = (), doubtful: bool = False
) -> Files:
    """Return the files of a magnetometer's calibration: JSON, exports, the figure."""
    check_exports(exports, MAGNETOMETER_EXPORTS)
    exporters: dict[str, Callable[..., str]] = {
        "px4": calibration.to_px4, "ardupilot": calibration.to_ardupilot
    }  # fmt: skip
    written_exports = [export for export in exports if export in exporters]
    texts = (
        calibration.to_json(),
        *(exporters[export](doubtful=doubtful) for export in written_exports),
    )
    endings = [ending for export in written_exports for ending in EXPORTS[export]]
    data = [*map(text_writer, texts)]
    return Files(
        "-zerorate-magnetometer", ".json", data, endings, {"": figure_writer(calibration.plot)}
    )


def corrected_files(result: Corrected) -> Files:
    """Return the files of a corrected recording: one log per clock."""
    tables = result.tables()
    data: list[Writer] = [partial(write_log, log) for log in tables.values()]
    others = [f"{ending}." for ending in tables if ending]
    return Files("-zerorate-calibrated", "", data, others, {})
