"""Errors of a navigation filter in outages of its receiver, compared with held values."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import ArgumentError, make_sentence
from zerorate.geometry.rotations import rotate
from zerorate.metrics.channels import check_positive
from zerorate.navigation.begin import Offset, find_beginning
from zerorate.navigation.coarse_start import begins_in_motion
from zerorate.navigation.events import pack_fixes
from zerorate.navigation.track import SmoothedPoses, Track, explain_no_start
from zerorate.numerals import shorten
from zerorate.progress import Progress, choose_reporter
from zerorate.record import LogError
from zerorate.types import Booleans, Floats, Integers
from zerorate.views import Result

if TYPE_CHECKING:
    from zerorate._native import NavigationFilter
    from zerorate.navigation.aids import Aid
    from zerorate.navigation.alignment import Alignment
    from zerorate.navigation.wheels import Wheels
    from zerorate.record import Recording
    from zerorate.record.fixes import Fixes

POSITION_HELD: Final = "position held"
VELOCITY_HELD: Final = "velocity held"
FILTER: Final = "filter"
SMOOTHED: Final = "smoothed"
"""Names of what is compared."""

ELLIPSE_SIGMAS: Final = math.sqrt(-2.0 * math.log(0.05))
"""Standard deviations to the edge of an ellipse that holds 95 % of a plane's errors."""
_DOUBT_S: Final = 10.0
_MIN_DOUBT_OUTAGES: Final = 3
"""Outages that test a start in motion: their length, s, and least number."""
_TIME_TOLERANCE_S: Final = 1e-6
"""Seconds by which times are one: those of fixes add up with rounding."""
_MAX_END_GAP_SHARE: Final = 0.1
"""Part of an outage that its last fix may come before its end."""


@dataclass(frozen=True, eq=False)
class OutageErrors:
    """Horizontal errors in n outages of one length, with m fixes withheld in all.

    Parameters
    ----------
    seconds : float
        Length of an outage.
    spans : ndarray, shape (n, 2)
        Times of the last fix before an outage and of the last one withheld in it, s.
    time : ndarray, shape (m,)
        Times of the withheld fixes, on the clock of the inertial sensors, s.
    outage : ndarray of int, shape (m,)
        Outage of each withheld fix.
    position : ndarray, shape (m, 3)
        Positions of these fixes: latitude and longitude, deg, height, m.
    errors : dict of str to ndarray, shape (m, 2)
        Errors north and east at each of them, m, of "position held", "velocity held", "filter" and,
        if requested, "smoothed".
    sigma : ndarray, shape (m, 2)
        The filter's standard deviations north and east at each of them, m.
    end : dict of str to ndarray, shape (n,)
        Horizontal error at the last withheld fix, m. For "smoothed" the largest error in the
        outage; NaN if fewer than two fixes follow.
    fix_sigma : ndarray, shape (m, 2)
        Standard deviations north and east that the receiver states for these fixes, m.
    """

    seconds: float
    spans: Floats
    time: Floats
    outage: Integers
    position: Floats
    errors: dict[str, Floats]
    sigma: Floats
    end: dict[str, Floats]
    fix_sigma: Floats

    @property
    def n(self) -> int:
        """Number of outages."""
        return len(self.spans)

    def rms(self, name: str = FILTER) -> float:
        """Return the root mean square of `end`, m, over the outages in which it is known."""
        return math.sqrt(float(np.mean(self._known_ends(name) ** 2)))

    def median(self, name: str = FILTER) -> float:
        """Return the median of `end`, m."""
        return float(np.median(self._known_ends(name)))

    def largest(self, name: str = FILTER) -> float:
        """Return the largest of `end`, m."""
        return float(np.max(self._known_ends(name)))

    def error_over_sigma(self) -> float:
        """Return the RMS ratio of the filter's end errors to their standard deviation: 1 is right.

        The standard deviation combines the filter and the fix.
        """
        return math.sqrt(0.5 * float(np.mean(self._end_squares())))

    def share_inside(self) -> float:
        """Return the share of end errors inside the figure's ellipse; 95 % if sigma is right."""
        return float(np.mean(self._end_squares() < ELLIPSE_SIGMAS**2))

    def _end_squares(self) -> Floats:
        """Return the squares of end errors over their variances, summed over both axes."""
        last = np.flatnonzero(np.diff(self.outage, append=-1))
        variance = self.sigma[last] ** 2 + self.fix_sigma[last] ** 2
        squares = (self.errors[FILTER][last] ** 2 / variance).sum(axis=1)
        known: Floats = squares[np.isfinite(squares)]
        return known if known.size else np.array([np.nan])

    def _known_ends(self, name: str) -> Floats:
        ends = self.end[name]
        known = np.isfinite(ends)
        return ends[known] if known.any() else np.array([np.nan])


@dataclass(frozen=True, eq=False, repr=False)
class Outages(Result):
    """Errors in outages of several lengths, as `outages` returns them.

    Parameters
    ----------
    lengths : tuple of OutageErrors
        Errors of each length, in the given order.
    source : str
        Name of the recording.
    notes : tuple of str
        Sentences on what was left out or assumed.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=240.0, seed=1)
    >>> found = zr.navigation.outages(drive.recording(), drive.fixes, seconds=[10.0, 30.0])
    >>> len(found.lengths), found[10.0].rms() < found[30.0].rms()
    (2, True)
    """

    lengths: tuple[OutageErrors, ...]
    source: str = "the recording"
    notes: tuple[str, ...] = ()

    def __getitem__(self, seconds: float) -> OutageErrors:
        """Return the errors of one length; KeyError if it was not requested."""
        for errors in self.lengths:
            if errors.seconds == seconds:
                return errors
        raise KeyError(seconds)

    def __repr__(self) -> str:
        """Return the number of outages of each length, and the filter's errors."""
        parts = (
            f"{errors.n} of {errors.seconds:g} s: {shorten(errors.rms(), 3)} m rms"
            for errors in self.lengths
        )
        return f"Outages({', '.join(parts)})"


def outages(
    imu: Recording,
    gnss: Fixes,
    *,
    seconds: float | Sequence[float] = (10.0, 30.0, 60.0),
    nav: NavigationFilter | None = None,
    antenna: npt.ArrayLike | None = None,
    smooth: bool = False,
    first: float = 60.0,
    between: float = 30.0,
    rest: npt.ArrayLike | None = None,
    wheel_speed: npt.ArrayLike | Wheels | None = None,
    aids: Mapping[str, npt.ArrayLike | Aid] | None = None,
    time_offset: Offset = "auto",
    threads: int | None = None,
    progress: Progress | None = None,
) -> Outages:
    """Return the errors of a navigation filter after outages of the receiver.

    Fixes are withheld, and the filter's track is compared with them. The same is done for a
    position and a velocity held since the last fix; on a slow platform these may be better.

    Parameters
    ----------
    imu : Recording
        Recording for ``NavigationFilter.process``, in the axes of the body.
    gnss : Fixes
        Fixes of the receiver; withheld ones count as true.
    seconds : float or sequence of float
        Lengths of outages; the filter runs once for each. Default 10, 30 and 60.
    nav : NavigationFilter, optional
        A new filter without samples; it is copied and not changed. By default axes, clock, antenna
        and start are found as in `zerorate.navigate`.
    antenna : array_like, shape (3,), optional
        Vector from the sensors to the antenna, body axes, m; if `nav` is given, set it there.
    smooth : bool
        Also smooth; its largest error inside an outage is reported.
    first : float
        Seconds from the filter's first fix to the first outage. Default 60.
    between : float
        Seconds from the end of an outage to the next, in which fixes are used. Default 30.
    rest : array_like of bool, shape (n,), optional
        Mask of known rest of the vehicle.
    wheel_speed : array_like, shape (n,), or Wheels, optional
        Speed of its wheels, m/s, for a filter of a wheeled vehicle.
    aids : dict of str to array_like or Aid, optional
        Readings of aids, as the arguments height, pressure, heading and baseline of
        ``NavigationFilter.process``.
    time_offset : float, TimeOffset or "auto"
        Offset added to the times of the fixes, s. "auto": the best fit of sensors and fixes; 0 if
        `nav` is given.
    threads : int, optional
        Number of lengths to run at once. Default: one per core. The result does not depend on it.
        Each needs 0.4 kB per sample and, with `smooth`, about 3 kB per step of the covariance.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.

    Returns
    -------
    Outages
        Errors by length; ``print`` shows RMS, median and largest.

    Raises
    ------
    LogError
        If there are no fixes, or the filter did not start.
    ValueError
        If an argument is out of range, the filter has seen samples, or there is no room for an
        outage of a requested length.

    Notes
    -----
    If a receiver reports no velocity, the held velocity comes from the last two positions. Errors
    are computed at the antenna, interpolated between samples. Filter errors smaller than the errors
    of the fixes cannot be measured.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(duration=240.0, seed=1)
    >>> found = zr.navigation.outages(drive.recording(), drive.fixes, seconds=30.0)
    >>> found[30.0].n, found[30.0].rms() < found[30.0].rms("velocity held")
    (2, True)
    """
    _check_fixes(gnss)
    lengths = _check_lengths(seconds)
    _check_not_negative("first", first)
    check_positive("between", between)
    thread_count = _thread_count(threads)
    if nav is not None and antenna is not None:
        raise ValueError("antenna cannot be combined with nav; set it on the NavigationFilter")
    report = choose_reporter(progress)
    report("navigating", 0.0)
    notes: tuple[str, ...] = ()
    if nav is None:
        beginning = find_beginning(imu, gnss, antenna=antenna, time_offset=time_offset)
        imu, time_offset, notes = beginning.recording, beginning.time_offset, beginning.notes
    template = beginning.filter() if nav is None else _check_unused(nav)
    offset = 0.0 if isinstance(time_offset, str) else time_offset
    inputs: dict[str, Any] = {"rest": rest, "wheel_speed": wheel_speed, "time_offset": offset}
    inputs |= aids or {}
    undisturbed = template.copy().process(imu, gnss, keep="track", **inputs)
    gaps = OutagePlan(lengths, smooth, first, between)
    result = gaps.run(imu, gnss, template, undisturbed, inputs, thread_count, report)
    return replace(result, notes=(*notes, *result.notes))


@dataclass(frozen=True)
class OutagePlan:
    """Lengths of outages, flag of smoothing, seconds before the first and between them."""

    lengths: Sequence[float]
    smooth: bool
    first: float = 60.0
    between: float = 30.0

    def run(
        self,
        imu: Recording,
        gnss: Fixes,
        nav: NavigationFilter,
        undisturbed: Track,
        inputs: dict[str, Any],
        threads: int,
        report: Progress,
    ) -> Outages:
        """Return the errors of a filter, from its estimates with all and with withheld fixes."""
        from zerorate.record.offset import TimeOffset

        fixes = _FixSpan.of(undisturbed, TimeOffset.of(inputs["time_offset"]).applied(gnss))
        withheld = [fixes.withhold(one, self.first, self.between) for one in self.lengths]

        def errors(length: float, withheld: _WithheldFixes) -> tuple[OutageErrors, list[str]]:
            used = gnss.chosen(~withheld.mask(len(gnss)))
            run = nav.copy()
            track = run.process(imu, used, keep="all" if self.smooth else "track", **inputs)
            poses: dict[str, _PoseGetter] = {FILTER: _pose_getter(track)}
            if self.smooth:
                poses[SMOOTHED] = SmoothedPoses(track)
            notes: list[str] = []
            return _compute_errors(
                length, withheld, fixes.gnss, track, poses, run.antenna, notes
            ), notes

        work = [
            partial(copy_context().run, errors, length, one)
            for length, one in zip(self.lengths, withheld, strict=True)
        ]
        results: list[OutageErrors] = []
        notes: list[str] = []
        with ThreadPoolExecutor(min(threads, len(work))) as pool:
            jobs = [pool.submit(one) for one in work]
            try:
                for i, job in enumerate(jobs):
                    report(f"{self.lengths[i]:g} s", (1 + i) / (1 + len(jobs)))
                    one, job_notes = job.result()
                    results.append(one)
                    notes += job_notes
            finally:
                for job in jobs:
                    job.cancel()
        return Outages(tuple(results), imu.source, tuple(dict.fromkeys(notes)))


def doubt_start(
    start: Alignment,
    imu: Recording,
    gnss: Fixes,
    nav: NavigationFilter,
    undisturbed: Track,
    inputs: dict[str, Any],
) -> str:
    """Return a sentence if a held velocity is better than a filter that began in motion."""
    if not begins_in_motion(start):
        return ""
    plan = OutagePlan((_DOUBT_S,), smooth=False, first=2.0 * _DOUBT_S, between=_DOUBT_S)
    try:
        found = plan.run(imu, gnss, nav, undisturbed, inputs, 1, lambda step, done: None)[_DOUBT_S]
    except ValueError:
        # There is no room for an outage.
        return ""
    filtered, held = found.rms(), found.rms(VELOCITY_HELD)
    if found.n < _MIN_DOUBT_OUTAGES or not filtered > held:
        return ""
    return (
        f"without fixes for {_DOUBT_S:g} s the filter is off by {shorten(filtered, 3)} m RMS, a "
        "velocity "
        f"that is held by {shorten(held, 3)} m: it began in motion, and no rest tells the gyro's "
        "bias"
    )


def _thread_count(threads: int | None) -> int:
    if threads is None:
        return os.cpu_count() or 1
    if not isinstance(threads, (int, np.integer)) or threads < 1:
        raise ArgumentError("threads", f"must be a whole number from 1, got {threads!r}")
    return int(threads)


def _check_fixes(gnss: Fixes) -> None:
    from zerorate.record.fixes import Fixes

    if not isinstance(gnss, Fixes):
        raise TypeError(
            f"gnss must be Fixes, as zr.read_fixes returns them, got {type(gnss).__name__}"
        )
    if len(gnss) == 0:
        raise LogError(f"{gnss.source}: there are no fixes to withhold")


def _check_unused(nav: NavigationFilter) -> NavigationFilter:
    if nav.samples_seen:
        raise ArgumentError(
            "nav", f"must be a filter that has seen no sample, this one has {nav.samples_seen}"
        )
    return nav


def _check_lengths(seconds: float | Sequence[float]) -> list[float]:
    lengths = np.atleast_1d(np.asarray(seconds, dtype=np.float64))
    if lengths.ndim != 1 or not lengths.size:
        raise ArgumentError("seconds", "must be a number or several, such as (10, 30, 60)")
    return list(dict.fromkeys(check_positive("seconds", float(length)) for length in lengths))


def _check_not_negative(name: str, value: float) -> None:
    if not 0.0 <= value < math.inf:
        raise ArgumentError(name, f"must be a number from 0, got {value}")


@dataclass(frozen=True, eq=False)
class _WithheldFixes:
    """Withheld fixes: their indices, their outages, and the last fix before each outage.

    `smoothable` is True for outages that two fixes follow: the filter does not trust a single fix.
    """

    fixes: Integers
    outage: Integers
    before: Integers
    smoothable: Booleans
    skipped_count: int

    def mask(self, n: int) -> Booleans:
        """Return the mask of the fixes, out of n, that are withheld."""
        mask = np.zeros(n, dtype=np.bool_)
        mask[self.fixes] = True
        return mask


@dataclass(frozen=True, eq=False)
class _FixSpan:
    """Fixes on the clock of a track, and the span in which they can be withheld."""

    gnss: Fixes
    begin: float
    last: float

    @classmethod
    def of(cls, track: Track, gnss: Fixes) -> _FixSpan:
        there = np.flatnonzero(track.navigating)
        if not there.size:
            raise LogError(
                make_sentence(
                    f"{track.source}: the filter did not start: ", explain_no_start(track)
                )
            )
        start = track.time[there[0]]
        until = np.flatnonzero(gnss.time <= start + _TIME_TOLERANCE_S)
        inside = np.flatnonzero(gnss.time <= track.time[-1])
        return cls(gnss, float(gnss.time[until[-1]]), float(gnss.time[inside[-1]]))

    def withhold(self, length: float, first: float, between: float) -> _WithheldFixes:
        """Return the fixes that are withheld in outages of a length."""
        time, begin = self.gnss.time, self.begin + first
        count = (
            math.floor((self.last + _TIME_TOLERANCE_S - begin - length) / (length + between)) + 1
        )
        if count < 1:
            raise ValueError(
                f"there is no room for an outage of {length:g} s: the filter started at "
                f"{self.begin:g} s, and {first:g} s later there are "
                f"{shorten(max(self.last - begin, 0.0), 4)} s of fixes left"
            )
        starts = begin + (length + between) * np.arange(count)
        edges = np.searchsorted(
            time, [starts + _TIME_TOLERANCE_S, starts + length + _TIME_TOLERANCE_S]
        )
        usual = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
        slack = max(_MAX_END_GAP_SHARE * length, 1.5 * usual)
        ends = [
            (int(a), int(b))
            for start, a, b in zip(starts, *edges, strict=True)
            if b > a and start + length - time[b - 1] < slack and start - time[a - 1] < slack
        ]
        if not ends:
            raise ValueError(
                f"there is no room for an outage of {length:g} s: the receiver has gaps itself"
            )
        befores = np.array([a - 1 for a, _ in ends])
        afters = np.array([b for _, b in ends])
        if np.isin(befores, afters - 1).any():
            raise ArgumentError("between", f"must leave a fix between outages, got {between:g} s")
        return _WithheldFixes(
            np.concatenate([np.arange(a, b) for a, b in ends]),
            np.repeat(np.arange(len(ends)), [b - a for a, b in ends]),
            befores,
            np.append(befores[1:] + 1, np.searchsorted(time, self.last + _TIME_TOLERANCE_S))
            - afters
            >= 2,
            count - len(ends),
        )


def _compute_errors(
    length: float,
    withheld: _WithheldFixes,
    gnss: Fixes,
    track: Track,
    poses: dict[str, _PoseGetter],
    lever: Floats,
    notes: list[str],
) -> OutageErrors:
    """Return the errors at the withheld fixes, and at the end of each outage."""
    chosen, before = withheld.fixes, withheld.before[withheld.outage]
    time, truth = gnss.time[chosen], gnss.position[chosen]
    since = (time - gnss.time[before])[:, np.newaxis]
    errors = {
        POSITION_HELD: -_displacement(gnss.position[before], truth),
        VELOCITY_HELD: _held_velocity(gnss, withheld.before, notes)[withheld.outage] * since
        - _displacement(gnss.position[before], truth),
    }
    errors |= {
        name: _antenna_errors(track.time, of, time, truth, lever) for name, of in poses.items()
    }
    last = np.flatnonzero(np.diff(withheld.outage, append=-1))
    distance = {name: np.hypot(*error.T) for name, error in errors.items()}
    end = {name: values[last] for name, values in distance.items()}
    if SMOOTHED in poses:
        largest = np.maximum.reduceat(distance[SMOOTHED], np.r_[0, last[:-1] + 1])
        end[SMOOTHED] = np.where(withheld.smoothable, largest, np.nan)
        unfollowed = int((~withheld.smoothable).sum())
        if unfollowed:
            notes.append(
                f"outages of {length:g} s followed by fewer than two fixes, which are not in the "
                f"smoother's row: {unfollowed} of {len(last)}"
            )
    spans = np.column_stack([gnss.time[withheld.before], time[last]])
    if withheld.skipped_count:
        notes.append(
            f"outages of {length:g} s left out where the receiver has gaps itself: "
            f"{withheld.skipped_count}"
        )
    lost = int((~np.isfinite(end[FILTER])).sum())
    if lost:
        notes.append(
            f"outages of {length:g} s in which a gap of the sensors ended the track, left out of "
            f"its row: {lost} of {len(last)}"
        )
    # The last sample before a fix: at the first after it the next may have been taken.
    samples = np.searchsorted(track.time, time, side="right") - 1
    sigma, fix_sigma = track.sigma[samples, :2], pack_fixes(gnss)[chosen, 7:9]
    return OutageErrors(length, spans, time, withheld.outage, truth, errors, sigma, end, fix_sigma)


def _displacement(start: Floats, stop: Floats) -> Floats:
    """Return displacements north and east between positions, m; heights may be missing."""
    from zerorate.geometry.earth import local_ned

    level = start.copy()
    level[:, 2] = np.nan_to_num(level[:, 2])
    return local_ned(stop, level)[:, :2]


def _held_velocity(gnss: Fixes, before: Integers, notes: list[str]) -> Floats:
    """Return the velocity north and east at fixes, held in outages."""
    velocity = np.full((len(before), 2), np.nan)
    if gnss.velocity is not None:
        velocity = gnss.velocity[before, :2].copy()
    missing = ~np.isfinite(velocity).all(axis=1)
    if missing.any():
        now = before[missing]
        earlier = np.maximum(now - 1, 0)
        passed = (gnss.time[now] - gnss.time[earlier])[:, np.newaxis]
        displacement = _displacement(gnss.position[earlier], gnss.position[now])
        velocity[missing] = np.where(
            passed > 0.0, displacement / np.where(passed > 0.0, passed, 1.0), 0.0
        )
        notes.append("velocity held: from the last two positions, since the receiver reports none")
    return velocity


_PoseGetter = Callable[[Integers], tuple[Floats, Floats]]
"""Positions and quaternions at some samples."""


def _pose_getter(track: Track) -> _PoseGetter:
    return lambda samples: (track.position[samples], track.quaternion[samples])


def _antenna_errors(
    clock: Floats, poses: _PoseGetter, time: Floats, truth: Floats, lever: Floats
) -> Floats:
    """Return the errors of an antenna's position, north and east, at some times."""
    after = np.clip(np.searchsorted(clock, time), 1, len(clock) - 1)
    before = after - 1
    part = ((time - clock[before]) / (clock[after] - clock[before]))[:, np.newaxis]
    ends = []
    for samples in (before, after):
        position, quaternion = poses(samples)
        ends.append(rotate(quaternion, lever)[:, :2] - _displacement(position, truth))
    return (1.0 - part) * ends[0] + part * ends[1]
