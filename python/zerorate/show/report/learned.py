"""What a filter that tunes itself learned of each axis, as plain text."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from zerorate.io.names import split_unit
from zerorate.numerals import significant, with_error
from zerorate.run.replay import Summary
from zerorate.run.replay.history import last_known, noise_units
from zerorate.show.report.tables import Table, as_text

__all__ = ["format_learned"]

_NOTE: Final = (
    "White noise as angle random walk, drift as rate random walk; 63 %: the time in which the bias "
    "follows a small step; bias and its standard deviation as they are at the end."
)


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
    head = ("axis", "rest [s]", "motion [s]", *_heads(replay.header.unit))
    title = f"Learned by {replay.method}"
    return as_text(Table(title, head, tuple(_rows(replay)), note=_NOTE))


def _heads(unit: str) -> tuple[str, ...]:
    (white, _), (walk, _) = noise_units(unit)
    return f"noise [{white}]", f"drift [{walk}]", "63 % [s]", f"bias [{unit}]"


def _rows(replay: Summary) -> Iterator[tuple[str, ...]]:
    (_, white), (_, walk) = noise_units(replay.header.unit)
    history = replay.history
    noise = white * last_known(history.angle_random_walk)
    drift = walk * last_known(history.rate_random_walk)
    for i, name in enumerate(replay.header.names):
        yield (
            split_unit(name)[0],
            *_times(replay, i),
            _number(noise[i]),
            _number(drift[i]),
            _memory(replay, i),
            _bias(replay, i),
        )


def _times(replay: Summary, i: int) -> tuple[str, str]:
    if replay.seen.at_rest is None:
        return "-", "-"
    rest = float(replay.seen.at_rest[i]) / replay.header.rate
    return f"{rest:.1f}", f"{replay.header.duration - rest:.1f}"


def _bias(replay: Summary, i: int) -> str:
    bias, sigma = replay.history.bias[-1, i], replay.history.bias_sigma[-1, i]
    return with_error(bias, sigma) if np.isfinite(bias) else "-"


def _memory(replay: Summary, i: int) -> str:
    seconds = replay.memory[i]
    return f"> {replay.header.duration:.4g}" if np.isinf(seconds) else _number(seconds)


def _number(value: float) -> str:
    return significant(value) if np.isfinite(value) else "-"
