"""Coarse clock offset of a receiver, from the rate of the course."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zerorate.navigation.windows import RotationAngle, Windows
from zerorate.types import Floats

_GRID_STEP_S: Final = 0.25
_FINE_STEP_S: Final = 0.01
NEAR_LAG_S: Final = 10.0
"""Largest offset of two clocks that are meant to be the same, s."""
_MIN_OVERLAP_S: Final = 30.0
_MIN_WINDOWS: Final = 20
_RATE_FLOOR_RAD_S: Final = 0.05
"""Rate, rad/s, by which the antenna's course can differ from the rate of the heading."""
_MIN_CORRELATIONS: Final = (0.5, 0.8)
"""Correlation needed for offsets within `NEAR_LAG_S`, and for larger offsets."""
_MIN_PEAK_RATIO: Final = 1.5
_PEAK_WIDTH_S: Final = 5.0
_MIN_PART_SHARE: Final = 0.1
_MIN_PART_TURNS_RAD: Final = (3.0, 0.75)
_MAX_COST_SHARE: Final = 0.5
_MIN_GAIN: Final = 20.0
MIN_JUMP_S: Final = 1.0
"""Limits for two lags in a record: smallest share of the squared course rates and smallest rotation
of each part; largest share of the residuals; smallest gain over one lag; smallest jump, s.
"""
_DEG_PER_RAD: Final = 180.0 / np.pi


@dataclass(frozen=True)
class Lag:
    """Clock offset between receiver and sensors, with its quality.

    Parameters
    ----------
    seconds : float
        Offset to add to the times of the fixes, s.
    correlation : float
        Correlation at this offset between the course's rate and the gyro's rate about down.
    slope : float
        Slope between both rates. It is 1 if units and axes are right.
    certain : bool
        True if no other offset fits nearly as well.
    """

    seconds: float
    correlation: float
    slope: float
    certain: bool


def is_rate(slope: float, factor: float = 1.4) -> bool:
    """Return True if a slope is the ratio of two units of rate, within a factor."""
    units = (1.0, _DEG_PER_RAD, 1.0 / _DEG_PER_RAD)
    return any(0.98 / factor < abs(slope) * unit < factor for unit in units)


def find_lag(
    rotation: RotationAngle, windows: Windows, peak_width: float = _PEAK_WIDTH_S
) -> Lag | None:
    """Return the lag that fits best, within ten seconds or, if none fits, in any overlap.

    Returns None if no overlap has 30 s and 20 windows. Lags further apart than `peak_width`, s,
    count as different.
    """
    grid = _ScoreGrid.of(rotation, windows, peak_width)
    if grid is None:
        return None
    for reach, least in ((NEAR_LAG_S, _MIN_CORRELATIONS[0]), (np.inf, _MIN_CORRELATIONS[1])):
        candidate = grid.find_best(reach)
        if candidate is None:
            continue
        at, ratio = candidate
        seconds, r, slope = _refine_lag(rotation, windows, at)
        # A weaker fit must be better than all other lags.
        leads = ratio > _MIN_PEAK_RATIO and (
            abs(r) >= _MIN_CORRELATIONS[1] or grid.peak_ratio(at) > _MIN_PEAK_RATIO
        )
        certain = abs(r) >= least and leads and is_rate(slope)
        if certain or (reach == np.inf):
            return Lag(seconds, r, slope, certain)
    return None


def find_lag_jump(
    rotation: RotationAngle, windows: Windows, about: float, *, certain: bool
) -> tuple[Floats, Floats] | None:
    """Return two parts of a record with a lag each, if two lags fit far better than one.

    Both lags are within ten seconds of a known lag. The likelihood ratio of two parts to one
    decides. The lag of all windows lies between the two lags and fits neither part. If the known
    lag is not `certain`, the fixes may come from another vehicle. A few turns then fit any lag, so
    one part must have the known lag.
    """
    own = windows.select(course_weights(windows) > 0.0)
    if len(own.start) < 2 * _MIN_WINDOWS:
        return None
    w = course_weights(own)
    lags = about + np.arange(-NEAR_LAG_S, NEAR_LAG_S + 0.1, _GRID_STEP_S)
    rates = np.array([rotation.rate(own.start + lag, own.stop + lag) for lag in lags])
    inside = np.isfinite(rates).all(axis=0)
    if inside.sum() < 2 * _MIN_WINDOWS:
        return None
    own, w, rates, c = own.select(inside), w[inside], rates[:, inside], own.course_rate[inside]
    middle, width = 0.5 * (own.start + own.stop), own.stop - own.start
    c = c - w @ c / w.sum()
    rates = rates - (rates @ w / w.sum())[:, np.newaxis]
    slope = (rates * w) @ c / np.maximum((rates**2) @ w, 1e-30)
    energy = np.cumsum(w * c**2)
    # Sign and unit of the slope are unknown. The largest slope belongs almost to the best lag.
    slope = slope[np.argmax(np.abs(slope))]
    costs = np.cumsum(w * (c - slope * rates) ** 2, axis=1)
    before, after = costs.min(axis=0), (costs[:, -1:] - costs).min(axis=0)
    share = energy / energy[-1]
    turned = np.cumsum(np.abs(c) * np.gradient(middle))
    enough = (share > _MIN_PART_SHARE) & (share < 1.0 - _MIN_PART_SHARE)
    least = _MIN_PART_TURNS_RAD[certain]
    enough &= (turned > least) & (turned[-1] - turned > least)
    if not enough.any():
        return None
    split = int(np.argmin(np.where(enough, before + after, np.inf)))
    one, two = costs[:, -1].min(), before[split] + after[split]
    # Windows overlap, so each counts only by the share of its time that is new.
    independent = float(np.minimum(np.diff(own.start, append=own.stop[-1]) / width, 1.0).sum())
    if two > _MAX_COST_SHARE * energy[-1] or independent * (one - two) < _MIN_GAIN * two:
        return None
    parts = costs[:, split], costs[:, -1] - costs[:, split]
    sides = middle <= middle[split], middle > middle[split]
    pair = np.array(
        [
            _refine_lag(rotation, own.select(side), float(lags[int(np.argmin(cost))]))[0]
            for side, cost in zip(sides, parts, strict=True)
        ]
    )
    near = certain or np.abs(pair - about).min() <= MIN_JUMP_S
    if abs(pair[1] - pair[0]) <= MIN_JUMP_S or not near:
        return None
    return np.array([middle[split], middle[min(split + 1, len(middle) - 1)]]), pair


def course_weights(windows: Windows) -> Floats:
    """Return the weight of each course rate; 0 where the rate is unknown."""
    known = 1.0 / (windows.course_sigma**2 + _RATE_FLOOR_RAD_S**2)
    return np.asarray(np.where(windows.course_known, known, 0.0))


def _correlate(rotation: RotationAngle, windows: Windows, lag: float) -> tuple[float, float]:
    """Return correlation and slope between the course's rate and the gyro's rate at a lag."""
    c, w = windows.course_rate, course_weights(windows)
    g = rotation.rate(windows.start + lag, windows.stop + lag)
    present = np.isfinite(g) & (w > 0.0)
    if present.sum() < _MIN_WINDOWS // 2:
        return 0.0, np.nan
    c, g, w = c[present], g[present], w[present] / w[present].sum()
    c, g = c - w @ c, g - w @ g
    cg, cc, gg = w @ (c * g), w @ (c * c), w @ (g * g)
    if not (cc > 0.0 and gg > 0.0):
        return 0.0, np.nan
    return float(cg / np.sqrt(cc * gg)), float(cg / gg)


def _refine_lag(rotation: RotationAngle, windows: Windows, at: float) -> tuple[float, float, float]:
    """Return lag, correlation and slope at the peak near a lag, by a parabola."""
    lags = at + np.arange(-_GRID_STEP_S, _GRID_STEP_S + 0.5 * _FINE_STEP_S, _FINE_STEP_S)
    fits = [_correlate(rotation, windows, lag) for lag in lags]
    sizes = np.abs([r for r, _ in fits])
    k = int(np.argmax(sizes))
    seconds = float(lags[k])
    if 0 < k < len(lags) - 1:
        a, b, c = sizes[k - 1 : k + 2]
        bend = a - 2.0 * b + c
        seconds += float(0.5 * _FINE_STEP_S * (a - c) / bend) if bend < 0.0 else 0.0
    return seconds, *fits[k]


@dataclass(frozen=True, eq=False)
class _ScoreGrid:
    """Scores of all lags, a quarter of a second apart."""

    lags: Floats
    scores: Floats
    peak_width: float

    @classmethod
    def of(cls, rotation: RotationAngle, windows: Windows, peak_width: float) -> _ScoreGrid | None:
        """Return the scores of all lags, from sums over the overlap by Fourier transforms."""
        w = course_weights(windows)
        known = w > 0.0
        if known.sum() < _MIN_WINDOWS:
            return None
        middle = 0.5 * (windows.start + windows.stop)[known]
        width = float(np.median((windows.stop - windows.start)[known]))
        start = rotation.time[0] + 0.5 * width
        at = np.arange(start, rotation.time[-1] - 0.5 * width, _GRID_STEP_S)
        if len(at) * _GRID_STEP_S < _MIN_OVERLAP_S:
            return None
        g = rotation.rate(at - 0.5 * width, at + 0.5 * width)
        there = np.isfinite(g).astype(np.float64)
        g = np.nan_to_num(g) * there
        slot = np.rint((middle - middle[0]) / _GRID_STEP_S).astype(np.int64)
        n = len(g) + int(slot[-1])
        size = 1 << int(n).bit_length()
        c, w = windows.course_rate[known], w[known]

        def summed(of_windows: Floats, of_gyro: Floats) -> Floats:
            spread = np.bincount(slot, of_windows, minlength=size)
            product = np.fft.rfft(of_gyro, size) * np.conj(np.fft.rfft(spread))
            return np.asarray(np.fft.irfft(product, size))

        count = summed(np.ones_like(w), there)
        total = np.maximum(summed(w, there), 1e-12)
        mean_c, mean_g = summed(w * c, there) / total, summed(w, g) / total
        cc = summed(w * c * c, there) / total - mean_c**2
        gg = summed(w, g * g) / total - mean_g**2
        cg = summed(w * c, g) / total - mean_c * mean_g
        good = (count >= _MIN_WINDOWS - 0.5) & (cc > 1e-12) & (gg > 1e-15)
        good &= count * 0.5 * width >= _MIN_OVERLAP_S - 1.0
        # Indices beyond the length of the gyro's record belong to negative lags.
        index = np.arange(size)
        index = np.where(index < len(g), index, index - size)
        with np.errstate(invalid="ignore", divide="ignore"):
            r = np.where(good, np.abs(cg) / np.sqrt(np.maximum(cc * gg, 1e-30)), 0.0)
        energy = np.sqrt(np.maximum(np.where(good, total * cc, 0.0), 0.0))
        if not good.any():
            return None
        order = np.argsort(index)
        scores = np.minimum(r, 1.0) * energy / energy.max()
        lags = at[0] - middle[0] + _GRID_STEP_S * index[order]
        return cls(lags, scores[order], peak_width)

    def find_best(self, reach: float) -> tuple[float, float] | None:
        """Return the best lag within a reach, and its score over the score of the next peak."""
        near = np.abs(self.lags) <= reach
        if not near.any():
            return None
        k = int(np.argmax(np.where(near, self.scores, -1.0)))
        if not self.scores[k] > 0.0:
            return None
        return float(self.lags[k]), self.peak_ratio(float(self.lags[k]), reach)

    def peak_ratio(self, lag: float, reach: float = np.inf) -> float:
        """Return the ratio of a lag's score to the best other score within a reach."""
        elsewhere = (np.abs(self.lags) <= reach) & (np.abs(self.lags - lag) > self.peak_width)
        second = float(self.scores[elsewhere].max()) if elsewhere.any() else 0.0
        own = float(self.scores[int(np.argmin(np.abs(self.lags - lag)))])
        return own / max(second, 1e-9)
