"""The clock of a receiver, coarsely, by how fast the course turns."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from zerorate.navigation.windows import Means, Turned, Windows
from zerorate.types import Floats

_STEP: Final = 0.25
_FINE: Final = 0.01
NEAR: Final = 10.0
"""Seconds by which clocks are off that are meant to be one."""
_OVERLAP: Final = 30.0
_WINDOWS: Final = 20
_FLOOR: Final = 0.05
"""Rate, rad/s, by which a course leads a heading, as the antenna does."""
_BELIEVED: Final = (0.5, 0.8)
"""Correlation that suffices for clocks that are nearly one, and for any."""
_LEAD: Final = 1.5
_BESIDE: Final = 5.0
_DEGREES: Final = 180.0 / np.pi


@dataclass(frozen=True)
class Lag:
    """By how much the times of fixes are to be moved.

    Parameters
    ----------
    seconds : float
        To be added to the times of the fixes.
    correlation : float
        Of the rate of the course with that of the gyro about down, there.
    slope : float
        Of the one on the other: 1 where units and axes are right.
    certain : bool
        Whether nothing else fits nearly as well.
    """

    seconds: float
    correlation: float
    slope: float
    certain: bool


def is_rate(slope: float) -> bool:
    """Whether a slope is that of a rate in some unit."""
    return any(0.7 < abs(slope) * unit < 1.4 for unit in (1.0, _DEGREES, 1.0 / _DEGREES))


def find_lag(means: Means, windows: Windows, down: Floats) -> Lag | None:
    """Return the lag that fits best, within ten seconds or, if none does, in any overlap.

    None if nowhere half a minute and twenty windows overlap.
    """
    turned = means.about(down)
    grid = _Grid.of(turned, windows)
    if grid is None:
        return None
    for reach, least in ((NEAR, _BELIEVED[0]), (np.inf, _BELIEVED[1])):
        found = grid.best(reach)
        if found is None:
            continue
        at, lead = found
        seconds, r, slope = _refined(turned, windows, at)
        # What fits less well has to lead wherever clocks may be.
        leads = lead > _LEAD and (abs(r) >= _BELIEVED[1] or grid.lead(at) > _LEAD)
        certain = abs(r) >= least and leads and is_rate(slope)
        if certain or (reach == np.inf):
            return Lag(seconds, r, slope, certain)
    return None


def lag_of_pieces(
    means: Means, windows: Windows, down: Floats, about: float
) -> tuple[Floats, Floats]:
    """Return times of pieces of a minute, and the lag of each that is believed.

    They are looked for within eight seconds of one that is known.
    """
    first, last = windows.start[0], windows.stop[-1]
    count = int(np.clip((last - first) // 60.0, 2, 20))
    edges = np.linspace(first, last + 1e-6, count + 1)
    lags = about + np.arange(-8.0, 8.0 + 0.5 * _STEP, _STEP)
    turned = means.about(down)
    times, found = [], []
    for a, b in pairwise(edges.tolist()):
        own = windows.chosen((windows.start >= a) & (windows.stop <= b))
        scores = np.array([abs(_fit(turned, own, lag)[0]) for lag in lags])
        scores = np.nan_to_num(scores)
        best = int(np.argmax(scores))
        rest = scores[np.abs(lags - lags[best]) > 2.0].max()
        if scores[best] > _BELIEVED[1] and scores[best] > 1.3 * rest:
            times.append(0.5 * (a + b))
            found.append(float(lags[best]))
    return np.array(times), np.array(found)


def weights(windows: Windows) -> Floats:
    """Return the weight of each rate of the course, 0 where it is not known."""
    known = 1.0 / (windows.course_sigma**2 + _FLOOR**2)
    return np.asarray(np.where(windows.turning, known, 0.0))


def _fit(turned: Turned, windows: Windows, lag: float) -> tuple[float, float]:
    """Return correlation and slope of the course's rate on the gyro's at a lag."""
    c, w = windows.course_rate, weights(windows)
    g = turned.rate(windows.start + lag, windows.stop + lag)
    there = np.isfinite(g) & (w > 0.0)
    if there.sum() < _WINDOWS // 2:
        return 0.0, np.nan
    c, g, w = c[there], g[there], w[there] / w[there].sum()
    c, g = c - w @ c, g - w @ g
    cg, cc, gg = w @ (c * g), w @ (c * c), w @ (g * g)
    if not (cc > 0.0 and gg > 0.0):
        return 0.0, np.nan
    return float(cg / np.sqrt(cc * gg)), float(cg / gg)


def _refined(turned: Turned, windows: Windows, at: float) -> tuple[float, float, float]:
    """Return lag, correlation and slope at the peak next to a lag, by a parabola."""
    lags = at + np.arange(-_STEP, _STEP + 0.5 * _FINE, _FINE)
    found = [_fit(turned, windows, lag) for lag in lags]
    sizes = np.abs([r for r, _ in found])
    k = int(np.argmax(sizes))
    seconds = float(lags[k])
    if 0 < k < len(lags) - 1:
        a, b, c = sizes[k - 1 : k + 2]
        bend = a - 2.0 * b + c
        seconds += float(0.5 * _FINE * (a - c) / bend) if bend < 0.0 else 0.0
    return seconds, *found[k]


@dataclass(frozen=True, eq=False)
class _Grid:
    """Scores of all lags, a quarter of a second apart."""

    lags: Floats
    scores: Floats

    @classmethod
    def of(cls, turned: Turned, windows: Windows) -> _Grid | None:
        """Return them by sums over what overlaps, all at once by Fourier transforms."""
        w = weights(windows)
        known = w > 0.0
        if known.sum() < _WINDOWS:
            return None
        middle = 0.5 * (windows.start + windows.stop)[known]
        width = float(np.median((windows.stop - windows.start)[known]))
        start = turned.time[0] + 0.5 * width
        at = np.arange(start, turned.time[-1] - 0.5 * width, _STEP)
        if len(at) * _STEP < _OVERLAP:
            return None
        g = turned.rate(at - 0.5 * width, at + 0.5 * width)
        there = np.isfinite(g).astype(np.float64)
        g = np.nan_to_num(g) * there
        place = np.rint((middle - middle[0]) / _STEP).astype(np.int64)
        n = len(g) + int(place[-1])
        size = 1 << int(n).bit_length()
        c, w = windows.course_rate[known], w[known]

        def summed(of_windows: Floats, of_gyro: Floats) -> Floats:
            spread = np.bincount(place, of_windows, minlength=size)
            product = np.fft.rfft(of_gyro, size) * np.conj(np.fft.rfft(spread))
            return np.asarray(np.fft.irfft(product, size))

        count = summed(np.ones_like(w), there)
        total = np.maximum(summed(w, there), 1e-12)
        mean_c, mean_g = summed(w * c, there) / total, summed(w, g) / total
        cc = summed(w * c * c, there) / total - mean_c**2
        gg = summed(w, g * g) / total - mean_g**2
        cg = summed(w * c, g) / total - mean_c * mean_g
        good = (count >= _WINDOWS - 0.5) & (cc > 1e-12) & (gg > 1e-15)
        good &= count * 0.5 * width >= _OVERLAP - 1.0
        # Indices beyond the gyro's are those of lags below zero.
        index = np.arange(size)
        index = np.where(index < len(g), index, index - size)
        with np.errstate(invalid="ignore", divide="ignore"):
            r = np.where(good, np.abs(cg) / np.sqrt(np.maximum(cc * gg, 1e-30)), 0.0)
        energy = np.sqrt(np.maximum(np.where(good, total * cc, 0.0), 0.0))
        if not good.any():
            return None
        order = np.argsort(index)
        scores = np.minimum(r, 1.0) * energy / energy.max()
        return cls(at[0] - middle[0] + _STEP * index[order], scores[order])

    def best(self, reach: float) -> tuple[float, float] | None:
        """Return the best lag within a reach, and by how much it leads those beside it."""
        near = np.abs(self.lags) <= reach
        if not near.any():
            return None
        k = int(np.argmax(np.where(near, self.scores, -1.0)))
        if not self.scores[k] > 0.0:
            return None
        return float(self.lags[k]), self.lead(float(self.lags[k]), reach)

    def lead(self, lag: float, reach: float = np.inf) -> float:
        """Return by how much a lag leads all within a reach that are not beside it."""
        others = (np.abs(self.lags) <= reach) & (np.abs(self.lags - lag) > _BESIDE)
        second = float(self.scores[others].max()) if others.any() else 0.0
        own = float(self.scores[int(np.argmin(np.abs(self.lags - lag)))])
        return own / max(second, 1e-9)
