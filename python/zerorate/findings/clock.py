"""The clock of a log: rate, jitter, late and repeated stamps, gaps and what they cost."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from zerorate.findings.finding import Finding, Spans, counted
from zerorate.findings.imus import Imu, Sensor
from zerorate.findings.limits import LIMITS, Severity
from zerorate.record.clock import ClockReport
from zerorate.record.runs import runs
from zerorate.types import Booleans, Floats, Integers

SECTION: Final = "The clock"
_PLACES: Final = 40
"""Places near a gap that tell what one of its length costs."""
_NEAR: Final = 4
"""Lengths of a gap within which such places lie."""
_GAPS: Final = 500
"""Gaps that are looked at, about, of very many."""
_FEWEST: Final = 3
_SLOW: Final = 50.0


def clock(found: Sequence[Imu]) -> Iterator[Finding]:
    """Yield what is seen of each clock that differs from those before."""
    seen: set[tuple[object, int]] = set()
    for imu in found:
        for one in imu.sensors:
            report = one.log.meta.get("clock")
            if (report, one.log.n) in seen:
                continue
            seen.add((report, one.log.n))
            yield from _rate(one, report)
            yield from _missing(one)


def _rate(one: Sensor, report: object) -> Iterator[Finding]:
    if not isinstance(report, ClockReport) or not report.stamped:
        text = f"{one.name}: no stamps; its rate is taken as {one.log.rate:.6g} Hz."
        yield Finding(SECTION, "no stamps", "good", text, one.log.rate, "Hz")
        return
    text = f"{one.name}: {report.summary()}."
    yield Finding(SECTION, "rate", "good", text, report.rate, "Hz", figure=one.figure)
    jitter = 100.0 * report.step_rms * report.rate
    if (how := LIMITS["jitter"].severity(jitter)) != "good":
        text = f"{one.name}: steps between stamps scatter by {jitter:.3g} % of a period."
        yield _of(one, "jitter", how, text, jitter)
    late = 100.0 * report.late_count / one.log.n
    if report.late_count >= _FEWEST and LIMITS["late stamps"].severity(late) != "good":
        text = (
            f"{one.name}: {report.late_count} stamps ({late:.2g} %) come more than half a period "
            "late, with no sample lost."
        )
        yield _of(one, "late stamps", "look", text, late)
    if report.repeated_count:
        text = f"{one.name}: {report.repeated_count} stamps repeat the one before."
        yield _of(one, "repeated stamps", "look", text, report.repeated_count)


def _of(
    one: Sensor, kind: str, how: Severity, text: str, value: float, spans: Spans = ()
) -> Finding:
    return Finding(
        SECTION, kind, how, text, float(value), LIMITS[kind].unit, None, spans, one.figure,
        _ADVICE.get(kind, "Stamp samples where they are taken, not where they arrive."),
    )  # fmt: skip


_ADVICE: Final = {
    "gaps": "Log to a faster medium or log less beside; then compare the lost share.",
    "break": "Look whether logging was stopped on purpose; the parts are judged together here.",
}


def _missing(one: Sensor) -> Iterator[Finding]:
    lost = np.asarray(np.isnan(one.log.data).all(axis=1))
    if not lost.any():
        return
    firsts, stops = runs(lost).T
    lengths = stops - firsts
    longest = max(1.0, 20.0 / one.log.rate)
    long = lengths / one.log.rate > longest
    yield from _breaks(one, firsts[long], lengths[long])
    yield from _gaps(one, firsts[~long], lengths[~long], lost)


def _breaks(one: Sensor, firsts: Integers, lengths: Integers) -> Iterator[Finding]:
    if not firsts.size:
        return
    most = float(lengths.max()) / one.log.rate
    spans = tuple(
        s for a, n in zip(firsts, lengths, strict=True) for s in one.spans(np.arange(a, a + n))
    )
    text = f"{one.name}: the log has {counted(firsts.size, 'break')}, {most:.3g} s at most."
    yield _of(one, "break", LIMITS["break"].severity(most), text, most, spans)


def _gaps(one: Sensor, firsts: Integers, lengths: Integers, lost: Booleans) -> Iterator[Finding]:
    if not firsts.size:
        return
    share = 100.0 * float(lengths.sum()) / one.log.n
    longest = 1e3 * float(lengths.max()) / one.log.rate
    told = (
        f"{one.name}: {share:.2g} % of samples are lost in {counted(firsts.size, 'gap')}, "
        f"the longest lost {longest:.4g} ms"
    )
    spans = one.spans(np.flatnonzero(lost), 0.0)
    if one.factor is None or not one.name.startswith("gyro"):
        yield _of(one, "gaps", "good", f"{told}.", share, spans)
        return
    cost = math.degrees(one.factor * _cost(one, firsts, lengths))
    text = f"{told}; a straight line over them is wrong by about {cost:.2g} deg in all."
    how = LIMITS["gaps"].severity(cost)
    # So slow a log shows a part of the sensor's samples: what it lost says little of the sensor.
    how = "look" if how == "act" and one.log.rate < _SLOW else how
    yield _of(one, "gaps", how, text, cost, spans)


def _cost(one: Sensor, firsts: Integers, lengths: Integers) -> float:
    """Return the error of the angle where gaps are bridged, by gaps of their length put near each.

    Squares are summed over the gaps; of very many a part tells of all.
    """
    chosen = range(0, firsts.size, math.ceil(firsts.size / _GAPS))
    known = [_errors(one, int(firsts[i]), int(lengths[i])) for i in chosen]
    squares = [float(np.mean(errors**2)) for errors in known if errors.size]
    return math.sqrt(firsts.size * float(np.mean(squares))) if squares else 0.0


def _errors(one: Sensor, first: int, length: int) -> Floats:
    """Return what a straight line over gaps would cost that begin near one, in the log's unit."""
    data, near = one.log.data, max(_NEAR * length, round(one.log.rate))
    low, high = max(1, first - near), min(one.log.n - length - 1, first + near)
    found = []
    for begin in np.linspace(low, max(low, high), _PLACES).astype(np.int64).tolist():
        inside = data[begin - 1 : begin + length + 1]
        if len(inside) == length + 2 and np.isfinite(inside).all():
            line = 0.5 * (inside[0] + inside[-1]) * length
            found.append(float(np.linalg.norm(line - inside[1:-1].sum(axis=0))) / one.log.rate)
    return np.array(found)
