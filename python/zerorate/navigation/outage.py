"""Errors of a navigation filter in receiver outages, compared with a held position or velocity."""

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
"""Names of the compared estimates."""

ELLIPSE_SIGMAS: Final = math.sqrt(-2.0 * math.log(0.05))
"""Standard deviations to the edge of the ellipse with 95 % of the errors in a plane."""
_DOUBT_S: Final = 10.0
_MIN_DOUBT_OUTAGES: Final = 3
"""Outages that test a start in motion: length (s) and smallest number."""
_TIME_TOLERANCE_S: Final = 1e-6
"""Largest difference of equal times, s; times of fixes have rounding errors."""
_MAX_END_GAP_SHARE: Final = 0.1
"""Largest gap between the last fix and the end of an outage, as a share of the outage."""


@dataclass(frozen=True, eq=False)
class OutageErrors:
    """Horizontal errors in n outages of the same length, with m withheld fixes in total.

    Parameters
    ----------
    seconds : float
        Length of an outage, s.
    spans : ndarray, shape (n, 2)
        Time of the last fix before each outage, and time of the last withheld fix in it, s.
    time : ndarray, shape (m,)
        Times of the withheld fixes, s, on the clock of the inertial sensors.
    outage : ndarray of int, shape (m,)
        Index of the outage of each withheld fix.
    position : ndarray, shape (m, 3)
        Positions of the withheld fixes: latitude and longitude, deg, height, m.
    errors : dict of str to ndarray, shape (m, 2)
        Errors north and east at each withheld fix, m. The keys are "position held", "velocity
        held", "filter" and, if requested, "smoothed".
    sigma : ndarray, shape (m, 2)
        The filter's standard deviations north and east at each withheld fix, m.
    end : dict of str to ndarray, shape (n,)
        Horizontal error at the last withheld fix of each outage, m. For "smoothed" it is the
        largest error in the outage. It is NaN if fewer than two fixes follow the outage.
    fix_sigma : ndarray, shape (m, 2)
        Standard deviations north and east of the withheld fixes, m, from the receiver.
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
        """Return the RMS of `end`, m, over the outages with a known error."""
        return math.sqrt(float(np.mean(self._known_ends(name) ** 2)))

    def median(self, name: str = FILTER) -> float:
        """Return the median of `end`, m."""
        return float(np.median(self._known_ends(name)))

    def largest(self, name: str = FILTER) -> float:
        """Return the maximum of `end`, m."""
        return float(np.max(self._known_ends(name)))

    def error_over_sigma(self) -> float:
        """Return the RMS of the filter's end errors divided by their sigma. 1 is consistent.

        This sigma is the root of the filter's variance plus the fix's variance.
        """
        return math.sqrt(0.5 * float(np.mean(self._end_squares())))

    def share_inside(self) -> float:
        """Return the share of end errors inside the 95 % ellipse; 0.95 if sigma is right."""
        return float(np.mean(self._end_squares() < ELLIPSE_SIGMAS**2))

    def _end_squares(self) -> Floats:
        """Return the squared end errors over their variances, summed over both axes."""
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
        Errors for each length, in the order of the request.
    source : str
        Name of the recording.
    notes : tuple of str
        Sentences on omissions and assumptions.

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
        """Return the errors for one length. Raises KeyError if it was not requested."""
        for errors in self.lengths:
            if errors.seconds == seconds:
                return errors
        raise KeyError(seconds)

    def __repr__(self) -> str:
        """Return the number of outages and the filter's errors, for each length."""
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
    """Return the errors of a navigation filter in outages of the receiver.

    Fixes are withheld, and the filter's track is compared with them. Two simple estimates are
    compared with the same fixes: the last position is held, or the last velocity is held. On a slow
    platform both may be better than the filter.

    Parameters
    ----------
    imu : Recording
        Recording for ``NavigationFilter.process``, in the axes of the body.
    gnss : Fixes
        Fixes of the receiver. Withheld fixes count as the true position.
    seconds : float or sequence of float
        Lengths of the outages, s. The filter runs once for each length. Default: 10, 30 and 60.
    nav : NavigationFilter, optional
        A filter that has not processed samples. It is copied and does not change. Default: axes,
        clock, antenna and start are found as in `zerorate.navigate`.
    antenna : array_like, shape (3,), optional
        Vector from the sensors to the antenna in body axes, m. If `nav` is given, set the antenna
        in `nav` instead.
    smooth : bool
        True also runs the smoother and reports its largest error in each outage.
    first : float
        Time from the filter's first fix to the first outage, s. Default 60.
    between : float
        Time between two outages, in which fixes are used, s. Default 30.
    rest : array_like of bool, shape (n,), optional
        Mask of samples at which the vehicle is known to rest.
    wheel_speed : array_like, shape (n,), or Wheels, optional
        Speed of the wheels, m/s, for a filter of a wheeled vehicle.
    aids : dict of str to array_like or Aid, optional
        Readings of aids by the argument names of ``NavigationFilter.process``: height, pressure,
        heading or baseline.
    time_offset : float, TimeOffset or "auto"
        Offset to add to the times of the fixes, s. "auto" finds the offset at which sensors and
        fixes agree best. If `nav` is given, "auto" means 0.
    threads : int, optional
        Number of outage lengths to run in parallel. Default: one per core. The result does not
        depend on it. Each length needs 0.4 kB per sample. With `smooth` it also needs about 3 kB
        per step of the covariance.
    progress : callable, optional
        Called with the name of the step and the fraction done. By default a notebook shows a bar.

    Returns
    -------
    Outages
        Errors by length. ``print`` shows RMS, median and maximum.

    Raises
    ------
    LogError
        If there are no fixes, or the filter did not start.
    ValueError
        If an argument is out of range, or the filter has processed samples. Also if the record is
        too short for a requested outage.

    Notes
    -----
    If a receiver reports no velocity, the held velocity comes from the last two positions. Errors
    refer to the antenna, with its position interpolated between samples. A filter error below the
    error of the fixes cannot be measured.

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
    """Lengths of outages, s, smoothing, and time before and between outages, s."""

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
        """Return the filter's errors, from its track with all fixes and its tracks with outages."""
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
    """Return a sentence if a held velocity is better than a filter that started in motion."""
    if not begins_in_motion(start):
        return ""
    plan = OutagePlan((_DOUBT_S,), smooth=False, first=2.0 * _DOUBT_S, between=_DOUBT_S)
    try:
        found = plan.run(imu, gnss, nav, undisturbed, inputs, 1, lambda step, done: None)[_DOUBT_S]
    except ValueError:
        # The record is too short for an outage.
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

    `smoothable` is True for outages with two later fixes, because the filter does not trust one
    fix.
    """

    fixes: Integers
    outage: Integers
    before: Integers
    smoothable: Booleans
    skipped_count: int

    def mask(self, n: int) -> Booleans:
        """Return the mask of withheld fixes among n fixes."""
        mask = np.zeros(n, dtype=np.bool_)
        mask[self.fixes] = True
        return mask


@dataclass(frozen=True, eq=False)
class _FixSpan:
    """Fixes on the clock of a track, and the time span in which fixes can be withheld."""

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
        """Return the fixes to withhold for outages of a given length."""
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
    # Use the last sample before a fix: the first sample after it may include the next fix.
    samples = np.searchsorted(track.time, time, side="right") - 1
    sigma, fix_sigma = track.sigma[samples, :2], pack_fixes(gnss)[chosen, 7:9]
    return OutageErrors(length, spans, time, withheld.outage, truth, errors, sigma, end, fix_sigma)


def _displacement(start: Floats, stop: Floats) -> Floats:
    """Return the displacements north and east between positions, m; heights may be missing."""
    from zerorate.geometry.earth import local_ned

    level = start.copy()
    level[:, 2] = np.nan_to_num(level[:, 2])
    return local_ned(stop, level)[:, :2]


def _held_velocity(gnss: Fixes, before: Integers, notes: list[str]) -> Floats:
    """Return the velocity north and east that each outage holds, m/s."""
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
"""Function from sample indices to positions and quaternions."""


def _pose_getter(track: Track) -> _PoseGetter:
    return lambda samples: (track.position[samples], track.quaternion[samples])


def _antenna_errors(
    clock: Floats, poses: _PoseGetter, time: Floats, truth: Floats, lever: Floats
) -> Floats:
    """Return the errors of the antenna position at some times, north and east, m."""
    after = np.clip(np.searchsorted(clock, time), 1, len(clock) - 1)
    before = after - 1
    part = ((time - clock[before]) / (clock[after] - clock[before]))[:, np.newaxis]
    ends = []
    for samples in (before, after):
        position, quaternion = poses(samples)
        ends.append(rotate(quaternion, lever)[:, :2] - _displacement(position, truth))
    return (1.0 - part) * ends[0] + part * ends[1]
