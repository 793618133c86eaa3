"""Findings on the clock of a log: rate, jitter, late and repeated stamps, gaps and their errors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.findings.finding import RANKS, Finding, Spans, count_noun
from zerorate.findings.imus import Imu, Sensor
from zerorate.findings.limits import LIMITS, Severity
from zerorate.numerals import shorten
from zerorate.record.clock import ClockReport
from zerorate.record.runs import runs
from zerorate.types import Booleans, Floats, Integers

SECTION: Final = "The clock"
_TRIALS_PER_GAP: Final = 40
"""Number of simulated gaps near a gap, to estimate its error."""
_TRIAL_RANGE_GAPS: Final = 4
"""Largest distance of simulated gaps from a gap, in lengths of the gap."""
_MAX_GAPS: Final = 500
"""Approximate largest number of examined gaps."""
_MIN_LATE_STAMPS: Final = 3
_SLOW_RATE_HZ: Final = 50.0


def clock_findings(imus: Sequence[Imu]) -> Iterator[Finding]:
    """Yield findings on each clock that differs from earlier clocks."""
    reported: set[tuple[object, int]] = set()
    for imu in imus:
        for sensor in imu.sensors:
            report = sensor.log.meta.get("clock")
            if (report, sensor.log.n) in reported:
                continue
            reported.add((report, sensor.log.n))
            yield from _check_rate(sensor, report)
            yield from _check_missing(sensor)


def _check_rate(sensor: Sensor, report: object) -> Iterator[Finding]:
    if not isinstance(report, ClockReport):
        text = f"{sensor.label}: rate {sensor.log.rate:.6g} Hz as stated."
        yield Finding(SECTION, "rate", "good", text, sensor.log.rate, "Hz")
        return
    if not report.stamped:
        text = (
            f"{sensor.label}: no timestamps, rate {sensor.log.rate:.6g} Hz as stated; lost samples "
            "do not show."
        )
        yield _make_finding(sensor, "no stamps", "look", text, 1.0)
        return
    # Gaps, late stamps and repeated stamps have their own findings below.
    counted = replace(report, gap_count=0, missing_count=0, repeated_count=0)
    summary = counted.summary()
    summary = summary if counted == report else summary.replace("clock regular", "clock")
    text = f"{sensor.label}: {summary}."
    yield Finding(SECTION, "rate", "good", text, report.rate, "Hz", figure=sensor.figure)
    jitter = 100.0 * report.step_rms * report.rate
    if (severity := LIMITS["jitter"].severity(jitter)) != "good":
        text = f"{sensor.label}: steps between stamps scatter by {jitter:.3g} % of a period."
        yield _make_finding(sensor, "jitter", severity, text, jitter)
    late = 100.0 * report.late_count / sensor.log.n
    if report.late_count >= _MIN_LATE_STAMPS and LIMITS["late stamps"].severity(late) != "good":
        text = (
            f"{sensor.label}: {report.late_count} stamps ({shorten(late)} %) come more than half "
            "a period "
            "late, with no sample lost."
        )
        yield _make_finding(sensor, "late stamps", "look", text, late)
    if report.repeated_count:
        text = f"{sensor.label}: {report.repeated_count} stamps repeat the one before."
        yield _make_finding(sensor, "repeated stamps", "look", text, report.repeated_count)


def _make_finding(
    sensor: Sensor, kind: str, severity: Severity, text: str, value: float, spans: Spans = ()
) -> Finding:
    return Finding(
        SECTION, kind, severity, text, float(value), LIMITS[kind].unit, None, spans, sensor.figure,
        _ADVICE.get(kind, "Stamp samples when they are taken, not when they arrive."),
    )  # fmt: skip


_FEWER_TOPICS: Final = (
    "Log to a faster medium or log fewer other topics; then compare the lost share."
)
_ADVICE: Final = {
    "no stamps": "Log the time of each sample, by the sensor's clock or the host's.",
    "gaps": "Log to a faster medium or log fewer other topics; then compare the lost share.",
    "break": "Check if logging was stopped on purpose; this report treats the parts as one log.",
}


def _check_missing(sensor: Sensor) -> Iterator[Finding]:
    lost = np.asarray(np.isnan(sensor.log.data).all(axis=1))
    if not lost.any():
        return
    firsts, stops = runs(lost).T
    lengths = stops - firsts
    longest = max(1.0, 20.0 / sensor.log.rate)
    long = lengths / sensor.log.rate > longest
    yield from _check_breaks(sensor, firsts[long], lengths[long])
    yield from _check_gaps(sensor, firsts[~long], lengths[~long], lost)


def _check_breaks(sensor: Sensor, firsts: Integers, lengths: Integers) -> Iterator[Finding]:
    if not firsts.size:
        return
    longest = float(lengths.max()) / sensor.log.rate
    spans = tuple(
        s for a, n in zip(firsts, lengths, strict=True) for s in sensor.spans(np.arange(a, a + n))
    )
    text = (
        f"{sensor.label}: the log has {count_noun(firsts.size, 'break')}, {longest:.3g} s at most."
    )
    yield _make_finding(sensor, "break", LIMITS["break"].severity(longest), text, longest, spans)


def _check_gaps(
    sensor: Sensor, firsts: Integers, lengths: Integers, lost: Booleans
) -> Iterator[Finding]:
    if not firsts.size:
        return
    share = 100.0 * float(lengths.sum()) / sensor.log.n
    longest = 1e3 * float(lengths.max()) / sensor.log.rate
    text_start = (
        f"{sensor.label}: {shorten(share)} % of samples are lost in "
        f"{count_noun(firsts.size, 'gap')}, the longest lost {longest:.4g} ms"
    )
    spans = sensor.spans(np.flatnonzero(lost), 0.0)
    lost_severity = LIMITS["lost samples"].severity(share)
    if sensor.factor is None or not sensor.name.startswith("gyro"):
        yield _make_finding(sensor, "lost samples", lost_severity, f"{text_start}.", share, spans)
        return
    cost = math.degrees(sensor.factor * _gap_angle_error(sensor, firsts, lengths))
    text = f"{text_start}; a straight line over them is wrong by about {shorten(cost)} deg in all."
    severity = LIMITS["gaps"].severity(cost)
    # A slow log contains only a part of the sensor's samples, so its losses say little about the
    # sensor.
    severity = "look" if severity == "act" and sensor.log.rate < _SLOW_RATE_HZ else severity
    if RANKS[lost_severity] < RANKS[severity]:
        yield _make_finding(sensor, "lost samples", lost_severity, text, share, spans)
    else:
        yield _make_finding(sensor, "gaps", severity, text, cost, spans)


def _gap_angle_error(sensor: Sensor, firsts: Integers, lengths: Integers) -> float:
    """Return the angle error of linear interpolation over gaps, from simulated gaps nearby.

    The squares are summed over the gaps. If there are very many gaps, a part is examined and the
    sum is scaled up.
    """
    sampled_gaps = range(0, firsts.size, math.ceil(firsts.size / _MAX_GAPS))
    gap_errors = [_trial_errors(sensor, int(firsts[i]), int(lengths[i])) for i in sampled_gaps]
    squares = [float(np.mean(errors**2)) for errors in gap_errors if errors.size]
    return math.sqrt(firsts.size * float(np.mean(squares))) if squares else 0.0


def _trial_errors(sensor: Sensor, first: int, length: int) -> Floats:
    """Return the errors of linear interpolation over simulated gaps, in the log's unit."""
    data, reach = sensor.log.data, max(_TRIAL_RANGE_GAPS * length, round(sensor.log.rate))
    low, high = max(1, first - reach), min(sensor.log.n - length - 1, first + reach)
    errors = []
    for begin in np.linspace(low, max(low, high), _TRIALS_PER_GAP).astype(np.int64).tolist():
        inside = data[begin - 1 : begin + length + 1]
        if len(inside) == length + 2 and np.isfinite(inside).all():
            line = 0.5 * (inside[0] + inside[-1]) * length
            errors.append(float(np.linalg.norm(line - inside[1:-1].sum(axis=0))) / sensor.log.rate)
    return np.array(errors)
