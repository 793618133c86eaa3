"""Events of an attitude filter at each sample, and sentences that describe them."""

from __future__ import annotations

from collections.abc import Iterator
from enum import IntFlag
from typing import Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from zerorate.record.clock import count_noun
from zerorate.record.runs import runs_of_rows
from zerorate.types import Booleans, Floats, Integers

EventBits: TypeAlias = npt.NDArray[np.uint16]
"""Sums of `Event` values."""

_MERGED_S: Final = 1.0
"""Events of one kind within this time count once, s."""
_MAX_LISTED: Final = 4


class Event(IntFlag):
    """Something that happened in the attitude filter at one sample.

    Each kind of event is one bit of the number in ``events``.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> from zerorate.attitude import Event
    >>> motion = zr.simulate_motion("hand", duration=40.0, seed=2, magnet=[[25.0, 30.0]])
    >>> events = zr.Attitude(100.0).trace(motion.gyro, motion.accel, motion.mag)["events"]
    >>> ignored = (events.astype(int) & Event.FIELD_IGNORED) != 0
    >>> bool(ignored[:2500].any()), bool(ignored[2500:3000].any())
    (False, True)
    """

    RATE_LEFT_OUT = 1
    RATE_MISSING = 2
    CLIPPED = 4
    GAP = 8
    GLITCH = 16
    KNOCK = 32
    FALL = 64
    BIAS_JUMP = 128
    REST_UNDONE = 256
    HEADING_DRIFT = 512
    FIELD_HELD = 1024
    FIELD_IGNORED = 2048
    UNCLEAR_REST = 4096
    WRONG_UNIT = 8192


class Kind(NamedTuple):
    """An event with its sentence, its name in figures, and True if it lasts."""

    event: Event
    text: str
    name: str
    lasts: bool


KINDS: Final = (
    Kind(Event.RATE_LEFT_OUT, "rates beyond the gyro's range left out", "left out", True),
    Kind(Event.RATE_MISSING, "no rate for more than 0.05 s", "missing", True),
    Kind(Event.CLIPPED, "rates at the gyro's range", "clipped", True),
    Kind(Event.GAP, "gap of the clock: tilt and heading less certain", "gap", False),
    Kind(Event.GLITCH, "outlier of the gyro undone", "glitch", False),
    Kind(Event.KNOCK, "wrong tilt corrected (after a knock or a bias jump)", "knock", False),
    Kind(Event.FALL, "tilt wrong by more than 45 deg, levelled again", "fall", False),
    Kind(Event.BIAS_JUMP, "bias jump of the gyro, found at rest", "jump", False),
    Kind(Event.REST_UNDONE, "earlier rest was false and is undone", "undone", False),
    Kind(
        Event.HEADING_DRIFT, "drift of the heading, found from the magnetic field", "drift", False
    ),
    Kind(Event.FIELD_HELD, "magnetometer stuck at one value, not used", "held", True),
    Kind(Event.FIELD_IGNORED, "disturbed magnetic field ignored", "ignored", True),
    Kind(Event.UNCLEAR_REST, "steady rate above the largest bias, or a rate table", "table?", True),
    Kind(Event.WRONG_UNIT, "rates 57 times too large or small: wrong unit", "unit?", True),
)
"""All events, in the order of their bits."""


def event_mask(events: EventBits, event: Event) -> Booleans:
    """Return the mask of samples with an event, shape (n,)."""
    mask: Booleans = (events & int(event)) != 0
    return mask


def event_notes(events: EventBits, at_rest: Booleans, time: Floats, rate: float) -> Iterator[str]:
    """Yield a sentence for each kind of event, with its count and times.

    Parameters
    ----------
    events : ndarray of uint16, shape (n,)
        Sums of `Event` values.
    at_rest : ndarray of bool, shape (n,)
        Mask of samples at rest.
    time : ndarray, shape (n,)
        Times of the samples, s.
    rate : float
        Sampling rate, Hz.
    """
    seconds = time - time[0]
    if at_rest.any():
        yield _describe_spans("at rest", at_rest, seconds, rate)
    for kind in KINDS:
        mask = event_mask(events, kind.event)
        if mask.any():
            describe = _describe_spans if kind.lasts else _describe_moments
            yield describe(kind.text, mask, seconds, rate)


def _describe_spans(text: str, mask: Booleans, seconds: Floats, rate: float) -> str:
    spans = _merge(mask, rate)
    lengths = (spans[:, 1] - spans[:, 0]) / rate
    longest = int(np.argmax(lengths))
    total = f"{text}: {_format_seconds(np.count_nonzero(mask) / rate)} s"
    if len(spans) == 1:
        return f"{total}, from {_format_seconds(seconds[spans[0, 0]])} s on"
    return (
        f"{total} in {len(spans)} spans, the first at {_format_seconds(seconds[spans[0, 0]])} s, "
        f"the longest {_format_seconds(lengths[longest])} s at "
        f"{_format_seconds(seconds[spans[longest, 0]])} s"
    )


def _describe_moments(text: str, mask: Booleans, seconds: Floats, rate: float) -> str:
    times = [_format_seconds(one) for one in seconds[_merge(mask, rate)[:, 0]]]
    listed = ", ".join(times[:_MAX_LISTED])
    more = f" and {len(times) - _MAX_LISTED} more" if len(times) > _MAX_LISTED else ""
    return f"{text}: {count_noun(len(times), 'time')}, at {listed}{more} s"


def _merge(mask: Booleans, rate: float) -> Integers:
    """Return first sample and end of each span, shape (m, 2); spans within a second are merged."""
    return runs_of_rows(np.flatnonzero(mask), max(1, round(_MERGED_S * rate)))


def _format_seconds(value: float) -> str:
    return f"{float(value):.1f}"
