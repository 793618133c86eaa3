"""A replay as plain text: scores, what the filter learned, and the sentences under them."""

import math
import textwrap
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

_TITLE: Final = "Bias as each method estimates it; 'raw' is the log itself"
_MEASURES: Final = (
    "Coasting is the angle error after holding an estimate for that long: what a wrong bias costs. "
    "Any low-pass filter lowers the deviation at rest, and pays with delay when the sensor turns."
)
_LEARNED: Final = (
    "In motion: includes the wait for the first rest. White noise: angle random walk N. Bias "
    "drift: rate random walk K. 'Follows a step': the time in which the bias makes 63 % of a small "
    "step."
)
_ANGLE: Final = {"rad/s": ("rad", 1.0), "deg/s": ("deg", 1.0), "deg/h": ("deg", 1.0 / 3600.0)}


def format_table(replay: Summary) -> str:
    """Return a table with a row for each axis and method, at most `WIDTH` columns wide.

    Parameters
    ----------
    replay : Summary
        What to show; the error to the true bias is shown where that was given.

    Returns
    -------
    str
        Lines without an end: a title, two of headings, one a row, some on what the numbers mean.
        A dash stands where a number means nothing.
    """
    lines = aligned(list(zip(*_columns(replay), strict=True)), 2, WIDTH)
    said = (_on_noise(replay), _MEASURES, _on_speed(replay))
    paragraphs = (textwrap.fill(text, WIDTH, break_on_hyphens=False) for text in said if text)
    return "\n".join((_TITLE, *lines, "", *paragraphs))


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
    (white, _), (walk, _) = noise_units(replay.header.unit)
    head = ("", "at rest", "in motion", "white noise", "bias drift", "follows a", "bias at the end")
    units = ("axis", "s", "s", white, walk, "step in, s", replay.header.unit)
    rows = (units, *_learned_rows(replay))
    return as_text(Table(f"Learned by {replay.method}", head, rows, note=_LEARNED))


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
    yield ["deviation", "over raw", *_numbers(rows, lambda s: s.reduction, ".3f")]
    for i, horizon in enumerate(replay.horizons):
        errors = _numbers(rows, lambda s, i=i: factor * s.coasting[i])  # type: ignore[misc]
        yield ["coasting", f"{horizon:g} s, {angle}", *errors]
    if not all(math.isnan(score.error) for score in rows):
        yield ["true error", unit, *_numbers(rows, lambda s: s.error)]


def _once(names: Sequence[str]) -> list[str]:
    """Return the names, each blank where it repeats the one before."""
    return [name if i == 0 or names[i - 1] != name else "" for i, name in enumerate(names)]


def _numbers(
    rows: Sequence[Score], value: Callable[[Score], float], form: str = "#.4g"
) -> list[str]:
    return [_number(value(score), form) for score in rows]


def _number(value: float, form: str) -> str:
    return format(value, form).rstrip(".") if math.isfinite(value) else "-"


def _on_noise(replay: Summary) -> str:
    """Say that what is steady is the estimate: nobody shall take that for a quieter log."""
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


def _on_speed(replay: Summary) -> str:
    """Say what is the same for every axis."""
    speeds = ", ".join(
        f"{method} {speed / 1e6:.3g}" for method, speed in replay.speed.items() if speed > 0.0
    )
    return f"Speed, million samples of one axis a second on one core: {speeds}." if speeds else ""


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
    header, missing = replay.header, replay.seen.missing_count
    yield from notes_of(header, even=True)
    if missing.any():
        counts = zip(header.names, missing.tolist(), strict=True)
        listed = ", ".join(f"{name} {n}" for name, n in counts if n)
        yield f"missing samples, predicted and not corrected: {listed} of {header.n}"
    yield from replay.left_out.sentences(header.names, header.n, replay.limit)
    for name, restarts in zip(replay.header.names, replay.restart_count.tolist(), strict=True):
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
        yield f"time in which {replay.method} makes 63 % of a step: {listed}"


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
    if seen.at_rest_count is None or seen.stuck_count is None:
        return None
    return replay.header.n - seen.at_rest_count - seen.stuck_count


def _on_output(replay: Summary) -> Iterator[str]:
    if replay.output == "compensated":
        limited = replay.limit is not None
        columns = next(extra_names(replay.header.names, replay.header.unit, limited))
        lost = "a stuck and a saturated sensor" if limited else "a stuck sensor"
        yield (
            "the filtered log holds raw minus bias under the names of the raw columns, and "
            f"{', '.join(columns)} and so on: the bias, its standard deviation, rest, and {lost}"
        )


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
    rested, moved = replay.seen.at_rest_count, _moved(replay)
    if rested is None or moved is None:
        return "-", "-"
    return f"{rested[i] / replay.header.rate:.1f}", f"{moved[i] / replay.header.rate:.1f}"


def _bias(replay: Summary, i: int) -> str:
    bias, sigma = replay.history.bias[-1, i], replay.history.bias_sigma[-1, i]
    return with_error(bias, sigma) if np.isfinite(bias) else "-"


def _memory(replay: Summary, i: int) -> str:
    seconds = replay.memory[i]
    return f"> {replay.header.duration:.4g}" if np.isinf(seconds) else or_dash(seconds)
