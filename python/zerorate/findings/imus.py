"""IMUs of a recording: their gyro and accelerometer in SI, in blocks of half a second."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final, TypeVar

import numpy as np
import numpy.typing as npt

from zerorate.record.devices import sensor_labels
from zerorate.record.log import Log, LogError
from zerorate.record.recording import Recording
from zerorate.record.runs import runs, runs_of_rows
from zerorate.types import Booleans, Floats, Integers
from zerorate.units import UNITS, convert

Number = TypeVar("Number", np.float64, np.int32)
GRAVITY_M_S2: Final = 9.80665
BLOCK_S: Final = 0.5
"""Length of a block, s."""
_MIN_RATE_HZ: Final = 10.0
"""Smallest sampling rate for the test of rest in blocks, Hz."""
_MIN_REST_BLOCKS: Final = 4
"""Number of blocks in the shortest rest."""
_AXES: Final = 3
_MAX_MEDIAN_SAMPLES: Final = 100_000
_MIN_PRESENT_SHARE: Final = 0.5
"""Smallest share of present samples in a used block."""


@dataclass(frozen=True, eq=False)
class Blocks:
    """Mean and scatter of a sensor in each block, SI, shape (m, 3), and a mask of used blocks."""

    mean: Floats
    scatter: Floats
    present: Booleans


@dataclass(frozen=True)
class StaticInterval:
    """Range of blocks (end exclusive) in which an IMU is at rest."""

    first: int
    last: int

    @property
    def seconds(self) -> float:
        """Length of the interval, s."""
        return BLOCK_S * (self.last - self.first)


@dataclass(frozen=True, eq=False)
class Sensor:
    """A log of three axes, its factor to SI, and its name."""

    name: str
    label: str
    log: Log
    factor: float | None
    start: float
    """Time of the sensor's first sample, s."""

    @property
    def figure(self) -> str:
        """Anchor of the sensor's figure."""
        return f"figure-{self.name}"

    def spans(self, rows: Integers, max_gap: float = 0.0) -> tuple[tuple[float, float], ...]:
        """Return the time spans of rows, s; neighbouring rows form one span."""
        pairs = runs_of_rows(rows, max(1, round(max_gap * self.log.rate))).tolist()
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
        edges = np.arange(0.0, float(log.sampled[-1]) - self.start + BLOCK_S, BLOCK_S) + self.start
        cuts = np.searchsorted(log.sampled, edges)
        count = np.diff(cuts)
        mean, scatter = np.full((2, len(count), _AXES), np.nan)
        present = count > 1
        for axis in range(_AXES):
            mean[:, axis], scatter[:, axis], full = _block_statistics(log.data[:, axis], cuts)
            present = present & (full > _MIN_PRESENT_SHARE * log.rate * BLOCK_S) & (full > 1)
        return Blocks(factor * mean, factor * scatter, present)


def _block_statistics(column: Floats, cuts: Integers) -> tuple[Floats, Floats, Floats]:
    """Return mean, scatter and number of the samples between cuts."""
    good = np.isfinite(column)
    # Subtract a typical value, so that squares keep their digits.
    subset = column[:: max(1, len(column) // _MAX_MEDIAN_SAMPLES)]
    subset = subset[np.isfinite(subset)]
    middle = float(np.median(subset)) if subset.size else 0.0
    values = column - middle
    values[~good] = 0.0
    full = _sums(good.astype(np.int32), cuts).astype(np.float64)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        mean = _sums(values, cuts) / full
        square = _sums(np.square(values, out=values), cuts) / full
        scatter = np.sqrt(np.maximum(square - mean**2, 0.0))
    return mean + middle, scatter, full


def _sums(values: npt.NDArray[Number], cuts: Integers) -> npt.NDArray[Number]:
    """Return the sums of values between cuts, 0 for an empty interval."""
    padded = np.append(values, values.dtype.type(0))
    sums = np.add.reduceat(padded, np.minimum(cuts[:-1], len(values)))
    return np.asarray(np.where(np.diff(cuts) > 0, sums, 0))


@dataclass(frozen=True, eq=False)
class Imu:
    """A gyro and an accelerometer of one device; one may be missing."""

    name: str
    gyro: Sensor | None
    accel: Sensor | None

    @property
    def sensors(self) -> tuple[Sensor, ...]:
        """Sensors that exist."""
        return tuple(sensor for sensor in (self.gyro, self.accel) if sensor is not None)

    @cached_property
    def still(self) -> Booleans:
        """Mask of blocks that may belong to a rest."""
        gyro, accel = self.gyro, self.accel
        if gyro is None or accel is None or None in (gyro.factor, accel.factor):
            return np.zeros(0, dtype=bool)
        if min(gyro.log.rate, accel.log.rate) < _MIN_RATE_HZ:
            return np.zeros(0, dtype=bool)
        rates, forces = gyro.blocks, accel.blocks
        count = min(len(rates.present), len(forces.present))
        present = rates.present[:count] & forces.present[:count]
        mean = forces.mean[:count]
        with np.errstate(invalid="ignore", over="ignore"):
            quiet = _is_quiet(rates.scatter[:count], present, 0.05, 0.008)
            quiet &= _is_quiet(forces.scatter[:count], present, 0.8, 0.06)
            quiet &= np.abs(np.linalg.norm(mean, axis=1) - GRAVITY_M_S2) < 1.0
            steps = np.abs(np.diff(mean, axis=0)).max(axis=1, initial=0.0)
        steady = np.append(steps < 0.15, True) & np.append(True, steps < 0.15)
        return np.asarray(quiet & steady & present)

    @cached_property
    def rests(self) -> tuple[StaticInterval, ...]:
        """Static intervals of at least two seconds."""
        return tuple(
            StaticInterval(a, b) for a, b in runs(self.still).tolist() if b - a >= _MIN_REST_BLOCKS
        )


def _is_quiet(
    scatter: Floats, present: Booleans, max_scatter: float, min_scatter: float
) -> Booleans:
    """Return the mask of blocks with a scatter close to the quietest twentieth."""
    worst = scatter.max(axis=1)
    present_scatter = worst[present & np.isfinite(worst)]
    floor = float(np.quantile(present_scatter, 0.05)) if present_scatter.size else 0.0
    return np.asarray(worst < max(min(3.0 * floor, max_scatter), min_scatter))


def cut_log(log: Log, begin: float, end: float) -> Log:
    """Return a log's samples between two times of its clock; LogError if there are none."""
    low, high = np.searchsorted(log.sampled, [begin, end]).tolist()
    if high - low < 2:
        raise LogError(f"{', '.join(log.names)}: no samples from {begin:.6g} to {end:.6g} s")
    return log.part(slice(low, high))


def start_time(recording: Recording) -> float:
    """Return the earliest time of all logs, s."""
    return min(float(log.sampled[0]) for log in recording.values())


def find_imus(recording: Recording) -> tuple[Imu, ...]:
    """Return the IMUs of a recording, pairing sensors with the same name and number."""
    start = start_time(recording)
    numbers = dict.fromkeys(_list_imu_numbers(recording))
    labels = sensor_labels(recording)
    imu_list = []
    for number in numbers:
        gyro = _read_sensor(recording, f"gyro{number}", labels, start)
        accel = _read_sensor(recording, f"accel{number}", labels, start)
        if gyro is not None or accel is not None:
            imu_list.append(Imu(_imu_name(number, gyro, accel), gyro, accel))
    return tuple(imu_list)


def _imu_name(number: str, gyro: Sensor | None, accel: Sensor | None) -> str:
    """Return the device's name from a label such as ``imu2 gyro``, else its number in the file."""
    sensor = gyro or accel
    device = "" if sensor is None else sensor.label.rpartition(" ")[0]
    return device or f"IMU {number.removeprefix('_') or '0'}"


def _list_imu_numbers(recording: Recording) -> Iterator[str]:
    for name in recording:
        kind, _, number = name.partition("_")
        if kind in ("gyro", "accel") and (not number or number.isdigit()):
            yield f"_{number}" if number else ""


def _read_sensor(
    recording: Recording, name: str, labels: Mapping[str, str], start: float
) -> Sensor | None:
    log, unit = recording.get(name), "rad/s" if name.startswith("gyro") else "m/s^2"
    if log is None or log.channels != _AXES:
        return None
    if np.isinf(log.data).any():
        log = log.with_data(np.where(np.isinf(log.data), np.nan, log.data))
    is_convertible = log.unit in UNITS and UNITS[log.unit].kind == UNITS[unit].kind
    factor = float(convert(1.0, log.unit, unit)) if is_convertible else None
    return Sensor(name, labels[name], log, factor, start)
