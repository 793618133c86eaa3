"""IMUs of one body against one another: rotation where they turn, differences where they rest."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from zerorate.findings.finding import Finding
from zerorate.findings.imus import BLOCK, Imu, Sensor
from zerorate.findings.limits import LIMITS
from zerorate.numerals import with_error
from zerorate.types import Booleans, Floats

SECTION: Final = "IMUs against one another"
_MOST: Final = 3
"""IMUs that are compared: autopilots have three."""
_TURN: Final = 0.2
"""Rad/s of a block that turns."""
_TURNS: Final = 20
"""Blocks that turn, without which no rotation is told."""
_ALIKE: Final = 0.95
"""Cosine of what two gyros of one body show, after the rotation."""
_STILL: Final = 8
_TILT: Final = math.radians(10.0)


def pairs(found: Sequence[Imu]) -> Iterator[Finding]:
    """Yield the differences of each two IMUs that are seen to be on one body."""
    usable = [imu for imu in found if imu.still.size and imu.gyro is not None][:_MOST]
    for one, other in combinations(usable, 2):
        yield from _pair(one, other)


class _Turned(NamedTuple):
    """A rotation from the axes of the second to those of the first, and its error, rad."""

    matrix: Floats
    sigma: float
    alike: float
    blocks: int


def _pair(one: Imu, other: Imu) -> Iterator[Finding]:
    count = min(len(one.still), len(other.still))
    first, second = one.sensors, other.sensors
    there = np.logical_and.reduce([s.blocks.there[:count] for s in (*first, *second)])
    turned = _rotation(one, other, there, count)
    if turned is not None and turned.alike < _ALIKE:
        return  # of two bodies
    calm = one.still[:count] & other.still[:count] & there
    matrix = np.eye(3) if turned is None else turned.matrix
    if turned is not None:
        yield _on_rotation(one, other, turned)
    if np.count_nonzero(calm) < _STILL or (turned is None and not _parallel(one, other, calm)):
        return
    for kind, mine, its in (
        ("gyros differ", one.gyro, other.gyro),
        ("accels differ", one.accel, other.accel),
    ):
        if mine is not None and its is not None:
            yield _difference(kind, mine, its, matrix, calm)


def _rotation(one: Imu, other: Imu, there: Booleans, count: int) -> _Turned | None:
    """Return the rotation between two gyros by blocks that turn, None where too few do."""
    if one.gyro is None or other.gyro is None:
        return None
    mine, its = one.gyro.blocks.mean[:count], other.gyro.blocks.mean[:count]
    sizes = np.maximum(np.linalg.norm(mine, axis=1), np.linalg.norm(its, axis=1))
    turning = there & (sizes > _TURN)
    if np.count_nonzero(turning) < _TURNS:
        return None
    mine = mine[turning] - np.median(mine[there], axis=0)
    its = its[turning] - np.median(its[there], axis=0)
    matrix, weakest = _wahba(mine, its)
    if weakest < 0.02:
        return None  # they turn about one axis only
    alike = float((mine * (its @ matrix.T)).sum() / math.sqrt((mine**2).sum() * (its**2).sum()))
    parts = np.array_split(np.arange(len(mine)), 8)
    turns = [_between(matrix, _wahba(mine[part], its[part])[0]) for part in parts]
    sigma = math.sqrt(float(np.mean(np.square(turns)))) / math.sqrt(len(parts))
    return _Turned(matrix, sigma, alike, int(np.count_nonzero(turning)))


def _wahba(mine: Floats, its: Floats) -> tuple[Floats, float]:
    """Return the rotation of the second vectors onto the first, and how sure its worst axis is."""
    left, sizes, right = np.linalg.svd(mine.T @ its)
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right)) or 1.0])
    weakest = (sizes[1] + sizes[2] * sign[2, 2]) / max(sizes.sum(), np.finfo(float).tiny)
    return np.asarray(left @ sign @ right), float(weakest)


def _between(one: Floats, other: Floats) -> float:
    """Return the angle between two rotations, rad."""
    return math.acos(min(1.0, max(-1.0, 0.5 * (float(np.trace(one.T @ other)) - 1.0))))


def _on_rotation(one: Imu, other: Imu, turned: _Turned) -> Finding:
    angle, sigma = math.degrees(_between(np.eye(3), turned.matrix)), math.degrees(turned.sigma)
    assert one.gyro is not None
    return Finding(
        SECTION, "rotation", "good",
        f"{one.name} and {other.name} are turned by {with_error(angle, sigma)} deg against each "
        f"other, by {turned.blocks} half-seconds of turns.",
        angle, "deg", sigma, (), one.gyro.figure,
    )  # fmt: skip


def _parallel(one: Imu, other: Imu, calm: Booleans) -> bool:
    """Whether gravity points alike at rest, where no turn tells the axes."""
    if one.accel is None or other.accel is None:
        return False
    mine, its = (imu.accel.blocks.mean[: len(calm)][calm] for imu in (one, other) if imu.accel)
    dot = (mine * its).sum(axis=1) / np.linalg.norm(mine, axis=1) / np.linalg.norm(its, axis=1)
    return bool(np.median(dot) > math.cos(_TILT))


def _difference(kind: str, mine: Sensor, its: Sensor, matrix: Floats, calm: Booleans) -> Finding:
    """Return how far the means of two sensors are apart over calm blocks, by tenths of them."""
    off = mine.blocks.mean[: len(calm)][calm] - its.blocks.mean[: len(calm)][calm] @ matrix.T
    factor = math.degrees(1.0) if kind == "gyros differ" else 1.0
    mean = factor * np.median(off, axis=0)
    parts = [np.median(part, axis=0) for part in np.array_split(off, min(10, len(off)))]
    sigmas = factor * np.std(parts, axis=0, ddof=1) / math.sqrt(len(parts))
    size = float(np.linalg.norm(mean))
    sigma = float(np.linalg.norm(sigmas * mean) / size) if size else float(sigmas.max())
    limit = LIMITS[kind]
    seconds = BLOCK * np.count_nonzero(calm)
    return Finding(
        SECTION, kind, limit.severity(size, sigma),
        f"{mine.name} and {its.name} differ by {with_error(size, sigma)} {limit.unit} over "
        f"{seconds:.3g} calm seconds.",
        size, limit.unit, sigma, mine.spans(np.arange(0)), mine.figure,
        "Keep it still for ten seconds in several poses; three IMUs tell which is the odd one.",
    )  # fmt: skip
