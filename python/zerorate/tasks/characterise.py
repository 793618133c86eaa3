"""Noise of gyros and accelerometers, from a log at rest: ``zerorate allan``."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from pathlib import Path
from typing import Any, Final, Unpack

import numpy as np

from zerorate.checks.preparation import AS_MEASURED_CHOICES, prepare
from zerorate.faults import ArgumentError, keyword_argument, make_sentence, sentence_of
from zerorate.io.reading import read_sensors
from zerorate.noise import NoiseModel
from zerorate.noise.characterise import (
    Characterisation,
    characterise_log,
    collect_notes,
    models_json,
)
from zerorate.noise.exports import list_undetermined
from zerorate.noise.kinds import KindName, TauGrid
from zerorate.noise.kinds import kind as find_kind
from zerorate.progress import Progress, choose_reporter
from zerorate.record.log import Log, LogError, drop_empty_logs
from zerorate.record.names import KIND_OF_UNIT, UNKNOWN_UNIT, looks_like_accelerometer
from zerorate.record.recording import Recording
from zerorate.tasks.curve_files import CURVE_FORMATS, write_curves
from zerorate.tasks.saving import Files, Writer, figure_writer, text_writer
from zerorate.tasks.source import ReadingArguments, Source, name_source_in_errors, recording_of
from zerorate.views import Result

EXPORTS: Final = {
    "kalibr": "-kalibr.yaml",
    "vins": "-vins.yaml",
    "orbslam3": "-orbslam3.yaml",
    "px4": "-px4.params",
    "ros": "-ros.yaml",
    "json": "-models.json",
}
"""File name endings of configurations for estimators, and of the models of all axes."""

_JSON: Final = "json"
_SENSOR_KINDS: Final = ("gyro", "accel")


@dataclass(frozen=True)
class Characterised(Result):
    """The noise of the sensors of a recording, as `zerorate.characterise` returns it.

    Parameters
    ----------
    sensors : tuple of Characterisation
        Curves and models of the gyros and of the accelerometers.
    alarms : tuple of str
        Contradictions in the recording, one sentence each.

    Examples
    --------
    >>> import zerorate as zr
    >>> noise = zr.NoiseModel(angle_random_walk=1e-4)
    >>> z, _ = zr.simulate(noise, rate=100.0, duration=600.0, seed=1)
    >>> found = zr.characterise({"gyro_x_radps": z}, rate=100.0)
    >>> found.gyro.worst.angle_random_walk.identifiable, found.accel
    (True, None)
    """

    sensors: tuple[Characterisation, ...]
    alarms: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """Name of the recording."""
        return str(self.sensors[0].log.meta.get("source", "the log"))

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on motion, gaps and fits, and on the log."""
        return collect_notes(self.sensors)

    @property
    def gyro(self) -> Characterisation | None:
        """The noise of the gyros; None if there are none."""
        return self._of_kind("gyro")

    @property
    def accel(self) -> Characterisation | None:
        """The noise of the accelerometers; None if there are none."""
        return self._of_kind("accel")

    def _of_kind(self, kind: str) -> Characterisation | None:
        return next((sensor for sensor in self.sensors if _kind_of(sensor.log) == kind), None)

    def save(
        self,
        output: str | os.PathLike[str] = ".",
        *,
        force: bool = False,
        bounds: bool = True,
        doubtful: bool = False,
        export: str | Iterable[str] = (),
        inflate: float = 1.0,
        per_sample: bool = False,
        **choices: Any,  # noqa: ANN401
    ) -> list[Path]:
        """Write the curves, a figure and exports; on an error, no file. See `Result.save`.

        Parameters
        ----------
        output : str or path
            Folder for the files, or the name of one of them.
        force : bool
            Replace existing files.
        bounds : bool
            Export the upper bound of a coefficient that the log does not determine. False omits the
            coefficient's line; Kalibr and ORB-SLAM3 reject files with a missing line.
        doubtful : bool
            Export results of a log with motion or too few samples, with a warning in the file.
        export : str or iterable of str
            Files for estimators, with the values of the worst axis: any of kalibr, vins, orbslam3,
            px4, ros. json contains the models of all axes.
        inflate : float
            Factor for the exported values.
        per_sample : bool
            For vins: standard deviations per sample instead of densities.
        **choices
            ``figure``, ``format`` (csv, json or npz), ``figure_format``.

        Raises
        ------
        ValueError
            If an export is not possible.
        """
        choices |= {"export": export, "inflate": inflate, "per_sample": per_sample}
        return super().save(output, force=force, bounds=bounds, doubtful=doubtful, **choices)


@dataclass(frozen=True)
class Characterisations(Result):
    """The noise of several recordings, in one table and one figure.

    Parameters
    ----------
    results : mapping of str to Characterised
        Results by the names of the recordings.
    """

    results: Mapping[str, Characterised]


def characterise(
    source: Source,
    *,
    kind: KindName = "oadev",
    taus: TauGrid | Sequence[float] = "octave",
    bridge: int = 0,
    confidence: float = 0.683,
    markov: int = 0,
    second_opinion: bool = True,
    fix: bool = False,
    progress: Progress | None = None,
    **reading: Unpack[ReadingArguments],
) -> Characterised:
    """Measure the noise of gyros and accelerometers from a recording at rest.

    The recording is checked first; samples are not changed. ``zerorate allan`` does the same.
    `zerorate.allan` returns only the deviations.

    Parameters
    ----------
    source : Recording, Log, path, data frame or mapping of arrays
        Recording with gyros, accelerometers, or both.
    kind : str
        Kind of deviation, as in `zerorate.allan`.
    taus : str or sequence of float
        Averaging times: "octave", "decade", "all", or seconds.
    bridge : int
        Longest gap filled with a straight line, samples.
    confidence : float
        Probability that the true deviation is within the confidence bounds.
    markov : int
        Number of Markov terms to fit.
    second_opinion : bool
        Also estimate the coefficients from the spectrum.
    fix : bool
        Correct the gyro's unit or axes if a motion clearly contradicts them.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.
    **reading
        Arguments of `zerorate.read_recording`, if the source is a file.

    Returns
    -------
    Characterised
        Deviations and models of every axis. The result has the methods `table`, `plot` and `save`.

    Raises
    ------
    LogError
        If there is no sensor, the log has fewer than 20 samples, or a column is empty.
    ValueError
        If an argument is not as described.

    Examples
    --------
    >>> import zerorate as zr
    >>> noise = zr.NoiseModel(angle_random_walk=1e-4)
    >>> z, _ = zr.simulate(noise, rate=100.0, duration=600.0, seed=1, axes=3)
    >>> found = zr.characterise({"gyro_radps": z}, rate=100.0)
    >>> len(found.sensors), len(found.gyro.axes)
    (1, 3)
    """
    if markov < 0:
        raise ArgumentError("markov", f"must not be negative, got {markov}")
    deviation_kind = find_kind(kind).name
    report = choose_reporter(progress)
    report("reading", 0.0)
    recording = _load_recording(source, reading)
    with name_source_in_errors(recording.source):
        prepared = prepare(recording, replace(AS_MEASURED_CHOICES, fix=fix))
    with name_source_in_errors(recording.source, prepared.alarms):
        sensors = tuple(
            characterise_log(
                log, kind=deviation_kind, taus=taus, bridge=bridge,
                confidence=confidence, markov=markov,
                second_opinion=second_opinion, progress=report,
            )
            for log in _group_by_clock(prepared.recording)
        )  # fmt: skip
    return Characterised(sensors, prepared.alarms)


def _load_recording(source: Source, reading: ReadingArguments) -> Recording:
    if isinstance(source, Recording | Log):
        recording = recording_of(source, reading)
        if isinstance(source, Log):
            return replace(recording, logs={_kind_of(source): source})
        sensor_logs = {
            name: log for name, log in recording.items() if name.partition("_")[0] in _SENSOR_KINDS
        }
        return replace(recording, logs=sensor_logs)
    logs = drop_empty_logs(read_sensors(source, **reading))  # type: ignore[arg-type]
    return Recording({_kind_of(log): log for log in logs}, str(logs[0].meta["source"]))


def _kind_of(log: Log) -> str:
    kind_by_name = "accel" if looks_like_accelerometer(log.names[0]) else "gyro"
    return KIND_OF_UNIT.get(log.unit, kind_by_name)


def _group_by_clock(recording: Recording) -> Iterator[Log]:
    """Yield a log of a recording's gyros, then of its accelerometers, for each clock."""
    logs = [log for kind in _SENSOR_KINDS for log in recording.of_kind(kind)]
    if not logs:
        raise LogError("there is neither a gyro nor an accelerometer")
    groups: dict[object, list[Log]] = {}
    for log in drop_empty_logs(logs):
        groups.setdefault((log.unit, log.n, log.rate, log.time[0]), []).append(log)
    yield from map(_join_logs, groups.values())


def _join_logs(logs: Sequence[Log]) -> Log:
    first = logs[0]
    if len(logs) == 1:
        return first
    notes = dict.fromkeys(note for log in logs for note in log.meta.get("notes", ()))
    names = tuple(name for log in logs for name in log.names)
    data = np.hstack([log.data for log in logs])
    return replace(first, data=data, names=names, meta={**first.meta, "notes": tuple(notes)})


def parse_exports(export: str | Iterable[str], inflate: float, per_sample: bool) -> list[str]:
    """Return the names of exports without duplicates; ValueError for options that none uses.

    `export`: names, separated by commas or as a sequence.
    """
    words = export.split(",") if isinstance(export, str) else list(export)
    names = list(dict.fromkeys(word.strip() for word in words if export))
    for name in names:
        if name not in EXPORTS:
            raise ArgumentError("export", f"takes some of {', '.join(EXPORTS)}, got '{name}'")
    if not (math.isfinite(inflate) and inflate > 0.0):
        raise ArgumentError("inflate", f"must be a positive number, got {inflate:g}")
    if inflate != 1.0 and not set(names) - {_JSON}:
        listed = ", ".join(name for name in EXPORTS if name != _JSON)
        raise ValueError(
            make_sentence(
                keyword_argument("inflate"),
                " acts on exports to estimators: ",
                keyword_argument("export", listed),
            )
        )
    if per_sample and "vins" not in names:
        raise ValueError(
            make_sentence(
                keyword_argument("per_sample"), " acts on ", keyword_argument("export", "vins")
            )
        )
    return names


def export_texts(
    result: Characterised,
    export: str | Iterable[str],
    *,
    inflate: float = 1.0,
    per_sample: bool = False,
    bounds: bool = True,
    doubtful: bool = False,
) -> tuple[dict[str, str], list[str]]:
    """Return the texts of exports by name, and the reasons why others are not possible.

    Raises
    ------
    ValueError
        If a name is unknown, no export uses an option, or an export needs the unknown unit of the
        samples.
    """
    texts: dict[str, str] = {}
    refused: dict[str, list[str]] = {}
    names = parse_exports(export, inflate, per_sample)
    _check_units(names, result.sensors[0].log)
    for name in names:
        try:
            texts[name] = _export_text(
                name, result.sensors, per_sample,
                inflate=inflate, bounds=bounds, doubtful=doubtful,
            )  # fmt: skip
        except ValueError as error:
            refused.setdefault(sentence_of(error), []).append(name)
    return texts, [
        make_sentence(f"no export to {', '.join(n)}: ", why) for why, n in refused.items()
    ]


def describe_missing_numbers(
    result: Characterised, exports: Iterable[str], bounds: bool = True
) -> list[str]:
    """Return the exported numbers that are bounds or missing, and advice for the next record."""
    kinds = set(exports) - {_JSON}
    if not kinds:
        return []
    # A ROS message has no field for a random walk.
    walk = kinds != {"ros"}
    models = (_worst_model(result.sensors, kind) for kind in ("angular rate", "acceleration"))
    return [
        f"exports have an upper bound of the {number}"
        if bounds
        else f"exports leave out the {number}"
        for model in models
        if model is not None
        for number in list_undetermined(model, walk)
    ]


def _check_units(exports: Sequence[str], gyro: Log) -> None:
    needs = next((name for name in exports if name != _JSON), None)
    if needs is not None and gyro.unit == UNKNOWN_UNIT:
        raise ValueError(
            make_sentence(
                keyword_argument("export", needs),
                " needs the unit of the samples, which the log does not say: give ",
                keyword_argument("unit", "deg/s,g", "unit='deg/s,g'"),
                ", for instance",
            )
        )


def _export_text(
    export: str,
    sensors: Sequence[Characterisation],
    per_sample: bool,
    **options: Any,  # noqa: ANN401
) -> str:
    if export == _JSON:
        return models_json(sensors, doubtful=options["doubtful"])
    text = _estimator_text(export, sensors, per_sample, **options)
    head = "".join(takewhile(lambda line: line.startswith("#"), text.splitlines(keepends=True)))
    notes = "".join(f"# {note}\n" for note in collect_notes(sensors) if note not in text)
    return head + notes + text.removeprefix(head)


def _estimator_text(
    export: str,
    sensors: Sequence[Characterisation],
    per_sample: bool,
    **options: Any,  # noqa: ANN401
) -> str:
    gyro, accelerometer = (_worst_model(sensors, kind) for kind in ("angular rate", "acceleration"))
    if gyro is None:
        raise ValueError("it needs a model of a gyro, which this log does not give")
    rate = sensors[0].curve.rate
    common: dict[str, Any] = {"accelerometer": accelerometer, **options}
    if export == "kalibr":
        return gyro.to_kalibr(rate=rate, rostopic=_ros_topic(sensors[0].log), **common)
    if export == "vins":
        return gyro.to_vins(rate=rate if per_sample else None, **common)
    if export == "orbslam3":
        return gyro.to_orbslam3(rate=rate, **common)
    if export == "ros":
        return gyro.to_ros(rate=rate, **common)
    return gyro.to_px4(**common)


def _ros_topic(log: Log) -> str:
    """Return the topic of a ROS recording, or else the topic of Kalibr's examples."""
    sensor = str(log.meta.get("sensor") or "")
    return sensor if sensor.startswith("/") else "/imu0"


def _worst_model(sensors: Sequence[Characterisation], quantity: str) -> NoiseModel | None:
    models = (sensor.worst for sensor in sensors)
    return next((m for m in models if m is not None and m.quantity == quantity), None)


def files_of(result: Characterised, **exports: Any) -> Files:  # noqa: ANN401
    """Return the files of a characterisation: curves, exports and a figure.

    `exports`: arguments of `export_texts`; ValueError if an export is not possible.
    """
    texts, refused = export_texts(result, exports.pop("export", ()), **exports)
    if refused:
        raise ValueError(make_sentence(*[part for why in refused for part in ("; ", why)][1:]))
    return files_with(result, texts)


def files_with(result: Characterised, exports: Mapping[str, str]) -> Files:
    """Return the files of a characterisation; `exports` maps further names to texts."""
    curves = [one.curve for one in result.sensors]
    writers: list[Writer] = [lambda path: write_curves(curves, path)]
    writers += map(text_writer, exports.values())
    endings = [EXPORTS[name] for name in exports]
    figure = figure_writer(result.plot)
    return Files("-zerorate-allan", "", writers, endings, {"": figure}, formats=CURVE_FORMATS)
