"""Clock offset of a receiver relative to the sensors, from a filter's innovations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from zerorate._native import NavigationFilter
from zerorate.checks.spikes import without_spikes
from zerorate.navigation.alignment import Alignment
from zerorate.navigation.clock_equations import (
    ARM,
    OFFSETS,
    RATE,
    SIZE,
    ClockEquations,
    Slopes,
    Weights,
)
from zerorate.navigation.events import Events, pack_fixes
from zerorate.navigation.increments import Increments
from zerorate.navigation.line_course import LineVelocities
from zerorate.navigation.windows import Epochs
from zerorate.record import Recording
from zerorate.record.fixes import Fixes
from zerorate.record.offset import TimeOffset
from zerorate.record.samples import Samples
from zerorate.types import Booleans, Floats, Integers

_SCAN_OFFSETS_S: Final = np.arange(-0.6, 0.61, 0.15)
_MAX_NIS: Final = 25.0
_DIFFERENCE_STEPS: Final = np.array([0.1, 0.1, 1e-4, 0.05, 0.05, 0.05])
"""Steps of the numerical derivatives: s, s, 1 and m. Time steps match the covariance's step."""
_MAX_STEPS: Final = np.array([0.3, 0.3, 1e-3, 0.7, 0.7, 0.7])
_CONVERGED_STEPS: Final = np.array([1e-3, 1e-3, 1e-5, 5e-3, 5e-3, 5e-3])
_SMALL_STEPS: Final = 5.0 * _CONVERGED_STEPS
"""Steps that count as converged, and steps below which earlier slopes are used again."""
_OFFSET_SIGMA_S: Final = 0.3
_RATE_PRIOR: Final = 1e-3
_UNKNOWN_ANTENNA_M: Final = 1.0
_STATED_ANTENNA_M: Final = 0.05
"""Prior standard deviations: offset, s; rate; antenna position, m, unknown and stated."""
_FIRST_GUESS_S: Final = 150.0
"""Length of the record that the first guess uses, s."""
_COST_ROUGHNESS: Final = 4.0
"""Accepted increase of the cost: the cost jumps when a fix moves past a sample."""
_MAX_ITERATIONS: Final = 8
_OUTLIER_FACTOR: Final = 2.0
_MAX_OUTLIER_SHARE: Final = 0.1
_MAX_OUTLIER_PASSES: Final = 2
"""Outliers exceed the limits by this factor; largest share of outliers; number of passes."""
_MANY_SPIKES_SHARE: Final = 0.02
_FINE_RECEIVER_M: Final = 0.1
_SPIKES_FACTOR: Final = 3.0
"""Above this share of spikes, a receiver of this accuracy, m, gets a larger sigma."""
_SLOW_SPEED_M_S: Final = 3.0
_SLOW_FACTOR: Final = 1.5
"""Below this speed, sigma is multiplied by this factor if there are positions only."""
_MIN_HEADING_SIGMA_RAD: Final = math.radians(27.0)
_SETTLING_S: Final = 20.0
_MIN_MOVING_FIXES: Final = 10
"""Smallest number of fixes in motion for an estimate."""
_MAX_MEAN_NIS: Final = 4.0
_MAX_ANTENNA_M: Final = 4.0
_STEP_TOLERANCES: Final = np.array([0.01, 0.01, 1e-4, 0.05, 0.05, 0.05])
"""Remaining step that always counts as converged."""
_RATE_SIGMAS: Final = 3.0
_RATE_SIGMA_FLOOR: Final = 5e-6
_OPEN_GATE: Final = 1e12
_MAX_OFFSET_S: Final = 1.0
"""Largest difference from the start value that is accepted, s."""
_MAX_SIGMA_S: Final = 0.1
"""Standard deviation above which an offset counts as unknown, s."""
_THREAD_COUNT: Final = 2


def find_time_offset(
    imu: Recording,
    gnss: Fixes,
    start: Alignment,
    *,
    time_offset: float = 0.0,
    **options: Any,  # noqa: ANN401
) -> TimeOffset:
    """Find the offset to add to the times of the fixes, and the antenna position.

    The search minimises the innovations of a filter over these parameters, and returns their
    standard deviations:

    - offset of the positions and offset of the velocities
    - common rate of change of both offsets
    - antenna position

    Parameters
    ----------
    imu : Recording
        Recording for ``NavigationFilter.process``, in the axes of the body.
    gnss : Fixes
        Fixes of the receiver, with or without velocities.
    start : Alignment
        As in `NavigationFilter`.
    time_offset : float
        Start value of the search, s. It must be within 0.6 s of the true offset. `check_navigation`
        finds offsets of any size to tenths of a second.
    **options
        As in `NavigationFilter`, but without ``adapt`` and ``gate``. An adaptive filter would treat
        the clock error as noise of the receiver. ``antenna_sigma`` is the prior standard deviation
        of the antenna position, m. Default: 0.05 if ``antenna`` is given, otherwise 1.

    Raises
    ------
    ValueError
        If an option is out of range, or the filter never starts.

    Notes
    -----
    The search uses Gauss-Newton steps on the normalised innovations after the first 20 s.
    Innovations beyond three robust standard deviations get less weight. The normal equations
    multiply derivatives from forward differences by those from backward differences, because their
    noises are independent.

    At constant speed a clock offset has the same effect as an antenna forward of the sensors. If
    the record cannot distinguish them, prior standard deviations decide: 0.3 s for the offset, 1e-3
    for the rate, 1 m for the antenna. The standard deviations of the result are then larger.

    A position or velocity beyond six standard deviations is left out, unless the next innovation
    has a similar size and the same sign.

    The standard deviations are at least their value for innovations of the predicted size. A fifth
    of a sample interval is then added. A rate is reported only if it exceeds three standard
    deviations. No offset is reported if the innovations are at least twice their expected size. The
    clock then does not explain them.

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
            raise ValueError(
                f"{name} is not used here: every fix counts with its stated standard deviation"
            )
    if not isinstance(gnss, Fixes):
        raise TypeError(f"gnss must be Fixes, as zr.read_fixes returns them, got {type(gnss)}")
    samples = Samples.of(imu, mag=False, what="navigation")
    steps, options = Increments.for_filter(samples, options)
    # The heading was found with another clock, so its standard deviation is raised.
    loose = replace(start, heading_sigma=max(start.heading_sigma, _MIN_HEADING_SIGMA_RAD))
    antenna = options.pop("antenna", None)
    known = _UNKNOWN_ANTENNA_M if antenna is None else _STATED_ANTENNA_M
    spread = options.pop("antenna_sigma", known)
    lever = np.zeros(3) if antenna is None else np.asarray(antenna, dtype=np.float64)
    # Check the options here, before a thread raises the error.
    NavigationFilter(loose, antenna=lever, antenna_sigma=spread, **options)
    # Even with the largest clock offset, no fix may come before the start.
    later = gnss.between(start.time - time_offset + _MAX_OFFSET_S)
    clean, spike_share = without_spikes(later)
    receiver = _Receiver.of(_thin_fixes(clean), spike_share)
    prior = _Prior.of(time_offset, lever, spread, receiver.has_velocities)
    with ThreadPoolExecutor(_THREAD_COUNT) as pool:
        return _Search(steps, receiver, loose, options, prior, pool).find()


def _thin_fixes(fixes: Fixes) -> Fixes:
    """Return at most two fixes per second, because denser fixes have correlated errors."""
    if len(fixes) < 2:
        return fixes
    every = round(0.5 / float(np.median(np.diff(fixes.time))))
    return fixes.chosen(slice(None, None, max(1, every)))


@dataclass(frozen=True, eq=False)
class _Prior:
    """Prior of the search: values, standard deviations, and the mask of searched parameters.

    The parameters are the offset of positions, s, the offset of velocities, s, their common rate,
    and the antenna position, m.
    """

    theta: Floats
    sigma: Floats
    free: Integers

    @classmethod
    def of(cls, offset: float, antenna: Floats, spread: float, has_velocities: bool) -> _Prior:
        theta = np.concatenate([[offset, offset, 0.0], antenna])
        sigma = np.array([_OFFSET_SIGMA_S, _OFFSET_SIGMA_S, _RATE_PRIOR, spread, spread, spread])
        free = sigma > 0.0
        free[1] &= has_velocities
        return cls(theta, sigma, np.flatnonzero(free))

    def away(self, theta: Floats) -> Floats:
        """Return the distance of the searched parameters from the prior, in standard deviations."""
        away: Floats = (theta - self.theta) / np.where(self.sigma > 0.0, self.sigma, 1.0)
        return away[self.free]


@dataclass(frozen=True, eq=False)
class _Receiver:
    """Fixes of a receiver, with their speed and their share of spikes."""

    gnss: Fixes
    has_velocities: bool
    spike_share: float

    @classmethod
    def of(cls, gnss: Fixes, spike_share: float) -> _Receiver:
        return cls(gnss, Epochs.of(gnss).is_reported, spike_share)

    @property
    def speed(self) -> Floats:
        """Speed at each fix, m/s; 0 if it does not differ significantly from zero."""
        if self.has_velocities:
            epochs = Epochs.of(self.gnss)
            speed, sigma = epochs.speed, epochs.sigma
        else:
            lines = LineVelocities.of(self.gnss, 4.0)
            speed, sigma = lines.speed, lines.sigma
        return np.where(
            speed > np.maximum(0.3 + 0.2 * self.has_velocities, 4.0 * sigma), speed, 0.0
        )


@dataclass(frozen=True, eq=False)
class _Innovations:
    """Normalised innovations of each fix, shape (m, 6); NaN if the fix was not used."""

    scalars: Floats
    unmasked: Floats
    """Normalised innovations including the first seconds, which the search does not use."""

    @property
    def used(self) -> Booleans:
        return np.isfinite(self.scalars)


@dataclass(eq=False)
class _Search:
    """Filter runs with shifted fixes and another antenna position."""

    samples: Increments
    receiver: _Receiver
    start: Alignment
    options: Mapping[str, Any]
    prior: _Prior
    pool: ThreadPoolExecutor
    outlier_passes: int = 0
    rows: Floats = field(init=False)
    middle: float = field(init=False)

    def __post_init__(self) -> None:
        self.rows = pack_fixes(self.gnss)
        self.middle = float(self.gnss.time.mean()) if len(self.gnss) else 0.0

    @property
    def gnss(self) -> Fixes:
        """The receiver's fixes."""
        return self.receiver.gnss

    def first_minutes(self) -> _Search:
        """Return a search over the first 150 s only."""
        fixes, whole, stop = self.gnss, self.samples, 0.0
        if len(fixes):
            fixes = fixes.between(stop=fixes.time[0] + _FIRST_GUESS_S)
            stop = fixes.time[-1] + self.prior.theta[0] + _MAX_OFFSET_S
        n = int(np.searchsorted(whole.time, stop))
        steps = Increments(whole.time[:n], whole.gyro[:n], whole.accel[:n])
        receiver = replace(self.receiver, gnss=fixes)
        return _Search(steps, receiver, self.start, self.options, self.prior, self.pool)

    def fix_times(self, theta: Floats) -> tuple[Floats, Floats]:
        """Return the corrected times of the positions and of the velocities, s."""
        drift = theta[RATE] * (self.gnss.time - self.middle)
        velocity = self.gnss.velocity_time
        velocity = self.gnss.time if velocity is None else velocity
        return self.gnss.time + theta[0] + drift, velocity + theta[1] + drift

    def position_lag(self, theta: Floats) -> float:
        """Return the median delay of a position after the nearest velocity, s."""
        position, velocity = self.fix_times(theta)
        velocity = np.sort(velocity)
        after = np.searchsorted(velocity, position).clip(1, max(1, len(velocity) - 1))
        before, behind = (velocity[np.minimum(after - k, len(velocity) - 1)] for k in (1, 0))
        nearest = np.where(position - before < behind - position, before, behind)
        return float(np.median(position - nearest))

    def run(self, theta: Floats) -> _Innovations:
        """Return the innovations with these offsets, this rate and this antenna position."""
        events = Events.apart(self.rows, *self.fix_times(theta))
        if not self.receiver.has_velocities:
            only = events.rows[events.position]
            events = Events(only, np.arange(len(only)), np.arange(len(only)))
        samples = self.samples
        nav = NavigationFilter(
            self.start, antenna=theta[ARM], adapt="fixed", gate=_OPEN_GATE, **self.options
        )
        output, _ = nav.process_arrays(samples.time, samples.gyro, samples.accel, events.rows)
        output = events.merge(output)
        whole = output["innovation"] / output["innovation_sigma"]
        scalars = whole.copy()
        navigating = np.flatnonzero(output["verdict"] == 0)
        if navigating.size:
            scalars[self.gnss.time < self.gnss.time[navigating[0]] + _SETTLING_S] = np.nan
        return _Innovations(scalars, whole)

    def find(self) -> TimeOffset:
        """Return the offset with the smallest innovations."""
        theta = self.first_minutes().scan()
        if theta is None or np.count_nonzero(self.receiver.speed) < _MIN_MOVING_FIXES:
            return TimeOffset(math.nan, math.inf)
        offset = self.descend(theta)
        if not offset.identifiable:
            # Start from the prior instead: during the first guess the filter may not have settled.
            offset = self.descend(self.prior.theta)
        return offset

    def descend(self, theta: Floats) -> TimeOffset:
        """Return the offset to which steps from these start values converge."""
        now, slopes = self.run(theta), None
        for _ in range(_MAX_ITERATIONS):
            slopes = self.slopes(theta, now) if slopes is None else slopes
            equations = self.equations(theta, now, slopes)
            step = equations.solve()
            if step is None:
                return TimeOffset(math.nan, math.inf)
            if (np.abs(step) < _CONVERGED_STEPS).all():
                break
            step = _shorten(step)
            before = theta
            theta, now = self.search_line(theta, step, now, equations.weights)
            if theta is before:
                break
            if not (np.abs(step) < _SMALL_STEPS).all():
                slopes = None
        outliers = _find_outliers(now, equations.weights.limit)
        if outliers.any() and self.outlier_passes < _MAX_OUTLIER_PASSES:
            return self.drop_outliers(outliers).descend(theta)
        return self.estimate(theta, now, equations)

    def drop_outliers(self, outliers: Booleans) -> _Search:
        """Return a search without the positions and velocities of a mask, shape (m, 2)."""
        search = replace(self, outlier_passes=self.outlier_passes + 1)
        search.rows = self.rows.copy()
        for k, part in enumerate((slice(1, 4), slice(4, 7))):
            search.rows[outliers[:, k], part] = np.nan
        return search

    def scan(self) -> Floats | None:
        """Return the best offset that positions and velocities share."""
        candidates = [self.prior.theta + x * OFFSETS for x in _SCAN_OFFSETS_S]
        runs = list(self.pool.map(self.run, candidates))
        if not any(run.used.any() for run in runs):
            raise ValueError(
                f"{self.gnss.source}: no fix can be used to find an offset: the filter does not "
                f"start"
            )
        common = np.logical_and.reduce([run.used for run in runs])
        if not common.any():
            return None
        costs = [np.minimum(run.scalars[common] ** 2, _MAX_NIS).sum() for run in runs]
        return candidates[int(np.argmin(costs))]

    def equations(self, theta: Floats, now: _Innovations, slopes: Slopes) -> ClockEquations:
        """Return the normal equations at these parameters."""
        weights, prior = Weights.of(now.scalars, self.gnss.time), self.prior
        return ClockEquations.of(weights, slopes, prior.free, prior.sigma, prior.away(theta))

    def slopes(self, theta: Floats, now: _Innovations) -> Slopes:
        """Return the derivatives of the innovations by each parameter, forward and backward."""
        h, unit, has_both = _DIFFERENCE_STEPS, np.eye(SIZE), self.receiver.has_velocities
        moves = [(k, sign * unit[k]) for k in self.prior.free.tolist() for sign in (1.0, -1.0)]
        lag = self.position_lag(theta) if has_both else math.inf
        near = abs(lag) <= h[0]
        if near:
            # The innovations depend on the order of a position and its velocity. Neither may
            # therefore
            # move past the other. At equal times the position comes first.
            away = 1.0 if lag > 0.0 else -1.0
            moves[:4] = [
                (0, OFFSETS), (0, -OFFSETS), (0, away * unit[0]), (1, -away * unit[1]),
            ]  # fmt: skip
        runs = list(self.pool.map(lambda move: self.run(theta + h * move[1]).scalars, moves))
        sloped = [
            (run - now.scalars) * (move.sum() / abs(move.sum()) / h[k])
            for run, (k, move) in zip(runs, moves, strict=True)
        ]
        if near:
            forward, backward, of_position, of_velocity = sloped[:4]
            of_position_back, of_velocity_back = backward - of_velocity, forward - of_position
            sloped[:4] = (
                [of_position, of_position_back, of_velocity_back, of_velocity]
                if away > 0.0
                else [forward - of_velocity, of_position, of_velocity, backward - of_position]
            )
        return Slopes(np.stack(sloped[::2], axis=2), np.stack(sloped[1::2], axis=2))

    def search_line(
        self, theta: Floats, step: Floats, now: _Innovations, weights: Weights
    ) -> tuple[Floats, _Innovations]:
        """Return parameters and innovations after a step, halved while the cost rises."""
        before = float((self.prior.away(theta) ** 2).sum())
        for _ in range(5):
            moved = theta - step
            new = self.run(moved)
            both = new.used & now.used
            prior = float((self.prior.away(moved) ** 2).sum())
            rise = weights.cost(new.scalars[both]) - weights.cost(now.scalars[both])
            if rise + prior - before <= _COST_ROUGHNESS:
                return moved, new
            step = 0.5 * step
        return theta, now

    def estimate(self, theta: Floats, now: _Innovations, equations: ClockEquations) -> TimeOffset:
        """Return the parameters with standard deviations; an insignificant rate is set to zero."""
        nis = float(np.nanmean(np.minimum(now.scalars**2, _MAX_NIS)))
        unknown = TimeOffset(math.nan, math.inf, nis=nis)
        sigma, remaining = equations.sigmas(), equations.remaining()
        if sigma is None or remaining is None or not nis <= _MAX_MEAN_NIS:
            return unknown
        if (np.abs(remaining) > np.maximum(2.0 * sigma, _STEP_TOLERANCES)).any():
            return unknown
        if not abs(theta[RATE]) > _RATE_SIGMAS * math.hypot(sigma[RATE], _RATE_SIGMA_FLOOR):
            # Estimate the other parameters with a rate of zero.
            rate_sigma, fixed = sigma[RATE], equations.without_rate(theta[RATE])
            step, sigma = fixed.solve(), fixed.sigmas()
            if step is None or sigma is None:
                return unknown
            theta = theta - step
            theta[RATE], sigma[RATE] = 0.0, rate_sigma
        dt = float(np.median(np.diff(self.samples.time)))
        sigma = np.hypot(sigma, [0.2 * dt, 0.2 * dt, _RATE_SIGMA_FLOOR, 0.0, 0.0, 0.0])
        sigma *= self.doubt()
        offsets = self.prior.free[self.prior.free < RATE]
        near = np.abs(theta[offsets] - self.prior.theta[0]).max() <= _MAX_OFFSET_S
        near &= np.abs(theta[ARM] - self.prior.theta[ARM]).max() <= _MAX_ANTENNA_M
        if not near or float(sigma[offsets].min()) > _MAX_SIGMA_S:
            return unknown
        p, v, rate = theta[: ARM.start].tolist()
        p_sigma, v_sigma, rate_sigma = sigma[: ARM.start].tolist()
        if not self.receiver.has_velocities:
            v = v_sigma = math.nan
        antenna = theta[ARM].tolist(), sigma[ARM].tolist()
        offset = TimeOffset(p, p_sigma, v, v_sigma, rate, rate_sigma, self.middle, nis)
        return replace(offset, antenna=tuple(antenna[0]), antenna_sigma=tuple(antenna[1]))

    def doubt(self) -> float:
        """Return the factor that corrects standard deviations too small in simulations."""
        receiver = self.receiver
        moving = receiver.speed[receiver.speed > 0.0]
        slow = moving.size > 0 and float(np.median(moving)) < _SLOW_SPEED_M_S
        factor = _SLOW_FACTOR if slow and not receiver.has_velocities else 1.0
        stated = float(np.nanmedian(self.rows[:, 7:9]))
        if receiver.spike_share > _MANY_SPIKES_SHARE and stated < _FINE_RECEIVER_M:
            factor *= _SPIKES_FACTOR
        return factor


def _shorten(step: Floats) -> Floats:
    """Limit a step: one factor for all parameters, except the antenna's height."""
    within = np.clip(step, -_MAX_STEPS, _MAX_STEPS)
    others = slice(0, SIZE - 1)
    ratio = _MAX_STEPS[others] / np.maximum(np.abs(step[others]), 1e-12)
    within[others] = step[others] * min(1.0, float(ratio.min()))
    return within


def _find_outliers(run: _Innovations, limit: float) -> Booleans:
    """Return the mask of outliers among positions and velocities, shape (m, 2).

    A wrong fix is isolated. An error of the filter also makes the next innovation large, with the
    same sign. If more than a tenth of the fixes would be outliers, the filter is wrong and no fix
    is left out.
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
