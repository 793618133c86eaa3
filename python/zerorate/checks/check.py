"""Check of a recording: its sensors on common ticks, compared with each other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate._native import check_field, check_fit, check_gyro, check_ticks
from zerorate.checks.axis_permutations import (
    INVERSES,
    SENSES,
    count_mistakes,
    format_sense,
    format_senses,
    shared_rows,
)
from zerorate.checks.decision import Costs, Decision, decide
from zerorate.checks.result import Checks, Finding
from zerorate.checks.sentences import describe_accel_axes, describe_axes, describe_unit
from zerorate.noise.coefficient import UNKNOWN_COEFFICIENT, Coefficient
from zerorate.record import Log, Recording
from zerorate.record.clock import ClockReport, describe_rate_error
from zerorate.record.samples import partner_name
from zerorate.types import Booleans, Floats
from zerorate.units import UNITS, convert

_TICK_S: Final = 0.02
_MIN_DURATION_S: Final = 20.0
"""Shortest recording for a check, s."""
_MIN_RATE_HZ: Final = 10.0
"""Smallest sampling rate that resolves motion, Hz."""
_COST_FLOOR, _FIELD_COST_FLOOR = 0.01, 0.05
_UNIT_FACTORS: Final = (1.0, math.pi / 180.0, 180.0 / math.pi)
_MAX_SCALE_SIGMA, _MAX_DELAY_SIGMA_S = 0.03, 0.015
_ROTATION_COUNT: Final = 24

Counts = npt.NDArray[np.uint64]
Scale = tuple[Coefficient, Coefficient, Coefficient]


def check(
    recording: Recording, *, gyro: str = "gyro", accel: str | None = None, scale: bool = True
) -> Checks:
    """Check the units, signs and axes of a recording's sensors against its motion.

    The gyro's rotation transforms the accelerometer's force into fixed axes. Gravity is constant
    there only if unit and axes are correct. A magnetometer's field is tested in the same way. Units
    and axes that the motion does not determine stay undecided. Nothing is corrected.

    Parameters
    ----------
    recording : Recording
        Recording with a gyro and an accelerometer of three axes at 10 Hz or more. A magnetometer is
        optional.
    gyro, accel : str
        Names of the sensors, such as ``"gyro_1"``. Default: the first gyro, and the accelerometer
        of its device.
    scale : bool
        Also estimate scale errors and a delay of the gyro, if unit and axes fit.

    Returns
    -------
    Checks
        Findings on gyro and magnetometer. ``table()`` shows them. ``apply(recording)`` corrects a
        unit or axes if the correction is certain.

    Examples
    --------
    >>> import zerorate as zr
    >>> recording = zr.simulate_motion("hand", duration=60.0).recording()
    >>> wrong = zr.Log(**{**vars(recording.gyro), "data": recording.gyro.data * [1, -1, 1]})
    >>> print(zr.check(zr.Recording({**recording, "gyro": wrong})).gyro.text)
    the gyro's y axis has the opposite sign to the accelerometer's
    """
    accel = accel or partner_name(recording, gyro, "accel")
    mag = partner_name(recording, gyro, "mag")
    notes = tuple(_describe_sizes(recording, accel, mag))
    clock = _describe_clock(recording[gyro]) if gyro in recording else ""
    known = {"source": recording.source, "notes": notes, "clock": clock}
    if reason := _find_obstacle(recording, gyro, accel):
        undecided = Finding(gyro if gyro in recording else "", "cannot tell", reason)
        field = _no_field_finding(recording, mag, reason)
        return Checks(undecided, field, *_unknown_scale(), None, **known)  # type: ignore[arg-type]
    ticks = _Ticks.of(recording[gyro], recording[accel], recording.get(mag))
    gyro_check = _check_gyro(ticks, recording[gyro], gyro)
    scale_and_delay = (
        _estimate_scale(ticks, gyro_check)
        if scale and _is_consistent(gyro_check.finding)
        else _unknown_scale()
    )
    field = _check_field(ticks, gyro_check, recording, mag)
    dip = None if ticks.fields is None else _median_dip(ticks)
    return Checks(gyro_check.finding, field, *scale_and_delay, dip, **known)  # type: ignore[arg-type]


def _find_obstacle(recording: Recording, gyro: str, accel: str) -> str:
    """Return the reason why no check is possible, or an empty string."""
    for name, kind in ((gyro, "rate"), (accel, "acceleration")):
        if name not in recording:
            return f"there is no {name}"
        log = recording[name]
        if log.channels != 3:
            return f"{name} has {log.channels} axes, not three"
        if log.rate < _MIN_RATE_HZ:
            return f"{name} has {log.rate:.3g} Hz, less than {_MIN_RATE_HZ:g} Hz"
        if kind == "rate" and (log.unit not in UNITS or UNITS[log.unit].kind != kind):
            return f"the unit of {name} is not known"
    start, stop = _common_span(recording[gyro], recording[accel])
    if stop - start < _MIN_DURATION_S:
        return f"the recording is shorter than {_MIN_DURATION_S:g} s"
    return ""


def _common_span(*logs: Log) -> tuple[float, float]:
    return max(float(log.sampled[0]) for log in logs), min(float(log.sampled[-1]) for log in logs)


@dataclass(frozen=True, eq=False)
class _Ticks:
    """Means of the sensors over ticks: rates in rad/s, force and field over their median size."""

    start: float
    rates: Floats
    forces: Floats
    fields: Floats | None

    @classmethod
    def of(cls, gyro: Log, accel: Log, mag: Log | None) -> _Ticks:
        start, stop = _common_span(gyro, accel)
        count = int((stop - start) / _TICK_S)

        def ticked(log: Log) -> Floats:
            return check_ticks(log.sampled, log.data, start, count)

        rates = convert(ticked(gyro), gyro.unit, "rad/s")
        has_field = mag is not None and mag.channels == 3 and mag.rate >= _MIN_RATE_HZ
        fields = _normalise(ticked(mag)) if mag is not None and has_field else None
        return cls(start, rates, _normalise(ticked(accel)), fields)

    def spans(
        self, starts: Counts, length: int, where: Booleans
    ) -> tuple[tuple[float, float], ...]:
        """Return the time spans of windows, overlapping ones merged."""
        spans: list[tuple[float, float]] = []
        for first in starts[where].tolist():
            begin, end = self.start + first * _TICK_S, self.start + (first + length) * _TICK_S
            if spans and begin <= spans[-1][1]:
                begin = spans.pop()[0]
            spans.append((round(begin, 6), round(end, 6)))
        return tuple(spans)


def _median_size(vectors: Floats) -> float:
    """Return the median length of vectors, 0 without vectors."""
    with np.errstate(over="ignore"):
        sizes = np.linalg.norm(vectors, axis=1)
    finite = sizes[np.isfinite(sizes)]
    return float(np.median(finite)) if finite.size else 0.0


def _normalise(vectors: Floats) -> Floats:
    size = _median_size(vectors)
    # Vectors without a median size show nothing.
    return vectors / size if size > 0.0 else np.full_like(vectors, np.nan)


@dataclass(frozen=True, eq=False)
class _GyroCheck:
    finding: Finding
    starts: Counts
    length: int
    bias: Floats
    unit: float
    sense: Floats


def _check_gyro(ticks: _Ticks, gyro: Log, name: str) -> _GyroCheck:
    costs, null, biases, starts, length = check_gyro(ticks.rates, ticks.forces)

    def refitted() -> Floats:
        args = (ticks.rates, ticks.forces, starts, length, biases[0, 0])
        refitted_result = check_fit(*args, fits=False)[0]
        # If nothing fits, raise no alarm.
        return refitted_result if refitted_result.size else np.zeros(len(starts))

    decision = decide(Costs(costs, null, _COST_FLOOR), refit=refitted)
    spans = ticks.spans(starts, length, decision.decisive)
    finding = _gyro_finding(decision, gyro, name, spans)
    sense = decision.likely if decision.status == "mistake" else 0
    bias = biases[decision.unit, sense]
    return _GyroCheck(finding, starts, length, bias, _UNIT_FACTORS[decision.unit], SENSES[sense])


def _gyro_finding(
    decision: Decision, gyro: Log, name: str, spans: tuple[tuple[float, float], ...]
) -> Finding:
    unit, factor = _resolve_unit(gyro.unit, decision.unit)
    is_unique = len(decision.remaining) == 1 and not decision.other_units
    is_partial = len(decision.remaining) < len(SENSES)
    texts = {
        "agrees": "only the gyro's stated unit and axes fit the accelerometer",
        "partly seen": "the gyro fits the accelerometer; the motion does not confirm all axes",
        "cannot tell": "the motion does not show the gyro's unit and axes",
        "doubt": "the gyro does not fit the accelerometer well; no other unit or axes clearly fit",
        "unit only": describe_unit("gyro", gyro.unit, unit, factor),
        "mistake": _describe_mistake(decision, gyro.unit, unit, factor),
    }
    is_mistake = decision.status == "mistake"
    return Finding(
        name,
        decision.status,
        texts[decision.status],
        unit,
        factor,
        SENSES[decision.remaining[0]] if is_mistake and is_unique else None,
        format_sense(SENSES[decision.likely]) if is_mistake else "",
        format_senses(decision.remaining) if is_partial else (),
        shared_rows(decision.remaining),
        spans,
        decision.ratio,
    )


def _resolve_unit(stated_unit: str, unit: int) -> tuple[str, float]:
    """Return the unit of the values, and the factor into that unit."""
    other = {("rad/s", 1): "deg/s", ("deg/s", 2): "rad/s"}.get((stated_unit, unit))
    return (other, 1.0) if other else (stated_unit, _UNIT_FACTORS[unit])


def _describe_mistake(decision: Decision, stated_unit: str, unit: str, factor: float) -> str:
    sense = SENSES[decision.likely]
    parts = [] if decision.unit == 0 else [describe_unit("gyro", stated_unit, unit, factor)]
    if count_mistakes(sense) > 0:
        axes = describe_axes("gyro", "accelerometer", sense)
        is_unique = len(decision.remaining) == 1 and not decision.other_units
        parts.append(axes if is_unique else _describe_likely(decision, axes))
        if np.linalg.det(sense) > 0.0 and is_unique:
            parts[-1] += f", {describe_accel_axes(min(sense.T, -sense.T, key=count_mistakes))}"
    return ", and ".join(parts)


def _describe_likely(decision: Decision, axes: str) -> str:
    others = [f"({sense})" for sense in format_senses(decision.remaining)[1:4]]
    if decision.other_units:
        others.append("some in another unit")
    return f"{axes}; the likeliest of several that fit; others are {', '.join(others)}"


def _is_consistent(finding: Finding) -> bool:
    return finding.status in ("agrees", "partly seen")


def _unknown_scale() -> tuple[Scale, Coefficient]:
    return (UNKNOWN_COEFFICIENT, UNKNOWN_COEFFICIENT, UNKNOWN_COEFFICIENT), UNKNOWN_COEFFICIENT


def _estimate_scale(ticks: _Ticks, gyro_check: _GyroCheck) -> tuple[Scale, Coefficient]:
    """Return the scale and delay of a gyro with correct axes, from its motion."""
    _, numbers, sigmas = check_fit(
        ticks.rates, ticks.forces, gyro_check.starts, gyro_check.length, gyro_check.bias, fits=True
    )
    x, y, z = (
        _make_coefficient(1.0 + numbers[index], sigmas[index], _MAX_SCALE_SIGMA)
        for index in (3, 7, 11)
    )
    return (x, y, z), _make_coefficient(numbers[12], sigmas[12], _MAX_DELAY_SIGMA_S)


def _make_coefficient(value: float, sigma: float, limit: float) -> Coefficient:
    return Coefficient(float(value), float(sigma)) if sigma < limit else UNKNOWN_COEFFICIENT


def _no_field_finding(recording: Recording, mag: str, reason: str) -> Finding:
    if mag not in recording:
        return Finding("", "cannot tell", "there is no magnetometer")
    return Finding(mag, "cannot tell", reason, recording[mag].unit)


def _check_field(ticks: _Ticks, gyro_check: _GyroCheck, recording: Recording, mag: str) -> Finding:
    """Return the finding on the magnetometer, from the gyro or the corrected gyro."""
    if ticks.fields is None:
        return _no_field_finding(
            recording, mag, f"{mag} does not have three axes at {_MIN_RATE_HZ:g} Hz or more"
        )
    gyro = gyro_check.finding
    if gyro.alarm and gyro.matrix is None:
        return _no_field_finding(recording, mag, "the gyro's axes are not known")
    rates = (gyro_check.unit * ticks.rates - gyro_check.bias) @ gyro_check.sense.T
    costs, null, starts, length = check_field(rates, ticks.fields)
    # The senses turn the gyro's axes into the magnetometer's.
    costs = costs[INVERSES[:_ROTATION_COUNT]]
    decision = decide(Costs(costs[np.newaxis], null, _FIELD_COST_FLOOR))
    spans = ticks.spans(starts, length, decision.decisive)
    return _field_finding(
        decision, recording[mag].unit, mag, spans, axes_known=_has_known_axes(gyro)
    )


def _has_known_axes(gyro: Finding) -> bool:
    """Return True if the axes of the gyro, or of the corrected gyro, are known."""
    return gyro.status == "agrees" or gyro.matrix is not None


def _field_finding(
    decision: Decision,
    unit: str,
    name: str,
    spans: tuple[tuple[float, float], ...],
    *,
    axes_known: bool,
) -> Finding:
    # No motion distinguishes a sense from its negative.
    both = np.concatenate([decision.remaining, decision.remaining + _ROTATION_COUNT])
    both = both[both < len(SENSES)]
    likely = min(both.tolist(), key=lambda place: (count_mistakes(SENSES[place]), place))
    axes = describe_axes("magnetometer", "gyro", SENSES[likely])
    fits = "the magnetometer's axes fit the gyro's"
    texts = {
        "agrees": f"{fits}, and no others do, except with all signs reversed",
        "partly seen": f"{fits}; the motion does not confirm all axes",
        "cannot tell": "the motion does not show the magnetometer's axes",
        "doubt": "the magnetometer does not fit the gyro well; no other axes clearly fit",
        "mistake": axes
        if axes_known
        else f"magnetometer and gyro disagree: {axes}, or the reverse",
    }
    is_mistake, is_partial = decision.status == "mistake", len(decision.remaining) < _ROTATION_COUNT
    return Finding(
        name,
        decision.status,
        texts[decision.status],
        unit,
        likely=format_sense(SENSES[likely]) if is_mistake else "",
        alternatives=format_senses(both) if is_partial else (),
        spans=spans,
        ratio=decision.ratio,
    )


def _median_dip(ticks: _Ticks) -> float | None:
    """Return the median angle of the field below the horizontal; the force at rest points up."""
    assert ticks.fields is not None
    sizes = np.linalg.norm(ticks.forces, axis=1) * np.linalg.norm(ticks.fields, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        sines = -(ticks.forces * ticks.fields).sum(axis=1) / sizes
    finite = sines[np.isfinite(sines)]
    return float(np.arcsin(np.median(finite).clip(-1.0, 1.0))) if finite.size else None


_USUAL_SIZES: Final = {
    "accel": {"m/s^2": (8.5, 11.0), "g": (0.85, 1.12)},
    "mag": {"uT": (20.0, 70.0), "gauss": (0.2, 0.7), "mG": (200.0, 700.0), "nT": (2e4, 7e4)},
}
"""Usual median size of an accelerometer's and a magnetometer's values, by unit."""


def _describe_clock(gyro: Log) -> str:
    """Return a sentence if stamps contradict a rate: an error of 1 % is 1 % of every rotation."""
    report = gyro.meta.get("clock")
    if not isinstance(report, ClockReport) or not report.stamped:
        return ""
    effect = describe_rate_error(gyro.rate, report.rate)
    if not effect:
        return ""
    text = f"the gyro's rate is stated as {gyro.rate:g} Hz, its stamps run at {report.rate:g}"
    return f"{text}: {effect}"


def _describe_sizes(recording: Recording, accel: str, mag: str) -> Iterator[str]:
    """Yield a sentence on each sensor with values of the size of another unit."""
    for name, kind in ((accel, "accel"), (mag, "mag")):
        log, known = recording.get(name), _USUAL_SIZES[kind]
        if log is None or log.channels != 3 or log.unit not in known:
            continue
        size = _median_size(log.data[:: max(log.n // 20_000, 1)])
        fits = [unit for unit, (low, high) in known.items() if low <= size <= high]
        if fits and log.unit not in fits:
            yield (
                f"{', '.join(log.names)}: {size:.3g} {log.unit} in the median, a usual size in "
                f"{fits[0]}"
            )
