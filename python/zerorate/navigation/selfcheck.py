"""What sensors and receiver say of each other: units, signs, axes, clocks, before any filter."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np

from zerorate.geometry.earth import local_ned
from zerorate.navigation.axes import Axes, find_axes
from zerorate.navigation.frozen import frozen_spans
from zerorate.navigation.lag import Lag, find_lag, is_rate, lag_of_pieces
from zerorate.navigation.windows import Epochs, Means, Windows
from zerorate.record import Recording
from zerorate.record.fixes import Fixes
from zerorate.record.samples import Samples
from zerorate.types import Floats

_LAG: Final = 1.0
"""Seconds by which clocks are off that are told here; less is found by innovations."""
_DEGREES: Final = 180.0 / math.pi
_UNITS: Final = (
    (0.24, 0.32, 1.0 / 3.6, "km/h"),
    (0.46, 0.57, 0.514444, "knots"),
)
_SCALE: Final = (0.85, 1.18)
_GYRO_SCALE: Final = (0.8, 1.25)
_TOLD: Final = 0.5
"""Correlation below which nothing is told."""
_MOUNT: Final = math.radians(15.0)
_BACKWARD: Final = math.radians(150.0)
_MOUNT_SIGMA: Final = math.radians(10.0)


@dataclass(frozen=True, eq=False)
class NavigationFinding:
    """What one step of a check has found.

    Parameters
    ----------
    what : str
        ``"frozen"``, ``"velocity"``, ``"position"``, ``"clock"``, ``"jump"``, ``"gyro"``,
        ``"force"``, ``"axes"`` or ``"mount"``.
    status : {"mistake", "cannot tell"}
        Whether something is wrong, or the motion does not show whether it is.
    text : str
        A sentence.
    value : float
        The factor, angle, rad, or time, s, that was found; NaN where there is none.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=200.0, seed=1)
    >>> late = drive.fixes.shifted(60.0)
    >>> (found,) = zr.navigation.check_navigation(drive.recording(), late).findings
    >>> found.what, found.status, round(found.value)
    ('clock', 'mistake', -60)
    """

    what: str
    status: Literal["mistake", "cannot tell"]
    text: str
    value: float = math.nan


@dataclass(frozen=True, eq=False)
class NavigationChecks:
    """What sensors and receiver say of each other, as `check_navigation` returns it.

    Parameters
    ----------
    findings : tuple of NavigationFinding
        What is wrong, and what cannot be told; nothing where all agrees.
    lag : float
        By how much the times of the fixes are to be moved, s, to tenths; NaN if that is not known.
    correlation : float
        Of the rate of the course with that of the gyro about down.
    axes : Axes or None
        Which way the axes of the sensors look.
    source : str
        Name of the recording.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=200.0, seed=1)
    >>> found = zr.navigation.check_navigation(drive.recording(), drive.fixes)
    >>> found.mistakes, found.correlation > 0.9, found.axes.certain
    ((), True, True)
    """

    findings: tuple[NavigationFinding, ...]
    lag: float
    correlation: float
    axes: Axes | None
    source: str = "the recording"

    @property
    def mistakes(self) -> tuple[NavigationFinding, ...]:
        """What is wrong beyond doubt."""
        return tuple(one for one in self.findings if one.status == "mistake")

    def __str__(self) -> str:
        """Return a line a finding."""
        lines = [f"{one.what}: {one.text}" for one in self.findings]
        return "\n".join(lines) or "sensors and fixes agree"

    def __repr__(self) -> str:
        """Say how many mistakes there are."""
        return f"NavigationChecks({len(self.mistakes)} mistakes, lag {self.lag:.2f} s)"


def check_navigation(
    imu: Recording, gnss: Fixes, *, time_offset: float = 0.0, mounted: bool = True
) -> NavigationChecks:
    """Check what sensors and receiver say of each other before a filter believes them.

    Parameters
    ----------
    imu : Recording
        With a gyro and an accelerometer, in any axes.
    gnss : Fixes
        Of the receiver.
    time_offset : float
        Added to the times of the fixes, s.
    mounted : bool
        Whether the axes are meant to be forward, right, down; else only their handedness counts.

    Returns
    -------
    NavigationChecks
        One finding a mistake: what is found is put right before the next step looks.

    Raises
    ------
    LogError
        If the recording has no gyro or accelerometer of a known unit.

    Notes
    -----
    Positions are compared with velocities, the rate of the course with the gyro about down, and
    the mean force with accelerations along and across the course. A vehicle that hardly turns or
    speeds up shows nothing of that: then it says so.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=200.0, seed=1)
    >>> zr.navigation.check_navigation(drive.recording(), drive.fixes).findings
    ()
    >>> late = drive.fixes.shifted(60.0)
    >>> [one.what for one in zr.navigation.check_navigation(drive.recording(), late).findings]
    ['clock']
    """
    work = _Work(Samples.of(imu, mag=False, what="navigation"), gnss.shifted(time_offset))
    steps = (_velocities, _clock, _gyro, _exchange, _hands, _mount if mounted else None, _frozen)
    found = [one for step in steps if step is not None for one in step(work)]
    lag = work.lag
    return NavigationChecks(
        tuple(found),
        math.nan if lag is None or not lag.certain else lag.seconds,
        math.nan if lag is None else lag.correlation,
        work.axes,
        imu.source,
    )


@dataclass(eq=False)
class _Work:
    """Sensors and fixes, of which each step puts right what it names."""

    samples: Samples
    fixes: Fixes
    lag: Lag | None = None
    axes: Axes | None = None
    exchanged: bool = False
    means: Means = field(init=False)
    down: Floats = field(init=False)

    def __post_init__(self) -> None:
        self.means = Means.of(self.samples)
        there = np.isfinite(self.samples.accel.sum(axis=1))
        mean = self.samples.accel[there].mean(axis=0) if there.any() else np.array([0.0, 0.0, -1.0])
        self.down = -mean / max(float(np.linalg.norm(mean)), 1e-9)

    def windows(self, positions: bool = False) -> Windows:
        """Return the windows of the fixes as they are by now."""
        between = Epochs.between_positions if positions else Epochs.of
        return Windows.of(between(self.fixes))


_Found = Iterator[NavigationFinding]


def _mistake(what: str, text: str, value: float = math.nan) -> NavigationFinding:
    return NavigationFinding(what, "mistake", text, value)


def _doubt(what: str, text: str) -> NavigationFinding:
    return NavigationFinding(what, "cannot tell", text)


def _frozen(work: _Work) -> _Found:
    lag = work.lag.seconds if work.lag is not None and work.lag.certain else 0.0
    for sensor in ("gyro", "accel"):
        spans = frozen_spans(work.samples, sensor, Epochs.of(work.fixes).shifted(lag))
        if spans:
            total = sum(stop - start for start, stop in spans)
            named = {"gyro": "the gyro", "accel": "the accelerometer"}[sensor]
            first, last = spans[0]
            yield _mistake(
                "frozen",
                f"{named} tells nothing new for {total:.1f} s while the vehicle moves, first from "
                f"{first:.1f} to {last:.1f} s",
                first,
            )


def _velocities(work: _Work) -> _Found:
    """Positions on velocities: units, exchanged columns, the sign of the vertical."""
    told = Epochs.of(work.fixes)
    ways = _ways(work.fixes, told) if told.told else None
    if ways is None:
        return
    way, mean = ways
    k, r = _regression(way[:, :2], mean[:, :2])
    own, other = np.abs(np.diag(k)).sum(), abs(k[0, 1]) + abs(k[1, 0])
    work.exchanged = bool(other > 2.0 * own and max(abs(r[0, 1]), abs(r[1, 0])) >= _TOLD)
    pair = (k[0, 1], k[1, 0]) if work.exchanged else (k[0, 0], k[1, 1])
    seen = (r[0, 1], r[1, 0]) if work.exchanged else (r[0, 0], r[1, 1])
    if min(abs(one) for one in seen) >= _TOLD:
        yield from _scale(work, math.sqrt(abs(pair[0] * pair[1])))
    vertical = np.isfinite(way[:, 2] + mean[:, 2])
    if vertical.sum() > 20 and float(np.sqrt(np.mean(mean[vertical, 2] ** 2))) >= 0.1:
        slope, r_down = _regression(way[vertical, 2:], mean[vertical, 2:])
        if slope[0, 0] < -0.5 and r_down[0, 0] < -0.5:
            yield _mistake("velocity", "the vertical velocity of the fixes is up, not down", -1.0)
            _turn_velocity(work, np.diag([1.0, 1.0, -1.0]))


def _scale(work: _Work, k: float) -> _Found:
    for low, high, factor, unit in _UNITS:
        if low < k < high:
            text = f"the velocities of the fixes are in {unit}: positions move {k:.3g} times as far"
            yield _mistake("velocity", text, factor)
            _turn_velocity(work, factor * np.eye(3))
            return
    if 0.011 < k < 0.028:
        yield _mistake("position", "latitude and longitude are in rad, not in deg", _DEGREES)
        position = work.fixes.position * [_DEGREES, _DEGREES, 1.0]
        if np.nanmax(np.abs(position[:, 0])) <= 90.0:
            work.fixes = replace(work.fixes, position=position)
        return
    # With latitude for longitude the way to the east has another scale.
    if not work.exchanged and not _SCALE[0] < k < _SCALE[1]:
        text = f"positions of the fixes move {k:.3g} times as far as their velocities say"
        yield _mistake("velocity", text, k)


def _turn_velocity(work: _Work, matrix: Floats) -> None:
    if work.fixes.velocity is not None:
        work.fixes = replace(work.fixes, velocity=work.fixes.velocity @ matrix.T)


def _ways(fixes: Fixes, told: Epochs) -> tuple[Floats, Floats] | None:
    """Return displacements over a second, and the mean velocities over them, m/s."""
    there = np.isfinite(fixes.position[:, :2].sum(axis=1))
    used = fixes.chosen(there)
    if len(used) < 20 or len(told.time) < 20:
        return None
    step = max(1, round(1.0 / max(float(np.median(np.diff(used.time))), 1e-3)))
    if len(used) <= step:
        return None
    place = used.position
    level = np.column_stack([place[:, :2], np.nan_to_num(place[:, 2])])
    seconds = used.time[step:] - used.time[:-step]
    way = local_ned(level[step:], level[:-step]) / seconds[:, np.newaxis]
    way[~np.isfinite(place[step:, 2] + place[:-step, 2]), 2] = np.nan
    velocity = told.velocity
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(told.time)[:, np.newaxis]
    integral = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    moved = np.column_stack([np.interp(used.time, told.time, column) for column in integral.T])
    mean = (moved[step:] - moved[:-step]) / seconds[:, np.newaxis]
    near = seconds < 3.0 * max(float(np.median(seconds)), 1e-3)
    near &= np.isfinite(mean[:, :2].sum(axis=1))
    if near.sum() < 20 or float(np.sqrt((mean[near, :2] ** 2).mean())) < 0.1:
        return None
    return way[near], mean[near]


def _regression(y: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Return slopes and correlations of columns on columns, outliers left out."""
    size = np.linalg.norm(y, axis=1)
    kept = size <= 5.0 * np.percentile(size, 90) + 1e-9
    y, x = y[kept] - y[kept].mean(axis=0), x[kept] - x[kept].mean(axis=0)
    slope = np.asarray(np.linalg.lstsq(x, y, rcond=None)[0].T, dtype=np.float64)
    spread = np.outer(np.linalg.norm(y, axis=0), np.linalg.norm(x, axis=0))
    return slope, np.asarray((y.T @ x) / np.maximum(spread, 1e-30))


def _clock(work: _Work) -> _Found:
    windows = work.windows()
    work.lag = lag = find_lag(work.means, windows, work.down)
    if len(windows.start) == 0:
        yield _doubt("clock", "there are too few fixes to tell their clock")
        return
    about = lag.seconds if lag is not None and lag.certain else 0.0
    times, lags = lag_of_pieces(work.means, windows, work.down, about)
    jumps = np.flatnonzero(np.abs(np.diff(lags)) > _LAG)
    if not (lag is not None and lag.certain) and not _is_one_jump(lags):
        jumps = jumps[:0]
    if jumps.size:
        k = int(jumps[0])
        yield _mistake(
            "jump",
            f"the clock of the fixes jumps by {lags[k] - lags[k + 1]:.1f} s between "
            f"{times[k]:.0f} and {times[k + 1]:.0f} s",
            float(lags[k + 1] - lags[k]),
        )
    elif lag is None or not lag.certain:
        yield _doubt(
            "clock",
            "whether sensors and fixes are on one clock is not told: the course hardly turns while "
            "both are there, or they are not of one vehicle",
        )
    elif abs(lag.seconds) > _LAG:
        yield _mistake(
            "clock", f"the fixes are on another clock, {-lag.seconds:.2f} s ahead", lag.seconds
        )


def _is_one_jump(lags: Floats) -> bool:
    """Whether two pieces or more have one lag, and all that follow another."""
    jumps = np.flatnonzero(np.abs(np.diff(lags)) > _LAG)
    return jumps.size == 1 and 1 <= jumps[0] <= len(lags) - 3


def _gyro(work: _Work) -> _Found:
    """Compare the rate of the course with the gyro's, but for its sign."""
    lag = work.lag
    if lag is None or not lag.certain or abs(lag.correlation) < _TOLD or not is_rate(lag.slope):
        return
    size = abs(lag.slope)
    if 30.0 < size < 110.0:
        yield _mistake("gyro", "the gyro is in rad/s, not in deg/s", _DEGREES)
    elif 30.0 < 1.0 / size < 110.0:
        yield _mistake("gyro", "the gyro is in deg/s, not in rad/s", 1.0 / _DEGREES)
    elif not _GYRO_SCALE[0] < size < _GYRO_SCALE[1] and abs(lag.correlation) > 0.9:
        yield _mistake("gyro", f"the vehicle turns {size:.3g} times as fast as its gyro says", size)


def _exchange(work: _Work) -> _Found:
    """Which is exchanged, the velocities or the positions: the right one turns as the gyro does."""
    if not work.exchanged:
        return
    lag = work.lag
    positive = lag is not None and lag.certain and lag.slope > 0.0
    if lag is None or not lag.certain:
        yield _doubt("position", "north and east are exchanged, in positions or in velocities")
        return
    if positive:
        yield _mistake("position", "latitude and longitude are exchanged")
        return
    yield _mistake("velocity", "the velocities north and east are exchanged")
    _turn_velocity(work, np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    work.lag = replace(lag, slope=-lag.slope, correlation=-lag.correlation)


def _hands(work: _Work) -> _Found:
    """Whether axes are right-handed, and the signs of gyro and force."""
    lag = work.lag
    if lag is None or not lag.certain:
        return
    work.axes = axes = find_axes(work.means, work.windows(), lag.seconds)
    hand = "" if axes is None else axes.handed
    if not hand:
        yield _doubt(
            "axes", "whether signs and axes are right is not told: it hardly speeds up or turns"
        )
    elif lag.slope < 0.0 and hand == "right":
        yield _mistake("gyro", "the gyro has the other sign", -1.0)
    elif lag.slope < 0.0:
        beside = (
            "" if work.fixes.velocity is not None else (", or latitude and longitude are exchanged")
        )
        yield _mistake("force", f"the accelerometer has the other sign{beside}", -1.0)
        work.axes = None
    elif hand == "left":
        yield _mistake("axes", "the axes of the sensors are left-handed: one of them is mirrored")
        work.axes = None


def _mount(work: _Work) -> _Found:
    axes = work.axes
    if axes is None or axes.yaw_sigma > _MOUNT_SIGMA or axes.handed != "right":
        return
    if abs(axes.yaw) <= max(_MOUNT, 4.0 * axes.yaw_sigma):
        return
    angle = f"{abs(math.degrees(axes.yaw)):.0f} deg (sigma {math.degrees(axes.yaw_sigma):.1f})"
    if abs(axes.yaw) > _BACKWARD:
        yield _mistake("mount", f"the sensors are mounted backward: x looks {angle} off", axes.yaw)
    else:
        side = "right" if axes.yaw > 0.0 else "left"
        yield _mistake("mount", f"forward is {angle} {side} of the sensors' x axis", axes.yaw)
