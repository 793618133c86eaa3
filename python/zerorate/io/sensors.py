"""Sensors among the columns of a table: candidates from names, scores, and choice."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

from zerorate.faults import keyword_argument, make_sentence
from zerorate.record.devices import missing_device
from zerorate.record.log import LogError
from zerorate.record.names import UNKNOWN_UNIT, meaning_of
from zerorate.record.words import ROLES, STAGES, ParsedName, words_of

ALL_SENSORS: Final = "all"
IMU_KINDS: Final = ("gyro", "accel", "mag")
_AXES: Final = 3
_MAX_LISTED: Final = 8


class Sensor(NamedTuple):
    """Column indices of a sensor, in the order x, y, z whatever the order in the file.

    ``has_named_axes`` is True if the names show the axes. A sensor may have fewer than three
    columns, or more if its names have only numbers. Values times ``factor`` (None: 1) are in
    ``unit``.
    """

    kind: str
    indices: tuple[int, ...]
    stem: str = ""
    stage: str = ""
    device: str = ""
    has_named_axes: bool = True
    unit: str = UNKNOWN_UNIT
    factor: float | None = None

    @property
    def is_complete(self) -> bool:
        """True if there are three axes."""
        return len(self.indices) == _AXES

    @property
    def score(self) -> tuple[bool, int, int]:
        """Score for sorting: three axes, stage, number; the smallest is the best."""
        stage = self.stage if self.stage in STAGES else ""
        numbers = [int(word) for word in self.device.split("_") if word.isdigit()]
        return not self.is_complete, STAGES.index(stage), numbers[-1] if numbers else -1

    def matches(self, wanted: Sequence[str]) -> bool:
        """Return True if the words match this sensor's device, stage or column names."""
        own = self.stem.split("_")
        return all(word in own or ROLES.get(word) == self.stage for word in wanted)

    def label(self, name: str) -> str:
        """Return the device as in a column's name: ``imu2`` of ``imu2_gyro_x``.

        If the device is a number, the result is the sensor's name, such as ``gyro2``. Empty without
        a device.
        """
        if not self.device:
            return ""
        is_number = self.device.replace("_", "").isdigit()
        words = (self.stem if is_number else self.device).split("_")
        found = re.search(r"[\W_]*".join(map(re.escape, words)), name, re.IGNORECASE)
        return "_".join(words) if found is None else found[0]


def find_sensors(names: Mapping[int, str]) -> list[Sensor]:
    """Return the sensors by the columns' names, in the order of the file."""
    groups: dict[tuple[str, str, bool], list[tuple[int, ParsedName]]] = {}
    others: dict[tuple[str, str], list[int]] = {}
    for index, meaning in ((index, meaning_of(name)) for index, name in names.items()):
        if meaning is None:
            continue
        if (words := meaning.words) is None:
            others.setdefault((meaning.kind, meaning.sensor), []).append(index)
            continue
        # Columns of one sensor have names that differ only in axis or number.
        key = (meaning.kind, words.stem, words.axis is None)
        groups.setdefault(key, []).append((index, words))
    sensors = [s for (kind, _, _), own in groups.items() for s in _split_copies(kind, own)]
    sensors = _merge_named_apart(sensors)
    angular = any(ROLES.get(word) == "angular" for s in sensors for word in s.stem.split("_"))
    # In a ROS message, linear acceleration includes gravity. Such a message has an angular
    # velocity; phones have a gyro instead.
    plain = any(s.kind == "accel" and s.stage != "linear" for s in sensors)
    found = [s for s in sensors if s.stage != "linear" or (angular and not plain)]
    found += [Sensor(kind, tuple(own), stem) for (kind, stem), own in others.items()]
    return sorted(found, key=lambda sensor: min(sensor.indices))


def _split_copies(kind: str, group: Sequence[tuple[int, ParsedName]]) -> Iterator[Sensor]:
    """Yield the sensor of a group of columns; repeated names give a second, third, ... sensor."""
    axes: dict[int | None, list[tuple[int, ParsedName]]] = {}
    for index, words in group:
        axis = words.number if words.axis is None else words.axis
        axes.setdefault(axis, []).append((index, words))
    order = sorted(axes, key=lambda axis: -1 if axis is None else axis)
    has_named_axes = group[0][1].axis is not None or order in ([0], [0, 1], [0, 1, 2])
    for copy in range(max(map(len, axes.values()))):
        part = [axes[axis][copy] for axis in order if copy < len(axes[axis])]
        words = part[0][1]
        device = f"{words.device}_{copy + 1}".lstrip("_") if copy else words.device
        stem = f"{words.stem}_{copy + 1}" if copy else words.stem
        indices = tuple(index for index, _ in part)
        yield Sensor(kind, indices, stem, words.stage, device, has_named_axes)


def _merge_named_apart(sensors: list[Sensor]) -> list[Sensor]:
    """Return the sensors with three single columns of one kind merged into one sensor."""
    for kind in IMU_KINDS:
        own = [sensor for sensor in sensors if sensor.kind == kind]
        indices = sorted(index for sensor in own for index in sensor.indices)
        if len(own) == len(indices) == _AXES and not any(s.has_named_axes for s in own):
            merged = own[0]._replace(indices=tuple(indices), device="")
            sensors = [sensor for sensor in sensors if sensor.kind != kind] + [merged]
    return sensors


def keep_best_stage(sensors: Sequence[Sensor]) -> tuple[list[Sensor], list[Sensor]]:
    """Return the best stage of each device, in the order of `STAGES`, and the other stages."""
    best: dict[tuple[str, str], int] = {}
    for one in sensors:
        key, rank = (one.kind, one.device), one.score[1]
        best[key] = min(best.get(key, rank), rank)
    kept = [one for one in sensors if one.score[1] == best[one.kind, one.device]]
    return kept, [one for one in sensors if one not in kept]


def choose_sensors(sensors: Sequence[Sensor], wanted: str | None) -> list[Sensor]:
    """Return the selected sensor of a kind; for ``"all"``, one sensor per device.

    If several sensors have this name, these properties decide in turn: three axes, the best stage,
    the lowest number, the first position in the file. ``"all"`` selects the best stage of every
    device.

    Raises
    ------
    LogError
        If no sensor has this name.
    """
    if wanted == ALL_SENSORS:
        return keep_best_stage(sensors)[0]
    pool = select_sensors(sensors, wanted)
    return [min(pool, key=lambda sensor: sensor.score)] if pool else []


def select_sensors(sensors: Sequence[Sensor], wanted: str | None) -> list[Sensor]:
    """Return the sensors that a name matches, or all for None; LogError without a match."""
    if wanted is None or wanted == ALL_SENSORS or not sensors:
        return list(sensors)
    words = words_of(wanted)
    pool = [sensor for sensor in sensors if words and sensor.matches(words)]
    if not pool:
        raise missing_device(wanted, [list_stems(sensors)])
    return pool


def list_devices(sensors: Sequence[Sensor], names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the devices, spelled as in the columns' names.

    Only sensors with three axes count. Stages of a device count once.
    """
    complete = [sensor for sensor in keep_best_stage(sensors)[0] if sensor.is_complete]
    labels = (sensor.label(names[sensor.indices[0]]) or sensor.stem for sensor in complete)
    return tuple(dict.fromkeys(labels))


def list_stems(sensors: Sequence[Sensor]) -> str:
    """Return the names of sensors as a list in a sentence."""
    stems = list(dict.fromkeys(sensor.stem for sensor in sensors))
    more = [f"... ({len(stems)} in all)"] if len(stems) > _MAX_LISTED else []
    return ", ".join([*stems[:_MAX_LISTED], *more])


def find_sensor_columns(names: Sequence[str], kind: str) -> tuple[int, ...]:
    """Return the columns of the only sensor of a kind; LogError for several devices."""
    own = [one for one in find_sensors(dict(enumerate(names))) if one.kind == kind]
    indices = tuple(index for sensor in choose_sensors(own, None) for index in sensor.indices)
    if len(devices := list_devices(own, names)) > 1:
        raise LogError(
            make_sentence(
                f"there are {len(devices)} IMUs: {', '.join(devices)}; choose one, such as ",
                keyword_argument("columns", ",".join(names[i] for i in indices)),
            ),
            "columns",
        )
    return indices


def find_accelerometer(names: Sequence[str], gyro: Sequence[int]) -> tuple[int, ...]:
    """Return the accelerometer's columns for a gyro: of its device, or else the only ones."""
    sensors = find_sensors(dict(enumerate(names)))
    accels, _ = keep_best_stage([s for s in sensors if s.kind == "accel" and s.is_complete])
    devices = {s.device for s in sensors if s.kind == "gyro" and set(gyro) & set(s.indices)}
    if len(devices) > 1:
        return ()
    same_device = [accel.indices for accel in accels if accel.device in devices]
    only = [accel.indices for accel in accels] if len(accels) == 1 else []
    return next(iter(same_device or only), ())
