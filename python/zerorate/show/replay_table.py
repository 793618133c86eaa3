"""Replay as plain text: scores, learned parameters, and notes."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from zerorate.faults import render_text
from zerorate.numerals import DASH, format_or_dash, format_with_error, shorten
from zerorate.record.names import split_unit
from zerorate.show.tables import (
    Table,
    align_rows,
    as_text,
    bullet_list,
    select_fitting_columns,
    wrap_prose,
)
from zerorate.tasks.replay import Score, Summary
from zerorate.tasks.replay.history import last_finite, noise_units
from zerorate.tasks.replay.result import Replays
from zerorate.texts import width

_TITLE: Final = "Bias as each method estimates it; 'raw': the samples"
Row = tuple[str, ...]

_OTHER_TIME: Final = "other, s"
"""Head of the column with the seconds that are not at rest."""
_SIGMA_NOTE: Final = "With ± σ."
_MEASURES_NOTE: Final = (
    "Coasting: angle error after an estimate is held for this time. Any low-pass filter lowers "
    "the deviation at rest, but delays rotations."
)
_LEARNED_NOTE: Final = (
    "In motion: includes the wait for the first rest. White noise: angle random walk N. Bias "
    "drift: rate random walk K. 'Follows a step': time in which the bias follows 63 % of a small "
    "step."
)
_ANGLE_UNITS: Final = {"rad/s": ("rad", 1.0), "deg/s": ("deg", 1.0), "deg/h": ("deg", 1.0 / 3600.0)}


def format_replay(replay: Summary) -> str:
    """Return the bias of each axis, the scores of several methods, and notes."""
    return "\n\n".join(
        filter(None, (format_bias(replay), _format_scores(replay), format_notes(replay)))
    )


def _format_scores(replay: Summary) -> str:
    return format_table(replay) if len(replay.speed) > 1 else ""


def format_replays(replays: Replays) -> str:
    """Return the biases of several logs in one table, and notes on each log."""
    parts = [format_biases(replays.results)]
    for name, replay in replays.results.items():
        alarms = "\n".join(map(render_text, replay.alarms))
        text = "\n\n".join(filter(None, (alarms, _format_scores(replay), format_notes(replay))))
        parts += [f"{name}\n{text}"] if text else []
    return "\n\n".join(parts)


def format_bias(replay: Summary) -> str:
    """Return each axis's bias at the end, time at rest, and error if the bias is held.

    The table has a row for each axis. With the method "auto" it includes the learned noise.
    """
    heads, rows = _bias_columns(replay)
    title = f"Bias at the end, by {replay.method}: {Path(_source_name(replay)).name}"
    legend = _column_meanings(heads, replay)
    return as_text(Table(title.rstrip(": "), heads, rows, words=2, note=_SIGMA_NOTE, legend=legend))


def format_biases(replays: Mapping[str, Summary]) -> str:
    """Return the biases of several logs by name, in one table per unit."""
    tables: dict[tuple[str, ...], list[tuple[str, ...]]] = {}
    for name, replay in replays.items():
        heads, rows = _bias_columns(replay, keep_unknown=True)
        table_rows = tables.setdefault(("log", *heads), [])
        table_rows += [(Path(name).name if i == 0 else "", *row) for i, row in enumerate(rows)]
    first_replay = next(iter(replays.values()))
    title = f"Bias at the end, by {first_replay.method}"
    return "\n\n".join(
        as_text(
            Table(
                title,
                heads,
                tuple(rows),
                3,
                _SIGMA_NOTE,
                legend=_column_meanings(heads, first_replay),
            )
        )
        for heads, rows in tables.items()
    )


def _bias_columns(replay: Summary, keep_unknown: bool = False) -> tuple[Row, tuple[Row, ...]]:
    """Return heads and rows of the bias table; unknown columns only with `keep_unknown`."""
    unit = replay.header.unit
    angle, factor = _ANGLE_UNITS.get(unit, (f"{unit} s", 1.0))
    scores = [score for score in replay.scores if score.method == replay.method]
    columns: list[tuple[str, list[str]]] = [
        ("axis", [split_unit(name)[0] for name in replay.header.names]),
        (f"bias, {unit}", [_format_bias(replay, i) for i in range(len(scores))]),
    ]
    if replay.error_at_end is not None:
        errors = [_format_number(error, ".2g") for error in replay.error_at_end.tolist()]
        columns.append(("error at the end", errors))
    times = [_format_times(replay, i) for i in range(len(scores))]
    for name, cells in zip(("at rest, s", _OTHER_TIME), zip(*times, strict=True), strict=True):
        columns.append((name, list(cells)))
    for i, horizon in enumerate(replay.horizons):
        errors = _format_numbers(scores, lambda s, i=i: factor * s.coasting[i], ".3g")  # type: ignore[misc]
        columns.append((f"{horizon:g} s, {angle}", errors))
    if replay.method == "auto":
        (white, _), (walk, _) = noise_units(unit)
        learned = list(zip(*_learned_rows(replay), strict=True))
        columns += [(f"N, {white}", list(learned[3])), (f"K, {walk}", list(learned[4]))]
    known_columns = [
        (head, cells) for head, cells in columns if keep_unknown or set(cells) != {DASH}
    ]
    rows = tuple(zip(*(cells for _, cells in known_columns), strict=True))
    return tuple(head for head, _ in known_columns), rows


def _source_name(replay: Summary) -> str:
    return str(replay.header.meta.get("source", ""))


def _column_meanings(heads: Sequence[str], replay: Summary) -> dict[int, str]:
    """Return explanations of column heads, by column index."""
    horizons = tuple(f"{horizon:g} s, " for horizon in replay.horizons)
    meanings = {}
    for i, head in enumerate(heads):
        if head.startswith(horizons):
            meanings[i] = f"{head.partition(',')[0]}: angle error if the bias is held so long."
        elif head == _OTHER_TIME:
            meanings[i] = "Other: in motion, or before the first rest."
        elif head.startswith(("N, ", "K, ")):
            meanings[i] = "N: white noise." if head.startswith("N") else "K: walk of the bias."
    return meanings


def format_table(replay: Summary) -> str:
    """Return a table with a row for each axis and method, at most `WIDTH` characters wide.

    It has a title, two heading lines, the rows, and notes on the numbers. A dash marks an undefined
    number.

    `replay`: replay to show. If it has a true bias, the table has the error relative to it.
    """
    rows = list(zip(*_score_columns(replay), strict=True))
    columns = select_fitting_columns(rows, 2, width(), range(len(rows[0]) - 1, 2, -1))
    lines = align_rows([[row[i] for i in columns] for row in rows], 2, width())
    paragraphs = (wrap_prose(text) for text in (_describe_noise(replay), _MEASURES_NOTE) if text)
    return "\n".join((wrap_prose(_TITLE), *lines, "", *paragraphs))


def format_learned(replay: Summary) -> str:
    """Return a table of the chosen filter's learned parameters, at most `WIDTH` characters wide.

    It has a row for each axis. It is empty for published methods, because they learn no parameters.
    """
    if replay.method != "auto":
        return ""
    (white, _), (walk, _) = noise_units(replay.header.unit)
    head = (
        "",
        "at rest",
        "not at rest",
        "white noise",
        "bias drift",
        "follows a",
        "bias at the end",
    )
    units = ("axis", "s", "s", white, walk, "step in, s", replay.header.unit)
    rows = (units, *_learned_rows(replay))
    return as_text(Table(f"Learned by {replay.method}", head, rows, note=_LEARNED_NOTE))


def format_notes(replay: Summary) -> str:
    """Return sentences on the log's clock, gaps and notes, and on the filter's actions.

    The text is empty if there are no sentences.
    """
    return bullet_list(replay.notes)


def _score_columns(replay: Summary) -> Iterator[list[str]]:
    unit = replay.header.unit
    angle, factor = _ANGLE_UNITS.get(unit, (f"{unit} s", 1.0))
    rows = replay.scores
    yield ["", "axis", *_blank_repeats([score.axis for score in rows])]
    yield ["", "method", *(score.method for score in rows)]
    yield ["mean", unit, *_format_numbers(rows, lambda s: s.mean)]
    yield ["deviation", unit, *_format_numbers(rows, lambda s: s.deviation)]
    yield ["deviation", "over raw", *_format_numbers(rows, lambda s: s.reduction, ".3f")]
    for i, horizon in enumerate(replay.horizons):
        errors = _format_numbers(rows, lambda s, i=i: factor * s.coasting[i])  # type: ignore[misc]
        yield ["coasting", f"{horizon:g} s, {angle}", *errors]
    if not all(math.isnan(score.error) for score in rows):
        yield ["true error", unit, *_format_numbers(rows, lambda s: s.error)]


def _blank_repeats(names: Sequence[str]) -> list[str]:
    """Return the names, with a blank for each repeated name."""
    return [name if i == 0 or names[i - 1] != name else "" for i, name in enumerate(names)]


def _format_numbers(
    rows: Sequence[Score], value: Callable[[Score], float], spec: str = "#.4g"
) -> list[str]:
    return [_format_number(value(score), spec) for score in rows]


def _format_number(value: float, spec: str) -> str:
    return format(value, spec).rstrip(".") if math.isfinite(value) else "-"


def _describe_noise(replay: Summary) -> str:
    """Return a note that the smooth curve is the estimate, not a log with less noise."""
    raw = [score.deviation for score in replay.scores if score.method == "raw"]
    ratios = [
        (split_unit(name)[0], after / before)
        for name, after, before in zip(
            replay.header.names, replay.compensated_deviation.tolist(), raw, strict=True
        )
        if before > 0.0 and math.isfinite(after)
    ]
    if not ratios:
        return ""
    listed = ", ".join(f"{name} {ratio:.3f}" for name, ratio in ratios)
    rate = f"compensated rate (raw minus the bias of {replay.method})"
    if replay.params["motion"] == "hold":
        return f"The {rate} keeps the sensor's noise: its deviation over raw is {listed}."
    return f"Deviation of the {rate} over raw, motion included: {listed}."


def _learned_rows(replay: Summary) -> Iterator[tuple[str, ...]]:
    (_, white), (_, walk) = noise_units(replay.header.unit)
    history = replay.history
    noise = white * last_finite(history.angle_random_walk)
    drift = walk * last_finite(history.rate_random_walk)
    for i, name in enumerate(replay.header.names):
        yield (
            split_unit(name)[0],
            *_format_times(replay, i),
            format_or_dash(noise[i]),
            format_or_dash(drift[i]),
            _format_time_constant(replay, i),
            _format_bias(replay, i),
        )


def _format_times(replay: Summary, i: int) -> tuple[str, str]:
    rest_counts, motion_counts = replay.sample_counts.at_rest_count, replay.moved_count
    if rest_counts is None or motion_counts is None:
        return "-", "-"
    return (
        f"{rest_counts[i] / replay.header.rate:.1f}",
        f"{motion_counts[i] / replay.header.rate:.1f}",
    )


def _format_bias(replay: Summary, i: int) -> str:
    bias, sigma = replay.history.bias[-1, i], replay.history.bias_sigma[-1, i]
    return format_with_error(bias, sigma) if np.isfinite(bias) else "-"


def _format_time_constant(replay: Summary, i: int) -> str:
    seconds = replay.time_constant[i]
    return (
        f"> {shorten(replay.header.duration, 4)}" if np.isinf(seconds) else format_or_dash(seconds)
    )
