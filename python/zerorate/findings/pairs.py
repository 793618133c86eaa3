"""Comparison of the IMUs of one body: differences in motion and at rest, and the outlier."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Final

import numpy as np

from zerorate.findings.finding import Finding
from zerorate.findings.gyro_comparison import MIN_CORRELATION, GyroDifference, compare_gyros
from zerorate.findings.imus import BLOCK_S, Imu, Sensor
from zerorate.findings.limits import LIMITS, Severity
from zerorate.numerals import format_with_error
from zerorate.types import Booleans, Floats

SECTION: Final = "IMUs against one another"
_MIN_VOTERS: Final = 3
"""Number of IMUs needed to find an outlier."""
_TURNING_RATE_RAD_S: Final = 0.2
"""Rate above which a block counts as rotating, rad/s."""
_MIN_TURNING_BLOCKS: Final = 20
"""Smallest number of blocks with rotation for a comparison."""
_MAX_ROTATION_SIGMA_DEG: Final = 1.0
"""Largest standard error of a reported rotation, deg."""
_MAX_DELAY_SIGMA_MS: Final = 5.0
"""Largest standard error of a reported delay, ms."""
_MAX_SCALE_SIGMA: Final = 0.01
"""Largest standard error of a reported scale."""
_MIN_CALM_BLOCKS: Final = 8
_MAX_TILT_RAD: Final = math.radians(10.0)
_OUTLIER_RATIO: Final = 3.0
"""Smallest ratio of an outlier's distance from the others to their mutual distance."""
_QUANTITIES: Final = {
    "delay": "delay",
    "scales differ": "scale",
    "gyros differ": "the gyro's bias",
    "accels differ": "the accelerometer's bias",
}
"""Possible causes of an odd IMU, by the kind of its finding."""


def pair_findings(imus: Sequence[Imu]) -> Iterator[Finding]:
    """Yield the differences of each pair of IMUs on one body, and the outlier."""
    usable = [imu for imu in imus if imu.still.size and imu.gyro is not None]
    findings = {
        (one.name, other.name): list(_compare_pair(one, other))
        for one, other in combinations(usable, 2)
    }
    for listed in findings.values():
        yield from listed
    if len(usable) >= _MIN_VOTERS:
        yield from find_outlier_imu(usable, findings)


def _compare_pair(one: Imu, other: Imu) -> Iterator[Finding]:
    count = min(len(one.still), len(other.still))
    sensors = (*one.sensors, *other.sensors)
    present = np.logical_and.reduce([s.blocks.present[:count] for s in sensors])
    difference = _compare_turning(one, other, present)
    if difference is not None and difference.correlation < MIN_CORRELATION:
        return  # on two bodies
    calm = one.still[:count] & other.still[:count] & present
    has_rotation = (
        difference is not None
        and math.degrees(difference.turn_sigma.max()) < _MAX_ROTATION_SIGMA_DEG
    )
    matrix = np.eye(3)
    if difference is not None:
        yield from _describe_turning(one, other, difference)
        matrix = difference.matrix if has_rotation else matrix
    if np.count_nonzero(calm) < _MIN_CALM_BLOCKS or not (
        has_rotation or _is_parallel(one, other, calm)
    ):
        return
    for kind, mine, its in (
        ("gyros differ", one.gyro, other.gyro),
        ("accels differ", one.accel, other.accel),
    ):
        if mine is not None and its is not None:
            yield _compare_means(kind, mine, its, matrix, calm)


def _compare_turning(one: Imu, other: Imu, present: Booleans) -> GyroDifference | None:
    """Return the difference of two gyros in motion, None if there is too little rotation."""
    if one.gyro is None or other.gyro is None:
        return None
    rates = (imu.gyro.blocks.mean[: len(present)] for imu in (one, other) if imu.gyro is not None)
    sizes = np.maximum(*(np.linalg.norm(rate, axis=1) for rate in rates))
    if np.count_nonzero(present & (sizes > _TURNING_RATE_RAD_S)) < _MIN_TURNING_BLOCKS:
        return None
    return compare_gyros(one.gyro, other.gyro)


def _describe_turning(one: Imu, other: Imu, difference: GyroDifference) -> Iterator[Finding]:
    mine, its = one.gyro, other.gyro
    assert mine is not None
    assert its is not None
    turn_sigma = math.degrees(difference.turn_sigma.max())
    if turn_sigma < _MAX_ROTATION_SIGMA_DEG:
        angle = math.degrees(_angle_between(np.eye(3), difference.matrix))
        yield Finding(
            SECTION, "rotation", "good",
            f"{one.name} and {other.name} are turned by {format_with_error(angle, turn_sigma)} deg "
            "against each other.",
            angle, "deg", turn_sigma, (), mine.figure,
        )  # fmt: skip
    delay, sigma = 1e3 * difference.delay, 1e3 * difference.delay_sigma
    if sigma < _MAX_DELAY_SIGMA_MS:
        order = "later" if delay >= 0.0 else "earlier"
        yield Finding(
            SECTION, "delay", _severity_beyond_error("delay", abs(delay), sigma),
            f"{its.label} is {format_with_error(abs(delay), sigma)} ms {order} than {mine.label}.",
            abs(delay), "ms", sigma, (), mine.figure,
            "Shift one of them by this delay before you compare or average them.",
        )  # fmt: skip
    known_axes = np.flatnonzero(difference.scale_sigma < _MAX_SCALE_SIGMA)
    if known_axes.size:
        off = 100.0 * np.abs(difference.scale[known_axes] - 1.0)
        worst = int(np.argmax(off))
        value, error = float(off[worst]), 100.0 * float(difference.scale_sigma[known_axes[worst]])
        scales = ", ".join(
            f"{format_with_error(difference.scale[k], difference.scale_sigma[k])} about {'xyz'[k]}"
            for k in known_axes
        )
        yield Finding(
            SECTION, "scales differ", _severity_beyond_error("scales differ", value, error),
            f"{mine.label} shows {scales} of what {its.label} does.",
            value, "%", error, (), mine.figure,
            "Rotate each axis by a known angle to find the correct one: `zerorate calibrate`.",
        )  # fmt: skip


def _severity_beyond_error(kind: str, value: float, sigma: float) -> Severity:
    """Return the severity of a value after two standard errors are subtracted."""
    return LIMITS[kind].severity(max(value - 2.0 * sigma, 0.0))


def find_outlier_imu(
    usable: Sequence[Imu], findings: Mapping[tuple[str, str], Sequence[Finding]]
) -> Iterator[Finding]:
    """Yield, for each quantity, the IMU that disagrees with the others, if these agree."""
    for kind, what in _QUANTITIES.items():
        values = {
            pair: finding
            for pair, listed in findings.items()
            for finding in listed
            if finding.kind == kind and finding.value is not None
        }
        compared = {name for pair in values for name in pair}
        if len(compared) < _MIN_VOTERS:
            continue
        for imu in (imu for imu in usable if imu.name in compared):
            own_differences = [finding for pair, finding in values.items() if imu.name in pair]
            others = [finding for pair, finding in values.items() if imu.name not in pair]
            if not others:
                continue
            remaining = sorted(others, key=lambda one: one.value or 0.0)[len(others) // 2]
            if _is_outlier(own_differences, remaining):
                yield _describe_outlier(imu, what, len(compared), own_differences, remaining)


def _is_outlier(own_differences: Sequence[Finding], remaining: Finding) -> bool:
    """Return True if one IMU differs from all others by three times their median difference."""
    near = min(own_differences, key=lambda one: one.value or 0.0)
    mine, its = near.value or 0.0, remaining.value or 0.0
    sigma = math.hypot(near.sigma or 0.0, remaining.sigma or 0.0)
    return mine > _OUTLIER_RATIO * its and mine - its > 4.0 * sigma


def _describe_outlier(
    imu: Imu, what: str, count: int, own_differences: Sequence[Finding], remaining: Finding
) -> Finding:
    nearest = min(own_differences, key=lambda one: one.value or 0.0)
    own, rest = (
        f"{format_with_error(one.value or 0.0, one.sigma or 0.0)} {remaining.unit}"
        for one in (nearest, remaining)
    )
    return Finding(
        SECTION, "outlier", nearest.severity,
        f"Of {count} IMUs, {imu.name} is the outlier in {what}: at least {own} from the others, "
        f"which differ by {rest}{'' if count == _MIN_VOTERS else ' (median)'}.",
        nearest.value, remaining.unit, nearest.sigma, (), imu.sensors[0].figure,
        "Exclude it, or check its mount, its range and its filter.",
    )  # fmt: skip


def _angle_between(one: Floats, other: Floats) -> float:
    """Return the angle between two rotations, rad."""
    return math.acos(min(1.0, max(-1.0, 0.5 * (float(np.trace(one.T @ other)) - 1.0))))


def _is_parallel(one: Imu, other: Imu, calm: Booleans) -> bool:
    """Return True if gravity at rest has the same direction in both IMUs."""
    if one.accel is None or other.accel is None:
        return False
    mine, its = (imu.accel.blocks.mean[: len(calm)][calm] for imu in (one, other) if imu.accel)
    dot = (mine * its).sum(axis=1) / np.linalg.norm(mine, axis=1) / np.linalg.norm(its, axis=1)
    return bool(np.median(dot) > math.cos(_MAX_TILT_RAD))


def _compare_means(kind: str, mine: Sensor, its: Sensor, matrix: Floats, calm: Booleans) -> Finding:
    """Return the difference between the means of two sensors over calm blocks, and its error."""
    off = mine.blocks.mean[: len(calm)][calm] - its.blocks.mean[: len(calm)][calm] @ matrix.T
    factor = math.degrees(1.0) if kind == "gyros differ" else 1.0
    mean = factor * np.median(off, axis=0)
    parts = [np.median(part, axis=0) for part in np.array_split(off, min(10, len(off)))]
    sigmas = factor * np.std(parts, axis=0, ddof=1) / math.sqrt(len(parts))
    size = float(np.linalg.norm(mean))
    sigma = float(np.linalg.norm(sigmas * mean) / size) if size else float(sigmas.max())
    limit = LIMITS[kind]
    seconds = BLOCK_S * np.count_nonzero(calm)
    return Finding(
        SECTION, kind, limit.severity(size, sigma),
        f"{mine.label} and {its.label} differ by {format_with_error(size, sigma)} {limit.unit} "
        f"over {seconds:.3g} calm seconds.",
        size, limit.unit, sigma, mine.spans(np.arange(0)), mine.figure,
        "Keep it still for ten seconds in several poses; with three IMUs or more this shows the "
        "outlier.",
    )  # fmt: skip
