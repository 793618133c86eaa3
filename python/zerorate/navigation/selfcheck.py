"""Checks of sensors and receiver against each other, without a filter: units, axes, clocks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np

from zerorate.geometry.earth import local_ned
from zerorate.navigation.axes import Axes, find_axes
from zerorate.navigation.frozen_sensors import frozen_spans
from zerorate.navigation.lag import Lag, find_lag, find_lag_jump, is_rate
from zerorate.navigation.line_course import MIN_TURNED_RAD, find_line_courses
from zerorate.navigation.windows import Epochs, Means, RotationAngle, Windows
from zerorate.numerals import shorten
from zerorate.record import Recording
from zerorate.record.fixes import Fixes
from zerorate.record.samples import Samples
from zerorate.types import Floats

_MIN_LAG_S: Final = 1.0
"""Smallest clock error that is reported here, s; the innovations show smaller errors."""
_LEAP_SECONDS: Final = {
    18: "18 s between UTC and the time of GPS",
    37: "37 s between UTC and atomic time",
}
_LEAP_TOLERANCE_S: Final = 0.7
_DEG_PER_RAD: Final = 180.0 / math.pi
_SPEED_UNITS: Final = (
    (0.24, 0.32, 1.0 / 3.6, "km/h"),
    (0.46, 0.57, 0.514444, "knots"),
)
_SPEED_SCALE_RANGE: Final = (0.85, 1.18)
_GYRO_SCALE_RANGE: Final = (0.8, 1.25)
_MIN_CORRELATION: Final = 0.5
"""Smallest correlation for a finding."""
_MIN_MOUNT_ANGLE_RAD: Final = math.radians(15.0)
_BACKWARD_ANGLE_RAD: Final = math.radians(150.0)
_MAX_MOUNT_SIGMA_RAD: Final = math.radians(10.0)


@dataclass(frozen=True, eq=False)
class NavigationFinding:
    """One finding of `check_navigation`.

    Parameters
    ----------
    what : str
        Kind of the finding: ``"frozen"``, ``"velocity"``, ``"position"``, ``"clock"``, ``"jump"``,
        ``"gyro"``, ``"force"``, ``"axes"`` or ``"mount"``.
    status : {"mistake", "cannot tell"}
        "mistake" if the finding is certain, "cannot tell" if the motion does not decide it.
    text : str
        Sentence that describes the finding.
    value : float
        Estimated factor, angle (rad) or time (s). NaN if there is none.

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
    """Findings on sensors and receiver, as `check_navigation` returns them.

    Parameters
    ----------
    findings : tuple of NavigationFinding
        Mistakes and undecided questions. Empty if sensors and receiver agree.
    lag : float
        Offset to add to the times of the fixes, s, accurate to about 0.1 s. NaN if unknown.
    correlation : float
        Correlation between the course's rate of change and the gyro's rate about down.
    axes : Axes or None
        Estimated axes of the sensors. None if unknown.
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
        """Findings with status "mistake"."""
        return tuple(finding for finding in self.findings if finding.status == "mistake")

    def __str__(self) -> str:
        """Return one line per finding."""
        lines = [f"{finding.what}: {finding.text}" for finding in self.findings]
        return "\n".join(lines) or "sensors and fixes agree"

    def __repr__(self) -> str:
        """Return the number of mistakes, and the lag."""
        return f"NavigationChecks({len(self.mistakes)} mistakes, lag {self.lag:.2f} s)"


def check_navigation(
    imu: Recording, gnss: Fixes, *, time_offset: float = 0.0, mounted: bool = True
) -> NavigationChecks:
    """Check sensors and receiver against each other before a filter uses them.

    Parameters
    ----------
    imu : Recording
        Recording with a gyro and an accelerometer, in any axes.
    gnss : Fixes
        Fixes of the receiver.
    time_offset : float
        Offset to add to the times of the fixes, s.
    mounted : bool
        True checks that the axes are forward, right, down. False checks their handedness only.

    Returns
    -------
    NavigationChecks
        One finding per mistake. Each mistake is corrected before the next check runs.

    Raises
    ------
    LogError
        If the recording has no gyro or accelerometer with a known unit.

    Notes
    -----
    The checks compare three pairs:

    - positions with velocities
    - the course's rate of change with the gyro's rate about down
    - the mean force with the accelerations along and across the course

    If the vehicle hardly turns or accelerates, a finding says that these checks are not possible.

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
    state = _CheckState(Samples.of(imu, mag=False, what="navigation"), gnss.shifted(time_offset))
    steps = (
        _check_velocities,
        _check_clock,
        _check_gyro,
        _check_swap,
        _check_handedness,
        _check_mount if mounted else None,
        _check_frozen,
    )
    findings = [finding for step in steps if step is not None for finding in step(state)]
    lag = state.lag
    return NavigationChecks(
        tuple(findings),
        math.nan if lag is None or not lag.certain else lag.seconds,
        math.nan if lag is None else lag.correlation,
        state.axes,
        imu.source,
    )


@dataclass(eq=False)
class _CheckState:
    """Sensors and fixes. Each check corrects the mistake that it finds."""

    samples: Samples
    fixes: Fixes
    lag: Lag | None = None
    axes: Axes | None = None
    is_swapped: bool = False
    means: Means = field(init=False)
    down: Floats = field(init=False)

    def __post_init__(self) -> None:
        self.means = Means.of(self.samples)
        present = np.isfinite(self.samples.accel.sum(axis=1))
        mean = (
            self.samples.accel[present].mean(axis=0)
            if present.any()
            else np.array([0.0, 0.0, -1.0])
        )
        self.down = -mean / max(float(np.linalg.norm(mean)), 1e-9)

    def find_course(self) -> tuple[list[tuple[RotationAngle, Windows]], Lag | None, float]:
        """Return gyro rotations, course rates, their lag, and the total change of course, rad.

        Without velocities, lines of several widths give several results. The best result is first.
        """
        if not Epochs.of(self.fixes).is_reported:
            courses = find_line_courses(self.means, self.fixes, self.down)
            if courses:
                pairs = [(one.rotation, one.windows) for one in courses]
                return pairs, courses[0].lag, max(one.turned for one in courses)
        windows, rotation = self.windows(), self.means.about(self.down)
        turned = 0.5 * np.nansum(np.abs(windows.course_rate) * (windows.stop - windows.start))
        return [(rotation, windows)], find_lag(rotation, windows), float(turned)

    def windows(self, positions: bool = False) -> Windows:
        """Return the windows of the fixes in their current state."""
        between = Epochs.between_positions if positions else Epochs.of
        return Windows.of(between(self.fixes))


_Findings = Iterator[NavigationFinding]


def _mistake(what: str, text: str, value: float = math.nan) -> NavigationFinding:
    return NavigationFinding(what, "mistake", text, value)


def _doubt(what: str, text: str) -> NavigationFinding:
    return NavigationFinding(what, "cannot tell", text)


def _check_frozen(work: _CheckState) -> _Findings:
    lag = work.lag.seconds if work.lag is not None and work.lag.certain else 0.0
    for sensor in ("gyro", "accel"):
        spans = frozen_spans(work.samples, sensor, Epochs.of(work.fixes).shifted(lag))
        if spans:
            total = sum(stop - start for start, stop in spans)
            named = {"gyro": "the gyro", "accel": "the accelerometer"}[sensor]
            first, last = spans[0]
            yield _mistake(
                "frozen",
                f"{named} repeats its values for {total:.1f} s while the vehicle moves, first from "
                f"{first:.1f} to {last:.1f} s",
                first,
            )


def _check_velocities(work: _CheckState) -> _Findings:
    """Check positions against velocities: units, exchanged columns, sign of the vertical."""
    epochs = Epochs.of(work.fixes)
    velocities = _mean_velocities(work.fixes, epochs) if epochs.is_reported else None
    if velocities is None:
        return
    way, mean = velocities
    k, r = _regress(way[:, :2], mean[:, :2])
    own, other = np.abs(np.diag(k)).sum(), abs(k[0, 1]) + abs(k[1, 0])
    work.is_swapped = bool(
        other > 2.0 * own and max(abs(r[0, 1]), abs(r[1, 0])) >= _MIN_CORRELATION
    )
    pair = (k[0, 1], k[1, 0]) if work.is_swapped else (k[0, 0], k[1, 1])
    correlations = (r[0, 1], r[1, 0]) if work.is_swapped else (r[0, 0], r[1, 1])
    if min(abs(correlation) for correlation in correlations) >= _MIN_CORRELATION:
        yield from _check_scale(work, math.sqrt(abs(pair[0] * pair[1])))
    vertical = np.isfinite(way[:, 2] + mean[:, 2])
    if vertical.sum() > 20 and float(np.sqrt(np.mean(mean[vertical, 2] ** 2))) >= 0.1:
        slope, r_down = _regress(way[vertical, 2:], mean[vertical, 2:])
        if slope[0, 0] < -0.5 and r_down[0, 0] < -0.5:
            yield _mistake("velocity", "the vertical velocity of the fixes is up, not down", -1.0)
            _transform_velocity(work, np.diag([1.0, 1.0, -1.0]))


def _check_scale(work: _CheckState, k: float) -> _Findings:
    for low, high, factor, unit in _SPEED_UNITS:
        if low < k < high:
            text = (
                f"the velocities of the fixes are in {unit}: "
                f"positions move {shorten(k, 3)} times as far"
            )
            yield _mistake("velocity", text, factor)
            _transform_velocity(work, factor * np.eye(3))
            return
    if 0.011 < k < 0.028:
        yield _mistake("position", "latitude and longitude are in rad, not in deg", _DEG_PER_RAD)
        position = work.fixes.position * [_DEG_PER_RAD, _DEG_PER_RAD, 1.0]
        if np.nanmax(np.abs(position[:, 0])) <= 90.0:
            work.fixes = replace(work.fixes, position=position)
        return
    # If latitude and longitude are exchanged, displacements east have another scale.
    if not work.is_swapped and not _SPEED_SCALE_RANGE[0] < k < _SPEED_SCALE_RANGE[1]:
        text = f"positions of the fixes move {shorten(k, 3)} times as far as their velocities state"
        yield _mistake("velocity", text, k)


def _transform_velocity(work: _CheckState, matrix: Floats) -> None:
    if work.fixes.velocity is not None:
        work.fixes = replace(work.fixes, velocity=work.fixes.velocity @ matrix.T)


def _mean_velocities(fixes: Fixes, epochs: Epochs) -> tuple[Floats, Floats] | None:
    """Return displacements over a second, and the mean velocity over each, m/s."""
    present = np.isfinite(fixes.position[:, :2].sum(axis=1))
    used = fixes.chosen(present)
    if len(used) < 20 or len(epochs.time) < 20:
        return None
    step = max(1, round(1.0 / max(float(np.median(np.diff(used.time))), 1e-3)))
    if len(used) <= step:
        return None
    position = used.position
    level = np.column_stack([position[:, :2], np.nan_to_num(position[:, 2])])
    seconds = used.time[step:] - used.time[:-step]
    way = local_ned(level[step:], level[:-step]) / seconds[:, np.newaxis]
    way[~np.isfinite(position[step:, 2] + position[:-step, 2]), 2] = np.nan
    velocity = epochs.velocity
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(epochs.time)[:, np.newaxis]
    integral = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    moved = np.column_stack([np.interp(used.time, epochs.time, column) for column in integral.T])
    mean = (moved[step:] - moved[:-step]) / seconds[:, np.newaxis]
    near = seconds < 3.0 * max(float(np.median(seconds)), 1e-3)
    near &= np.isfinite(mean[:, :2].sum(axis=1))
    if near.sum() < 20 or float(np.sqrt((mean[near, :2] ** 2).mean())) < 0.1:
        return None
    return way[near], mean[near]


def _regress(y: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Return slopes and correlations between two sets of columns, without outliers."""
    size = np.linalg.norm(y, axis=1)
    inliers = size <= 5.0 * np.percentile(size, 90) + 1e-9
    y, x = y[inliers] - y[inliers].mean(axis=0), x[inliers] - x[inliers].mean(axis=0)
    slope = np.asarray(np.linalg.lstsq(x, y, rcond=None)[0].T, dtype=np.float64)
    spread = np.outer(np.linalg.norm(y, axis=0), np.linalg.norm(x, axis=0))
    return slope, np.asarray((y.T @ x) / np.maximum(spread, 1e-30))


def _check_clock(work: _CheckState) -> _Findings:
    courses, lag, turned = work.find_course()
    work.lag = lag
    if len(courses[0][1].start) == 0:
        yield _doubt("clock", "there are too few fixes to find their clock")
        return
    certain = lag is not None and lag.certain
    about = lag.seconds if lag is not None and certain else 0.0
    # The lines that fit best are long, and can hide a jump that shorter lines show.
    jumps = (find_lag_jump(*course, about, certain=certain) for course in courses)
    if (parts := next((jump for jump in jumps if jump is not None), None)) is not None:
        (before, after), (first, second) = parts
        yield _mistake(
            "jump",
            f"the clock of the fixes jumps by {first - second:.1f} s between {before:.0f} and "
            f"{after:.0f} s",
            float(second - first),
        )
        # No lag fits both parts: later checks run without a lag.
        work.lag = None
    elif lag is None or not lag.certain:
        reason = (
            "the course hardly changes while both are present"
            if turned < MIN_TURNED_RAD
            else "course and gyro rotate differently, as if from different vehicles"
        )
        yield _doubt("clock", f"the fixes' clock cannot be compared with the sensors': {reason}")
    elif abs(lag.seconds) > _MIN_LAG_S:
        leap = next((s for s in _LEAP_SECONDS if abs(abs(lag.seconds) - s) < _LEAP_TOLERANCE_S), 0)
        named = f": leap seconds, {_LEAP_SECONDS[leap]}" if leap else ""
        text = f"the fixes are on another clock, {-lag.seconds:.2f} s ahead{named}"
        yield _mistake("clock", text, lag.seconds)


def _check_gyro(work: _CheckState) -> _Findings:
    """Compare the rate of the course with the gyro's rate, ignoring the sign."""
    lag = work.lag
    if (
        lag is None
        or not lag.certain
        or abs(lag.correlation) < _MIN_CORRELATION
        or not is_rate(lag.slope)
    ):
        return
    size = abs(lag.slope)
    if 30.0 < size < 110.0:
        yield _mistake("gyro", "the gyro is in rad/s, not in deg/s", _DEG_PER_RAD)
    elif 30.0 < 1.0 / size < 110.0:
        yield _mistake("gyro", "the gyro is in deg/s, not in rad/s", 1.0 / _DEG_PER_RAD)
    elif not _GYRO_SCALE_RANGE[0] < size < _GYRO_SCALE_RANGE[1] and abs(lag.correlation) > 0.9:
        yield _mistake(
            "gyro", f"the vehicle turns {shorten(size, 3)} times as fast as its gyro says", size
        )


def _check_swap(work: _CheckState) -> _Findings:
    """Yield a finding if north and east are exchanged, in positions or in velocities."""
    if not work.is_swapped:
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
    _transform_velocity(work, np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    work.lag = replace(lag, slope=-lag.slope, correlation=-lag.correlation)


def _check_handedness(work: _CheckState) -> _Findings:
    """Yield mistakes of the handedness and of the signs of gyro and force."""
    lag = work.lag
    if lag is None or not lag.certain:
        return
    work.axes = axes = find_axes(work.means, work.windows(), lag.seconds)
    handedness = "" if axes is None else axes.handedness
    if not handedness:
        yield _doubt(
            "axes", "signs and axes cannot be checked: the vehicle hardly accelerates or turns"
        )
    elif lag.slope < 0.0 and handedness == "right":
        yield _mistake("gyro", "the gyro has the wrong sign", -1.0)
    elif lag.slope < 0.0:
        alternative = (
            "" if work.fixes.velocity is not None else (", or latitude and longitude are exchanged")
        )
        yield _mistake("force", f"the accelerometer has the wrong sign{alternative}", -1.0)
        work.axes = None
    elif handedness == "left":
        yield _mistake("axes", "the axes of the sensors are left-handed: one of them is mirrored")
        work.axes = None


def _check_mount(work: _CheckState) -> _Findings:
    axes = work.axes
    if axes is None or axes.yaw_sigma > _MAX_MOUNT_SIGMA_RAD or axes.handedness != "right":
        return
    if abs(axes.yaw) <= max(_MIN_MOUNT_ANGLE_RAD, 4.0 * axes.yaw_sigma):
        return
    angle = f"{abs(math.degrees(axes.yaw)):.0f} deg (sigma {math.degrees(axes.yaw_sigma):.1f})"
    if abs(axes.yaw) > _BACKWARD_ANGLE_RAD:
        yield _mistake("mount", f"the sensors are mounted backward: x looks {angle} off", axes.yaw)
    else:
        side = "right" if axes.yaw > 0.0 else "left"
        yield _mistake("mount", f"forward is {angle} {side} of the sensors' x axis", axes.yaw)
