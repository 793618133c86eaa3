"""Findings on samples: missing, saturated, repeated, spiked or coarse."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from zerorate.checks.constant import describe_dead_axes
from zerorate.findings.finding import RANKS, Finding, as_sentence
from zerorate.findings.imus import BLOCK_S, Imu, Sensor
from zerorate.findings.limits import LIMITS
from zerorate.findings.saturation import Saturation, find_saturation
from zerorate.numerals import shorten
from zerorate.record.clock import ClockReport
from zerorate.record.runs import runs, runs_of_rows
from zerorate.types import Booleans, Floats, Integers

SECTION: Final = "The samples"
_AXES: Final = "xyz"
_OTHER_AXES: Final = (slice(1, 3), slice(0, 3, 2), slice(0, 2))
_MIN_RATE_HZ: Final = 50.0
_MIN_EQUAL_RUN: Final = 58
_MAX_STEP_SAMPLES: Final = 200_000
"""Number of samples used to find the step of a sensor."""
_SPIKE_WINDOW: Final = 101
_CHUNK_ROWS: Final = 1 << 18


def sample_findings(imus: Sequence[Imu]) -> Iterator[Finding]:
    """Yield findings on the samples of each sensor."""
    for imu in imus:
        for sensor in imu.sensors:
            findings = list(_check_sensor(imu, sensor))
            yield from findings or [_describe_clean(sensor)]


def _check_sensor(imu: Imu, sensor: Sensor) -> Iterator[Finding]:
    steps = [quantization_step(column) for column in sensor.log.data.T]
    yield from _check_dead_axes(sensor)
    yield from _check_missing(sensor)
    yield from _check_saturation(sensor, steps)
    yield from _check_equal_samples(sensor, steps)
    yield from _check_spikes(sensor, steps)
    yield from _check_resolution(imu, sensor, steps)


def _check_dead_axes(sensor: Sensor) -> Iterator[Finding]:
    for text in describe_dead_axes({sensor.label: sensor.log}, (sensor.label,)):
        advice = "Check the driver, and the columns that were read."
        yield Finding(
            SECTION, "dead axis", "act", as_sentence(text), figure=sensor.figure, advice=advice
        )


def _check_missing(sensor: Sensor) -> Iterator[Finding]:
    rows = _rows_without_number(sensor)
    share = 100.0 * rows.size / sensor.log.n
    severity = LIMITS["missing samples"].severity(share)
    if severity == "good":
        return
    spans = sensor.spans(rows, 0.5)
    yield Finding(
        SECTION, "missing samples", severity,
        f"{sensor.label}: {shorten(share)} % of samples have no number, {_longest_run(rows)} in "
        "a row at most, "
        f"from {spans[0][0]:.1f} to {spans[-1][1]:.1f} s.",
        share, "%", None, spans, sensor.figure,
        "Compare with what the sensor sent; exclude these spans from integration.",
    )  # fmt: skip


def _rows_without_number(sensor: Sensor) -> Integers:
    """Return the rows with a missing axis, except rows that the clock reports as lost."""
    known = np.isfinite(sensor.log.data)
    report = sensor.log.meta.get("clock")
    lost = report.missing_count if isinstance(report, ClockReport) else 0
    no_axis = ~known.any(axis=1)
    any_missing = ~known.all(axis=1)
    # The clock gives the number of lost rows, not their positions.
    return np.flatnonzero(
        any_missing if np.count_nonzero(no_axis) > lost else any_missing & ~no_axis
    )


def _describe_clean(sensor: Sensor) -> Finding:
    text = f"{sensor.label}: no limit, stuck value, spike or coarse step in {sensor.log.n} samples."
    return Finding(SECTION, "samples", "good", text, float(sensor.log.n), "", figure=sensor.figure)


def quantization_step(column: Floats) -> float:
    """Return the step of an axis' values, 0 if they are not on a grid."""
    values = column[:_MAX_STEP_SAMPLES]
    values = values[np.isfinite(values)]
    unique = np.unique(values)
    if unique.size < 3 or unique.size >= 0.5 * values.size:
        return 0.0
    steps = np.diff(unique)
    low = float(np.quantile(steps, 0.1))
    step = float(np.median(steps[steps <= 1.5 * low]))
    if not step > 0.0:
        return 0.0
    whole = steps / step
    return step if np.mean(np.abs(whole - np.round(whole)) < 0.1) >= 0.9 else 0.0


def _check_saturation(sensor: Sensor, steps: Sequence[float]) -> Iterator[Finding]:
    saturations = {}
    for axis, (column, step) in enumerate(zip(sensor.log.data.T, steps, strict=True)):
        other_axes = sensor.log.data[:, _OTHER_AXES[axis]]
        for sign, mark in ((1.0, "+"), (-1.0, "-")):
            if (
                saturation := find_saturation(sign * column, other_axes, sensor.log.rate, step)
            ) is not None:
                saturations[f"{mark}{_AXES[axis]}"] = saturation
    hard = {axis: saturation for axis, saturation in saturations.items() if saturation.hard}
    if hard:
        yield _describe_hard_limit(sensor, hard)
    soft = {axis: saturation for axis, saturation in saturations.items() if not saturation.hard}
    if soft:
        yield _describe_soft_limit(sensor, soft)


def _describe_hard_limit(sensor: Sensor, saturations: Mapping[str, Saturation]) -> Finding:
    rows, share = _saturated_rows(sensor, saturations)
    longest = _longest_run(rows) / sensor.log.rate
    severity = min(
        LIMITS["at its limit"].severity(share),
        LIMITS["at its limit, longest"].severity(longest),
        key=RANKS.__getitem__,
    )
    spans = sensor.spans(rows, 0.5)
    return Finding(
        SECTION, "at its limit", severity,
        f"{sensor.label} was at its limit for {shorten(share)} % of samples, {shorten(longest)} s "
        f"at a time at most ({_list_limits(sensor, saturations)}), from {spans[0][0]:.1f} to "
        f"{spans[-1][1]:.1f} s.",
        share, "%", None, spans, sensor.figure,
        "Set a wider range, and exclude these spans from integration.",
    )  # fmt: skip


def _describe_soft_limit(sensor: Sensor, saturations: Mapping[str, Saturation]) -> Finding:
    rows, share = _saturated_rows(sensor, saturations)
    spans = sensor.spans(rows, 0.5)
    return Finding(
        SECTION, "soft limit", LIMITS["soft limit"].severity(share),
        f"{sensor.label} has a soft limit near its largest value "
        f"({_list_limits(sensor, saturations)}): {shorten(share)} % of samples, from "
        f"{spans[0][0]:.1f} to "
        f"{spans[-1][1]:.1f} s.",
        share, "%", None, spans, sensor.figure,
        "Compare with the range in its data sheet, and set a wider range.",
    )  # fmt: skip


def _saturated_rows(
    sensor: Sensor, saturations: Mapping[str, Saturation]
) -> tuple[Integers, float]:
    """Return the rows at one of the limits, and their share, %."""
    rows = np.unique(np.concatenate([stop.rows for stop in saturations.values()]))
    return rows, 100.0 * rows.size / sensor.log.n


def _list_limits(sensor: Sensor, saturations: Mapping[str, Saturation]) -> str:
    where = ", ".join(f"{axis} at {stop.value:.5g}" for axis, stop in saturations.items())
    return f"{where} {sensor.log.unit}"


def _longest_run(rows: Integers) -> int:
    """Return the longest run of consecutive rows."""
    first, stop = runs_of_rows(rows).T
    return int((stop - first).max(initial=0))


def _longest_equal_run(same: Booleans) -> tuple[int, int]:
    """Return the first sample and the length of the longest run of equal samples."""
    first, stop = runs(same).T
    if not first.size:
        return 0, 1
    best = int(np.argmax(stop - first))
    return int(first[best]), int(stop[best] - first[best]) + 1


def _check_equal_samples(sensor: Sensor, steps: Sequence[float]) -> Iterator[Finding]:
    data = sensor.log.data
    repeats = np.empty((sensor.log.n - 1, 3), dtype=bool)
    for axis in range(3):
        np.equal(data[1:, axis], data[:-1, axis], out=repeats[:, axis])
    together = np.asarray(repeats.all(axis=1))
    first, length = _longest_equal_run(together)
    kind = LIMITS["equal samples"]
    if length >= kind.look and _usual_repeat_share(together, first, length, sensor.log.rate) <= 0.3:
        yield _describe_stuck(sensor, "all axes", first, length)
        return
    for axis in range(3):
        first, length = _longest_equal_run(repeats[:, axis])
        if length >= _MIN_EQUAL_RUN and _is_stuck(
            sensor, repeats[:, axis], axis, first, length, steps
        ):
            yield _describe_stuck(sensor, f"axis {_AXES[axis]}", first, length)


def _usual_repeat_share(same: Booleans, first: int, length: int, rate: float) -> float:
    """Return the share of repeated samples outside a run: the mean, or the worst second's."""
    outside = np.concatenate([same[:first], same[first + length - 1 :]])
    block = max(1, round(rate))
    seconds = outside[: len(outside) // block * block].reshape(-1, block)
    worst = float(np.quantile(seconds.mean(axis=1), 0.95)) if len(seconds) else 0.0
    return max(float(outside.mean()) if outside.size else 0.0, worst)


def _is_stuck(
    sensor: Sensor, same: Booleans, axis: int, first: int, length: int, steps: Sequence[float]
) -> bool:
    repeat_share = _usual_repeat_share(same, first, length, sensor.log.rate)
    if repeat_share >= 0.5 or sensor.log.n * repeat_share ** (length - 1) >= 1e-3:
        return False
    part = sensor.log.data[first : first + length]
    other_axes = [a for a in range(3) if a != axis]
    moving = all(np.nanstd(part[:, a]) > 3.0 * steps[a] for a in other_axes)
    column, value = sensor.log.data[:, axis], part[0, axis]
    return moving and bool(np.nanmin(column) < value < np.nanmax(column))


def _describe_stuck(sensor: Sensor, what: str, first: int, length: int) -> Finding:
    spans = sensor.spans(np.arange(first, first + length))
    return Finding(
        SECTION, "equal samples", LIMITS["equal samples"].severity(length),
        f"{sensor.label}, {what}: {length} equal samples one after the other, from "
        f"{spans[0][0]:.2f} to {spans[0][1]:.2f} s.",
        float(length), "", None, spans, sensor.figure,
        "Exclude this span, and check the next log for one.",
    )  # fmt: skip


def _check_spikes(sensor: Sensor, steps: Sequence[float]) -> Iterator[Finding]:
    if sensor.log.rate < _MIN_RATE_HZ:
        return
    pairs = zip(sensor.log.data.T, steps, strict=True)
    rows = np.unique(np.concatenate([_find_spikes(column, step) for column, step in pairs]))
    share = 100.0 * rows.size / sensor.log.n
    severity = LIMITS["spikes"].severity(rows.size)
    severity = (
        "act"
        if severity == "look" and LIMITS["spikes, share"].severity(share) == "act"
        else severity
    )
    if severity == "good":
        return
    yield Finding(
        SECTION, "spikes", severity,
        f"{sensor.label}: {rows.size} single samples ({shorten(share)} %) lie far from both "
        "neighbours.",
        float(rows.size), "", None, sensor.spans(rows), sensor.figure,
        "Remove them before filtering: `zerorate.denoise`, or a median of three.",
    )  # fmt: skip


def _find_spikes(column: Floats, step: float) -> Integers:
    """Return the rows of single samples that no motion explains."""
    if len(column) < _SPIKE_WINDOW + 4:
        return np.empty(0, dtype=np.int64)
    with np.errstate(invalid="ignore", over="ignore"):
        size = column[:-2] + column[2:]
        size *= -0.5
        size += column[1:-1]
        np.abs(size, out=size)
        known = size[np.isfinite(size)]
        if not known.size:
            return np.empty(0, dtype=np.int64)
        threshold = 4.0 * float(np.quantile(known, 0.995, overwrite_input=True))
        middle = float(np.median(known, overwrite_input=True))
        candidates = np.flatnonzero(size > max(threshold, middle, 4.0 * step))
        spikes = [at for at in candidates.tolist() if _is_single(column, at)]
    return np.array(spikes, dtype=np.int64) + 1


def _is_single(column: Floats, index: int) -> bool:
    """Return True if a single sample is an outlier: its neighbours deviate half as far, oppositely.

    The index is the index of the sample before it.
    """
    first = max(0, index - _SPIKE_WINDOW)
    part = column[first : index + _SPIKE_WINDOW + 3]
    deviations, at = part[1:-1] - 0.5 * (part[:-2] + part[2:]), index - first
    if at < 3 or at + 3 >= len(deviations):
        return False
    deviation = deviations[at]
    near, far = deviations[[at - 1, at + 1]] / deviation, deviations[[at - 2, at + 2]] / deviation
    around = np.delete(
        deviations[max(0, at - _SPIKE_WINDOW // 2) : at + _SPIKE_WINDOW // 2],
        _SPIKE_WINDOW // 2 - 1,
    )
    scatter = float(np.nanmedian(np.abs(around)))
    single = (np.abs(near + 0.5) < 0.1).all() and (np.abs(far) < 0.1).all()
    return bool(single and abs(deviation) > 20.0 * scatter)


def _check_resolution(imu: Imu, sensor: Sensor, steps: Sequence[float]) -> Iterator[Finding]:
    if not imu.rests or sensor.factor is None:
        return
    rows = np.concatenate([np.arange(rest.first, rest.last) for rest in imu.rests])
    rows = rows[rows < len(sensor.blocks.present)]
    scatter = np.median(sensor.blocks.scatter[rows], axis=0)
    ratios = [
        sensor.factor * step / max(float(size), sensor.factor * step / math.sqrt(12.0) / 2.0)
        for step, size in zip(steps, scatter, strict=True)
        if step > 0.0
    ]
    worst = max(ratios, default=0.0)
    if LIMITS["coarse step"].severity(worst) == "good":
        return
    axis = int(np.argmax(steps))
    yield Finding(
        SECTION, "coarse step", "look",
        f"{sensor.label}: values change in steps of {steps[axis]:.3g} {sensor.log.unit}, "
        f"{shorten(worst)} times "
        "their scatter at rest.",
        worst, "", None, _spans(imu), sensor.figure,
        "Log more digits, or set a smaller range.",
    )  # fmt: skip


def _spans(imu: Imu) -> tuple[tuple[float, float], ...]:
    return tuple((BLOCK_S * rest.first, BLOCK_S * rest.last) for rest in imu.rests)
