"""The array of ``zerorate replay --array``: all gyros of a log as one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zerorate.array.options import ARRAY_OPTIONS
from zerorate.cli.errors import UsageFault, as_usage, of_log, writing
from zerorate.cli.outputs import check_outputs, print_written, progress_bar
from zerorate.cli.records import Record, print_title
from zerorate.io import read_recording, write_log
from zerorate.record import LogError
from zerorate.tasks.saving import together

if TYPE_CHECKING:
    from zerorate.array.logs import ArrayLog
    from zerorate.array.rotations import Rotations
    from zerorate.cli.options import Reading
    from zerorate.progress import Progress
    from zerorate.tasks.array import ArrayReplay

ARRAY: Final = "Several gyros of one body"
"""The panel of help."""

ARRAY_CONSTANTS: Final = {name: ARRAY_OPTIONS[name] for name in ("method", "scale_error")}
"""What the filter does not have as well."""

_FIND: Final = "find"
_WORDS: Final = ("auto", "mean", "white")
_USED: Final = ("method", "limit", "rest_limit", "bias_limit")
"""Options of the filter that an array has, too."""
_TURNED: Final = 5.0
"""Degrees between sensors that nobody would call aligned."""


@dataclass(frozen=True)
class ArrayOptions:
    """What the options of an array say: rotations from a file, or to be found, and weights."""

    file: Path | None
    find: bool
    weights: str | list[float]
    constants: Mapping[str, Any]
    given: str

    @classmethod
    def of(
        cls, rotations: str | None, weights: str | None, constants: Mapping[str, Any]
    ) -> ArrayOptions:
        """Return what was typed; a usage fault if that means nothing."""
        find = rotations == _FIND
        file = None if rotations is None or find else Path(rotations)
        given = {"--rotations": rotations, "--weights": weights}
        names = [name for name, value in given.items() if value is not None]
        names += [array_flag(name) for name in constants]
        return cls(file, find, _weights(weights), constants, " and ".join(names))


def array_flag(name: str) -> str:
    """Return how a constant of the array is called beside the options of the filter."""
    return "--array-method" if name == "method" else f"--{name.replace('_', '-')}"


def _weights(text: str | None) -> str | list[float]:
    if text is None or text in _WORDS:
        return text or _WORDS[0]
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        raise UsageFault(
            f"--weights takes {', '.join(_WORDS)} or numbers with commas between, got '{text}'"
        ) from None


def refuse_with_array(
    options: Mapping[str, Any],
    *,
    compared: str | None,
    calibration: Path | None,
    no_accel: bool,
    everything: bool,
) -> None:
    """Raise a usage fault for what means nothing where one gyro is made of many."""
    from zerorate.cli.options import flag

    others = [flag(name) for name in options if name not in _USED]
    if options["method"] != "auto":
        others.append("--method")
    others += ["--methods"] if compared is not None else []
    others += ["--calibration"] if calibration is not None else []
    others += ["--no-accel"] if no_accel else []
    others += ["--figure all"] if everything else []
    if others:
        verb = "has" if len(others) == 1 else "have"
        raise UsageFault(f"{', '.join(others)} {verb} no effect on --array")


def replay_arrays(
    reading: Reading,
    found: Sequence[Record],
    paths: Sequence[Sequence[Path]],
    force: bool,
    asked: ArrayOptions,
    options: Mapping[str, Any],
) -> None:
    """Replay each record, write its files, the log first, and print what is to be said of it."""
    known = None if asked.file is None else _read_rotations(asked.file)
    every = [_with_rotations(files, asked.find) for files in paths]
    for files in every:
        check_outputs(files, force, None, asked.file)
    for record, files in zip(found, every, strict=True):
        with progress_bar() as progress:
            log = _read(reading, record)
            with _naming(str(log.meta.get("source", "the log"))), as_usage():
                result, rotations = _replayed(log, asked, known, options, progress)
            _write(result, rotations if asked.find else None, files, force, progress)
        print_title(record, first=record is found[0])
        _print(result, rotations, files)


def _with_rotations(files: Sequence[Path], find: bool) -> list[Path]:
    """Return the files, one for the rotations among them if they are to be found."""
    if not find:
        return list(files)
    return [*files, files[0].with_name(f"{files[0].stem}-rotations.json")]


def _read_rotations(path: Path) -> Rotations:
    from zerorate.array.rotations import read_rotations

    with as_usage():
        return read_rotations(path)


def _read(reading: Reading, record: Record) -> ArrayLog:
    from zerorate.array.logs import array_log

    recording = reading.read(read_recording, record.source, only=["gyro", "accel"])
    with _naming(recording.source):
        return array_log(recording)


def _replayed(
    log: ArrayLog,
    asked: ArrayOptions,
    known: Rotations | None,
    options: Mapping[str, Any],
    progress: Progress,
) -> tuple[ArrayReplay, Rotations | None]:
    """Return the replay, and the rotations that were given or found."""
    from zerorate.tasks.array import replay_array

    if asked.file is not None or asked.find:
        if len(log.axes) != 3:
            raise UsageFault("--rotations is for gyros of three axes, and these have one")
        known = known or _found(log, options)
    matrices = positions = None
    if known is not None:
        matrices = known.of(log.labels)
        known = replace(known, **_rows(known, log.labels))
        positions = known.positions
    weights: Any = asked.weights
    if isinstance(weights, list) and len(weights) != log.sensors:
        raise UsageFault(
            f"--weights takes one number for each of the {log.sensors} sensors, got {len(weights)}"
        )
    arguments = {name: value for name, value in options.items() if name in _USED[1:]}
    result = replay_array(
        log, rotations=matrices, positions=positions, weights=weights, progress=progress,
        **asked.constants, **arguments,
    )  # fmt: skip
    return result, known


def _rows(known: Rotations, labels: Sequence[str]) -> dict[str, Any]:
    """Return what rotations hold of these sensors, in this order."""
    places = [known.labels.index(label) for label in labels]
    return {
        "matrices": known.matrices[places],
        "sigma_deg": known.sigma_deg[places],
        "residuals": known.residuals[places],
        "labels": tuple(labels),
        "positions": None if known.positions is None else known.positions[places],
    }


def _found(log: ArrayLog, options: Mapping[str, Any]) -> Rotations:
    from zerorate.array.rotations import find_rotations

    return find_rotations(
        log.data, log.rate, unit=log.unit, limit=options.get("limit"), labels=log.labels
    )


def _print(result: ArrayReplay, rotations: Rotations | None, files: Sequence[Path]) -> None:
    from zerorate.show import (
        format_accelerometers,
        format_array,
        format_array_notes,
        format_rotations,
    )

    turned = None if rotations is None else format_rotations(rotations)
    notes = format_array_notes(result, [*_not_aligned(result)])
    accel = None if result.accel is None else format_accelerometers(result)
    print("\n\n".join(filter(None, (format_array(result), accel, turned, notes))))
    print_written(files)


def _not_aligned(result: ArrayReplay) -> Iterator[str]:
    """Yield a sentence if sensors that were taken as aligned turn differently."""
    log = result.log
    if result.rotations is not None or len(log.axes) != 3 or log.sensors == 1:
        return
    try:
        angles = _found(log, result.params).angles
    except LogError:
        return
    off = np.flatnonzero(angles > _TURNED)
    if off.size:
        listed = ", ".join(f"{log.labels[k]} by {angles[k]:.0f} deg" for k in off)
        yield (
            f"the sensors are not aligned: against {log.labels[0]} are turned {listed}; "
            "--rotations find takes that into account"
        )


def _write(
    result: ArrayReplay,
    rotations: Rotations | None,
    files: Sequence[Path],
    force: bool,
    progress: Progress,
) -> None:
    """Write the log, the figure if there is a file for it, and the rotations that were found."""
    with writing(), together(files, force) as temporary:
        rest = list(temporary)
        if rotations is not None:
            rotations.to_json(rest.pop(), force=True)
        progress("writing", 0.9)
        write_log(result.filtered_log, rest[0])
        if len(rest) > 1:
            _draw(result, rest[1])


def _draw(result: ArrayReplay, path: Path) -> None:
    from zerorate.show import plot_array, save_figure

    save_figure(plot_array(result), path)


@contextmanager
def _naming(source: str) -> Iterator[None]:
    """Say which log is at fault."""
    try:
        yield
    except LogError as error:
        raise of_log(error, source) from None
