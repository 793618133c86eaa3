"""A replay as plain text: the table, and the sentences under it."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.io import Log
from zerorate.replay import Replay, Score
from zerorate.report.text import WIDTH, bulleted, on_clock

__all__ = ["format_notes", "format_table"]

_GAP: Final = "  "
_NO_REST: Final = "no rest yet"
_WARNING: Final = (
    "At rest any low-pass filter lowers the deviation, and pays with delay when the sensor turns.",
    "Coasting error is the angle lost by holding the estimate: what a user pays for a wrong bias.",
)
_COMPENSATED: Final = (
    "Measured is the drift that a method finds; the filtered log is raw minus it, as noisy as raw."
)
_ANGLE: Final = {"rad/s": ("rad", 1.0), "deg/s": ("deg", 1.0), "deg/h": ("deg", 1.0 / 3600.0)}


def format_table(replay: Replay) -> str:
    """Return a table with a row for each axis and method, at most `WIDTH` columns wide.

    Parameters
    ----------
    replay : Replay
        What to show; the error to the true drift is shown where that was given.

    Returns
    -------
    str
        Lines without an end: two of headings, one a row, some on what the numbers mean. A dash
        stands where a number means nothing.
    """
    columns = list(_columns(replay))
    widths = [max(map(len, column)) for column in columns]
    widths[0] = min(widths[0], WIDTH - sum(widths[1:]) - len(_GAP) * (len(widths) - 1))
    lines = []
    for cells in zip(*columns, strict=True):
        first, method, *numbers = (_fit(c, w) for c, w in zip(cells, widths, strict=True))
        right = (cell.strip().rjust(w) for cell, w in zip(numbers, widths[2:], strict=True))
        lines.append(_GAP.join((first, method, *right)).rstrip())
    said = (*_WARNING, _COMPENSATED) if replay.output == "compensated" else _WARNING
    return "\n".join((*lines, "", *said))


def format_notes(replay: Replay) -> str:
    """Return the sentences on the log's clock, gaps and notes, and on what the filter did.

    Parameters
    ----------
    replay : Replay
        What to speak of.

    Returns
    -------
    str
        Lines without an end, empty if there is nothing to say.
    """
    return bulleted(_notes(replay))


def _columns(replay: Replay) -> Iterator[list[str]]:
    unit = replay.log.unit
    angle, factor = _ANGLE.get(unit, (f"{unit} s", 1.0))
    rows = replay.scores
    yield ["", "axis", *_once([score.axis for score in rows])]
    yield ["", "method", *(score.method for score in rows)]
    yield ["mean", unit, *_numbers(rows, lambda s: s.mean)]
    yield ["deviation", unit, *_numbers(rows, lambda s: s.deviation)]
    yield ["reduction", "after/raw", *_numbers(rows, lambda s: s.reduction, ".3f")]
    for i, horizon in enumerate(replay.horizons):
        errors = _numbers(rows, lambda s, i=i: factor * s.coasting[i])  # type: ignore[misc]
        yield [f"{horizon:g} s coast", angle, *errors]
    if not all(math.isnan(score.error) for score in rows):
        yield ["true error", unit, *_numbers(rows, lambda s: s.error)]
    yield ["speed", "samples/s", *(_speed(replay, score.method) for score in rows)]


def _once(names: Sequence[str]) -> list[str]:
    """Return the names, each blank where it repeats the one before."""
    return [name if i == 0 or names[i - 1] != name else "" for i, name in enumerate(names)]


def _numbers(
    rows: Sequence[Score], value: Callable[[Score], float], form: str = "#.4g"
) -> list[str]:
    return [_number(value(score), form) for score in rows]


def _number(value: float, form: str) -> str:
    return format(value, form).rstrip(".") if math.isfinite(value) else "-"


def _speed(replay: Replay, method: str) -> str:
    speed = replay.speed.get(method, math.nan)
    return f"{speed / 1e6:.3g} M" if math.isfinite(speed) else "-"


def _fit(text: str, width: int) -> str:
    return text.ljust(width) if len(text) <= width else text[: width - 1] + "…"


def _notes(replay: Replay) -> Iterator[str]:
    yield from _on_log(replay.log)
    yield from _on_start(replay)
    guarded = int(np.sum(replay.guard_count[replay.method]))
    if guarded:
        steps = replay.log.data.size
        yield (
            f"{replay.method}: {guarded} of {steps} steps of the process noise were shortened to "
            "keep it positive"
        )
    if replay.method != "auto":
        yield from _on_memory(replay)
    yield from _on_motion(replay)
    yield from _on_output(replay)


def _on_log(log: Log) -> Iterator[str]:
    yield from on_clock(log)
    missing = np.isnan(log.data).sum(axis=0)
    if missing.any():
        counts = ", ".join(f"{name} {n}" for name, n in zip(log.names, missing, strict=True) if n)
        yield f"missing samples, predicted and not corrected: {counts} of {log.n}"
    yield from log.meta.get("notes", ())


def _on_start(replay: Replay) -> Iterator[str]:
    needed = max(10, round(replay.params["startup"] * replay.log.rate))
    axes = zip(replay.log.names, replay.log.data.T, replay.ready, replay.status, strict=True)
    for name, z, ready, status in axes:
        present = z[np.isfinite(z)]
        if ready or present.size == 0 or status == _NO_REST:
            continue
        if present.min() == present.max() and present.size >= needed:
            yield f"{name}: all samples are equal, so no noise, model or gain was learned"
        else:
            yield (
                f"{name}: start-up not finished: it needs {needed} samples, has {present.size}: "
                "no noise, model or gain was learned"
            )


def _on_memory(replay: Replay) -> Iterator[str]:
    times = {
        name: "longer than the record" if math.isinf(seconds) else f"{seconds:.3g} s"
        for name, seconds in zip(replay.log.names, replay.memory, strict=True)
        if not math.isnan(seconds)
    }
    if times:
        listed = ", ".join(f"{name} {text}" for name, text in times.items())
        yield f"{replay.method} follows 63 % of a step in: {listed}"


def _on_motion(replay: Replay) -> Iterator[str]:
    for name, status in zip(replay.log.names, replay.status, strict=True):
        if status == _NO_REST:
            yield f"{name}: no rest was found, so no drift is known: a filter learns while it rests"
    if replay.readings is None or replay.readings.at_rest.all():
        return
    moved = np.count_nonzero(~replay.readings.at_rest, axis=0) / replay.log.rate
    listed = ", ".join(f"{n} {s:.4g} s" for n, s in zip(replay.log.names, moved, strict=True) if s)
    yield f"in motion, where the drift is held: {listed}; all measures are of the rest"


def _on_output(replay: Replay) -> Iterator[str]:
    columns = list(replay.beside)[:3]
    if columns:
        yield (
            "the filtered log holds raw minus drift under the names of the raw columns, and "
            f"{', '.join(columns)} and so on: the drift, its standard deviation, and rest"
        )
