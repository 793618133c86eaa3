"""Comparison of filters of attitude with an orientation that something else measured."""

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
from zerorate.progress import Progress, reported
from zerorate.record import LogError, Recording
from zerorate.tasks.compare.comparison import Comparison
from zerorate.tasks.compare.imu import Imu
from zerorate.tasks.compare.measures import Row
from zerorate.tasks.compare.orientation import turning_speed
from zerorate.tasks.compare.peers import PEERS, Run, missing
from zerorate.tasks.compare.trial import Orientation, Trial
from zerorate.tasks.compare.turning import MOVING
from zerorate.types import Booleans, Floats

_ERRORS: Final = ("total", "heading", "inclination")
_SPEED_OVER: Final = 0.5
"""Seconds over which the reference's speed is taken: so long that jitter of markers is none."""
_OWN: Final = METHODS
_SMOOTHED: Final = "auto+smooth"
ATTITUDE_METHODS: Final = (*_OWN, *PEERS, _SMOOTHED)
"""Methods of `zerorate.Attitude`, and filters of other packages."""
OFFLINE: Final = (_SMOOTHED, *(name for name, peer in PEERS.items() if not peer.causal))
"""Those that see the whole record."""


def compare_attitude(
    recordings: Sequence[Recording | Trial],
    methods: Sequence[str] = ATTITUDE_METHODS,
    progress: Progress | None = None,
    *,
    frame: Frame = "enu",
) -> Comparison:
    """Measure filters of attitude on recordings with a reference orientation.

    Parameters
    ----------
    recordings : sequence of Recording or Trial
        Each with a gyro, an accelerometer and an orientation; with a magnetometer the filters are
        also run with nine axes. A sample on another clock than the gyro's stands at the nearest
        one of the gyro.
    methods : sequence of str
        Methods of `zerorate.Attitude`, and of other packages, with their own defaults:
        ``"vqf"``, ``"imufusion"``, ``"ahrs-madgwick"`` and ``"ahrs-mahony"``. One that is not
        installed is left out, and a note says so. Two see the whole record: ``"auto+smooth"``,
        which is `zerorate.Attitude.smooth`, and ``"vqf-offline"``.
    progress : callable, optional
        Called with a step's name and the fraction of it that is done.
        By default a bar in a notebook.
    frame : {"enu", "ned", "nwu"}
        Of the earth, to which the reference turns the sensor. Its north must be the magnetic one.

    Returns
    -------
    Comparison
        Of kind ``"attitude"``, with the errors of `zerorate.metrics.orientation_errors` where the
        reference moves. In each row, rad: ``total``, ``heading`` and ``inclination`` of nine axes,
        ``heading_6`` (relative) and ``inclination_6`` of six; and the s that a sample took,
        ``time`` and ``time_6``.

    Raises
    ------
    LogError
        If a recording lacks the accelerometer or the orientation, or a unit is not known.
    ValueError
        If a method or the frame is not known.

    Examples
    --------
    >>> import zerorate as zr
    >>> recording = zr.simulate_motion("hand", duration=30.0, seed=1).recording()
    >>> found = zr.tasks.compare.compare_attitude([recording], ["auto"])
    >>> row = found.rows[0]
    >>> row.method, row.values["inclination"] < 0.02  # rad
    ('auto', True)
    """
    check_attitude(methods, frame)
    chosen, notes = _installed(methods)
    trials = [one if isinstance(one, Trial) else Trial.of(one) for one in recordings]
    report, rows = reported(progress), []
    for i, trial in enumerate(trials):
        if trial.orientation is None:
            raise LogError(f"{trial.source}: there is no orientation to compare attitudes with")
        imu = Imu.of(trial)
        notes.extend(_on_clocks(trial))
        for j, row in enumerate(_rows(trial, imu, trial.orientation, chosen, frame)):
            rows.append(row)
            report("attitude", (i + (j + 1) / len(chosen)) / len(trials))
    return Comparison("attitude", tuple(rows), tuple(notes))


def check_attitude(methods: Sequence[str], frame: str) -> None:
    """Raise ValueError if a method is not known or named twice, or the frame is not known."""
    unknown = [name for name in methods if name not in ATTITUDE_METHODS]
    if unknown:
        raise ValueError(
            f"there is no method of attitude '{unknown[0]}'; known: {', '.join(ATTITUDE_METHODS)}"
        )
    if len(set(methods)) < len(methods):
        raise ValueError(f"methods of attitude must all be different, got {', '.join(methods)}")
    if frame not in FRAMES:
        raise ArgumentError("frame", f"must be one of {', '.join(FRAMES)}, got {frame!r}")


def _installed(methods: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the methods that can be run, and notes on those that cannot."""
    absent = [name for name in methods if name in PEERS and missing(name)]
    packages = dict.fromkeys(PEERS[name].package for name in absent)
    notes = [f"not installed, so left out: {', '.join(packages)}"] if packages else []
    return [name for name in methods if name not in absent], notes


def _on_clocks(trial: Trial) -> Iterator[str]:
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
    moving = turning_speed(true, imu.rate, _SPEED_OVER) > MOVING
    for method in methods:
        values: dict[str, float] = {}
        if imu.mag is not None:
            nine = _run(method, imu)
            values |= _errors(nine.quaternions, true, moving, "absolute")
            values["time"] = nine.seconds / len(true)
        six = _run(method, imu.six_axes())
        drift = _errors(six.quaternions, true, moving, "relative")
        values |= {f"{name}_6": drift[name] for name in ("heading", "inclination")}
        values["time_6"] = six.seconds / len(true)
        yield Row(trial.source, "all", method, "rad", values, causal=method not in OFFLINE)


def _run(method: str, imu: Imu) -> Run:
    if method in PEERS:
        return PEERS[method].run(imu)
    name = method.removesuffix("+smooth")
    attitude: Any = Attitude(imu.rate, mag=imu.mag is not None, method=cast(Any, name))
    start = time.perf_counter()
    if method == _SMOOTHED:
        quaternions = attitude.smooth(imu.gyro, imu.accel, imu.mag)["quaternion"]
    else:
        quaternions = attitude.process(imu.gyro, imu.accel, imu.mag)
    return Run(quaternions, time.perf_counter() - start)


def _errors(
    quaternions: Floats, true: Floats, where: Booleans, heading: Literal["absolute", "relative"]
) -> dict[str, float]:
    """Return the errors by name, NaN where nothing moves while the reference is there."""
    try:
        found = orientation_errors(quaternions, true, where=where, heading=heading)
    except ValueError:
        return dict.fromkeys(_ERRORS, math.nan)
    return {name: getattr(found, name) for name in _ERRORS}
