"""The attitude of a recording: ``zerorate attitude``."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, TypeAlias, Unpack, get_args

import numpy.typing as npt

from zerorate.attitude.estimate import AttitudeEstimate, attitude_of
from zerorate.attitude.options import ATTITUDE_OPTIONS
from zerorate.calibration.calibration import Calibration
from zerorate.calibration.magnet.changes import note_iron_changes
from zerorate.calibration.magnetometer import MagnetometerCalibration
from zerorate.checks.preparation import Choices, Clipped, prepare
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.geometry.frames import Frame
from zerorate.geometry.magnetic import earth_field
from zerorate.io.poses import read_poses
from zerorate.io.writing import write_log
from zerorate.metrics.orientation import Heading
from zerorate.options import check_used
from zerorate.progress import Progress, choose_reporter
from zerorate.record.poses import Poses
from zerorate.tasks.coordinates import parse_position
from zerorate.tasks.corrections import correction_of
from zerorate.tasks.saving import Files, Writer, figure_writer, text_writer
from zerorate.tasks.source import (
    ReadingArguments,
    Source,
    name_source_in_errors,
    one_imu_of,
    split_options,
)
from zerorate.views import page_of

_Path: TypeAlias = str | os.PathLike[str]
_Columns: TypeAlias = Sequence[str | int]


class AttitudeOptions(ReadingArguments, total=False):
    """Options of `estimate_attitude` for the named methods and for reading."""

    time_constant: float
    kp: float
    ki: float
    beta: float
    gyro_noise: float
    accel_noise: float
    mag_noise: float
    bias_walk: float


_MAG_DISABLED: Final = keyword_argument("mag", "", "mag=False")
_FILE_SUFFIXES: Final = (".tum", ".txt", ".csv")


def estimate_attitude(
    source: Source,
    *,
    frame: Frame | None = None,
    method: str = "auto",
    offline: bool = False,
    mag: bool = True,
    learn_magnetometer: bool = False,
    declination: float = 0.0,
    at: npt.ArrayLike | None = None,
    bias_limit: float | None = None,
    gyro: str | None = None,
    accel: str | None = None,
    calibration: Calibration | _Path | None = None,
    magnetometer: MagnetometerCalibration | _Path | None = None,
    clipped: Clipped = "auto",
    fix: bool = False,
    reference: Poses | _Path | _Columns | None = None,
    reference_offset: float = 0.0,
    reference_frame: Frame | None = None,
    reference_heading: Heading | None = None,
    progress: Progress | None = None,
    **options: Unpack[AttitudeOptions],
) -> AttitudeEstimate:
    """Estimate the orientation of a body from gyro, accelerometer and, if present, magnetometer.

    The recording is checked and corrected first. All samples are put on the clock of the gyro:
    another sensor's sample is processed with the first gyro sample at or after it. ``zerorate
    attitude`` does the same.

    Parameters
    ----------
    source : Recording, path, data frame or mapping of arrays
        Recording with gyro and accelerometer of three axes, and optionally a magnetometer in any
        unit.
    frame : {"enu", "ned", "nwu"}, optional
        Axes of the earth, for example "enu" for east, north, up. North is magnetic north, or true
        north if `declination` or `at` is given. Default: "ned" if the gyro's axes are known to be
        forward, right, down (as in a PX4 log), otherwise "enu".
    method : str
        Method of `zerorate.Attitude`. "auto" needs no settings.
    offline : bool
        Use the whole recording for each sample, including later samples.
    mag : bool
        Use the magnetometer if there is one. Without it, the heading is relative to the start and
        drifts.
    learn_magnetometer : bool
        Learn the magnetometer's hard iron from the motion, as in a live filter.
    declination : float
        Declination: angle of magnetic north east of true north, rad. If given, north is true north.
    at : array_like, shape (2,), optional
        Latitude and longitude, deg. They replace `declination`, which is then computed by the World
        Magnetic Model.
    bias_limit : float, optional
        Largest possible bias, rad/s. A larger steady rate is treated as rotation, not as rest.
        Default 10 deg/s.
    gyro, accel : str
        Names of logs, such as ``"gyro_1"``. Default: the only gyro, and the accelerometer of its
        device. ``sensor="imu2"`` chooses both by the name of their device.
    calibration : Calibration or path, optional
        Calibration that corrects gyro and accelerometer first.
    magnetometer : MagnetometerCalibration or path, optional
        Calibration that corrects the magnetometer first. If the same recording was used for the
        calibration, each interval of the calibration gets its own hard iron.
    clipped : {"auto", "restore", "leave"}
        Treatment of clipped rates. "auto": restore them from their flanks if there is no other
        explanation. "restore": restore them wherever the flanks predict larger rates. "leave": do
        not change them.
    fix : bool
        Correct the gyro's unit or axes if the motion clearly contradicts them.
    reference : Poses, path or sequence of str, optional
        True orientation from sensor to earth. Poses on the clock of the recording, or a file with
        such poses. Their north may be any direction. Or names of the source's four columns w, x, y,
        z. Default: columns named like an orientation, such as ``ref_quat_w``.
    reference_offset : float
        Offset added to the times of the poses, s.
    reference_frame : {"enu", "ned", "nwu"}, optional
        Earth axes of the reference; default `frame`.
    reference_heading : {"aligned", "absolute", "relative"}, optional
        Comparison of headings. "aligned": rotate the reference to the best fit. "absolute": use the
        reference's north. "relative": count headings from the first sample. Default: "aligned" for
        poses; otherwise "absolute", or "relative" without a magnetometer.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.
    **options
        Constants of named methods of `zerorate.Attitude`: time_constant, kp, ki, beta, gyro_noise,
        accel_noise, mag_noise, bias_walk. If the source is a file, also arguments of
        `zerorate.read_recording`.

    Returns
    -------
    AttitudeEstimate
        Estimate with arrays in SI units; ``table()`` and ``plot()`` use deg.

    Raises
    ------
    LogError
        If gyro or accelerometer is missing, does not have three axes, or has no known unit. Also if
        gravity is absent. The error's notes list contradictions in the recording.
    ValueError
        If an argument is out of range, or has no effect.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> motion = zr.simulate_motion("hand", duration=30.0, seed=2)
    >>> found = zr.estimate_attitude(motion.recording())
    >>> found, found.alarms
    (AttitudeEstimate(3000 samples at 100 Hz, nine axes, auto, enu), ())
    >>> bool(np.degrees(found.errors().inclination) < 1.0)
    True
    """
    report = choose_reporter(progress)
    if not mag:
        _refuse_mag_options(learn_magnetometer=learn_magnetometer, magnetometer=magnetometer, at=at)
    north_declination, declination_notes = _find_declination(declination, at)
    truth, columns = _load_reference(reference, reference_offset)
    _check_heading(reference_heading)
    correct = correction_of(calibration, magnetometer, gyro=gyro or "gyro", accel=accel)
    reading, constants = split_options(options, ATTITUDE_OPTIONS)
    check_used(constants, [method], ATTITUDE_OPTIONS)
    settings = {**constants, **_filter_settings(learn_magnetometer, bias_limit)}
    report("reading", 0.0)
    recording = one_imu_of(source, {**reading, "reference": columns}, gyro, accel)
    gyro = gyro or "gyro"
    choices = Choices(gyro, accel, fix, clipped, bias_limit=bias_limit, correct=correct)
    with name_source_in_errors(recording.source):
        prepared = prepare(recording, choices)
    with name_source_in_errors(recording.source, prepared.alarms):
        estimate = attitude_of(
            prepared.recording, frame=frame, method=method, offline=offline, mag=mag,
            declination=north_declination,
            gyro=gyro, accel=accel, reference=truth, reference_frame=reference_frame,
            progress=report, **settings,
        )  # fmt: skip
    if reference_heading is not None and estimate.reference is None:
        raise ValueError(make_sentence(keyword_argument("reference_heading"), " needs a reference"))
    heading = reference_heading or estimate.compared_heading
    changes = note_iron_changes(prepared.recording, gyro) if estimate.mag else ()
    notes = (*declination_notes, *estimate.notes, *changes)
    return replace(estimate, alarms=prepared.alarms, notes=notes, compared_heading=heading)


def _refuse_mag_options(**mag_options: object) -> None:
    """Raise ValueError for a magnetometer argument if the magnetometer is not used."""
    for name, value in mag_options.items():
        if value is not None and value is not False:
            raise ValueError(
                make_sentence(keyword_argument(name), " has no effect with ", _MAG_DISABLED)
            )


def _filter_settings(learn_magnetometer: bool, bias_limit: float | None) -> dict[str, Any]:
    """Return the given options of the default filter; other filters do not accept them."""
    learned: dict[str, Any] = {"learn_magnetometer": True} if learn_magnetometer else {}
    return learned if bias_limit is None else {**learned, "bias_limit": bias_limit}


def _find_declination(
    declination: float, at: npt.ArrayLike | None
) -> tuple[float, tuple[str, ...]]:
    """Return the declination, rad; from the earth's field model if a position is given."""
    if at is None:
        return declination, ()
    if declination:
        message = (
            keyword_argument("at"),
            " determines the declination: give it, or ",
            keyword_argument("declination"),
        )
        raise ValueError(make_sentence(*message))
    field = earth_field(*parse_position(at))
    declination_deg = math.degrees(field.declination)
    note = f"magnetic north lies {declination_deg:.1f} deg east of true north, by the {field.model}"
    return field.declination, (note,)


def _load_reference(
    reference: Poses | _Path | _Columns | None, offset: float
) -> tuple[Poses | None, _Columns | None]:
    """Return the true poses, or the names of the source's columns with them."""
    if isinstance(reference, Poses):
        return _shift_time(reference, offset), None
    if isinstance(reference, str | os.PathLike):
        path = Path(reference)
        if path.exists() and not path.is_dir():
            return _shift_time(read_poses(path), offset), None
        if not isinstance(reference, str) or _is_file_name(reference):
            raise ValueError(
                make_sentence(keyword_argument("reference"), f" names {path}, which does not exist")
            )
        reference = [_parse_column(word) for word in reference.split(",")]
    if offset:
        message = (
            keyword_argument("reference_offset"),
            " acts on a file that ",
            keyword_argument("reference"),
            " names",
        )
        raise ValueError(make_sentence(*message))
    return None, reference


def _shift_time(poses: Poses, offset: float) -> Poses:
    return replace(poses, time=poses.time + offset) if offset else poses


def _is_file_name(text: str) -> bool:
    return text.endswith(_FILE_SUFFIXES) or "/" in text or "\\" in text


def _parse_column(word: str) -> str | int:
    name = word.strip()
    return int(name) if name.lstrip("-").isdecimal() else name


def _check_heading(heading: str | None) -> None:
    headings = get_args(Heading)
    if heading is not None and heading not in headings:
        raise ArgumentError(
            "reference_heading", f"must be one of {', '.join(headings)}, got {heading!r}"
        )


def files_of(result: AttitudeEstimate, *, tum: bool = False, view: bool = False) -> Files:
    """Return the files of an attitude: log and figure; on request also poses and a 3D page."""
    writers: list[Writer] = [lambda path: write_log(result.to_log(), path)]
    endings = []
    if tum:
        writers.append(text_writer(result.poses().to_tum()))
        endings.append(".tum")
    if view:
        writers.append(text_writer(page_of(result)))
        endings.append(".html")
    return Files("-zerorate-attitude", "", writers, endings, {"": figure_writer(result.plot)})
