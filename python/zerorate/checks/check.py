"""The check of a recording: its sensors on common ticks, judged against each other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate._native import check_field, check_fit, check_gyro, check_ticks
from zerorate.checks.decision import Costs, Decision, decide
from zerorate.checks.result import Checks, Finding
from zerorate.checks.senses import INVERSES, SENSES, changes, listed, shared_rows, typed
from zerorate.checks.sentences import mistaken, on_axes, on_unit
from zerorate.noise.coefficient import NOTHING_KNOWN, Coefficient
from zerorate.record import Log, Recording
from zerorate.record.clock import ClockReport, on_rate
from zerorate.record.samples import partner
from zerorate.types import Booleans, Floats
from zerorate.units import UNITS, convert

_TICK: Final = 0.02
_LEAST: Final = 20.0
"""Seconds without which nothing is told."""
_SLOWEST: Final = 10.0
"""Hz of a sensor whose samples follow a motion."""
_FLOOR, _FIELD_FLOOR = 0.01, 0.05
_UNITS: Final = (1.0, math.pi / 180.0, 180.0 / math.pi)
_SCALE_KNOWN, _DELAY_KNOWN = 0.03, 0.015
_ROTATIONS: Final = 24

Counts = npt.NDArray[np.uint64]
Scale = tuple[Coefficient, Coefficient, Coefficient]


def check(
    recording: Recording, *, gyro: str = "gyro", accel: str | None = None, scale: bool = True
) -> Checks:
    """Return what motion shows of the units, signs and axes of a recording's sensors.

    The gyro carries the accelerometer's force through the motion: if its unit and its axes are
    right, and no other, gravity is constant there. So it is with a magnetometer's field. What
    motion cannot show is left open, and nothing is corrected.

    Parameters
    ----------
    recording : Recording
        With a gyro and an accelerometer of three axes, of 10 Hz or more, and maybe a magnetometer.
    gyro, accel : str
        Which of several sensors: ``"gyro_1"`` and so on; default the first, and the accelerometer
        of its device.
    scale : bool
        Whether to look for scale errors and a delay of the gyro, too, where it fits. Default yes.

    Returns
    -------
    Checks
        What was found of gyro and magnetometer; ``table()`` shows it, ``apply(recording)`` puts
        right what is exact.

    Examples
    --------
    >>> import zerorate as zr
    >>> recording = zr.simulate_motion("hand", duration=60.0).recording()
    >>> wrong = zr.Log(**{**vars(recording.gyro), "data": recording.gyro.data * [1, -1, 1]})
    >>> print(zr.check(zr.Recording({**recording, "gyro": wrong})).gyro.text)
    the gyro's y axis has the sign other than the accelerometer's
    """
    accel = accel or partner(recording, gyro, "accel")
    mag = partner(recording, gyro, "mag")
    notes = tuple(_on_sizes(recording, accel, mag))
    clock = _on_clock(recording[gyro]) if gyro in recording else ""
    known = {"source": recording.source, "notes": notes, "clock": clock}
    if reason := _reason(recording, gyro, accel):
        silent = Finding(gyro if gyro in recording else "", "cannot tell", reason)
        return Checks(silent, _no_field(recording, mag, reason), *_no_scale(), None, **known)  # type: ignore[arg-type]
    ticks = _Ticks.of(recording[gyro], recording[accel], recording.get(mag))
    judged = _judged(ticks, recording[gyro], gyro)
    fitted = _scale(ticks, judged) if scale and _fits(judged.finding) else _no_scale()
    field = _field(ticks, judged, recording, mag)
    dip = None if ticks.fields is None else _dip(ticks)
    return Checks(judged.finding, field, *fitted, dip, **known)  # type: ignore[arg-type]


def _reason(recording: Recording, gyro: str, accel: str) -> str:
    """Return why nothing can be told, if so."""
    for name, kind in ((gyro, "rate"), (accel, "acceleration")):
        if name not in recording:
            return f"there is no {name}"
        log = recording[name]
        if log.channels != 3:
            return f"{name} has {log.channels} axes, not three"
        if log.rate < _SLOWEST:
            return f"{name} has {log.rate:.3g} Hz, less than {_SLOWEST:g} Hz"
        if kind == "rate" and (log.unit not in UNITS or UNITS[log.unit].kind != kind):
            return f"the unit of {name} is not known"
    start, stop = _common(recording[gyro], recording[accel])
    if stop - start < _LEAST:
        return f"the recording is shorter than {_LEAST:g} s"
    return ""


def _common(*logs: Log) -> tuple[float, float]:
    return max(float(log.sampled[0]) for log in logs), min(float(log.sampled[-1]) for log in logs)


@dataclass(frozen=True, eq=False)
class _Ticks:
    """Means of the sensors over ticks: rad/s, and by their median size."""

    start: float
    rates: Floats
    forces: Floats
    fields: Floats | None

    @classmethod
    def of(cls, gyro: Log, accel: Log, mag: Log | None) -> _Ticks:
        start, stop = _common(gyro, accel)
        count = int((stop - start) / _TICK)

        def ticked(log: Log) -> Floats:
            return check_ticks(log.sampled, log.data, start, count)

        rates = convert(ticked(gyro), gyro.unit, "rad/s")
        has_field = mag is not None and mag.channels == 3 and mag.rate >= _SLOWEST
        fields = _sized(ticked(mag)) if mag is not None and has_field else None
        return cls(start, rates, _sized(ticked(accel)), fields)

    def spans(
        self, starts: Counts, length: int, where: Booleans
    ) -> tuple[tuple[float, float], ...]:
        """Return the seconds of windows, those that overlap as one."""
        found: list[tuple[float, float]] = []
        for first in starts[where].tolist():
            begin, end = self.start + first * _TICK, self.start + (first + length) * _TICK
            if found and begin <= found[-1][1]:
                begin = found.pop()[0]
            found.append((round(begin, 6), round(end, 6)))
        return tuple(found)


def _median_size(vectors: Floats) -> float:
    """Return the median length of vectors, 0 where there is none."""
    with np.errstate(over="ignore"):
        sizes = np.linalg.norm(vectors, axis=1)
    there = sizes[np.isfinite(sizes)]
    return float(np.median(there)) if there.size else 0.0


def _sized(vectors: Floats) -> Floats:
    size = _median_size(vectors)
    # Without a size there is nothing to see.
    return vectors / size if size > 0.0 else np.full_like(vectors, np.nan)


@dataclass(frozen=True, eq=False)
class _Judged:
    finding: Finding
    starts: Counts
    length: int
    bias: Floats
    unit: float
    sense: Floats


def _judged(ticks: _Ticks, gyro: Log, name: str) -> _Judged:
    costs, null, biases, starts, length = check_gyro(ticks.rates, ticks.forces)

    def refitted() -> Floats:
        args = (ticks.rates, ticks.forces, starts, length, biases[0, 0])
        found = check_fit(*args, fits=False)[0]
        # Numbers so wild that nothing fits are no ground for an alarm.
        return found if found.size else np.zeros(len(starts))

    decision = decide(Costs(costs, null, _FLOOR), refitted=refitted)
    spans = ticks.spans(starts, length, decision.telling)
    finding = _gyro_finding(decision, gyro, name, spans)
    sense = decision.likely if decision.status == "mistake" else 0
    bias = biases[decision.unit, sense]
    return _Judged(finding, starts, length, bias, _UNITS[decision.unit], SENSES[sense])


def _gyro_finding(
    decision: Decision, gyro: Log, name: str, spans: tuple[tuple[float, float], ...]
) -> Finding:
    unit, factor = _in_unit(gyro.unit, decision.unit)
    alone = len(decision.left) == 1 and not decision.others
    some = len(decision.left) < len(SENSES)
    said = {
        "agrees": "the gyro's unit and axes fit the accelerometer, and nothing else does",
        "partly seen": "the gyro fits the accelerometer; the motion shows not all of its axes",
        "cannot tell": "the motion does not show the gyro's unit and axes",
        "doubt": "the gyro does not fit the accelerometer well, nor does anything else for sure",
        "unit only": on_unit("gyro", gyro.unit, unit, factor),
        "mistake": _on_mistake(decision, gyro.unit, unit, factor),
    }
    named = decision.status == "mistake"
    return Finding(
        name,
        decision.status,
        said[decision.status],
        unit,
        factor,
        SENSES[decision.left[0]] if named and alone else None,
        typed(SENSES[decision.likely]) if named else "",
        listed(decision.left) if some else (),
        shared_rows(decision.left),
        spans,
        decision.ratio,
    )


def _in_unit(named: str, unit: int) -> tuple[str, float]:
    """Return the unit in which values are, and what makes them so."""
    other = {("rad/s", 1): "deg/s", ("deg/s", 2): "rad/s"}.get((named, unit))
    return (other, 1.0) if other else (named, _UNITS[unit])


def _on_mistake(decision: Decision, named: str, unit: str, factor: float) -> str:
    sense = SENSES[decision.likely]
    parts = [] if decision.unit == 0 else [on_unit("gyro", named, unit, factor)]
    if changes(sense) > 0:
        axes = on_axes("gyro", "accelerometer", sense)
        alone = len(decision.left) == 1 and not decision.others
        parts.append(axes if alone else _on_likely(decision, axes))
        if np.linalg.det(sense) > 0.0 and alone:
            parts[-1] += (
                f", {mistaken(-sense.T if changes(-sense.T) < changes(sense) else sense.T)}"
            )
    return ", and ".join(parts)


def _on_likely(decision: Decision, axes: str) -> str:
    others = [f"({one})" for one in listed(decision.left)[1:4]]
    if decision.others:
        others.append("some in another unit")
    return f"{axes}; that is the likeliest of several that fit, beside {', '.join(others)}"


def _fits(finding: Finding) -> bool:
    return finding.status in ("agrees", "partly seen")


def _no_scale() -> tuple[Scale, Coefficient]:
    return (NOTHING_KNOWN, NOTHING_KNOWN, NOTHING_KNOWN), NOTHING_KNOWN


def _scale(ticks: _Ticks, judged: _Judged) -> tuple[Scale, Coefficient]:
    """Return what the motion shows of scale and delay of a gyro that fits."""
    _, numbers, sigmas = check_fit(
        ticks.rates, ticks.forces, judged.starts, judged.length, judged.bias, fits=True
    )
    x, y, z = (_known(1.0 + numbers[place], sigmas[place], _SCALE_KNOWN) for place in (3, 7, 11))
    return (x, y, z), _known(numbers[12], sigmas[12], _DELAY_KNOWN)


def _known(value: float, sigma: float, limit: float) -> Coefficient:
    return Coefficient(float(value), float(sigma)) if sigma < limit else NOTHING_KNOWN


def _no_field(recording: Recording, mag: str, reason: str) -> Finding:
    if mag not in recording:
        return Finding("", "cannot tell", "there is no magnetometer")
    return Finding(mag, "cannot tell", reason, recording[mag].unit)


def _field(ticks: _Ticks, judged: _Judged, recording: Recording, mag: str) -> Finding:
    """Return what the gyro, as it is or put right, shows of the magnetometer."""
    if ticks.fields is None:
        return _no_field(recording, mag, f"{mag} has not three axes, or less than {_SLOWEST:g} Hz")
    gyro = judged.finding
    if gyro.alarm and gyro.matrix is None:
        return _no_field(recording, mag, "which way the gyro turns is not known")
    rates = (judged.unit * ticks.rates - judged.bias) @ judged.sense.T
    costs, null, starts, length = check_field(rates, ticks.fields)
    # They are of what turns the gyro's axes into the magnetometer's.
    costs = costs[INVERSES[:_ROTATIONS]]
    decision = decide(Costs(costs[np.newaxis], null, _FIELD_FLOOR))
    spans = ticks.spans(starts, length, decision.telling)
    return _field_finding(decision, recording[mag].unit, mag, spans, alone=_fits_alone(gyro))


def _fits_alone(gyro: Finding) -> bool:
    """Whether the axes of a gyro, as it is or put right, are known."""
    return gyro.status == "agrees" or gyro.matrix is not None


def _field_finding(
    decision: Decision,
    unit: str,
    name: str,
    spans: tuple[tuple[float, float], ...],
    *,
    alone: bool,
) -> Finding:
    # No motion tells a sense from its negative.
    both = np.concatenate([decision.left, decision.left + _ROTATIONS])
    both = both[both < len(SENSES)]
    likely = min(both.tolist(), key=lambda place: (changes(SENSES[place]), place))
    axes = on_axes("magnetometer", "gyro", SENSES[likely])
    fits = "the magnetometer's axes fit the gyro's"
    said = {
        "agrees": f"{fits}, and nothing else does, but for the sign of all",
        "partly seen": f"{fits}; the motion shows not all of them",
        "cannot tell": "the motion does not show the magnetometer's axes",
        "doubt": "the magnetometer does not fit the gyro well, nor do other axes for sure",
        "mistake": axes if alone else f"magnetometer and gyro disagree: {axes}, or the reverse",
    }
    named, some = decision.status == "mistake", len(decision.left) < _ROTATIONS
    return Finding(
        name,
        decision.status,
        said[decision.status],
        unit,
        likely=typed(SENSES[likely]) if named else "",
        alternatives=listed(both) if some else (),
        spans=spans,
        ratio=decision.ratio,
    )


def _dip(ticks: _Ticks) -> float | None:
    """Return the median angle by which the field points down: the force at rest points up."""
    assert ticks.fields is not None
    sizes = np.linalg.norm(ticks.forces, axis=1) * np.linalg.norm(ticks.fields, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        sines = -(ticks.forces * ticks.fields).sum(axis=1) / sizes
    there = sines[np.isfinite(sines)]
    return float(np.arcsin(np.median(there).clip(-1.0, 1.0))) if there.size else None


_SIZES: Final = {
    "accel": {"m/s^2": (8.5, 11.0), "g": (0.85, 1.12)},
    "mag": {"uT": (20.0, 70.0), "gauss": (0.2, 0.7), "mG": (200.0, 700.0), "nT": (2e4, 7e4)},
}
"""Median size of what an accelerometer and a magnetometer show, by unit."""


def _on_clock(gyro: Log) -> str:
    """Return a sentence where stamps contradict a rate: 1 % of it is 1 % of every turn."""
    report = gyro.meta.get("clock")
    if not isinstance(report, ClockReport) or not report.stamped:
        return ""
    turned = on_rate(gyro.rate, report.rate)
    if not turned:
        return ""
    told = f"the gyro's rate is stated as {gyro.rate:g} Hz, its stamps run at {report.rate:g}"
    return f"{told}: {turned}"


def _on_sizes(recording: Recording, accel: str, mag: str) -> Iterator[str]:
    """Yield a sentence on each sensor whose size is that of another unit than the one named."""
    for name, kind in ((accel, "accel"), (mag, "mag")):
        log, known = recording.get(name), _SIZES[kind]
        if log is None or log.channels != 3 or log.unit not in known:
            continue
        size = _median_size(log.data[:: max(log.n // 20_000, 1)])
        fits = [unit for unit, (low, high) in known.items() if low <= size <= high]
        if fits and log.unit not in fits:
            yield (
                f"{', '.join(log.names)}: {size:.3g} {log.unit} in the middle is the size of "
                f"{fits[0]}"
            )
