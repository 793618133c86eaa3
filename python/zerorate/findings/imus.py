"""The IMUs of a recording: their gyro and accelerometer in SI, in blocks of half a second."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final, TypeVar

import numpy as np
import numpy.typing as npt

from zerorate.record.log import Log, LogError
from zerorate.record.recording import Recording
from zerorate.record.runs import runs, runs_of_rows
from zerorate.types import Booleans, Floats, Integers
from zerorate.units import UNITS, convert

Number = TypeVar("Number", np.float64, np.int32)
GRAVITY: Final = 9.80665
BLOCK: Final = 0.5
"""Seconds of a block."""
_SLOWEST: Final = 10.0
"""Hz of a sensor of which blocks tell whether it rests."""
_STILL: Final = 4
"""Blocks of the shortest rest."""
_AXES: Final = 3
_SOME: Final = 100_000
_PRESENT: Final = 0.5
"""Share of a block's samples without which it tells nothing."""


@dataclass(frozen=True, eq=False)
class Blocks:
    """Mean and scatter of a sensor in each block, SI, shape (m, 3), and whether it is there."""

    mean: Floats
    scatter: Floats
    there: Booleans


@dataclass(frozen=True)
class Rest:
    """Blocks from one to before another in which an IMU rests."""

    first: int
    last: int

    @property
    def seconds(self) -> float:
        """Its length."""
        return BLOCK * (self.last - self.first)


@dataclass(frozen=True, eq=False)
class Sensor:
    """A log of three axes, what makes SI of its numbers, and the anchor of its figure."""

    name: str
    log: Log
    factor: float | None
    start: float
    """Seconds that count as the beginning."""

    @property
    def figure(self) -> str:
        """The anchor of its figure."""
        return f"figure-{self.name}"

    def spans(self, rows: Integers, joined: float = 0.0) -> tuple[tuple[float, float], ...]:
        """Return the seconds of some rows, those next to each other as one."""
        pairs = runs_of_rows(rows, max(1, round(joined * self.log.rate))).tolist()
        times, period = self.log.sampled, 1.0 / self.log.rate
        return tuple(
            (
                round(float(times[a]) - self.start, 6),
                round(float(times[b - 1]) - self.start + period, 6),
            )
            for a, b in pairs
        )

    def rows(self, start: float, stop: float) -> slice:
        """Return the rows between two times since the beginning."""
        edges = np.searchsorted(self.log.sampled, np.array([start, stop]) + self.start)
        return slice(int(edges[0]), int(edges[1]))

    @cached_property
    def blocks(self) -> Blocks:
        """The blocks of the whole recording, from its beginning."""
        log, factor = self.log, self.factor or 1.0
        edges = np.arange(0.0, float(log.sampled[-1]) - self.start + BLOCK, BLOCK) + self.start
        cuts = np.searchsorted(log.sampled, edges)
        count = np.diff(cuts)
        mean, scatter = np.full((2, len(count), _AXES), np.nan)
        there = count > 1
        for axis in range(_AXES):
            mean[:, axis], scatter[:, axis], full = _of_axis(log.data[:, axis], cuts)
            there = there & (full > _PRESENT * log.rate * BLOCK) & (full > 1)
        return Blocks(factor * mean, factor * scatter, there)


def _of_axis(column: Floats, cuts: Integers) -> tuple[Floats, Floats, Floats]:
    """Return mean, scatter and number of the samples between cuts."""
    good = np.isfinite(column)
    # A value in their midst, so that squares keep their digits.
    some = column[:: max(1, len(column) // _SOME)]
    some = some[np.isfinite(some)]
    middle = float(np.median(some)) if some.size else 0.0
    values = column - middle
    values[~good] = 0.0
    full = _sums(good.astype(np.int32), cuts).astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        mean = _sums(values, cuts) / full
        square = _sums(np.square(values, out=values), cuts) / full
        scatter = np.sqrt(np.maximum(square - mean**2, 0.0))
    return mean + middle, scatter, full


def _sums(values: npt.NDArray[Number], cuts: Integers) -> npt.NDArray[Number]:
    """Return the sums of values between cuts, 0 of none."""
    padded = np.append(values, values.dtype.type(0))
    sums = np.add.reduceat(padded, np.minimum(cuts[:-1], len(values)))
    return np.asarray(np.where(np.diff(cuts) > 0, sums, 0))


@dataclass(frozen=True, eq=False)
class Imu:
    """A gyro and an accelerometer of one device, of which one may be missing."""

    name: str
    gyro: Sensor | None
    accel: Sensor | None

    @property
    def sensors(self) -> tuple[Sensor, ...]:
        """Those that there are."""
        return tuple(one for one in (self.gyro, self.accel) if one is not None)

    @cached_property
    def still(self) -> Booleans:
        """Whether each block may be one of a rest."""
        gyro, accel = self.gyro, self.accel
        if gyro is None or accel is None or None in (gyro.factor, accel.factor):
            return np.zeros(0, dtype=bool)
        if min(gyro.log.rate, accel.log.rate) < _SLOWEST:
            return np.zeros(0, dtype=bool)
        rates, forces = gyro.blocks, accel.blocks
        count = min(len(rates.there), len(forces.there))
        there = rates.there[:count] & forces.there[:count]
        mean = forces.mean[:count]
        with np.errstate(invalid="ignore", over="ignore"):
            quiet = _quiet(rates.scatter[:count], there, 0.05, 0.008)
            quiet &= _quiet(forces.scatter[:count], there, 0.8, 0.06)
            quiet &= np.abs(np.linalg.norm(mean, axis=1) - GRAVITY) < 1.0
            steps = np.abs(np.diff(mean, axis=0)).max(axis=1, initial=0.0)
        steady = np.append(steps < 0.15, True) & np.append(True, steps < 0.15)
        return np.asarray(quiet & steady & there)

    @cached_property
    def rests(self) -> tuple[Rest, ...]:
        """Its rests of two seconds and more."""
        return tuple(Rest(a, b) for a, b in runs(self.still).tolist() if b - a >= _STILL)


def _quiet(scatter: Floats, there: Booleans, most: float, least: float) -> Booleans:
    """Return whether blocks scatter as little as the quietest twentieth of them, about."""
    worst = scatter.max(axis=1)
    known = worst[there & np.isfinite(worst)]
    floor = float(np.quantile(known, 0.05)) if known.size else 0.0
    return np.asarray(worst < max(min(3.0 * floor, most), least))


def part(log: Log, begin: float, end: float) -> Log:
    """Return the samples of a log between two times of its clock; LogError where there are none."""
    low, high = np.searchsorted(log.sampled, [begin, end]).tolist()
    if high - low < 2:
        raise LogError(f"{', '.join(log.names)}: no samples from {begin:.6g} to {end:.6g} s")
    return log.part(slice(low, high))


def beginning(recording: Recording) -> float:
    """Return the earliest time of all logs, s."""
    return min(float(log.sampled[0]) for log in recording.values())


def imus(recording: Recording) -> tuple[Imu, ...]:
    """Return the IMUs of a recording, those with both sensors of one name and number."""
    start = beginning(recording)
    numbers = dict.fromkeys(_numbers(recording))
    found = []
    for number in numbers:
        gyro = _sensor(recording, f"gyro{number}", "rad/s", start)
        accel = _sensor(recording, f"accel{number}", "m/s^2", start)
        if gyro is not None or accel is not None:
            found.append(Imu(f"IMU {number.removeprefix('_') or '0'}", gyro, accel))
    return tuple(found)


def _numbers(recording: Recording) -> Iterator[str]:
    for name in recording:
        kind, _, number = name.partition("_")
        if kind in ("gyro", "accel") and (not number or number.isdigit()):
            yield f"_{number}" if number else ""


def _sensor(recording: Recording, name: str, unit: str, start: float) -> Sensor | None:
    log = recording.get(name)
    if log is None or log.channels != _AXES:
        return None
    if np.isinf(log.data).any():
        log = log.with_data(np.where(np.isinf(log.data), np.nan, log.data))
    known = log.unit in UNITS and UNITS[log.unit].kind == UNITS[unit].kind
    return Sensor(name, log, float(convert(1.0, log.unit, unit)) if known else None, start)
