"""Comparison of attitude filters with a reference orientation."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from typing import Any, Final, Literal, cast

from zerorate._native import Attitude
from zerorate.attitude.estimate import METHODS
from zerorate.faults import ArgumentError
from zerorate.geometry.frames import FRAMES, Frame, in_enu
from zerorate.metrics import orientation_errors
from zerorate.progress import Progress, choose_reporter
from zerorate.record import LogError, Recording
from zerorate.tasks.compare.comparison import Comparison
from zerorate.tasks.compare.imu import Imu
from zerorate.tasks.compare.measures import Row
from zerorate.tasks.compare.orientation import turning_speed
from zerorate.tasks.compare.peers import PEERS, Run, is_missing
from zerorate.tasks.compare.trial import Orientation, Trial
from zerorate.tasks.compare.turning import MIN_MOVING_RATE_RAD_S
from zerorate.types import Booleans, Floats

_ERRORS: Final = ("total", "heading", "inclination")
_SPEED_WINDOW_S: Final = 0.5
"""Window for the speed of the reference, s; long enough to average out jitter of markers."""
_OWN_METHODS: Final = METHODS
_SMOOTHER: Final = "auto+smooth"
ATTITUDE_METHODS: Final = (*_OWN_METHODS, *PEERS, _SMOOTHER)
"""Methods of `zerorate.Attitude`, and filters of other packages."""
OFFLINE_METHODS: Final = (_SMOOTHER, *(name for name, peer in PEERS.items() if not peer.causal))
"""Methods that use the whole recording."""


def compare_attitude(
    recordings: Sequence[Recording | Trial],
    methods: Sequence[str] = ATTITUDE_METHODS,
    progress: Progress | None = None,
    *,
    frame: Frame = "enu",
) -> Comparison:
    """Measure attitude filters on recordings with a reference orientation.

    Parameters
    ----------
    recordings : sequence of Recording or Trial
        Recordings with gyro, accelerometer and orientation. If there is a magnetometer, the filters
        also run with nine axes. Each sample of another sensor is moved to the nearest gyro sample.
    methods : sequence of str
        Methods of `zerorate.Attitude`, and filters of other packages with their defaults:
        ``"vqf"``, ``"imufusion"``, ``"ahrs-madgwick"`` and ``"ahrs-mahony"``. Filters that are not
        installed are left out, with a note. Two methods use the whole recording: ``"auto+smooth"``
        (`zerorate.Attitude.smooth`) and ``"vqf-offline"``.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.
    frame : {"enu", "ned", "nwu"}
        Earth axes of the reference. Its north must be magnetic north.

    Returns
    -------
    Comparison
        Comparison of kind ``"attitude"``, with the errors of `zerorate.metrics.orientation_errors`
        while the reference moves. Each row has errors in rad: ``total``, ``heading`` and
        ``inclination`` with nine axes, ``heading_6`` (relative) and ``inclination_6`` with six
        axes. ``time`` and ``time_6`` are the computing times per sample, s.

    Raises
    ------
    LogError
        If a recording has no accelerometer or orientation, or a unit is unknown.
    ValueError
        If a method or the frame is unknown.

    Examples
    --------
    >>> import zerorate as zr
    >>> recording = zr.simulate_motion("hand", duration=30.0, seed=1).recording()
    >>> found = zr.tasks.compare.compare_attitude([recording], ["auto"])
    >>> row = found.rows[0]
    >>> row.method, row.values["inclination"] < 0.02  # rad
    ('auto', True)
    """
    check_attitude_methods(methods, frame)
    available, notes = _split_installed(methods)
    trials = [
        recording if isinstance(recording, Trial) else Trial.of(recording)
        for recording in recordings
    ]
    report, rows = choose_reporter(progress), []
    for i, trial in enumerate(trials):
        if trial.orientation is None:
            raise LogError(f"{trial.source}: there is no orientation to compare attitudes with")
        imu = Imu.of(trial)
        notes.extend(_clock_notes(trial))
        for j, row in enumerate(_rows(trial, imu, trial.orientation, available, frame)):
            rows.append(row)
            report("attitude", (i + (j + 1) / len(available)) / len(trials))
    return Comparison("attitude", tuple(rows), tuple(notes))


def check_attitude_methods(methods: Sequence[str], frame: str) -> None:
    """Raise ValueError for an unknown or repeated method, or an unknown frame."""
    unknown = [name for name in methods if name not in ATTITUDE_METHODS]
    if unknown:
        raise ValueError(
            f"there is no method of attitude '{unknown[0]}'; known: {', '.join(ATTITUDE_METHODS)}"
        )
    if len(set(methods)) < len(methods):
        raise ValueError(f"methods of attitude must all be different, got {', '.join(methods)}")
    if frame not in FRAMES:
        raise ArgumentError("frame", f"must be one of {', '.join(FRAMES)}, got {frame!r}")


def _split_installed(methods: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the methods that can run, and notes on the others."""
    absent = [name for name in methods if name in PEERS and is_missing(name)]
    packages = dict.fromkeys(PEERS[name].package for name in absent)
    notes = [f"not installed, so left out: {', '.join(packages)}"] if packages else []
    return [name for name in methods if name not in absent], notes


def _clock_notes(trial: Trial) -> Iterator[str]:
    for log in (trial.accel, trial.mag):
        if log is not None and (log.n, log.rate) != (trial.log.n, trial.log.rate):
            yield (
                f"{trial.source}: {', '.join(log.names)} at {log.rate:g} Hz, each sample at the "
                "nearest one of the gyro"
            )


def _rows(
    trial: Trial, imu: Imu, truth: Orientation, methods: Sequence[str], frame: Frame
) -> Iterator[Row]:
    true = in_enu(truth.quaternions, frame)
    moving = turning_speed(true, imu.rate, _SPEED_WINDOW_S) > MIN_MOVING_RATE_RAD_S
    for method in methods:
        values: dict[str, float] = {}
        if imu.mag is not None:
            nine_axes = _run_method(method, imu)
            values |= _errors(nine_axes.quaternions, true, moving, "absolute")
            values["time"] = nine_axes.seconds / len(true)
        six_axes = _run_method(method, imu.six_axes())
        drift = _errors(six_axes.quaternions, true, moving, "relative")
        values |= {f"{name}_6": drift[name] for name in ("heading", "inclination")}
        values["time_6"] = six_axes.seconds / len(true)
        yield Row(trial.source, "all", method, "rad", values, causal=method not in OFFLINE_METHODS)


def _run_method(method: str, imu: Imu) -> Run:
    if method in PEERS:
        return PEERS[method].run(imu)
    name = method.removesuffix("+smooth")
    attitude: Any = Attitude(imu.rate, mag=imu.mag is not None, method=cast(Any, name))
    start = time.perf_counter()
    if method == _SMOOTHER:
        quaternions = attitude.smooth(imu.gyro, imu.accel, imu.mag)["quaternion"]
    else:
        quaternions = attitude.process(imu.gyro, imu.accel, imu.mag)
    return Run(quaternions, time.perf_counter() - start)


def _errors(
    quaternions: Floats, true: Floats, where: Booleans, heading: Literal["absolute", "relative"]
) -> dict[str, float]:
    """Return the errors by name; NaN if the reference never moves."""
    try:
        errors = orientation_errors(quaternions, true, where=where, heading=heading)
    except ValueError:
        return dict.fromkeys(_ERRORS, math.nan)
    return {name: getattr(errors, name) for name in _ERRORS}
