"""Replay of an array, as ``zerorate replay --array``: many gyros fused into one."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, TypeAlias, Unpack

import numpy as np
import numpy.typing as npt

from zerorate._native import GyroArray, allan_deviations
from zerorate.array.accelerometers import FusedAccelerometers, fuse_accelerometers
from zerorate.array.logs import ArrayLog, array_log
from zerorate.array.rotations import Rotations, find_rotations, read_rotations
from zerorate.checks.preparation import FILTER_CHOICES, prepare
from zerorate.faults import ArgumentError, bare_argument, keyword_argument, make_sentence
from zerorate.geometry.scipy_rotation import RotationLike, as_matrices
from zerorate.io.writing import write_log
from zerorate.numerals import shorten
from zerorate.options import add_rest_limits
from zerorate.progress import Progress, choose_reporter
from zerorate.record.log import Log, LogError, notes_of
from zerorate.record.names import add_unit_suffix
from zerorate.record.recording import Recording
from zerorate.record.runs import runs
from zerorate.tasks.replay.measures import onset_samples
from zerorate.tasks.saving import Files, Writer, figure_writer, text_writer
from zerorate.tasks.source import ReadingArguments, Source, name_source_in_errors, recording_of
from zerorate.types import Booleans, Floats, Integers
from zerorate.units import UNITS
from zerorate.views import Result

Weights: TypeAlias = Literal["auto", "mean", "white"]
Columns: TypeAlias = dict[str, Floats | Booleans]

Path_ = str | os.PathLike[str]

_BLOCK_ROWS: Final = 1 << 14
_REPORTED_TAU_S: Final = 1.0
_READING_OPTIONS: Final = ReadingArguments.__optional_keys__
_FIND: Final = "find"
_MAX_MISALIGNMENT_DEG: Final = 5.0
"""Smallest angle between sensors that is reported as misalignment, deg."""
_MAX_LISTED_SPANS: Final = 3
"""Largest number of listed spans of an exclusion."""

SAMPLE_FATES: Final = ("used", "missing", "saturated", "excluded", "left out")
"""Possible treatments of a sensor's sample; `ArrayReplay.fate` contains indices of this tuple.

"left out": the sample is far from all other sensors, the sensor is stuck, or it has not learned its
bias yet while others have.
"""
_USED, _MISSING, _SATURATED, _EXCLUDED, _LEFT_OUT = range(len(SAMPLE_FATES))


@dataclass(frozen=True, eq=False)
class ArrayAllan:
    """Overlapping Allan deviations at rest, with all biases subtracted, in the unit of the log.

    Parameters
    ----------
    taus : ndarray, shape (m,)
        Averaging times, s: octaves, and the time closest to one second.
    sensors : ndarray, shape (N, axes, m)
        Deviations of each sensor in the axes of the body; NaN if there are no two consecutive
        clusters with all samples.
    mean : ndarray, shape (axes, m)
        Deviations of the plain mean of all sensors.
    fused : ndarray, shape (axes, m)
        Deviations of the fused rate.
    second : int
        Index of one second in `taus`.
    """

    taus: Floats
    sensors: Floats
    mean: Floats
    fused: Floats
    second: int

    def gains(self) -> tuple[Floats, Floats]:
        """Return the gains over the plain mean and over one sensor: two arrays (axes + 1, m).

        A gain is a ratio of deviations. The last row is for all axes: it is computed from the mean
        squared deviations over axes and sensors.
        """
        squares = [np.concatenate((s, s.mean(axis=0, keepdims=True))) for s in self._squares()]
        single, mean, fused = squares
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.sqrt(mean / fused), np.sqrt(single / fused)

    def _squares(self) -> tuple[Floats, Floats, Floats]:
        return _finite_mean(self.sensors**2, axis=0), self.mean**2, self.fused**2


@dataclass(frozen=True, eq=False, kw_only=True)
class ArrayReplay(Result):
    """Result of the replay of an array with N sensors and n samples.

    Parameters
    ----------
    log : ArrayLog
        The log of the array.
    rotations : ndarray, shape (N, 3, 3), or None
        Rotations from each sensor's axes to the axes of the body; None if all are assumed aligned.
    params : mapping
        Other arguments that make the same `GyroArray`.
    rate : ndarray, shape (n, 3) or (n,)
        Rate of the body without its bias; NaN if no sensor is left.
    weights : ndarray, shape (n, N)
        Share of each sensor in the rate, averaged over the axes; 0 if the sensor was not used.
    fate : ndarray of int8, shape (n, N)
        Treatment of each sample: an index of `SAMPLE_FATES`.
    disputed : ndarray of bool, shape (n,)
        True where sensors disagreed and the wrong one could not be identified.
    at_rest : ndarray of bool, shape (n, axes)
        True where the body was at rest.
    bias : ndarray, shape (N, 3) or (N,)
        Bias of each sensor in its own axes, at the end.
    health : tuple of str
        Health of each sensor at the end.
    allan : ArrayAllan or None
        Allan deviations; None if the body was never at rest.
    speed : float
        Number of samples processed per second on one core, summed over all sensors. The time
        includes the storage of these results.
    accel : FusedAccelerometers or None
        The fused accelerometers; None if the log has none.
    accel_allan : ArrayAllan or None
        Allan deviations of the accelerometers at rest, in their unit.
    rotation_set : Rotations or None
        The rotations with their standard errors; None if they were neither found nor read.
    rotations_found : bool
        True if rotations were found from the motion; `save` then also writes them.
    remarks : tuple of str
        Sentences on the alignment of the sensors relative to each other.
    alarms : tuple of str
        Contradictions in the recording, one sentence each.
    """

    log: ArrayLog
    rotations: Floats | None
    params: Mapping[str, Any]
    rate: Floats
    weights: Floats
    fate: npt.NDArray[np.int8]
    disputed: Booleans
    at_rest: Booleans
    bias: Floats
    health: tuple[str, ...]
    allan: ArrayAllan | None
    speed: float
    accel: FusedAccelerometers | None = None
    accel_allan: ArrayAllan | None = None
    rotation_set: Rotations | None = None
    rotations_found: bool = False
    remarks: tuple[str, ...] = ()
    alarms: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """Name of the recording."""
        return str(self.log.meta.get("source", "the log"))

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on the log and its sensors."""
        return tuple(notes_on(self))

    @property
    def shares(self) -> Floats:
        """Share of each sensor's samples by treatment, in the order of `SAMPLE_FATES`, (N, 5)."""
        return np.stack(
            [(self.fate == kind).mean(axis=0) for kind in range(len(SAMPLE_FATES))], axis=1
        )

    @property
    def rest_mask(self) -> Booleans:
        """Mask of samples at which the body is certainly at rest about all axes, shape (n,)."""
        return _certain_rest(self.at_rest, self.log.rate)

    @property
    def mean_weights(self) -> Floats:
        """Mean weights at rest, shape (N,); over all samples if there is no rest."""
        rest_mask = self.rest_mask
        means: Floats = self.weights[rest_mask if rest_mask.any() else slice(None)].mean(axis=0)
        return means

    def to_log(self) -> Log:
        """Return the rate of the body as a log of one gyro.

        Its extra columns are acceleration, rest, disagreement, and each sensor's weight and
        exclusion.
        """
        return replace(self.log.fused(self.rate), extra=self._extra())

    def _extra(self) -> Columns:
        columns: Columns = {}
        if self.accel is not None:
            for i, axis in enumerate("xyz"):
                columns[add_unit_suffix(f"accel_{axis}", self.accel.unit)] = self.accel.accel[:, i]
        for i, axis in enumerate(self.log.axes):
            columns[f"at_rest_{axis}" if axis else "at_rest"] = self.at_rest[:, i]
        columns["disputed"] = self.disputed
        for k, label in enumerate(self.log.labels):
            columns[f"weight_{label}"] = self.weights[:, k]
            columns[f"excluded_{label}"] = self.fate[:, k] == _EXCLUDED
        return columns

    def excluded_spans(self, sensor: int) -> list[tuple[float, float]]:
        """Return the spans in which a sensor was excluded, in s from the first sample."""
        excluded = runs(self.fate[:, sensor] == _EXCLUDED) / self.log.rate
        return [(start, stop) for start, stop in excluded.tolist()]


class ArrayArguments(ReadingArguments, total=False):
    """Options of `zerorate.GyroArray`, and arguments for reading."""

    method: str
    limit: float | None
    rest_limit: float | None
    bias_limit: float | None
    scale_error: float


def replay_array(
    source: Source | ArrayLog,
    *,
    rotations: Rotations | RotationLike | Path_ | None = None,
    positions: npt.ArrayLike | None = None,
    weights: Weights | npt.ArrayLike = "auto",
    fix: bool = False,
    progress: Progress | None = None,
    **options: Unpack[ArrayArguments],
) -> ArrayReplay:
    """Fuse all gyros of a recording into one, sample by sample as in a live stream.

    ``zerorate replay --array`` does the same.

    Parameters
    ----------
    source : Recording, Log, ArrayLog, path, data frame or mapping of arrays
        Recording with several gyros of one body; an ArrayLog is used unchanged.
    rotations : Rotations, path, array_like of shape (N, 3, 3), scipy Rotation or "find", optional
        Rotations to the axes of the body. "find" estimates them from the motion in the log. By
        default all sensors are assumed aligned.
    positions : array_like, shape (N, 3), optional
        Positions of the sensors in the axes of the body, m. Only accelerometers need them.
    weights : {"auto", "mean", "white"} or array_like
        Weights, as in `zerorate.GyroArray`.
    fix : bool
        Correct a gyro's unit or axes if the motion clearly contradicts them.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.
    **options
        Other arguments of `zerorate.GyroArray`: ``limit``, ``rest_limit``, ``bias_limit``,
        ``scale_error``, ``method``. If the unit is known, the limits of rest default to
        `zerorate.options.REST_LIMITS`. If the source is a file, also arguments of
        `zerorate.read_recording`.

    Returns
    -------
    ArrayReplay
        Fused rate, weights, treatment of each sample, and Allan deviations. The result has the
        methods `table`, `plot` and `save`.

    Raises
    ------
    LogError
        If there is no gyro, the gyros do not match, or all samples are missing.
    ValueError
        If an argument is not valid.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> z = [0.5, -0.2, 0.1, 0.0] + 0.1 * rng.standard_normal((6000, 4))
    >>> log = ArrayLog(np.arange(6000) / 100.0, 100.0, z, tuple("abcd"), "deg/s", ("z",))
    >>> result = replay_array(log)
    >>> result.to_log()
    Log(6000 samples at 100 Hz, 60 s, deg/s: gyro_z)
    >>> over_mean, over_one = result.allan.gains()
    >>> print(over_one[-1, result.allan.second].round(1))
    2.0
    """
    report = choose_reporter(progress)
    array_options: dict[str, Any] = dict(options)
    reading = {name: array_options.pop(name) for name in _READING_OPTIONS if name in array_options}
    loaded = _load_rotations(rotations)
    log, alarms = _load_array(source, reading, fix)
    with name_source_in_errors(str(log.meta.get("source", "the log")), alarms):
        if loaded is not None and len(log.axes) != 3:
            raise ArgumentError("rotations", "is for gyros of three axes, and these have one")
        rotation_set = _find_rotations(log, array_options) if _is_find(loaded) else loaded
        matrices: Any = rotation_set
        sensor_positions = positions
        if isinstance(rotation_set, Rotations):
            rotation_set = rotation_set.part(log.labels)
            matrices, sensor_positions = rotation_set.matrices, rotation_set.positions
        result = _run(
            log, matrices, sensor_positions, _check_weights(weights, log), report, array_options
        )
        remarks = tuple(_misalignment_remarks(result))
    result_rotations = rotation_set if isinstance(rotation_set, Rotations) else None
    rotations_found = result_rotations is not None and _is_find(loaded)
    return replace(
        result,
        rotation_set=result_rotations,
        rotations_found=rotations_found,
        remarks=remarks,
        alarms=alarms,
    )


def _is_find(rotations: object) -> bool:
    return isinstance(rotations, str) and rotations == _FIND


def _load_rotations(rotations: Rotations | RotationLike | Path_ | None) -> Any:  # noqa: ANN401
    """Return rotations; if the argument is a path, read them from the file."""
    if isinstance(rotations, str | os.PathLike) and not _is_find(rotations):
        return read_rotations(rotations)
    return as_matrices(rotations)


def _load_array(
    source: Source | ArrayLog, reading: Mapping[str, Any], fix: bool
) -> tuple[ArrayLog, tuple[str, ...]]:
    """Return the prepared gyros of a source, and the alarms."""
    if isinstance(source, ArrayLog):
        return source, ()
    selection = {} if isinstance(source, Recording | Log) else {"only": ["gyro", "accel"]}
    recording = recording_of(source, reading, **selection)
    alarms: list[str] = []
    with name_source_in_errors(recording.source):
        for index in range(max(len(recording.of_kind("gyro")), 1)):
            gyro, accel = (f"{kind}_{index}" if index else kind for kind in ("gyro", "accel"))
            prepared = prepare(recording, replace(FILTER_CHOICES, gyro=gyro, accel=accel, fix=fix))
            recording, alarms = prepared.recording, [*alarms, *prepared.alarms]
        return array_log(recording), tuple(dict.fromkeys(alarms))


def _find_rotations(log: ArrayLog, options: Mapping[str, Any]) -> Rotations:
    return find_rotations(
        log.data, log.rate, unit=log.unit, limit=options.get("limit"), labels=log.labels
    )


def _check_weights(weights: Weights | npt.ArrayLike, log: ArrayLog) -> Any:  # noqa: ANN401
    if not isinstance(weights, str) and np.size(weights) != log.sensors:
        raise ArgumentError(
            "weights",
            f"takes one number for each of the {log.sensors} sensors, got {np.size(weights)}",
        )
    return weights


def _misalignment_remarks(result: ArrayReplay) -> Iterator[str]:
    """Yield a sentence if sensors assumed aligned measure different rotations."""
    log = result.log
    if result.rotations is not None or len(log.axes) != 3 or log.sensors == 1:
        return
    try:
        angles = _find_rotations(log, result.params).angles
    except LogError:
        return
    off = np.flatnonzero(angles > _MAX_MISALIGNMENT_DEG)
    if off.size:
        listed = ", ".join(f"{log.labels[k]} by {angles[k]:.0f} deg" for k in off)
        yield make_sentence(
            f"the sensors are not aligned: against {log.labels[0]} are turned {listed}; ",
            keyword_argument("rotations", _FIND, "rotations='find'"),
            " takes that into account",
        )


def _run(
    log: ArrayLog,
    rotations: npt.ArrayLike | None,
    positions: npt.ArrayLike | None,
    weights: Weights | npt.ArrayLike,
    report: Progress,
    options: Mapping[str, Any],
) -> ArrayReplay:
    if not np.isfinite(log.data).any():
        raise LogError("no sensor has a sample: all are missing")
    array_options = add_rest_limits(options, ["auto"], log.unit)
    matrices = None if rotations is None else np.asarray(rotations, dtype=np.float64)
    array = GyroArray(
        log.rate,
        log.sensors,
        axes=len(log.axes),
        rotations=matrices,
        weights=weights,
        labels=list(log.labels),
        **array_options,
    )
    recorder = _ArrayRecorder(log, matrices, array_options.get("limit"))
    for first in range(0, log.n, _BLOCK_ROWS):
        recorder.take(array, first)
        report("filtering", min(first + _BLOCK_ROWS, log.n) / log.n)
    allan = recorder.allan()
    accel = _fuse_accelerometers(log, recorder.rate, matrices, positions)
    accel_allan = None if accel is None else _accel_allan(log, accel, matrices, recorder.at_rest)
    report("measuring", 1.0)
    return ArrayReplay(
        log=log,
        rotations=matrices,
        params={"weights": weights, **array_options},
        rate=recorder.rate if log.data.ndim == 3 else recorder.rate[:, 0],
        weights=recorder.weights,
        fate=recorder.fate,
        disputed=recorder.disputed,
        at_rest=recorder.at_rest,
        bias=np.asarray(array.bias),
        health=tuple(array.health),
        allan=allan,
        speed=log.data.size / recorder.seconds if recorder.seconds > 0.0 else np.nan,
        accel=accel,
        accel_allan=accel_allan,
    )


def _fuse_accelerometers(
    log: ArrayLog, rate: Floats, rotations: Floats | None, positions: npt.ArrayLike | None
) -> FusedAccelerometers | None:
    """Return the fused accelerometers of the log."""
    if log.accel is None or len(log.axes) != 3:
        return None
    known = log.unit in UNITS and UNITS[log.unit].kind == "rate"
    if positions is not None and not known:
        raise ValueError(f"positions need rates of a known unit, got '{log.unit}'")
    return fuse_accelerometers(
        log.accel, rate, log.rate, rotations=rotations, positions=positions,
        gyro_unit=log.unit if known else "rad/s", accel_unit=log.accel_unit,
    )  # fmt: skip


def _accel_allan(
    log: ArrayLog, fused: FusedAccelerometers, rotations: Floats | None, at_rest: Booleans
) -> ArrayAllan | None:
    assert log.accel is not None
    accel = log.accel if rotations is None else np.einsum("kij,nkj->nki", rotations, log.accel)
    return _allan(accel, fused.accel, at_rest, log.rate)


class _ArrayRecorder:
    """Records of an array, block by block."""

    def __init__(self, log: ArrayLog, rotations: Floats | None, limit: float | None) -> None:
        n, sensors, axes = log.n, log.sensors, len(log.axes)
        self._log, self._rotations, self._limit = log, rotations, limit
        self._residuals = np.empty((n, sensors, axes))
        self.rate = np.empty((n, axes))
        self.weights = np.empty((n, sensors))
        self.fate = np.empty((n, sensors), np.int8)
        self.disputed = np.empty(n, np.bool_)
        self.at_rest = np.empty((n, axes), np.bool_)
        self.seconds = 0.0
        self._excluded = np.zeros(sensors, np.bool_)

    def take(self, array: GyroArray, first: int) -> None:
        """Process one block by the array, and record its output."""
        block = np.s_[first : first + _BLOCK_ROWS]
        z = np.ascontiguousarray(self._log.data[block])
        begin = time.thread_time()
        trace = array.trace(z)
        self.seconds += time.thread_time() - begin
        with_axes = {key: _expand_axes(trace[key], z.ndim) for key in ("weights", "used", "bias")}
        samples = _expand_axes(z, z.ndim)
        self.rate[block] = trace["rate"].reshape(len(z), -1)
        self.at_rest[block] = trace["at_rest"].reshape(len(z), -1)
        self.weights[block] = with_axes["weights"].mean(axis=2)
        self.disputed[block] = trace["disputed"]
        used: Booleans = np.all(with_axes["used"], axis=2)
        # A fault found at the end of a sample takes effect with the next sample.
        excluded = np.concatenate((self._excluded[np.newaxis], trace["excluded"]))
        self._excluded = excluded[-1]
        self.fate[block] = _classify_samples(samples, used, excluded[:-1], self._limit)
        self._residuals[block] = self._to_body_axes(samples - with_axes["bias"])

    def _to_body_axes(self, rates: Floats) -> Floats:
        """Return rates in the axes of the body."""
        if self._rotations is None:
            return rates
        body_rates: Floats = np.einsum("kij,nkj->nki", self._rotations, rates)
        return body_rates

    def allan(self) -> ArrayAllan | None:
        """Return the Allan deviations at rest; None without rest."""
        return _allan(self._residuals, self.rate, self.at_rest, self._log.rate)


def _allan(sensors: Floats, fused: Floats, at_rest: Booleans, rate: float) -> ArrayAllan | None:
    """Return Allan deviations at rest, of sensors (n, N, axes) and their fusion (n, axes)."""
    rest = _certain_rest(at_rest, rate)
    if not rest.any():
        return None
    n, count, axes = sensors.shape
    # At rest, no working sensor reaches the end of its range.
    rest_sensors = np.where(rest[:, np.newaxis, np.newaxis], sensors, np.nan)
    rest_fused = np.where(rest[:, np.newaxis], fused, np.nan)
    records = np.concatenate(
        (rest_sensors.reshape(n, -1), _finite_mean(rest_sensors, axis=1), rest_fused), axis=1
    )
    factors, second = _cluster_lengths(n, rate)
    deviations, _, _ = allan_deviations(records, factors.tolist())
    curves = np.split(deviations.T, (count * axes, (count + 1) * axes))
    return ArrayAllan(
        factors / rate, curves[0].reshape(count, axes, -1), curves[1], curves[2], second
    )


def _expand_axes(values: npt.NDArray[Any], ndim: int) -> npt.NDArray[Any]:
    """Return values of shape (n, N, axes); a missing axis dimension is added."""
    return values if ndim == 3 else values[:, :, np.newaxis]


def _classify_samples(
    z: Floats, used: Booleans, excluded: Booleans, limit: float | None
) -> npt.NDArray[np.int8]:
    """Return the fate of each sample z (n, N, axes) of each sensor."""
    fate = np.where(used, _USED, _LEFT_OUT).astype(np.int8)
    fate[excluded] = _EXCLUDED
    if limit is not None:
        fate[(np.abs(z) >= limit).any(axis=2)] = _SATURATED
    fate[~np.isfinite(z).all(axis=2)] = _MISSING
    return fate


def _certain_rest(rest: Booleans, rate: float) -> Booleans:
    """Return the mask of rest on all axes, without samples in which motion may have begun."""
    certain: Booleans = np.all(rest, axis=1)
    before = onset_samples(rate)
    for i in np.flatnonzero(certain[:-1] & ~certain[1:]) + 1:
        certain[max(0, i - before) : i] = False
    return certain


def _finite_mean(values: Floats, axis: int) -> Floats:
    """Return the mean of the finite values; NaN if there are none."""
    present = np.isfinite(values)
    count = present.sum(axis=axis)
    total = np.where(present, values, 0.0).sum(axis=axis)
    means: Floats = np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0)
    return means


def _cluster_lengths(n: int, rate: float) -> tuple[Integers, int]:
    """Return the cluster lengths in samples, and the index of one second among them."""
    octaves = [1 << i for i in range(max(1, (n // 4).bit_length()))]
    second = min(max(round(_REPORTED_TAU_S * rate), 1), max(n // 4, 1))
    factors = np.unique([*octaves, second])
    return factors, int(np.flatnonzero(factors == second)[0])


def notes_on(replay: ArrayReplay) -> Iterator[str]:
    """Yield the sentences on the log of an array, and on its sensors."""
    log = replay.log
    yield from notes_of(replay.to_log(), evenly_spaced=True)
    yield from replay.remarks
    if replay.rotations is None and len(log.axes) == 3 and log.sensors > 1:
        yield "without rotations all sensors are assumed to be aligned"
    for k, label in enumerate(log.labels):
        spans = replay.excluded_spans(k)
        if spans:
            yield f"{label} disagreed with the others and was excluded: {_format_spans(spans)}"
        if replay.health[k] != "good":
            yield f"{label} is {replay.health[k]} at the end"
    if replay.disputed.any():
        seconds = replay.disputed.sum() / log.rate
        yield (f"for {shorten(seconds, 4)} s sensors disagreed without a majority: all were used")
    lost = ~np.isfinite(replay.rate.reshape(log.n, -1)).all(axis=1)
    if lost.any():
        yield f"no sensor was left in {int(lost.sum())} of {log.n} samples: the rate is NaN there"
    if replay.accel is not None and replay.accel.angular_acceleration is None:
        yield make_sentence(
            "the accelerometers are fused without lever arms: positions in the file of ",
            bare_argument("rotations"),
            " give them",
        )
    yield (
        "the log of the array holds its rate without bias, and also rest, weight_LABEL and "
        "excluded_LABEL of each sensor"
    )


def _format_spans(spans: Sequence[tuple[float, float]]) -> str:
    """Return the first spans as text, and the number of further spans."""
    shown = ", ".join(
        f"{shorten(start, 4)} to {shorten(end, 4)} s" for start, end in spans[:_MAX_LISTED_SPANS]
    )
    more = len(spans) - _MAX_LISTED_SPANS
    return f"{shown} and {more} more" if more > 0 else shown


def files_of(result: ArrayReplay) -> Files:
    """Return the files of an array's replay: log, figure, and found rotations."""
    writers: list[Writer] = [lambda path: write_log(result.to_log(), path)]
    others = []
    if result.rotations_found and result.rotation_set is not None:
        writers.append(text_writer(result.rotation_set.to_json()))
        others.append("-rotations.json")
    return Files("-zerorate", "", writers, others, {"": figure_writer(result.plot)})
