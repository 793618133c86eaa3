"""Partition of a record into spans of one hard iron, and wild ones, by dynamic programming."""

from __future__ import annotations

from typing import Final

import numpy as np

from zerorate.calibration.magnet.spans import WALKS, Span
from zerorate.calibration.magnet.ticks import TICK, Ticks, noise_of
from zerorate.types import Booleans, Floats

_PRICE: Final = 24.0
"""Of another span, beside the evidence of its prior."""
_DROP: Final = 64.0
_WILD: Final = 0.35
"""Deviation of an axis where nothing is believed."""
_LONGEST: Final = 60
_PER: Final = 10


class _Filters:
    """A Kalman filter of hard iron and field for each start, side by side."""

    def __init__(self, variance: float, walk: float) -> None:
        self.variance, self.drift = variance, walk**2 * variance * TICK
        self.x, self.P = np.zeros((0, 6)), np.zeros((0, 6, 6))

    def begin(self, field: Floats) -> None:
        self.x = np.vstack([self.x, np.concatenate([np.zeros(3), field])])
        self.P = np.concatenate([self.P, np.eye(6)[None]])

    def keep(self, where: Booleans) -> None:
        self.x, self.P = self.x[where], self.P[where]

    def step(self, field: Floats, rotation: Floats, ticks: int) -> Floats:
        """Take a tick, ``ticks`` after the one before, and return what it costs each."""
        one, P = np.eye(3), self.P
        P[:, 3:, 3:] += one * (self.drift * ticks)
        H = np.hstack([rotation, one])
        PH = P @ H.T
        S = H @ PH + one * self.variance
        v = field - self.x @ H.T
        d = np.einsum("ai,aij,aj->a", v, np.linalg.inv(S), v)
        far = np.sqrt(np.maximum(d, 9.0) / 9.0)
        cost: Floats = np.log(np.linalg.det(S)) + np.where(d < 9.0, d, 18.0 * far - 9.0)
        K = PH @ np.linalg.inv(S + one * ((far - 1.0) * self.variance)[:, None, None])
        self.x = self.x + np.einsum("aij,aj->ai", K, v)
        P = P - K @ PH.transpose(0, 2, 1)
        self.P = 0.5 * (P + P.transpose(0, 2, 1))
        return cost


def spans_of(ticks: Ticks) -> list[Span]:
    """Return the spans of least cost, of the walk of the field that has most evidence."""
    variance = noise_of(ticks)
    return min((_spans(ticks, variance, walk) for walk in WALKS), key=lambda found: found[0])[1]


def _spans(ticks: Ticks, variance: float, walk: float) -> tuple[float, list[Span]]:
    seconds = int(ticks.number[-1]) // _PER + 1
    edges = np.searchsorted(ticks.number, np.arange(seconds + 1) * _PER)
    wild = 3.0 * (np.log(_WILD**2) + 1.0) * np.diff(edges)
    best, came = np.zeros(seconds + 1), [(0, False)] * (seconds + 1)
    starts, costs = np.zeros(0, dtype=np.int64), np.zeros(0)
    filters = _Filters(variance, walk)
    for j in range(seconds):
        if edges[j + 1] > edges[j]:
            starts, costs = np.append(starts, j), np.append(costs, 0.0)
            filters.begin(np.median(ticks.turned[edges[j] : edges[j + 1]], axis=0))
        for k in range(edges[j], edges[j + 1]):
            since = int(ticks.number[k] - ticks.number[k - 1]) if k else 1
            costs = costs + filters.step(ticks.turned[k], ticks.rotation[k], since)
        first = max(j + 1 - _LONGEST, 0)
        disturbed = best[first : j + 1] + np.cumsum(wild[first : j + 1][::-1])[::-1]
        place = int(disturbed.argmin())
        least, way = float(disturbed[place]), (first + place, True)
        own = best[starts] + costs
        if len(own) and own.min() < least:
            least, way = float(own.min()), (int(starts[own.argmin()]), False)
        best[j + 1], came[j + 1] = least + _PRICE, way
        kept = own <= best[j + 1] + _DROP
        starts, costs = starts[kept], costs[kept]
        filters.keep(kept)
    return float(best[-1]), _path(came, seconds)


def _path(came: list[tuple[int, bool]], stop: int) -> list[Span]:
    spans: list[Span] = []
    while stop:
        start, wild = came[stop]
        spans.append(Span(start, stop, "disturbed" if wild else "plain"))
        stop = start
    return spans[::-1]
