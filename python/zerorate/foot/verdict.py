"""Errors and notes for tracks that may not be from a foot."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import keyword_argument, make_sentence
from zerorate.foot.swings import MIN_SHARE, Swings
from zerorate.record import LogError

if TYPE_CHECKING:
    from zerorate.types import Booleans, Floats

_MIN_SWING_RATE_RAD_S: Final = math.radians(100.0)
"""Smallest peak rate of a foot between two stances, rad/s."""
_MIN_SWING_S: Final = 0.5
"""Shortest total time outside stances for a test of the motion, s."""
_MAX_REJECTED_SHARE: Final = 0.2
"""Largest share of rejected stance nodes without a note."""


def refuse_other_bodies(
    time: Floats, gyro: Floats, stances: npt.NDArray[np.int64], swings: Swings
) -> None:
    """Raise LogError if the motion is not the motion of a foot.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the samples, s.
    gyro : ndarray, shape (n, 3)
        Rates, rad/s.
    stances : ndarray of int, shape (s, 3)
        First sample, end (exclusive) and sample of least motion of each stance.
    swings : Swings
        Swings between the stances.
    """
    if swings.are_judged:
        if swings.share < MIN_SHARE and swings.moves:
            raise _refuse_foot(swings.describe_failure())
        return
    moving = _mask_moving(len(time), stances)
    if not len(stances) or _seconds_in(moving, time) < _MIN_SWING_S:
        return
    with np.errstate(invalid="ignore"):
        fastest = float(np.nanmax(np.abs(gyro[moving]), initial=0.0))
    if fastest < _MIN_SWING_RATE_RAD_S:
        raise _refuse_foot(
            f"it turns by {math.degrees(fastest):.0f} deg/s at most, and a foot by more than 100"
        )


def describe_doubts(time: Floats, outputs: dict[str, Any], swings: Swings) -> Iterator[str]:
    """Yield the reasons to doubt that the track is right.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the samples, s.
    outputs : dict
        Outputs of the compiled filter: stances, rejections, and the number of repeated levellings.
    swings : Swings
        Swings of the track.
    """
    stances = outputs["stances"]
    yield from swings.notes(time)
    if not len(stances):
        yield "it never stands, so its track is not known, and it may not be on a foot"
    elif not swings.are_judged:
        yield (
            "it never swings, so it counts as standing; a smoothly driving machine looks the "
            "same, and its track would be missed"
        )
    if outputs["relevelled"]:
        times = "once" if outputs["relevelled"] == 1 else f"{outputs['relevelled']} times"
        yield (
            f"its level was wrong {times}, and the filter restarted at a stance with the tilt of "
            f"the force: since then the heading is hardly known; joined recordings look the same"
        )
    count = max(int((stances[:, 1] - stances[:, 0]).sum()) // outputs["every"], 1)
    share = min(outputs["rejections"] / count, 1.0)
    if share > _MAX_REJECTED_SHARE:
        yield (
            f"{100.0 * share:.0f} % of its stances contradict the track: it may not be on a foot, "
            f"or "
            "turn beyond the range of its gyro"
        )


def _mask_moving(n: int, stances: npt.NDArray[np.int64]) -> Booleans:
    """Return the mask of samples outside stances."""
    moving = np.ones(n, bool)
    for first, end, _ in stances:
        moving[first:end] = False
    return moving


def _seconds_in(mask: Booleans, time: Floats) -> float:
    return float(mask.mean() * (time[-1] - time[0]))


def _refuse_foot(reason: str) -> LogError:
    return LogError(
        make_sentence(
            f"this sensor is not on a foot: {reason}; wear it on the instep or the heel. A wrong "
            f"sample rate and a clipped gyro look the same. Vehicles need wheels or a receiver: "
            f"navigate; ",
            keyword_argument("assume_foot", "", "assume_foot=True"),
            " navigates it in spite of this",
        )
    )
