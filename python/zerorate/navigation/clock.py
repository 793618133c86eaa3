"""By how much the clock of a receiver differs from that of the sensors, by innovations."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from zerorate._native import NavigationFilter
from zerorate.navigation.alignment import Alignment
from zerorate.navigation.events import Events, pack_fixes
from zerorate.navigation.increments import Increments
from zerorate.navigation.windows import Epochs
from zerorate.record import Recording
from zerorate.record.fixes import Fixes
from zerorate.record.offset import TimeOffset
from zerorate.record.samples import Samples
from zerorate.types import Booleans, Floats

_SCAN_OFFSETS_S: Final = np.arange(-0.6, 0.61, 0.15)
_MAX_NIS: Final = 25.0
_DIFFERENCE_STEPS: Final = np.array([0.02, 0.02, 1e-4])
_MAX_STEPS: Final = np.array([0.3, 0.3, 1e-3])
_FIRST_GUESS_S: Final = 150.0
"""Seconds that suffice for a first guess."""
_COST_ROUGHNESS: Final = 4.0
"""By how much a cost may rise: it is rough where fixes come and go between two samples."""
_CONVERGED_STEPS: Final = np.array([1e-3, 1e-3, 1e-5])
_MAX_ITERATIONS: Final = 8
_ANDERSON_DEPTH: Final = 2
_PLAIN_ITERATIONS: Final = 1
"""Steps, in all and back, and those that are taken as they are."""
_HUBER_LIMIT: Final = 3.0
_OUTLIER_FACTOR: Final = 2.0
_MAX_OUTLIER_SHARE: Final = 0.1
_MAX_OUTLIER_PASSES: Final = 2
"""A fix beyond so many of these limits is left out, unless there are more; so many times."""
_CHI_SQUARED_MEDIAN: Final = 0.455
"""Of chi-squared with one degree of freedom."""
_MIN_HEADING_SIGMA_RAD: Final = math.radians(27.0)
_SETTLING_S: Final = 20.0
_BLOCK_S: Final = 10.0
_MIN_MOVING_FIXES: Final = 10
"""Fixes in motion, without which nothing is told."""
_MAX_MEAN_NIS: Final = 4.0
_STEP_TOLERANCE_S: Final = 0.01
"""Seconds of a step that is still to be taken where it counts as found in any case."""
_RATE_SIGMAS: Final = 3.0
_RATE_SIGMA_FLOOR: Final = 5e-6
_OPEN_GATE: Final = 1e12
_MAX_OFFSET_S: Final = 1.0
"""Seconds of offset that are looked for, on both sides."""
_MAX_SIGMA_S: Final = 0.1
"""A standard deviation, s, above which nothing is known."""
_THREAD_COUNT: Final = 2


def find_time_offset(
    imu: Recording,
    gnss: Fixes,
    start: Alignment,
    *,
    time_offset: float = 0.0,
    **options: Any,  # noqa: ANN401
) -> TimeOffset:
    """Find what is to be added to the times of the fixes so that they fit the sensors.

    That of positions, that of velocities, and by how much both grow, with their deviations: those
    by which a filter's innovations are the smallest.

    Parameters
    ----------
    imu : Recording
        As ``NavigationFilter.process`` takes it, in the axes of the body.
    gnss : Fixes
        Of the receiver.
    start : Alignment
        As of `NavigationFilter`.
    time_offset : float
        Where to search from, s; within 0.6 s. `check_navigation` finds one of any size to tenths.
    **options
        As of `NavigationFilter`, without ``adapt`` and ``gate``: here a receiver is believed, for
        what is taken for its noise is not seen as a clock.

    Raises
    ------
    ValueError
        If an option is out of range, the filter never begins, or there are no velocities:
        positions alone would not tell an offset from a drift.

    Notes
    -----
    Gauss and Newton's steps on the normalised innovations, which count less beyond three robust
    deviations, after the first 20 s. A position or a velocity beyond six of them is left out if
    the next is not as large to the same side: it would lead the filter astray. A position and a
    velocity of one fix are two events; to carry one of them by the last force to the other's time
    would cost more than it tells. Deviations are by leaving out blocks of 10 s, none below that of
    innovations that are as large as the filter says, with a fifth of the time of a sample. A rate
    is told beyond three deviations only. Innovations of twice their size are not of a clock: then
    nothing is told.

    Examples
    --------
    >>> import zerorate as zr
    >>> drive = zr.simulate_drive(50.0, 120.0, seed=1)
    >>> start = zr.navigation.find_start(drive.recording(), drive.fixes)
    >>> late = drive.fixes.shifted(0.12)
    >>> found = zr.navigation.find_time_offset(drive.recording(), late, start)
    >>> abs(found.velocity_seconds + 0.12) < 4 * found.velocity_sigma < 0.1
    True
    """
    for name in ("adapt", "gate"):
        if name in options:
            raise ValueError(f"{name} is not used here: every fix counts, as it says")
    if not isinstance(gnss, Fixes):
        raise TypeError(f"gnss must be Fixes, as zr.read_fixes returns them, got {type(gnss)}")
    samples = Samples.of(imu, mag=False, what="navigation")
    steps, options = Increments.for_filter(samples, options)
    # What was found of the heading was so with another clock.
    loose = replace(start, heading_sigma=max(start.heading_sigma, _MIN_HEADING_SIGMA_RAD))
    nav = NavigationFilter(loose, adapt="fixed", gate=_OPEN_GATE, **options)
    # No move of the clock takes one before the start.
    later = _thin_fixes(gnss.between(start.time - time_offset + _MAX_OFFSET_S))
    with ThreadPoolExecutor(_THREAD_COUNT) as pool:
        return _Search(steps, later, nav, time_offset, pool).find()


def _thin_fixes(fixes: Fixes) -> Fixes:
    """Return two fixes a second at most: the errors of more are not new, and each costs time."""
    if len(fixes) < 2:
        return fixes
    every = round(0.5 / float(np.median(np.diff(fixes.time))))
    return fixes.chosen(slice(None, None, max(1, every)))


@dataclass(frozen=True, eq=False)
class _Innovations:
    """Normalised innovations of each fix, shape (m, 6), NaN where it was not used."""

    scalars: Floats
    unmasked: Floats
    """The same with those of the first seconds, which count for no clock."""

    @property
    def used(self) -> Booleans:
        return np.isfinite(self.scalars)


@dataclass(eq=False)
class _Search:
    """Runs of one filter with fixes at other times."""

    samples: Increments
    gnss: Fixes
    nav: NavigationFilter
    initial_offset: float
    pool: ThreadPoolExecutor
    outlier_passes: int = 0
    rows: Floats = field(init=False)
    middle: float = field(init=False)

    def __post_init__(self) -> None:
        self.rows = pack_fixes(self.gnss)
        self.middle = float(self.gnss.time.mean()) if len(self.gnss) else 0.0

    def first_minutes(self) -> _Search:
        """Return a search of the first minutes alone."""
        early = (
            self.gnss.between(stop=self.gnss.time[0] + _FIRST_GUESS_S)
            if len(self.gnss)
            else self.gnss
        )
        whole, stop = (
            self.samples,
            early.time[-1] + self.initial_offset + _MAX_OFFSET_S if len(early) else 0.0,
        )
        n = int(np.searchsorted(whole.time, stop))
        steps = Increments(whole.time[:n], whole.gyro[:n], whole.accel[:n])
        return _Search(steps, early, self.nav, self.initial_offset, self.pool)

    def fix_times(self, theta: Floats) -> tuple[Floats, Floats]:
        """Return those of positions and of velocities with their offsets and the rate of both."""
        drift = theta[2] * (self.gnss.time - self.middle)
        velocity = self.gnss.velocity_time
        velocity = self.gnss.time if velocity is None else velocity
        return self.gnss.time + theta[0] + drift, velocity + theta[1] + drift

    def position_lag(self, theta: Floats) -> float:
        """Return by how much positions come after the velocities nearest to them, s."""
        position, velocity = self.fix_times(theta)
        velocity = np.sort(velocity)
        after = np.searchsorted(velocity, position).clip(1, max(1, len(velocity) - 1))
        before, behind = (velocity[np.minimum(after - k, len(velocity) - 1)] for k in (1, 0))
        nearest = np.where(position - before < behind - position, before, behind)
        return float(np.median(position - nearest))

    def run(self, theta: Floats) -> _Innovations:
        """Return the innovations with offsets of positions and velocities and their rate."""
        events = Events.apart(self.rows, *self.fix_times(theta))
        samples = self.samples
        output, _ = self.nav.copy().process_arrays(
            samples.time, samples.gyro, samples.accel, events.rows
        )
        output = events.merge(output)
        whole = output["innovation"] / output["innovation_sigma"]
        scalars = whole.copy()
        navigating = np.flatnonzero(output["verdict"] == 0)
        if navigating.size:
            scalars[self.gnss.time < self.gnss.time[navigating[0]] + _SETTLING_S] = np.nan
        return _Innovations(scalars, whole)

    def find(self) -> TimeOffset:
        """Return the offset at which the innovations are the smallest."""
        theta = self.first_minutes().scan()
        epochs = Epochs.of(self.gnss)
        if (
            theta is None
            or (epochs.speed > np.maximum(0.5, 4.0 * epochs.sigma)).sum() < _MIN_MOVING_FIXES
        ):
            return TimeOffset(math.nan, math.inf)
        offset = self.descend(theta)
        if not offset.identifiable:
            # From another side, where the first minutes were those of a filter that finds itself.
            offset = self.descend(np.array([self.initial_offset, self.initial_offset, 0.0]))
        return offset

    def descend(self, theta: Floats) -> TimeOffset:
        """Return the offset that steps from some numbers lead to."""
        now, mixing = self.run(theta), _AndersonMixing()
        for turn in range(_MAX_ITERATIONS):
            slopes = self.slopes(theta, now)
            equations = _NormalEquations.of(now, slopes, self.gnss.time)
            step = equations.solve(None)
            if step is None:
                return TimeOffset(math.nan, math.inf)
            if (np.abs(step) < _CONVERGED_STEPS).all():
                break
            if turn >= _PLAIN_ITERATIONS:
                step = mixing.mix(theta, step)
            step = np.clip(step, -_MAX_STEPS, _MAX_STEPS)
            before = theta
            theta, now = self.search_line(theta, step, now, equations.limit)
            if theta is before:
                break
        outliers = _find_outliers(now, equations.limit)
        if outliers.any() and self.outlier_passes < _MAX_OUTLIER_PASSES:
            return self.drop_outliers(outliers).descend(theta)
        return self.estimate(theta, now, slopes)

    def drop_outliers(self, outliers: Booleans) -> _Search:
        """Return a search without some positions and velocities, shape (m, 2)."""
        search = replace(self, outlier_passes=self.outlier_passes + 1)
        search.rows = self.rows.copy()
        for k, part in enumerate((slice(1, 4), slice(4, 7))):
            search.rows[outliers[:, k], part] = np.nan
        return search

    def scan(self) -> Floats | None:
        """Return the best of both offsets together."""
        candidates = [
            np.array([self.initial_offset + x, self.initial_offset + x, 0.0])
            for x in _SCAN_OFFSETS_S
        ]
        runs = list(self.pool.map(self.run, candidates))
        if not any(run.used[:, 3].any() for run in runs):
            raise ValueError(
                f"{self.gnss.source}: no velocity is used, by which an offset is found: the "
                "filter does not begin, or the receiver tells none"
            )
        common = np.logical_and.reduce([run.used for run in runs])
        if not common.any():
            return None
        costs = [np.minimum(run.scalars[common] ** 2, _MAX_NIS).sum() for run in runs]
        return candidates[int(np.argmin(costs))]

    def slopes(self, theta: Floats, now: _Innovations) -> Floats:
        """Return how the innovations change with each number, shape (m, 6, 3)."""
        sides = [(1.0, -1.0)] * 3
        lag = self.position_lag(theta)
        if abs(lag) <= _DIFFERENCE_STEPS[0]:
            # Which of two events comes first decides what is new of either: none is moved past the
            # other. Of one time the position is the first.
            away = 2.0 if lag > 0.0 else -2.0
            sides[:2] = [(away, 0.0), (-away, 0.0)]

        def moved(move: tuple[int, float]) -> Floats:
            i, steps = move
            return (
                self.run(theta + steps * _DIFFERENCE_STEPS * np.eye(3)[i]).scalars
                if steps
                else now.scalars
            )

        runs = list(self.pool.map(moved, [(i, at) for i, pair in enumerate(sides) for at in pair]))
        return np.stack(
            [
                (runs[2 * i] - runs[2 * i + 1]) / ((plus - minus) * _DIFFERENCE_STEPS[i])
                for i, (plus, minus) in enumerate(sides)
            ],
            axis=2,
        )

    def search_line(
        self, theta: Floats, step: Floats, now: _Innovations, limit: float
    ) -> tuple[Floats, _Innovations]:
        """Return numbers and innovations after a step, halved while the cost rises."""
        for _ in range(5):
            new = self.run(theta - step)
            both = new.used & now.used
            if (
                _huber_cost(new.scalars[both], limit)
                <= _huber_cost(now.scalars[both], limit) + _COST_ROUGHNESS
            ):
                return theta - step, new
            step = 0.5 * step
        return theta, now

    def estimate(self, theta: Floats, now: _Innovations, slopes: Floats) -> TimeOffset:
        """Return the numbers with their deviations, without a rate that is not sure."""
        equations = _NormalEquations.of(now, slopes, self.gnss.time)
        sigma = equations.sigmas(3)
        nis = float(np.nanmean(np.minimum(now.scalars**2, _MAX_NIS)))
        remaining = equations.solve(None)
        if sigma is None or remaining is None or not nis <= _MAX_MEAN_NIS:
            return TimeOffset(math.nan, math.inf, nis=nis)
        floor = np.array([_STEP_TOLERANCE_S, _STEP_TOLERANCE_S, 1e-4])
        if (np.abs(remaining) > np.maximum(2.0 * sigma, floor)).any():
            return TimeOffset(math.nan, math.inf, nis=nis)
        if not abs(theta[2]) > _RATE_SIGMAS * math.hypot(sigma[2], _RATE_SIGMA_FLOOR):
            # The others as they are where there is no rate.
            back = equations.solve(2, theta[2])
            sigma_pair = equations.sigmas(2)
            if back is None or sigma_pair is None:
                return TimeOffset(math.nan, math.inf, nis=nis)
            theta, sigma = np.array([*(theta[:2] - back), 0.0]), np.array([*sigma_pair, sigma[2]])
        dt = float(np.median(np.diff(self.samples.time)))
        sigma = np.hypot(sigma, [0.2 * dt, 0.2 * dt, _RATE_SIGMA_FLOOR])
        near = np.abs(theta[:2] - self.initial_offset).max() <= _MAX_OFFSET_S
        if not near or float(sigma[:2].min()) > _MAX_SIGMA_S:
            return TimeOffset(math.nan, math.inf, nis=nis)
        (p, v, rate), (p_sigma, v_sigma, rate_sigma) = theta.tolist(), sigma.tolist()
        return TimeOffset(p, p_sigma, v, v_sigma, rate, rate_sigma, self.middle, nis)


@dataclass(eq=False)
class _AndersonMixing:
    """Steps so far: a filter takes a part of an offset for biases, and each leaves some of it."""

    theta: list[Floats] = field(default_factory=list)
    step: list[Floats] = field(default_factory=list)

    def mix(self, theta: Floats, step: Floats) -> Floats:
        """Return a step to where those of the last turns would vanish (Anderson's mixing)."""
        self.theta.append(theta)
        self.step.append(step)
        at, steps = (
            np.array(x[-_ANDERSON_DEPTH - 1 :]) / _DIFFERENCE_STEPS for x in (self.theta, self.step)
        )
        if len(steps) < 2:
            return step
        moved, changed = np.diff(at, axis=0).T, np.diff(steps, axis=0).T
        part = np.linalg.lstsq(changed, steps[-1], rcond=1e-3)[0]
        mixed: Floats = _DIFFERENCE_STEPS * (steps[-1] + (moved - changed) @ part)
        return mixed


def _find_outliers(run: _Innovations, limit: float) -> Booleans:
    """Return which positions and velocities are far beyond the others, shape (m, 2).

    A wrong fix stands alone: what comes after one that a filter's own error makes large is large
    to the same side. One in ten at most: more are a filter that fits them badly.
    """
    parts = run.unmasked.reshape(-1, 2, 3)
    outliers = np.zeros(parts.shape[:2], dtype=np.bool_)
    for k in range(2):
        used = np.flatnonzero(np.isfinite(parts[:, k]).any(axis=1))
        u = np.nan_to_num(parts[used, k])
        after = np.concatenate((u[1:], np.zeros((min(1, len(u)), 3))))
        far = (np.abs(u) > _OUTLIER_FACTOR * limit) & (after * np.sign(u) < 0.5 * np.abs(u))
        outliers[used, k] = far.any(axis=1)
    outliers &= outliers.mean(axis=0) <= _MAX_OUTLIER_SHARE
    return outliers


def _huber_cost(u: Floats, limit: float) -> float:
    size = np.abs(u)
    return float(np.where(size <= limit, size**2, limit * (2.0 * size - limit)).sum())


@dataclass(frozen=True, eq=False)
class _NormalEquations:
    """Sums of the normal equations, a block of ten seconds each."""

    normal: Floats
    right: Floats
    limit: float

    @classmethod
    def of(cls, run: _Innovations, slopes: Floats, time: Floats) -> _NormalEquations:
        there = run.used & np.isfinite(slopes.sum(axis=2))
        block = np.broadcast_to(
            np.floor((time - time[0]) / _BLOCK_S).astype(np.int64)[:, np.newaxis], there.shape
        )[there]
        u, j = run.scalars[there], slopes[there]
        squares = u**2
        limit = (
            _HUBER_LIMIT * max(1.0, math.sqrt(float(np.median(squares)) / _CHI_SQUARED_MEDIAN))
            if u.size
            else 1.0
        )
        weight = np.minimum(1.0, limit / np.maximum(np.abs(u), 1e-12))
        count = int(block.max(initial=0)) + 1
        normal, right = np.zeros((count, 3, 3)), np.zeros((count, 3))
        for a in range(3):
            right[:, a] = np.bincount(block, weight * j[:, a] * u, minlength=count)
            for b in range(3):
                normal[:, a, b] = np.bincount(block, weight * j[:, a] * j[:, b], minlength=count)
        mask = np.trace(normal, axis1=1, axis2=2) > 0.0
        return cls(normal[mask], right[mask], limit)

    def solve(self, size: int | None, rate: float = 0.0) -> Floats | None:
        """Return the step that all blocks ask for; with `size` 2 a rate is taken back first."""
        normal, right = self.normal.sum(axis=0), self.right.sum(axis=0)
        return _solve(normal, right - normal[:, 2] * rate, size or 3)

    def sigmas(self, size: int) -> Floats | None:
        """Return those by leaving out each block, but none below that of unit innovations.

        Blocks of a short drive are few, and may agree by chance.
        """
        n = len(self.normal)
        normal, right = self.normal.sum(axis=0), self.right.sum(axis=0)
        replicates = [
            _solve(normal - a, right - b, size)
            for a, b in zip(self.normal, self.right, strict=True)
        ]
        solutions = [solution for solution in replicates if solution is not None]
        if len(solutions) < max(n, 3):
            return None
        spread = np.array(solutions) - np.mean(solutions, axis=0)
        least = np.diag(np.linalg.inv(normal[:size, :size]))
        left_out = (n - 1.0) / n * (spread**2).sum(axis=0)
        return np.asarray(np.sqrt(np.maximum(left_out, least)))


def _solve(normal: Floats, right: Floats, size: int) -> Floats | None:
    scale = np.sqrt(np.diag(normal)[:size])
    if not (scale > 0.0).all():
        return None
    scaled = normal[:size, :size] / np.outer(scale, scale)
    if np.linalg.cond(scaled) > 1e8:
        return None
    return np.asarray(np.linalg.solve(scaled, right[:size] / scale) / scale)
