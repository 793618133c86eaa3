"""Shapes of low-pass filters: squared magnitudes of textbook filters, by corner and order."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np

from zerorate.types import Floats

_WHOLE_ORDER: Final = 0.05
_MAX_SIMPLE_MEAN: Final = 12.0
_MEAN_CORNER: Final = 0.4429
_CUBE_CORNER: Final = 0.2622


class Shape(NamedTuple):
    """Family of filters: squared magnitude for parameters p, start values, and names."""

    name: str
    response: Callable[[Floats, Floats], Floats]
    starts: Callable[[float], Sequence[Sequence[float]]]
    corner: Callable[[Floats], float]
    order: Callable[[Floats], float]


def _tangent_ratio(f: Floats, corner: float) -> Floats:
    ratio: Floats = np.tan(np.pi * np.minimum(f, 0.499999)) / math.tan(math.pi * corner)
    return ratio


def _inside(log_corner: float) -> float:
    return min(math.exp(log_corner), 0.4999)


def _exponential(f: Floats, p: Floats) -> Floats:
    corner = math.sin(math.pi * _inside(p[0]))
    return 1.0 / (1.0 + (np.sin(np.pi * f) / corner) ** 2)


def butterworth(order: float) -> Callable[[Floats, Floats], Floats]:
    """Return the squared magnitude of a digital Butterworth filter at f, for [ln f_c]."""
    return lambda f, p: 1.0 / (1.0 + _tangent_ratio(f, _inside(p[0])) ** (2.0 * order))


def _any_butterworth(f: Floats, p: Floats) -> Floats:
    order = min(max(math.exp(p[1]), 0.3), 12.0)
    ratio = np.maximum(_tangent_ratio(f, _inside(p[0])), 1e-30)
    log_ratio = 2.0 * order * np.log(ratio)
    return 1.0 / (1.0 + np.exp(np.minimum(log_ratio, 600.0)))


def _aliased(f: Floats, p: Floats) -> Floats:
    corner = math.exp(p[0])
    aliases = range(-3, 4)
    total = sum(1.0 / (1.0 + ((f + k) / corner) ** 4) for k in aliases)
    level = sum(1.0 / (1.0 + (k / corner) ** 4) for k in aliases)
    return np.asarray(total / level)


def _damped(f: Floats, p: Floats) -> Floats:
    t = _tangent_ratio(f, _inside(p[0])) ** 2
    damping = math.exp(p[1])
    return 1.0 / ((1.0 - t) ** 2 + 4.0 * damping**2 * t)


def _damped_corner(p: Floats) -> float:
    half = 1.0 - 2.0 * math.exp(p[1]) ** 2
    ratio = math.sqrt(half + math.sqrt(half**2 + 1.0))
    return math.atan(ratio * math.tan(math.pi * _inside(p[0]))) / math.pi


def moving_average(f: Floats, p: Floats) -> Floats:
    """Return the squared magnitude of a moving average at frequencies f, for [ln f_c]."""
    width = max(_MEAN_CORNER / math.exp(p[0]), 1.0001)
    if width > _MAX_SIMPLE_MEAN:
        x = width * np.sin(np.pi * f)
        return np.where(x > 1e-9, np.sin(np.pi * width * f) / np.maximum(x, 1e-9), 1.0) ** 2
    lags = np.arange(1, math.ceil(width))
    weights = 1.0 - lags / width
    series = 1.0 + 2.0 * np.tensordot(weights, np.cos(2.0 * np.pi * lags[:, None, None] * f), 1)
    return np.asarray(np.maximum(series / (1.0 + 2.0 * weights.sum()), 0.0))


def _cube(f: Floats, p: Floats) -> Floats:
    width = _CUBE_CORNER / math.exp(p[0])
    aliases = range(-2, 3)
    total = sum(np.sinc(width * (f + k)) ** 6 for k in aliases)
    level = sum(float(np.sinc(width * k)) ** 6 for k in aliases)
    return np.asarray(total / level)


def _corners(lowest: float, count: int = 24) -> Floats:
    corners: Floats = np.geomspace(2.5 * lowest, 0.47, count)
    return corners


def _plain_starts(*others: float) -> Callable[[float], Sequence[Sequence[float]]]:
    return lambda lowest: [(math.log(corner), *others) for corner in _corners(lowest)]


def _mean_starts(lowest: float) -> Sequence[Sequence[float]]:
    widths = np.unique(np.rint(np.geomspace(2.0, min(80.0, _MEAN_CORNER / lowest), 48)))
    return [(math.log(_MEAN_CORNER / width),) for width in widths]


def _cube_starts(lowest: float) -> Sequence[Sequence[float]]:
    return [(math.log(corner),) for corner in _corners(lowest, 48)]


def own_corner(p: Floats) -> float:
    """Return the corner of a shape with the corner's logarithm as first parameter."""
    return math.exp(p[0])


def _own_order(p: Floats) -> float:
    order = math.exp(p[1])
    whole = max(round(order), 1)
    return float(whole) if abs(order - whole) < _WHOLE_ORDER * whole else order


def _damped_order(p: Floats) -> float:
    return 2.0 if 0.5 < math.exp(p[1]) < 1.0 else math.nan


SHAPES: Final = (
    Shape("one", _exponential, _plain_starts(), own_corner, lambda p: 1.0),
    Shape("oneb", butterworth(1.0), _plain_starts(), own_corner, lambda p: 1.0),
    Shape("two", butterworth(2.0), _plain_starts(), own_corner, lambda p: 2.0),
    Shape(
        "bw", _any_butterworth, _plain_starts(math.log(1.5)), own_corner, lambda p: math.exp(p[1])
    ),
    Shape("twoa", _aliased, _plain_starts(), own_corner, lambda p: 2.0),
    Shape("damp", _damped, _plain_starts(math.log(0.7)), _damped_corner, _damped_order),
    Shape("mean", moving_average, _mean_starts, own_corner, lambda p: math.inf),
    Shape("sinc3", _cube, _cube_starts, own_corner, lambda p: 3.0),
)
