"""Swings of a track, and tests that show the swings of a foot."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from zerorate.types import Booleans, Floats

MIN_SHARE: Final = 0.5
"""Smallest share of the swing time that must pass the tests for a foot."""
_SURE_SHARE: Final = 0.8
"""Share of the swing time below which a note is added."""
_SURE_LEAN_RAD: Final = math.radians(20.0)
"""Median lean above which a note is added: recorded feet 1 to 7 deg, simulated runs 16 deg."""
_MIN_SWINGING_S: Final = 0.5
_MIN_SWING_S: Final = 0.02
_WINDOW: Final = 6
"""Number of swings in a window that finds spans without foot motion."""
_STRAY_SPEED_M_S: Final = 2.0
"""Growth of the position's standard deviation in a span without foot motion, m/s."""
MAX_FLOOR_STEP_M: Final = 0.1
"""Largest height of a stance above the floor on which it is placed, m, as in the core."""
_RANDOM_SHARE: Final = 0.2
"""Sums of vertical velocities below this share of their scatter count as random."""


class _Test(NamedTuple):
    """A test that swings of a foot pass, and the text if most swings fail it."""

    name: str
    passes: Callable[[Floats], Booleans]
    describe: Callable[[float], str]


_TESTS: Final = (
    _Test(
        "turn",
        lambda x: x > math.radians(100.0),
        lambda x: f"it turns by {math.degrees(x):.0f} deg/s at most, and a foot by more than 100",
    ),
    _Test(
        "depth",
        lambda x: x < 0.2,
        lambda x: (
            f"it does not stand between swings: its speed bound falls to {x:.2g} of the swing's"
            ", and a foot's below 0.2"
        ),
    ),
    _Test(
        "tilt",
        lambda x: x < math.radians(20.0),
        lambda x: (
            f"its tilt changes by {math.degrees(x):.0f} deg from one stance to the next, "
            "and a foot's by less than 20"
        ),
    ),
    _Test(
        "lean",
        lambda x: x < math.radians(45.0),
        lambda x: (
            f"the force points {math.degrees(x):.0f} deg off the vertical where it should "
            "stand, and a foot's less than 45"
        ),
    ),
    _Test(
        "way",
        lambda x: x > 0.1,
        lambda x: f"it moves by {x:.2f} m from stance to stance, and a foot by more than 0.1",
    ),
)
"""Measured on 307 feet and 243 other bodies: `docs/evidence/foot.md`."""


@dataclass(frozen=True, eq=False)
class Swings:
    """Swings of a track from one stance to the next (`FootTrack.swings`); m swings.

    Parameters
    ----------
    start, end : ndarray of int, shape (m,)
        Last sample of the previous stance, and first sample of the next stance. Both are samples at
        which the covariance is computed.
    duration : ndarray, shape (m,)
        Duration of the swing, s.
    turn : ndarray, shape (m,)
        Largest angular rate in the swing, rad/s.
    depth : ndarray, shape (m,)
        Speed bound in a stance divided by the 0.9 quantile of the bound in the swing. Of both
        stances the larger bound counts.
    tilt : ndarray, shape (m,)
        Angle between the vertical directions of both stances, in the sensor's axes, rad.
    lean : ndarray, shape (m,)
        Angle between mean force and vertical in a stance, rad. Of both stances the larger angle
        counts.
    way : ndarray, shape (m,)
        Distance between both stances, m.
    vertical_velocity, vertical_velocity_sigma : ndarray, shape (m,)
        Vertical velocity (m/s, positive up) that the next stance corrects, and its standard
        deviation.

    Examples
    --------
    >>> import zerorate as zr
    >>> walk = zr.simulate_walk(strides=20, seed=1)
    >>> swings = zr.FootNavigation().process(walk.recording()).swings
    >>> len(swings), swings.share
    (20, 1.0)
    """

    start: npt.NDArray[np.int64]
    end: npt.NDArray[np.int64]
    duration: Floats
    turn: Floats
    depth: Floats
    tilt: Floats
    lean: Floats
    way: Floats
    vertical_velocity: Floats
    vertical_velocity_sigma: Floats

    @classmethod
    def from_rows(cls, rows: Floats) -> Swings:
        """Return the swings from rows of the compiled filter, shape (m, 10)."""
        start, end = rows[:, :2].astype(np.int64).T
        duration = np.maximum(rows[:, 2], _MIN_SWING_S)
        turn, depth, tilt, lean, way, down, sigma = rows[:, 3:].T
        return cls(start, end, duration, turn, depth, tilt, lean, way, -down, sigma)

    def __len__(self) -> int:
        """Return the number of swings."""
        return len(self.start)

    @property
    def tests(self) -> dict[str, Booleans]:
        """Mask of the swings that pass each test, by the test's name."""
        return {test.name: test.passes(getattr(self, test.name)) for test in _TESTS}

    @property
    def are_judged(self) -> bool:
        """True if the swings last 0.5 s or more in total, so that they can be tested."""
        return bool(self.duration.sum() >= _MIN_SWINGING_S)

    @property
    def share(self) -> float:
        """Share of the swing time that passes all five tests; NaN without swings."""
        return self._share(np.logical_and.reduce(list(self.tests.values())))

    @property
    def moves(self) -> bool:
        """True if the sensor moves, but not like a foot."""
        tests = self.tests
        del tests["way"]
        return self._share(np.logical_and.reduce(list(tests.values()))) < MIN_SHARE

    def _share(self, passed: Booleans) -> float:
        total = float(self.duration.sum())
        return float(self.duration[passed].sum()) / total if total > 0.0 else math.nan

    def describe_failure(self) -> str:
        """Return a clause on the most failed test, with the median value of the failed swings."""
        shares = {name: self._share(passed) for name, passed in self.tests.items()}
        worst = min(_TESTS, key=lambda test: shares[test.name])
        failed = ~worst.passes(getattr(self, worst.name))
        median = float(np.median(getattr(self, worst.name)[failed]))
        return (
            f"in {100.0 * (1.0 - shares[worst.name]):.0f} % of its swings {worst.describe(median)}"
        )

    def stray_spans(self) -> list[tuple[int, int]]:
        """Return the spans of samples without foot motion, from windows of six swings."""
        passed = np.logical_and.reduce(list(self.tests.values()))
        stray = np.zeros(len(self), bool)
        if len(self) >= _WINDOW:
            windows = np.lib.stride_tricks.sliding_window_view(self.duration, _WINDOW)
            of_foot = np.lib.stride_tricks.sliding_window_view(self.duration * passed, _WINDOW)
            for first in np.flatnonzero(of_foot.sum(axis=1) < MIN_SHARE * windows.sum(axis=1)):
                stray[first : first + _WINDOW] |= ~passed[first : first + _WINDOW]
        spans: list[tuple[int, int]] = []
        previous = -_WINDOW
        for k in np.flatnonzero(stray):
            start, end = int(self.start[k]), int(self.end[k])
            if spans and k - previous < _WINDOW // 2:
                spans[-1] = (spans[-1][0], end)
            else:
                spans.append((start, end))
            previous = int(k)
        return spans

    def notes(self, time: Floats) -> Iterator[str]:
        """Yield the reasons to doubt that the sensor is on a foot."""
        if not self.are_judged:
            return
        share = self.share
        if share < MIN_SHARE and not self.moves:
            yield (
                f"it steps on the spot: {self.describe_failure()}; a foot that taps and a stick on "
                "its pivot look the same"
            )
            return
        if share < _SURE_SHARE:
            yield (
                f"it may not be on a foot: {100.0 * share:.0f} % of its swing time looks like a "
                f"foot's; {self.describe_failure()}"
            )
        elif (lean := float(np.median(self.lean))) > _SURE_LEAN_RAD:
            yield (
                f"it may not be on a foot: the force points {math.degrees(lean):.0f} deg off the "
                "vertical where it stands, and a foot's less than 20"
            )
        for start, end in self.stray_spans():
            yield f"from {time[start]:.0f} to {time[end]:.0f} s it is not on a foot"

    def climb_variance(self, height: Floats, *, clipped: bool, level: bool) -> Floats:
        """Return the height variance from errors that add up over the swings, m², shape (n,).

        A stance corrects a vertical velocity, but not the height error from it. Random errors
        cancel over the swings. A tilt error with the same value in each swing does not cancel.

        Parameters
        ----------
        height : ndarray, shape (n,)
            Height of the track, m.
        clipped : bool
            True if the gyro is clipped. Errors that may be random are then included.
        level : bool
            True if the floor is level. Only swings to another floor are then included.
        """
        rise = height[self.end] - height[self.start] if len(self) else np.empty(0)
        counted = self.duration * (np.abs(rise) >= MAX_FLOOR_STEP_M if level else 1.0)
        error = 0.5 * np.cumsum(self.vertical_velocity * counted)
        spread = 0.5 * np.cumsum(self.vertical_velocity_sigma * counted)
        counts = clipped | (np.abs(error) > _RANDOM_SHARE * spread)
        values = np.concatenate([[0.0], np.where(counts, error, 0.0) ** 2])
        variance: Floats = values[np.searchsorted(self.end, np.arange(len(height)), side="right")]
        return variance

    def stray_variance(self, time: Floats) -> Floats:
        """Return the position variance from spans without foot motion, m², shape (n,)."""
        inside = np.zeros(len(time), bool)
        for start, end in self.stray_spans():
            inside[start:end] = True
        seconds = np.cumsum(np.diff(time, prepend=time[0]) * inside)
        variance: Floats = (_STRAY_SPEED_M_S * seconds) ** 2
        return variance
