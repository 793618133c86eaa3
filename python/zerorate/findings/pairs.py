"""IMUs of one body against one another: what turns and rests tell, and the odd one of three."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Final

import numpy as np

from zerorate.findings.against import ALIKE, Against, against
from zerorate.findings.finding import Finding
from zerorate.findings.imus import BLOCK, Imu, Sensor
from zerorate.findings.limits import LIMITS, Severity
from zerorate.numerals import with_error
from zerorate.types import Booleans, Floats

SECTION: Final = "IMUs against one another"
_MOST: Final = 3
"""IMUs that are compared: autopilots have three."""
_TURN: Final = 0.2
"""Rad/s of a block that turns."""
_TURNS: Final = 20
"""Blocks that turn, without which turns tell nothing."""
_ROTATION: Final = 1.0
"""Error, deg, with which a rotation is still told."""
_DELAY: Final = 5.0
"""Error, ms, with which a delay is still told."""
_SCALE: Final = 0.01
"""Error with which a scale is still told."""
_STILL: Final = 8
_TILT: Final = math.radians(10.0)
_ODD: Final = 3.0
"""How many times farther the odd one of three is from the others than they are apart."""
_QUANTITIES: Final = {
    "delay": "delay",
    "scales differ": "scale",
    "gyros differ": "the gyro's bias",
    "accels differ": "the accelerometer's bias",
}
"""What may make one of three the odd one, by the kind of its finding."""


def pairs(found: Sequence[Imu]) -> Iterator[Finding]:
    """Yield the differences of each two IMUs that are seen to be on one body, and the odd one."""
    usable = [imu for imu in found if imu.still.size and imu.gyro is not None][:_MOST]
    findings = {
        (one.name, other.name): list(_pair(one, other)) for one, other in combinations(usable, 2)
    }
    for listed in findings.values():
        yield from listed
    if len(usable) == _MOST:
        yield from odd_one(usable, findings)


def _pair(one: Imu, other: Imu) -> Iterator[Finding]:
    count = min(len(one.still), len(other.still))
    sensors = (*one.sensors, *other.sensors)
    there = np.logical_and.reduce([s.blocks.there[:count] for s in sensors])
    found = _turned(one, other, there)
    if found is not None and found.alike < ALIKE:
        return  # of two bodies
    calm = one.still[:count] & other.still[:count] & there
    known = found is not None and math.degrees(found.turn_sigma.max()) < _ROTATION
    matrix = np.eye(3)
    if found is not None:
        yield from _on_turns(one, other, found)
        matrix = found.matrix if known else matrix
    if np.count_nonzero(calm) < _STILL or not (known or _parallel(one, other, calm)):
        return
    for kind, mine, its in (
        ("gyros differ", one.gyro, other.gyro),
        ("accels differ", one.accel, other.accel),
    ):
        if mine is not None and its is not None:
            yield _difference(kind, mine, its, matrix, calm)


def _turned(one: Imu, other: Imu, there: Booleans) -> Against | None:
    """Return how two gyros differ by turns, None where too few are."""
    if one.gyro is None or other.gyro is None:
        return None
    rates = (imu.gyro.blocks.mean[: len(there)] for imu in (one, other) if imu.gyro is not None)
    sizes = np.maximum(*(np.linalg.norm(rate, axis=1) for rate in rates))
    if np.count_nonzero(there & (sizes > _TURN)) < _TURNS:
        return None
    return against(one.gyro, other.gyro)


def _on_turns(one: Imu, other: Imu, found: Against) -> Iterator[Finding]:
    mine, its = one.gyro, other.gyro
    assert mine is not None
    assert its is not None
    turn_sigma = math.degrees(found.turn_sigma.max())
    if turn_sigma < _ROTATION:
        angle = math.degrees(_between(np.eye(3), found.matrix))
        yield Finding(
            SECTION, "rotation", "good",
            f"{one.name} and {other.name} are turned by {with_error(angle, turn_sigma)} deg "
            "against each other.",
            angle, "deg", turn_sigma, (), mine.figure,
        )  # fmt: skip
    delay, sigma = 1e3 * found.delay, 1e3 * found.delay_sigma
    if sigma < _DELAY:
        order = "later" if delay >= 0.0 else "earlier"
        yield Finding(
            SECTION, "delay", _beyond("delay", abs(delay), sigma),
            f"{its.name} is {with_error(abs(delay), sigma)} ms {order} than {mine.name}.",
            abs(delay), "ms", sigma, (), mine.figure,
            "Shift the one by it before the two are compared or averaged.",
        )  # fmt: skip
    told = np.flatnonzero(found.scale_sigma < _SCALE)
    if told.size:
        off = 100.0 * np.abs(found.scale[told] - 1.0)
        worst = int(np.argmax(off))
        value, error = float(off[worst]), 100.0 * float(found.scale_sigma[told[worst]])
        scales = ", ".join(
            f"{with_error(found.scale[k], found.scale_sigma[k])} about {'xyz'[k]}" for k in told
        )
        yield Finding(
            SECTION, "scales differ", _beyond("scales differ", value, error),
            f"{mine.name} shows {scales} of what {its.name} does.",
            value, "%", error, (), mine.figure,
            "Turn each axis by a known angle to tell which of them is right: `zerorate calibrate`.",
        )  # fmt: skip


def _beyond(kind: str, value: float, sigma: float) -> Severity:
    """Return the severity of a value that errors may have made: two of them are taken off."""
    return LIMITS[kind].severity(max(value - 2.0 * sigma, 0.0))


def odd_one(
    usable: Sequence[Imu], findings: Mapping[tuple[str, str], Sequence[Finding]]
) -> Iterator[Finding]:
    """Yield of which of three IMUs each quantity is far from those of the others, which agree."""
    for kind, what in _QUANTITIES.items():
        values = {
            pair: one
            for pair, listed in findings.items()
            for one in listed
            if one.kind == kind and one.value is not None
        }
        if len(values) < _MOST:
            continue
        for imu in usable:
            others = [one for pair, one in values.items() if imu.name in pair]
            (rest,) = [one for pair, one in values.items() if imu.name not in pair]
            if _is_odd(others, rest):
                yield _on_odd(imu, what, others, rest)


def _is_odd(others: Sequence[Finding], rest: Finding) -> bool:
    """Whether both differences from one are three times that of the other two, beyond errors."""
    near = min(others, key=lambda one: one.value or 0.0)
    mine, its = near.value or 0.0, rest.value or 0.0
    sigma = math.hypot(near.sigma or 0.0, rest.sigma or 0.0)
    return mine > _ODD * its and mine - its > 4.0 * sigma


def _on_odd(imu: Imu, what: str, others: Sequence[Finding], rest: Finding) -> Finding:
    far, apart = (
        [with_error(one.value or 0.0, one.sigma or 0.0) for one in some]
        for some in (others, [rest])
    )
    worst = min(others, key=lambda one: one.value or 0.0)
    return Finding(
        SECTION, "odd one", worst.severity,
        f"Of three, {imu.name} is the odd one by {what}: {' and '.join(far)} {rest.unit} from the "
        f"others, which differ by {apart[0]} {rest.unit}.",
        worst.value, rest.unit, worst.sigma, (), imu.sensors[0].figure,
        "Leave it out, or look at its mount, its range and its filter.",
    )  # fmt: skip


def _between(one: Floats, other: Floats) -> float:
    """Return the angle between two rotations, rad."""
    return math.acos(min(1.0, max(-1.0, 0.5 * (float(np.trace(one.T @ other)) - 1.0))))


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
        "Keep it still for ten seconds in several poses; of three IMUs, the odd one shows.",
    )  # fmt: skip
