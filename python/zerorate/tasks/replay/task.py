"""Bias of a gyro, sample by sample as in a live stream: ``zerorate replay``."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, Self, Unpack

import numpy.typing as npt

from zerorate.calibration.calibration import Calibration
from zerorate.checks.preparation import FILTER_CHOICES
from zerorate.faults import ArgumentError
from zerorate.io.counts import Scale
from zerorate.io.logfile import LogFile
from zerorate.io.reading import read_log
from zerorate.io.writing import write_log
from zerorate.options import METHODS, add_rest_limits, check_used
from zerorate.progress import Progress, choose_reporter
from zerorate.record.log import Log
from zerorate.record.names import split_unit
from zerorate.tasks.corrections import calibration_of
from zerorate.tasks.imu import Imu
from zerorate.tasks.replay.result import Panels, Replay, Summary
from zerorate.tasks.replay.run import BLOCK_ROWS, HORIZONS, filter_to_file, run_filters
from zerorate.tasks.saving import Files, figure_writer
from zerorate.tasks.source import Source, UnscaledArguments, name_source_in_errors
from zerorate.units import convert

if TYPE_CHECKING:
    from zerorate._native import _FilterOptions, _Method, _Output

    class ReplayOptions(_FilterOptions, UnscaledArguments, total=False):
        """Options of `zerorate.DriftFilter`, and arguments of reading."""

        output: _Output
        data_scale: Scale
else:
    ReplayOptions = dict

Path_ = str | os.PathLike[str]
_READING_OPTIONS: Final = UnscaledArguments.__optional_keys__
_ALL: Final = "all"


def replay(
    source: Source | LogFile,
    *,
    method: _Method = "auto",
    methods: Sequence[str] | Literal["all"] = (),
    accel: bool | Log = True,
    calibration: Calibration | Path_ | None = None,
    fix: bool = False,
    truth: npt.ArrayLike | Path_ | None = None,
    horizons: Sequence[float] = HORIZONS,
    progress: Progress | None = None,
    **options: Unpack[ReplayOptions],
) -> Replay:
    """Remove the bias from every axis of a log, sample by sample as in a live stream.

    The recording is checked first; rates are not changed. ``zerorate replay`` does the same.

    Parameters
    ----------
    source : Recording, Log, path, data frame or mapping of arrays
        Recording with a gyro. An accelerometer with three axes, if any, detects motion.
    method : str
        Method of `zerorate.DriftFilter`. Default "auto", which tunes itself.
    methods : sequence of str or "all"
        Methods to compare with `method`.
    accel : bool or Log
        False: ignore the accelerometer. A Log: use this log as accelerometer.
    calibration : Calibration or path, optional
        Calibration that corrects the gyro first.
    fix : bool
        Correct the gyro's unit or axes if the motion clearly contradicts them.
    truth : array_like or path, optional
        True bias, if known: an array in the shape and unit of the data. Or a file from ``zerorate
        simulate`` with columns such as ``drift_x_radps``.
    horizons : sequence of float
        Horizons of the coasting error, s.
    progress : callable, optional
        Called in this thread with the name of the step and the fraction done. By default a notebook
        shows a bar.
    **options
        Options of `zerorate.DriftFilter`; each is passed to the methods that use it. If the unit is
        known, `rest_limit` defaults to 10 deg/s and `bias_limit` to 20 deg/s; None means no limit.
        If the source is a file, also arguments of `zerorate.read_log`; the argument ``scale`` is
        named ``data_scale`` here.

    Returns
    -------
    Replay
        The filtered log, scores and learned parameters. The result has the methods `table`, `plot`
        and `save`.

    Raises
    ------
    LogError
        If there is no gyro, all samples are missing, or the source cannot be read.
    ValueError
        If a method or an option is not valid, or if none of the methods uses an option.

    Examples
    --------
    >>> import zerorate as zr
    >>> motion = zr.simulate_motion("hand", duration=60.0, seed=1)
    >>> found = zr.replay(motion.recording())
    >>> found.method, found.alarms, found.to_log().names
    ('auto', (), ('gyro_x_radps', 'gyro_y_radps', 'gyro_z_radps'))
    """
    report = choose_reporter(progress)
    request = _ReplayRequest.of(method, methods, horizons, options)
    report("reading", 0.0)
    imu = _load_imu(source, request, accel, calibration, fix)
    with name_source_in_errors(imu.source, imu.alarms):
        log = imu.gyro.log()
        accel_log = None if imu.accel is None else imu.accel.log()
        result = run_filters(
            log,
            accel=accel_log,
            truth=_load_truth(truth, log),
            progress=report,
            **request.of_log(log.unit),
        )
    return replace(result, alarms=imu.alarms)


def _load_truth(truth: npt.ArrayLike | Path_ | None, log: Log) -> npt.ArrayLike | None:
    """Return the true bias of a log; from a file it is converted to the log's unit."""
    if not isinstance(truth, str | os.PathLike):
        return truth
    axes = [name.rpartition("_") for name in (split_unit(own)[0] for own in log.names)]
    columns = [f"drift_{axis}_radps" for _, _, axis in axes]
    drift = read_log(truth, columns=columns, rate=log.rate, unit="rad/s").data
    return convert(drift, "rad/s", log.unit)


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
    rows: int = BLOCK_ROWS,
    **options: Unpack[ReplayOptions],
) -> Summary:
    """Remove the bias from a log of any length, block by block, and write the filtered log.

    Scores and file are identical to the results of `replay` and ``save(figure=False)``. If input
    and output are Parquet, the length is unlimited. Other formats need memory for the whole log.

    Parameters
    ----------
    source : Recording, Log, LogFile, path, data frame or mapping of arrays
        Source as in `replay`. The checks use the first million samples.
    path : path
        File to write. After an error, no partial file remains.
    method, methods, accel, calibration, fix, horizons, progress, **options
        As in `replay`.
    force : bool
        Replace an existing file.
    rows : int
        Number of samples per block; the results do not depend on it.

    Returns
    -------
    Summary
        Results of `replay` without the samples.

    Raises
    ------
    LogError, ValueError
        As in `replay`.
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
    request = _ReplayRequest.of(method, methods, horizons, options)
    imu = _load_imu(source, request, accel, calibration, fix)
    with name_source_in_errors(imu.source, imu.alarms):
        summary = filter_to_file(
            imu.gyro, Path(path), accel=imu.accel, force=force, progress=progress, rows=rows,
            **request.of_log(imu.gyro.header.unit),
        )  # fmt: skip
    return replace(summary, alarms=imu.alarms)


@dataclass(frozen=True)
class _ReplayRequest:
    """Arguments for the filters and for the reader."""

    methods: tuple[str, ...]
    horizons: Sequence[float]
    options: Mapping[str, Any]
    reading: Mapping[str, Any]

    @classmethod
    def of(
        cls,
        method: str,
        comparison: Sequence[str] | Literal["all"],
        horizons: Sequence[float],
        arguments: Mapping[str, Any],
    ) -> Self:
        """Return the checked arguments, sorted by use."""
        reading = {name: value for name, value in arguments.items() if name in _READING_OPTIONS}
        options = {name: value for name, value in arguments.items() if name not in _READING_OPTIONS}
        if "data_scale" in options:
            reading["scale"] = options.pop("data_scale")
        methods = (*_comparison_methods(comparison, method), method)
        check_used((name for name in options if name != "output"), methods)
        return cls(methods, horizons, options, reading)

    def of_log(self, unit: str) -> dict[str, Any]:
        """Return the arguments of the filters for a log with this unit."""
        filter_options = add_rest_limits(self.options, self.methods, unit)
        return {"methods": self.methods, "horizons": self.horizons, **filter_options}


def _comparison_methods(comparison: Sequence[str], method: str) -> tuple[str, ...]:
    """Return the methods to compare with the chosen method."""
    names = METHODS if isinstance(comparison, str) and comparison == _ALL else tuple(comparison)
    for name in names:
        if name not in METHODS:
            known = ", ".join(METHODS)
            raise ArgumentError("methods", f"takes all, or some of {known}, got '{name}'")
    return tuple(dict.fromkeys(name for name in names if name != method))


def _load_imu(
    source: Source | LogFile,
    request: _ReplayRequest,
    accel: bool | Log,
    calibration: Calibration | Path_ | None,
    fix: bool,
) -> Imu:
    limit = request.options.get("bias_limit", 0.0)
    bias_limit = math.inf if limit is None else limit or None
    choices = replace(FILTER_CHOICES, fix=fix, bias_limit=bias_limit)
    imu = Imu.of(source, request.reading, calibration_of(calibration), choices)
    if isinstance(accel, Log):
        return replace(imu, accel=LogFile.of(accel))
    return imu if accel else replace(imu, accel=None)


def files_of(result: Replay, *, panels: Panels = "usual") -> Files:
    """Return the files of a replay: the filtered log and a figure."""
    figure = figure_writer(lambda: result.plot(panels))
    return Files("-zerorate", "", [lambda path: write_log(result.to_log(), path)], (), {"": figure})
