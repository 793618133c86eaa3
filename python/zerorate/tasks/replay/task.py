"""What ``zerorate replay`` does: the bias of a gyro, sample by sample as live."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, Self, Unpack

import numpy.typing as npt

from zerorate.calibration.calibration import Calibration
from zerorate.checks.preparation import FILTERED
from zerorate.faults import ArgumentError
from zerorate.io.counts import Scale
from zerorate.io.logfile import LogFile
from zerorate.io.writing import write_log
from zerorate.options import METHODS, check_used, with_limits
from zerorate.progress import Progress, reported
from zerorate.record.log import Log
from zerorate.tasks.corrections import calibration_of
from zerorate.tasks.imu import Imu
from zerorate.tasks.replay.result import Panels, Replay, Summary
from zerorate.tasks.replay.run import HORIZONS, ROWS, filter_to_file, run_filters
from zerorate.tasks.saving import Files, figure_writer
from zerorate.tasks.source import Source, UnscaledArguments, explained

if TYPE_CHECKING:
    from zerorate._native import _FilterOptions, _Method, _Output

    class ReplayOptions(_FilterOptions, UnscaledArguments, total=False):
        """Options of `zerorate.DriftFilter`, and arguments of reading."""

        output: _Output
        data_scale: Scale
else:
    ReplayOptions = dict

Path_ = str | os.PathLike[str]
_READING: Final = UnscaledArguments.__optional_keys__
_ALL: Final = "all"


def replay(
    source: Source | LogFile,
    *,
    method: _Method = "auto",
    methods: Sequence[str] | Literal["all"] = (),
    accel: bool | Log = True,
    calibration: Calibration | Path_ | None = None,
    fix: bool = False,
    truth: npt.ArrayLike | None = None,
    horizons: Sequence[float] = HORIZONS,
    progress: Progress | None = None,
    **options: Unpack[ReplayOptions],
) -> Replay:
    """Remove the bias from every axis of a log, sample by sample as live.

    The recording is checked first; rates stay as they were measured. ``zerorate replay`` does the
    same.

    Parameters
    ----------
    source : Recording, Log, path, data frame or mapping of arrays
        With a gyro. An accelerometer of three axes shows when the body moves.
    method : str
        Method of `zerorate.DriftFilter`; default the one that tunes itself.
    methods : sequence of str or "all"
        Methods to compare it with.
    accel : bool or Log
        False leaves the accelerometer alone; a Log is the accelerometer.
    calibration : Calibration or path, optional
        Taken off the gyro first.
    fix : bool
        Put right a unit or axes of the gyro that the motion contradicts, where that is sure.
    truth : array_like, optional
        True bias, of the shape and unit of the data, where it is known.
    horizons : sequence of float
        Horizons of the coasting error, s.
    progress : callable, optional
        Called in this thread with a step's name and the fraction that is done. By default a bar in
        a notebook.
    **options
        Options of `zerorate.DriftFilter`, each for those methods that use it. Where the unit is
        known `rest_limit` is 10 deg/s and `bias_limit` 20 deg/s unless they are given; None is no
        limit. Arguments of `zerorate.read_log` for a source that is read; its ``scale`` is
        ``data_scale`` here.

    Returns
    -------
    Replay
        The filtered log, scores, what was learned; `table`, `plot`, `save`.

    Raises
    ------
    LogError
        If there is no gyro, no axis holds a sample, or the source cannot be read.
    ValueError
        If a method or an option is not valid, or no method uses an option.

    Examples
    --------
    >>> import zerorate as zr
    >>> motion = zr.simulate_motion("hand", duration=60.0, seed=1)
    >>> found = zr.replay(motion.recording())
    >>> found.method, found.alarms, found.to_log().names
    ('auto', (), ('gyro_x_radps', 'gyro_y_radps', 'gyro_z_radps'))
    """
    report = reported(progress)
    asked = _Asked.of(method, methods, horizons, options)
    report("reading", 0.0)
    imu = _imu(source, asked, accel, calibration, fix)
    with explained(imu.source, imu.alarms):
        log = imu.gyro.log()
        own = None if imu.accel is None else imu.accel.log()
        found = run_filters(log, accel=own, truth=truth, progress=report, **asked.of_log(log.unit))
    return replace(found, alarms=imu.alarms)


def replay_to_file(
    source: Source | LogFile,
    path: Path_,
    *,
    method: _Method = "auto",
    methods: Sequence[str] | Literal["all"] = (),
    accel: bool | Log = True,
    calibration: Calibration | Path_ | None = None,
    fix: bool = False,
    horizons: Sequence[float] = HORIZONS,
    force: bool = False,
    progress: Progress | None = None,
    rows: int = ROWS,
    **options: Unpack[ReplayOptions],
) -> Summary:
    """Remove the bias from a log of any length, block by block, and write the filtered log.

    Scores and bytes are those of `replay` and its ``save(figure=False)``. The length does not
    matter for Parquet in and out; other formats are made in memory.

    Parameters
    ----------
    source : Recording, Log, LogFile, path, data frame or mapping of arrays
        As of `replay`. The checks judge the first million samples.
    path : path
        The file to write, whole or not at all.
    method, methods, accel, calibration, fix, horizons, progress, **options
        As of `replay`.
    force : bool
        Replace an existing file.
    rows : int
        Samples of a block; the results do not depend on it.

    Returns
    -------
    Summary
        All that `replay` gives, without the samples.

    Raises
    ------
    LogError, ValueError
        As of `replay`.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> import zerorate as zr
    >>> from zerorate.tasks.replay import replay_to_file
    >>> folder = Path(tempfile.mkdtemp())
    >>> z = 0.5 + 0.1 * np.random.default_rng(1).standard_normal(6000)
    >>> log = zr.Log(np.arange(6000) / 100.0, 100.0, z, ["gyro_z"])
    >>> zr.write_log(log, folder / "raw.parquet")
    >>> summary = replay_to_file(folder / "raw.parquet", folder / "filtered.parquet")
    >>> summary.header.n, [score.method for score in summary.scores]
    (6000, ['raw', 'auto'])
    """
    asked = _Asked.of(method, methods, horizons, options)
    imu = _imu(source, asked, accel, calibration, fix)
    with explained(imu.source, imu.alarms):
        found = filter_to_file(
            imu.gyro, Path(path), accel=imu.accel, force=force, progress=progress, rows=rows,
            **asked.of_log(imu.gyro.header.unit),
        )  # fmt: skip
    return replace(found, alarms=imu.alarms)


@dataclass(frozen=True)
class _Asked:
    """What is asked of the filters, and of the reader."""

    methods: tuple[str, ...]
    horizons: Sequence[float]
    options: Mapping[str, Any]
    reading: Mapping[str, Any]

    @classmethod
    def of(
        cls,
        method: str,
        compared: Sequence[str] | Literal["all"],
        horizons: Sequence[float],
        given: Mapping[str, Any],
    ) -> Self:
        """Return what was given, sorted and checked."""
        reading = {name: value for name, value in given.items() if name in _READING}
        options = {name: value for name, value in given.items() if name not in _READING}
        if "data_scale" in options:
            reading["scale"] = options.pop("data_scale")
        methods = (*_others(compared, method), method)
        check_used((name for name in options if name != "output"), methods)
        return cls(methods, horizons, options, reading)

    def of_log(self, unit: str) -> dict[str, Any]:
        """Return the arguments of the filters of a log in a unit."""
        known = with_limits(self.options, self.methods, unit)
        return {"methods": self.methods, "horizons": self.horizons, **known}


def _others(compared: Sequence[str], method: str) -> tuple[str, ...]:
    """Return the methods that the chosen one is compared with."""
    names = METHODS if isinstance(compared, str) and compared == _ALL else tuple(compared)
    for name in names:
        if name not in METHODS:
            known = ", ".join(METHODS)
            raise ArgumentError("methods", f"takes all, or some of {known}, got '{name}'")
    return tuple(dict.fromkeys(name for name in names if name != method))


def _imu(
    source: Source | LogFile,
    asked: _Asked,
    accel: bool | Log,
    calibration: Calibration | Path_ | None,
    fix: bool,
) -> Imu:
    limit = asked.options.get("bias_limit", 0.0)
    known = math.inf if limit is None else limit or None
    choices = replace(FILTERED, fix=fix, bias_limit=known)
    imu = Imu.of(source, asked.reading, calibration_of(calibration), choices)
    if isinstance(accel, Log):
        return replace(imu, accel=LogFile.of(accel))
    return imu if accel else replace(imu, accel=None)


def files_of(found: Replay, *, panels: Panels = "usual") -> Files:
    """Return what a replay is saved as: the filtered log and a figure."""
    figure = figure_writer(lambda: found.plot(panels))
    return Files("-zerorate", "", [lambda path: write_log(found.to_log(), path)], (), {"": figure})
