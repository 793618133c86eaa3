"""A replay as plain text: scores, what the filter learned, and the sentences under them."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.io.log import notes_of
from zerorate.io.names import split_unit
from zerorate.numerals import or_dash, with_error
from zerorate.run.replay import Score, Summary
from zerorate.run.replay.history import last_known, noise_units
from zerorate.run.replay.result import extra_names, unlearned
from zerorate.show.tables import WIDTH, Table, aligned, as_text, bulleted
from zerorate.types import Integers

__all__ = ["format_learned", "format_notes", "format_table"]

_WARNING: Final = (
    "At rest any low-pass filter lowers the deviation, and pays with delay when the sensor turns.",
    "Coasting error is the angle lost by holding the estimate: what a user pays for a wrong bias.",
)
_COMPENSATED: Final = (
    "Measured is the drift that a method finds; the filtered log is raw minus it, as noisy as raw."
)
_LEARNED: Final = (
    "Motion counts the wait for the first rest. White noise as angle random walk, drift as rate "
    "random walk; 63 %: the time in which the bias follows a small step; bias and its standard "
    "deviation as they are at the end."
)
_ANGLE: Final = {"rad/s": ("rad", 1.0), "deg/s": ("deg", 1.0), "deg/h": ("deg", 1.0 / 3600.0)}


def format_table(replay: Summary) -> str:
    """Return a table with a row for each axis and method, at most `WIDTH` columns wide.

    Parameters
    ----------
    replay : Summary
        What to show; the error to the true drift is shown where that was given.

    Returns
    -------
    str
        Lines without an end: two of headings, one a row, some on what the numbers mean. A dash
        stands where a number means nothing.
    """
    lines = aligned(list(zip(*_columns(replay), strict=True)), 2, WIDTH)
    compensated = replay.output == "compensated" and replay.params["motion"] == "hold"
    said = (*_WARNING, _COMPENSATED) if compensated else _WARNING
    return "\n".join((*lines, "", *said))


def format_learned(replay: Summary) -> str:
    """Return a table of what the chosen filter learned, at most `WIDTH` columns wide.

    Parameters
    ----------
    replay : Summary
        What to show.

    Returns
    -------
    str
        Lines without an end, a row for each axis; empty for the published methods, which have no
        such parameters.
    """
    if replay.method != "auto":
        return ""
    head = ("axis", "rest [s]", "motion [s]", *_learned_heads(replay.header.unit))
    title = f"Learned by {replay.method}"
    return as_text(Table(title, head, tuple(_learned_rows(replay)), note=_LEARNED))


def format_notes(replay: Summary) -> str:
    """Return the sentences on the log's clock, gaps and notes, and on what the filter did.

    Parameters
    ----------
    replay : Summary
        What the sentences are about.

    Returns
    -------
    str
        Lines without an end, empty if there is nothing to say.
    """
    return bulleted(_notes(replay))


def _columns(replay: Summary) -> Iterator[list[str]]:
    unit = replay.header.unit
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


def _speed(replay: Summary, method: str) -> str:
    speed = replay.speed.get(method, math.nan)
    return f"{speed / 1e6:.3g} M" if math.isfinite(speed) else "-"


def _notes(replay: Summary) -> Iterator[str]:
    yield from _on_log(replay)
    yield from unlearned(replay)
    guarded = int(np.sum(replay.guard_count[replay.method]))
    if guarded:
        steps = replay.header.n * replay.header.channels
        yield (
            f"{replay.method}: {guarded} of {steps} steps of the process noise were shortened to "
            "keep it positive"
        )
    if replay.method != "auto":
        yield from _on_memory(replay)
    yield from _on_motion(replay)
    yield from _on_output(replay)


def _on_log(replay: Summary) -> Iterator[str]:
    header, missing = replay.header, replay.seen.missing
    yield from notes_of(header)
    if missing.any():
        counts = zip(header.names, missing.tolist(), strict=True)
        listed = ", ".join(f"{name} {n}" for name, n in counts if n)
        yield f"missing samples, predicted and not corrected: {listed} of {header.n}"
    yield from replay.left_out.sentences(header.names, header.n, replay.limit)
    for name, restarts in zip(replay.header.names, replay.restarts.tolist(), strict=True):
        if restarts:
            times = "once" if restarts == 1 else f"{restarts} times"
            yield (
                f"{name}: the noise learned at the start proved wrong by many orders, and noise "
                f"and drift were learned anew, {times}"
            )


def _on_memory(replay: Summary) -> Iterator[str]:
    times = {
        name: "longer than the record" if math.isinf(seconds) else f"{seconds:.3g} s"
        for name, seconds in zip(replay.header.names, replay.memory, strict=True)
        if not math.isnan(seconds)
    }
    if times:
        listed = ", ".join(f"{name} {text}" for name, text in times.items())
        yield f"{replay.method} follows 63 % of a step in: {listed}"


def _on_motion(replay: Summary) -> Iterator[str]:
    moved = _moved(replay)
    if moved is None or not moved.any():
        return
    seconds = zip(replay.header.names, moved / replay.header.rate, strict=True)
    listed = ", ".join(f"{name} {time:.4g} s" for name, time in seconds if time)
    yield (
        f"in motion, or not yet seen to rest, where nothing is learned: {listed}; all measures are "
        "of the rest"
    )


def _moved(replay: Summary) -> Integers | None:
    """Return how many samples of each axis were neither of the rest nor of a stuck sensor."""
    seen = replay.seen
    if seen.at_rest is None or seen.stuck is None:
        return None
    return replay.header.n - seen.at_rest - seen.stuck


def _on_output(replay: Summary) -> Iterator[str]:
    if replay.output == "compensated":
        limited = replay.limit is not None
        columns = next(extra_names(replay.header.names, replay.header.unit, limited))
        lost = "a stuck and a saturated sensor" if limited else "a stuck sensor"
        yield (
            "the filtered log holds raw minus drift under the names of the raw columns, and "
            f"{', '.join(columns)} and so on: the drift, its standard deviation, rest, and {lost}"
        )
        if replay.params["motion"] == "ignore":
            yield (
                f"{replay.method} took every sample for rest, so what it followed of a motion is "
                "missing from the filtered log; motion= set to 'hold' learns at rest only"
            )


def _learned_heads(unit: str) -> tuple[str, ...]:
    (white, _), (walk, _) = noise_units(unit)
    return f"noise [{white}]", f"drift [{walk}]", "63 % [s]", f"bias [{unit}]"


def _learned_rows(replay: Summary) -> Iterator[tuple[str, ...]]:
    (_, white), (_, walk) = noise_units(replay.header.unit)
    history = replay.history
    noise = white * last_known(history.angle_random_walk)
    drift = walk * last_known(history.rate_random_walk)
    for i, name in enumerate(replay.header.names):
        yield (
            split_unit(name)[0],
            *_times(replay, i),
            or_dash(noise[i]),
            or_dash(drift[i]),
            _memory(replay, i),
            _bias(replay, i),
        )


def _times(replay: Summary, i: int) -> tuple[str, str]:
    rested, moved = replay.seen.at_rest, _moved(replay)
    if rested is None or moved is None:
        return "-", "-"
    return f"{rested[i] / replay.header.rate:.1f}", f"{moved[i] / replay.header.rate:.1f}"


def _bias(replay: Summary, i: int) -> str:
    bias, sigma = replay.history.bias[-1, i], replay.history.bias_sigma[-1, i]
    return with_error(bias, sigma) if np.isfinite(bias) else "-"


def _memory(replay: Summary, i: int) -> str:
    seconds = replay.memory[i]
    return f"> {replay.header.duration:.4g}" if np.isinf(seconds) else or_dash(seconds)
