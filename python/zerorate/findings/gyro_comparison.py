"""Delay, rotation and scale between two gyros of one body, each with its error."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from zerorate.findings.imus import BLOCK_S, Sensor
from zerorate.types import Booleans, Floats

_CELL_S: Final = 0.04
"""Length of the compared mean rates, s; longer at low sample rates."""
_WINDOW_S: Final = 20.0
_MAX_WINDOWS: Final = 90
"""Number of compared windows, those with the most rotation: half an hour."""
_MAX_DELAY_S: Final = 0.5
"""Largest delay of the search, s."""
_JACKKNIFE_PARTS: Final = 12
"""Number of parts of equal evidence for the jackknife of the errors."""
_MIN_CELLS: Final = 200
MIN_CORRELATION: Final = 0.95
"""Smallest correlation of two gyros on one body."""
_MAX_GAP_PERIODS: Final = 3.5
"""Length of a gap, in sampling periods, above which gyros are not compared."""
_CLIPPING_FRACTION: Final = 0.995
"""Share of an axis' largest rate above which a sample may be clipped."""
_MAX_ITERATIONS: Final = 20
_DELAY_TOLERANCE_S: Final = 1e-5
"""Step of the delay below which the search ends, s."""


class GyroDifference(NamedTuple):
    """Difference of a second gyro from a first.

    To get the rate of the first gyro at t, take the rate of the second gyro at t + delay. Rotate it
    by `matrix` and multiply it by `scale` along the axes of the first gyro. Standard errors are
    infinite if rotations do not determine the quantity.
    """

    correlation: float
    """Correlation of both gyros after correction; below 0.95 they are not on one body."""
    delay: float
    delay_sigma: float
    matrix: Floats
    turn_sigma: Floats
    """Standard errors of the rotation about each axis of the first gyro, rad."""
    scale: Floats
    scale_sigma: Floats
    scatter: float
    """RMS of the remaining difference of the cell means, rad/s."""


class _Cells(NamedTuple):
    """Mean rates of the first gyro and edges of usable cells, by window."""

    rates: Floats
    low: Floats
    high: Floats


class _GyroIntegral:
    """Integral of a gyro: a piecewise cubic with the samples as derivative."""

    def __init__(self, sensor: Sensor) -> None:
        increasing = np.append(True, np.diff(sensor.log.sampled) > 0.0)
        self.time = sensor.log.sampled[increasing]
        self.rate = (sensor.factor or 1.0) * sensor.log.data[increasing]
        self.period = 1.0 / sensor.log.rate
        known = np.isfinite(self.rate).all(axis=1)
        largest = np.abs(self.rate[known]).max(axis=0, initial=0.0)
        with np.errstate(invalid="ignore"):
            self.good = known & (np.abs(self.rate) < _CLIPPING_FRACTION * largest).all(axis=1)
        values = np.where(known[:, np.newaxis], self.rate, 0.0)
        steps = np.diff(self.time)[:, np.newaxis]
        slopes = np.gradient(values, self.time, axis=0)
        # The trapezoid rule with its end correction is exact for cubics.
        parts = 0.5 * steps * (values[1:] + values[:-1]) - steps**2 / 12.0 * np.diff(slopes, axis=0)
        self.values = values
        self.angle = np.concatenate([np.zeros((1, 3)), np.cumsum(parts, axis=0)])
        holes = (
            (np.diff(self.time) > _MAX_GAP_PERIODS * self.period) | ~self.good[1:] | ~self.good[:-1]
        )
        self.holes = np.append(0, np.cumsum(holes))

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Return the angle and the rate at given times, each of shape (n, 3)."""
        i = np.clip(np.searchsorted(self.time, times) - 1, 0, len(self.time) - 2)
        step = (self.time[i + 1] - self.time[i])[:, np.newaxis]
        u = ((times - self.time[i]) / step[:, 0])[:, np.newaxis]
        first, last = self.values[i], self.values[i + 1]
        rise = self.angle[i + 1] - self.angle[i]
        bend, twist = 3.0 * rise - step * (2.0 * first + last), step * (first + last) - 2.0 * rise
        angle = self.angle[i] + u * (step * first + u * (bend + u * twist))
        return angle, first + u * (2.0 * bend + 3.0 * u * twist) / step

    def is_unbroken(self, low: Floats, high: Floats) -> Booleans:
        """Return the mask of spans inside the log without a gap, a NaN or clipping."""
        inside = (low > self.time[0]) & (high < self.time[-1])
        a = np.clip(np.searchsorted(self.time, low) - 1, 0, len(self.holes) - 1)
        b = np.clip(np.searchsorted(self.time, high), 0, len(self.holes) - 1)
        return np.asarray(inside & (self.holes[a] == self.holes[b]))


def compare_gyros(first: Sensor, second: Sensor) -> GyroDifference | None:
    """Return the difference of a gyro from another; None if there is too little rotation.

    Mean rates over cells of 0.04 s follow from integrals of both gyros. Gauss-Newton fits a linear
    map of nine elements, a bias and a delay. The polar decomposition of the map gives rotation and
    scale. Standard errors come from a jackknife over twelve parts of equal evidence, which is valid
    for coloured noise. They include the noise of the first gyro, which reduces estimated scales.
    """
    mine, its = _GyroIntegral(first), _GyroIntegral(second)
    cells = _select_cells(first, mine, its)
    if cells is None:
        return None
    delay = _search_delay(cells, its)
    linear = np.eye(3)
    for _ in range(_MAX_ITERATIONS):
        usable = its.is_unbroken(cells.low + delay, cells.high + delay)
        usable_cells = _Cells(*(part[usable] for part in cells))
        if len(usable_cells.low) < _MIN_CELLS:
            return None
        rates, changes = _mean_rates_at_delay(usable_cells, its, delay)
        step, linear, _ = _solve_step(usable_cells.rates, rates, changes @ linear.T)
        if abs(step) < _DELAY_TOLERANCE_S or abs(delay + step) > _MAX_DELAY_S:
            break
        delay += step
    difference = _estimate_difference(usable_cells.rates, rates, changes @ linear.T, delay)
    # If no delay is best, the gyros may be on different bodies.
    return (
        difference if abs(step) < _DELAY_TOLERANCE_S else difference._replace(delay_sigma=math.inf)
    )


def _select_cells(first: Sensor, mine: _GyroIntegral, its: _GyroIntegral) -> _Cells | None:
    """Return the cells of the windows with the most rotation."""
    length = max(_CELL_S, 2.0 * max(mine.period, its.period))
    begin, end = max(mine.time[0], its.time[0]), min(mine.time[-1], its.time[-1])
    sizes = np.linalg.norm(first.blocks.mean, axis=1)
    starts = np.arange(begin, end - 1.0, _WINDOW_S)
    edges = np.clip(((starts - first.start) / BLOCK_S).astype(np.int64), 0, max(len(sizes) - 1, 0))
    if not starts.size or not sizes.size:
        return None
    window_rates = np.add.reduceat(np.nan_to_num(sizes), edges)
    busiest = np.sort(np.argsort(-window_rates, kind="stable")[:_MAX_WINDOWS])
    spans = [np.arange(s, min(s + _WINDOW_S, end), length) for s in starts[busiest]]
    low = np.concatenate([edges_of_window[:-1] for edges_of_window in spans])
    high = np.concatenate([edges_of_window[1:] for edges_of_window in spans])
    unbroken = mine.is_unbroken(low, high)
    low, high = low[unbroken], high[unbroken]
    if len(low) < _MIN_CELLS:
        return None
    rates = (mine.at(high)[0] - mine.at(low)[0]) / (high - low)[:, np.newaxis]
    return _Cells(rates, low, high)


def _mean_rates_at_delay(cells: _Cells, its: _GyroIntegral, delay: float) -> tuple[Floats, Floats]:
    """Return the second gyro's mean rates, delayed, and their derivatives by the delay."""
    (below, slow), (above, fast) = its.at(cells.low + delay), its.at(cells.high + delay)
    length = (cells.high - cells.low)[:, np.newaxis]
    return (above - below) / length, (fast - slow) / length


def _search_delay(cells: _Cells, its: _GyroIntegral) -> float:
    """Return the delay, to one cell, with the best linear map from the second gyro to the first.

    Norms of the rates cannot be compared, because they include the bias.
    """
    length = float(cells.high[0] - cells.low[0])
    count = round(_MAX_DELAY_S / length)
    best, least_square = 0.0, math.inf
    for delay in length * np.arange(-count, count + 1):
        usable = its.is_unbroken(cells.low + delay, cells.high + delay)
        if np.count_nonzero(usable) < max(_MIN_CELLS, 0.5 * len(usable)):
            continue
        part = _Cells(*(one[usable] for one in cells))
        rates = _mean_rates_at_delay(part, its, delay)[0]
        known = np.column_stack([rates, np.ones(len(rates))])
        inverse = np.linalg.pinv(known.T @ known, hermitian=True)
        residual = part.rates - known @ (inverse @ (known.T @ part.rates))
        size = float(np.mean(np.square(residual)))
        if size < least_square:
            best, least_square = float(delay), size
    return best


def _correlation(first: Floats, second: Floats) -> float:
    first, second = first - first.mean(axis=0), second - second.mean(axis=0)
    size = math.sqrt(float(np.square(first).sum()) * float(np.square(second).sum()))
    return float((first * second).sum()) / size if size > 0.0 else 0.0


def _normal_sums(mine: Floats, its: Floats, delay_slopes: Floats) -> tuple[Floats, ...]:
    """Return the sums of the normal equations."""
    known = np.column_stack([its, np.ones(len(its))])
    squares = np.array([float(np.square(delay_slopes).sum()), float((delay_slopes * mine).sum())])
    return known.T @ known, known.T @ mine, known.T @ delay_slopes, squares


def _solve_sums(sums: tuple[Floats, ...]) -> tuple[float, Floats, Floats]:
    """Return the corrections of the delay, the linear map and the offset."""
    gram, onto, along, (size, projection) = sums
    inverse = np.linalg.pinv(gram, hermitian=True)
    rest = size - float((along * (inverse @ along)).sum())
    step = (projection - float((along * (inverse @ onto)).sum())) / rest if rest > 0.0 else 0.0
    solution = inverse @ (onto - step * along)
    return step, np.asarray(solution[:3].T), np.asarray(solution[3])


def _solve_step(mine: Floats, its: Floats, delay_slopes: Floats) -> tuple[float, Floats, Floats]:
    return _solve_sums(_normal_sums(mine, its, delay_slopes))


def _split_polar(linear: Floats) -> tuple[Floats, Floats]:
    """Return the nearest rotation of a linear map, and its scale along the first gyro's axes."""
    left, sizes, right = np.linalg.svd(linear)
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right)) or 1.0])
    stretch = (left * sizes) @ left.T
    return np.asarray(left @ sign @ right), np.asarray(np.diag(stretch))


def _estimate_difference(
    mine: Floats, its: Floats, delay_slopes: Floats, delay: float
) -> GyroDifference:
    evidence = np.cumsum(np.square(its - its.mean(axis=0)).sum(axis=1))
    cuts = np.searchsorted(
        evidence, evidence[-1] * np.arange(1, _JACKKNIFE_PARTS) / _JACKKNIFE_PARTS
    )
    triples = zip(*(np.split(one, cuts) for one in (mine, its, delay_slopes)), strict=True)
    parts = [_normal_sums(*triple) for triple in triples]
    total = tuple(np.sum([part[k] for part in parts], axis=0) for k in range(4))
    step, linear, offset = _solve_sums(total)
    matrix, scale = _split_polar(linear)
    residual = mine - its @ linear.T - offset - step * delay_slopes
    numbers = []
    for part in parts:
        step_change, partial_map, _ = _solve_sums(
            tuple(a - b for a, b in zip(total, part, strict=True))
        )
        turn, stretch = _split_polar(partial_map)
        numbers.append(np.concatenate([[step_change], _rotation_vector(turn @ matrix.T), stretch]))
    spread = np.std(numbers, axis=0) * math.sqrt(_JACKKNIFE_PARTS - 1.0)
    # Largest reduction of the fitted scale by noise of the first gyro.
    attenuation = (
        0.5
        * float(np.mean(np.square(residual)))
        * np.diag(np.linalg.pinv(np.cov(its @ matrix.T, rowvar=False), hermitian=True))
    )
    return GyroDifference(
        _correlation(mine, mine - residual), delay + step, float(spread[0]), matrix, spread[1:4],
        scale, np.hypot(spread[4:], attenuation), math.sqrt(float(np.mean(np.square(residual)))),
    )  # fmt: skip


def _rotation_vector(small: Floats) -> Floats:
    """Return the rotation vector of a small rotation."""
    off = 0.5 * (small - small.T)
    return np.array([off[2, 1], off[0, 2], off[1, 0]])
