"""The samples of a log: missing, at their limit, equal, spiked, coarse against their scatter."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from zerorate.checks.constant import dead_axes
from zerorate.findings.finding import RANKS, Finding, sentence
from zerorate.findings.imus import BLOCK, Imu, Sensor
from zerorate.findings.limits import LIMITS
from zerorate.findings.stops import Stop, stop_of
from zerorate.record.clock import ClockReport
from zerorate.record.runs import runs, runs_of_rows
from zerorate.types import Booleans, Floats, Integers

SECTION: Final = "The samples"
_AXES: Final = "xyz"
_OTHERS: Final = (slice(1, 3), slice(0, 3, 2), slice(0, 2))
_SLOW: Final = 50.0
_RUN: Final = 58
_UNIQUE: Final = 200_000
"""Samples that tell the step of a sensor."""
_WINDOW: Final = 101
_PIECE: Final = 1 << 18


def samples(found: Sequence[Imu]) -> Iterator[Finding]:
    """Yield what is seen of the numbers of each sensor."""
    for imu in found:
        for one in imu.sensors:
            findings = list(_of_sensor(imu, one))
            yield from findings or [_nothing(one)]


def _of_sensor(imu: Imu, one: Sensor) -> Iterator[Finding]:
    steps = [step_of(column) for column in one.log.data.T]
    yield from _dead(one)
    yield from _missing(one)
    yield from _at_limit(one, steps)
    yield from _equal(one, steps)
    yield from _spikes(one, steps)
    yield from _coarse(imu, one, steps)


def _dead(one: Sensor) -> Iterator[Finding]:
    for text in dead_axes({one.name: one.log}, (one.name,)):
        advice = "Look at the driver, or at the columns that were read."
        yield Finding(SECTION, "dead axis", "act", sentence(text), figure=one.figure, advice=advice)


def _missing(one: Sensor) -> Iterator[Finding]:
    rows = _without_number(one)
    share = 100.0 * rows.size / one.log.n
    how = LIMITS["missing samples"].severity(share)
    if how == "good":
        return
    spans = one.spans(rows, 0.5)
    yield Finding(
        SECTION, "missing samples", how,
        f"{one.name}: {share:.2g} % of samples have no number, {_longest(rows)} in a row at most, "
        f"from {spans[0][0]:.1f} to {spans[-1][1]:.1f} s.",
        share, "%", None, spans, one.figure,
        "Compare with what the sensor sent; leave these spans out of any integral.",
    )  # fmt: skip


def _without_number(one: Sensor) -> Integers:
    """Return the rows without a number on some axis, less those that the clock found lost."""
    known = np.isfinite(one.log.data)
    report = one.log.meta.get("clock")
    lost = report.missing_count if isinstance(report, ClockReport) else 0
    nothing = ~known.any(axis=1)
    some = ~known.all(axis=1)
    # The clock tells how many are lost, not which: what goes beyond came without a number.
    return np.flatnonzero(some if np.count_nonzero(nothing) > lost else some & ~nothing)


def _nothing(one: Sensor) -> Finding:
    text = (
        f"{one.name}: none at a limit, stuck, spiked or coarse, as far as {one.log.n} samples show."
    )
    return Finding(SECTION, "samples", "good", text, float(one.log.n), "", figure=one.figure)


def step_of(column: Floats) -> float:
    """Return the step of the numbers of an axis, 0 where they are on no grid."""
    values = column[:_UNIQUE]
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


def _at_limit(one: Sensor, steps: Sequence[float]) -> Iterator[Finding]:
    stops = {}
    for axis, (column, step) in enumerate(zip(one.log.data.T, steps, strict=True)):
        others = one.log.data[:, _OTHERS[axis]]
        for sign, mark in ((1.0, "+"), (-1.0, "-")):
            if (stop := stop_of(sign * column, others, one.log.rate, step)) is not None:
                stops[f"{mark}{_AXES[axis]}"] = stop
    hard = {axis: stop for axis, stop in stops.items() if stop.hard}
    if hard:
        yield _on_hard(one, hard)
    soft = {axis: stop for axis, stop in stops.items() if not stop.hard}
    if soft:
        yield _on_soft(one, soft)


def _on_hard(one: Sensor, stops: Mapping[str, Stop]) -> Finding:
    rows, share = _rows(one, stops)
    longest = _longest(rows) / one.log.rate
    how = min(
        LIMITS["at its limit"].severity(share),
        LIMITS["at its limit, longest"].severity(longest),
        key=RANKS.__getitem__,
    )
    spans = one.spans(rows, 0.5)
    return Finding(
        SECTION, "at its limit", how,
        f"{one.name} was at its limit for {share:.2g} % of samples, {longest:.2g} s on end at most "
        f"({_places(one, stops)}), from {spans[0][0]:.1f} to {spans[-1][1]:.1f} s.",
        share, "%", None, spans, one.figure,
        "Set a wider range, and leave these spans out of any integral.",
    )  # fmt: skip


def _on_soft(one: Sensor, stops: Mapping[str, Stop]) -> Finding:
    rows, share = _rows(one, stops)
    spans = one.spans(rows, 0.5)
    return Finding(
        SECTION, "soft limit", LIMITS["soft limit"].severity(share),
        f"{one.name} bends just below its largest value where it comes near it "
        f"({_places(one, stops)}): {share:.2g} % of samples, from {spans[0][0]:.1f} to "
        f"{spans[-1][1]:.1f} s.",
        share, "%", None, spans, one.figure,
        "Compare with the range of its data sheet, and set a wider one.",
    )  # fmt: skip


def _rows(one: Sensor, stops: Mapping[str, Stop]) -> tuple[Integers, float]:
    """Return the rows at any of the limits, and their share, %."""
    rows = np.unique(np.concatenate([stop.rows for stop in stops.values()]))
    return rows, 100.0 * rows.size / one.log.n


def _places(one: Sensor, stops: Mapping[str, Stop]) -> str:
    where = ", ".join(f"{axis} at {stop.value:.5g}" for axis, stop in stops.items())
    return f"{where} {one.log.unit}"


def _longest(rows: Integers) -> int:
    """Return the longest run of rows next to each other."""
    first, stop = runs_of_rows(rows).T
    return int((stop - first).max(initial=0))


def _longest_equal(same: Booleans) -> tuple[int, int]:
    """Return the first sample and the length of the longest run of equal samples."""
    first, stop = runs(same).T
    if not first.size:
        return 0, 1
    best = int(np.argmax(stop - first))
    return int(first[best]), int(stop[best] - first[best]) + 1


def _equal(one: Sensor, steps: Sequence[float]) -> Iterator[Finding]:
    data = one.log.data
    repeats = np.empty((one.log.n - 1, 3), dtype=bool)
    for axis in range(3):
        np.equal(data[1:, axis], data[:-1, axis], out=repeats[:, axis])
    together = np.asarray(repeats.all(axis=1))
    first, length = _longest_equal(together)
    kind = LIMITS["equal samples"]
    if length >= kind.look and _usual(together, first, length, one.log.rate) <= 0.3:
        yield _stuck(one, "all axes", first, length)
        return
    for axis in range(3):
        first, length = _longest_equal(repeats[:, axis])
        if length >= _RUN and _is_stuck(one, repeats[:, axis], axis, first, length, steps):
            yield _stuck(one, f"axis {_AXES[axis]}", first, length)


def _usual(same: Booleans, first: int, length: int, rate: float) -> float:
    """Return how often samples repeat outside a run: in the mean, or in the worst seconds."""
    others = np.concatenate([same[:first], same[first + length - 1 :]])
    block = max(1, round(rate))
    seconds = others[: len(others) // block * block].reshape(-1, block)
    worst = float(np.quantile(seconds.mean(axis=1), 0.95)) if len(seconds) else 0.0
    return max(float(others.mean()) if others.size else 0.0, worst)


def _is_stuck(
    one: Sensor, same: Booleans, axis: int, first: int, length: int, steps: Sequence[float]
) -> bool:
    usual = _usual(same, first, length, one.log.rate)
    if usual >= 0.5 or one.log.n * usual ** (length - 1) >= 1e-3:
        return False
    part = one.log.data[first : first + length]
    others = [a for a in range(3) if a != axis]
    moving = all(np.nanstd(part[:, a]) > 3.0 * steps[a] for a in others)
    column, value = one.log.data[:, axis], part[0, axis]
    return moving and bool(np.nanmin(column) < value < np.nanmax(column))


def _stuck(one: Sensor, what: str, first: int, length: int) -> Finding:
    spans = one.spans(np.arange(first, first + length))
    return Finding(
        SECTION, "equal samples", LIMITS["equal samples"].severity(length),
        f"{one.name}, {what}: {length} equal samples one after the other, from "
        f"{spans[0][0]:.2f} to {spans[0][1]:.2f} s.",
        float(length), "", None, spans, one.figure,
        "Leave the span out, and look whether the next log has one.",
    )  # fmt: skip


def _spikes(one: Sensor, steps: Sequence[float]) -> Iterator[Finding]:
    if one.log.rate < _SLOW:
        return
    pairs = zip(one.log.data.T, steps, strict=True)
    rows = np.unique(np.concatenate([_spiked(column, step) for column, step in pairs]))
    share = 100.0 * rows.size / one.log.n
    how = LIMITS["spikes"].severity(rows.size)
    how = "act" if how == "look" and LIMITS["spikes, share"].severity(share) == "act" else how
    if how == "good":
        return
    yield Finding(
        SECTION, "spikes", how,
        f"{one.name}: {rows.size} single samples ({share:.2g} %) lie far from both neighbours.",
        float(rows.size), "", None, one.spans(rows), one.figure,
        "Remove them with `zerorate.denoise`, or a median of three, before any filter.",
    )  # fmt: skip


def _spiked(column: Floats, step: float) -> Integers:
    """Return the rows of single samples that no motion makes."""
    if len(column) < _WINDOW + 4:
        return np.empty(0, dtype=np.int64)
    with np.errstate(invalid="ignore", over="ignore"):
        size = column[:-2] + column[2:]
        size *= -0.5
        size += column[1:-1]
        np.abs(size, out=size)
        known = size[np.isfinite(size)]
        if not known.size:
            return np.empty(0, dtype=np.int64)
        least = 4.0 * float(np.quantile(known, 0.995, overwrite_input=True))
        middle = float(np.median(known, overwrite_input=True))
        places = np.flatnonzero(size > max(least, middle, 4.0 * step))
        good = [at for at in places.tolist() if _is_single(column, at)]
    return np.array(good, dtype=np.int64) + 1


def _is_single(column: Floats, place: int) -> bool:
    """Whether a sample alone is off: its neighbours lean half of it the other way, no others.

    The place is that of the sample before it.
    """
    first = max(0, place - _WINDOW)
    part = column[first : place + _WINDOW + 3]
    off, at = part[1:-1] - 0.5 * (part[:-2] + part[2:]), place - first
    if at < 3 or at + 3 >= len(off):
        return False
    mine = off[at]
    near, far = off[[at - 1, at + 1]] / mine, off[[at - 2, at + 2]] / mine
    around = np.delete(off[max(0, at - _WINDOW // 2) : at + _WINDOW // 2], _WINDOW // 2 - 1)
    scatter = float(np.nanmedian(np.abs(around)))
    single = (np.abs(near + 0.5) < 0.1).all() and (np.abs(far) < 0.1).all()
    return bool(single and abs(mine) > 20.0 * scatter)


def _coarse(imu: Imu, one: Sensor, steps: Sequence[float]) -> Iterator[Finding]:
    if not imu.rests or one.factor is None:
        return
    rows = np.concatenate([np.arange(rest.first, rest.last) for rest in imu.rests])
    rows = rows[rows < len(one.blocks.there)]
    scatter = np.median(one.blocks.scatter[rows], axis=0)
    ratios = [
        one.factor * step / max(float(size), one.factor * step / math.sqrt(12.0) / 2.0)
        for step, size in zip(steps, scatter, strict=True)
        if step > 0.0
    ]
    worst = max(ratios, default=0.0)
    if LIMITS["coarse step"].severity(worst) == "good":
        return
    axis = int(np.argmax(steps))
    yield Finding(
        SECTION, "coarse step", "look",
        f"{one.name}: numbers go in steps of {steps[axis]:.3g} {one.log.unit}, {worst:.2g} times "
        "their scatter at rest.",
        worst, "", None, _spans(imu), one.figure,
        "Log more digits, or set a smaller range.",
    )  # fmt: skip


def _spans(imu: Imu) -> tuple[tuple[float, float], ...]:
    return tuple((BLOCK * rest.first, BLOCK * rest.last) for rest in imu.rests)
