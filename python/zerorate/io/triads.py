"""Sensors among the columns of a table: axes by their names, and the choice among several."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final, NamedTuple

from zerorate.faults import keyword_argument, make_sentence
from zerorate.record.devices import missing_device
from zerorate.record.log import LogError
from zerorate.record.names import Meaning, meaning_of
from zerorate.record.words import ROLES, STAGES, ParsedName, words_of

ALL_SENSORS: Final = "all"
_AXES: Final = 3
_MAX_LISTED: Final = 8


class Triad(NamedTuple):
    """Columns of one sensor by their indices, in the order x, y, z whatever that of the file.

    ``has_named_axes`` is True if the names show the axes; there are fewer than three where the
    sensor has fewer, and more where names only count.
    """

    kind: str
    indices: tuple[int, ...]
    stem: str
    stage: str
    device: str
    has_named_axes: bool

    @property
    def is_complete(self) -> bool:
        """True if there are three axes."""
        return len(self.indices) == _AXES

    def matches(self, wanted: Sequence[str]) -> bool:
        """Return True if words name this sensor: its device, its stage, or words of its columns."""
        own = self.stem.split("_")
        return all(word in own or ROLES.get(word) == self.stage for word in wanted)


class _Column(NamedTuple):
    position: int
    meaning: Meaning
    words: ParsedName


def find_triads(names: Mapping[int, str]) -> list[Triad]:
    """Return the gyros, accelerometers and magnetometers that columns are of, by their names."""
    columns = [
        _Column(index, meaning, meaning.words)
        for index, meaning in ((index, meaning_of(name)) for index, name in names.items())
        if meaning is not None and meaning.words is not None
    ]
    triads = [triad for group in _group_columns(columns) for triad in _split_triads(group)]
    return [
        triad
        for triad in _order_triads(triads)
        if triad.stage != "linear" or _includes_gravity(triad, triads)
    ]


def _group_columns(columns: Iterable[_Column]) -> list[list[_Column]]:
    """Return columns whose names differ in their axis or number alone."""
    groups: dict[tuple[str, str, bool], list[_Column]] = {}
    for column in columns:
        _, meaning, words = column
        key = (meaning.kind, words.stem, words.axis is None)
        groups.setdefault(key, []).append(column)
    return list(groups.values())


def _split_triads(group: list[_Column]) -> Iterator[Triad]:
    """Yield the sensor of a group of columns, or the first, second, ... of a table that repeats."""
    axes: dict[int | None, list[_Column]] = {}
    for column in group:
        words_of_column = column.words
        axes.setdefault(
            words_of_column.number if words_of_column.axis is None else words_of_column.axis, []
        ).append(column)
    order = sorted(axes, key=lambda axis: -1 if axis is None else axis)
    has_named_axes = group[0].words.axis is not None or order in ([0], [0, 1], [0, 1, 2])
    for copy in range(max(map(len, axes.values()))):
        part = [axes[axis][copy] for axis in order if copy < len(axes[axis])]
        words = part[0].words
        device = f"{words.device}_{copy + 1}".lstrip("_") if copy else words.device
        stem = f"{words.stem}_{copy + 1}" if copy else words.stem
        indices = tuple(column.position for column in part)
        yield Triad(part[0].meaning.kind, indices, stem, words.stage, device, has_named_axes)


def _order_triads(triads: list[Triad]) -> list[Triad]:
    """Return the sensors, three columns without axes and with names of their own being one."""
    result = list(triads)
    for kind in dict.fromkeys(triad.kind for triad in triads):
        own = [triad for triad in triads if triad.kind == kind]
        indices = tuple(index for triad in own for index in triad.indices)
        if not any(triad.has_named_axes for triad in own) and len(own) == len(indices) == _AXES:
            merged = own[0]._replace(
                indices=tuple(sorted(indices)), device="", has_named_axes=False
            )
            result = [triad for triad in result if triad.kind != kind] + [merged]
    return sorted(result, key=lambda triad: min(triad.indices))


def _includes_gravity(linear: Triad, triads: list[Triad]) -> bool:
    """Return True if a linear acceleration has gravity in it, as in a message of ROS.

    Such a message also has an angular velocity, where phones have a gyro.
    """
    others = [triad for triad in triads if triad.kind == "accel" and triad.stage != "linear"]
    return not others and any(
        ROLES.get(word) == "angular" for triad in triads for word in triad.stem.split("_")
    )


def _rank(triad: Triad) -> tuple[bool, int, int]:
    """Return the rank of a sensor: three axes, a good stage, a low number."""
    stage = triad.stage if triad.stage in STAGES else ""
    numbers = [int(word) for word in triad.device.split("_") if word.isdigit()]
    return not triad.is_complete, STAGES.index(stage), numbers[-1] if numbers else -1


def find_sensor_columns(names: Sequence[str], kind: str) -> tuple[int, ...]:
    """Return the columns of the one sensor of a kind; LogError if several devices have one."""
    own = [triad for triad in find_triads(dict(enumerate(names))) if triad.kind == kind]
    if len(devices := list_devices(own, names)) > 1:
        columns = ",".join(names[i] for i in choose_triads(own, None)[0][0].indices)
        raise LogError(
            make_sentence(
                f"there are {len(devices)} IMUs: {', '.join(devices)}; choose one, such as ",
                keyword_argument("columns", columns),
            ),
            "columns",
        )
    chosen, _ = choose_triads(own, None)
    return tuple(index for triad in chosen for index in triad.indices)


def keep_best_stage(triads: Sequence[Triad]) -> tuple[list[Triad], list[Triad]]:
    """Return the best stage of each device, as `STAGES` orders them, and the other stages."""
    best: dict[tuple[str, str], int] = {}
    for triad in triads:
        key, rank = (triad.kind, triad.device), _rank(triad)[1]
        best[key] = min(best.get(key, rank), rank)
    best_triads = [other for other in triads if _rank(other)[1] == best[other.kind, other.device]]
    return best_triads, [other for other in triads if other not in best_triads]


def choose_triads(triads: Sequence[Triad], sensor: str | None) -> tuple[list[Triad], list[Triad]]:
    """Return the sensors of one kind that are meant, and the others.

    One is meant: of those that ``sensor`` names, with three axes if any has, of the best stage, the
    one of the lowest number, the first in the file. ``"all"`` means one of every device.

    Raises
    ------
    LogError
        If there is no sensor of that name.
    """
    if sensor == ALL_SENSORS:
        return keep_best_stage(triads)
    pool = select_triads(triads, sensor)
    best = min(pool, key=_rank, default=None)
    return ([] if best is None else [best]), [triad for triad in triads if triad is not best]


def select_triads(triads: Sequence[Triad], sensor: str | None) -> list[Triad]:
    """Return the sensors that a name means, all for None; LogError if it means none."""
    if sensor is None or sensor == ALL_SENSORS or not triads:
        return list(triads)
    wanted = words_of(sensor)
    pool = [triad for triad in triads if wanted and triad.matches(wanted)]
    if not pool:
        raise missing_device(sensor, [_list_stems(triads)])
    return pool


def device_label(triad: Triad, name: str) -> str:
    """Return the device of a sensor as a column's name spells it: ``imu2`` of ``imu2_gyro_x``.

    The name of the whole sensor, ``gyro2``, where its device is a number alone; empty without one.
    """
    if not triad.device:
        return ""
    is_number = triad.device.replace("_", "").isdigit()
    words = (triad.stem if is_number else triad.device).split("_")
    found = re.search(r"[\W_]*".join(map(re.escape, words)), name, re.IGNORECASE)
    return "_".join(words) if found is None else found[0]


def list_devices(triads: Sequence[Triad], names: Sequence[str]) -> tuple[str, ...]:
    """Return the devices of which one is to be chosen, each as the columns' names spell it.

    Sensors with fewer axes than others of their kind do not count, and stages of one are one.
    """
    complete = [triad for triad in keep_best_stage(triads)[0] if triad.is_complete]
    labels = (device_label(triad, names[triad.indices[0]]) or triad.stem for triad in complete)
    return tuple(dict.fromkeys(labels))


def describe_others(chosen: Sequence[Triad], others: Sequence[Triad], label: str) -> Iterator[str]:
    """Yield the sentence on the sensors of a kind that are not read, if there are any."""
    if chosen and others:
        yield make_sentence(
            f"of several sensors {label} is read; ",
            keyword_argument("sensor"),
            f" chooses another: {_list_stems(others)}",
        )


def describe_axes(triad: Triad, names: Sequence[str]) -> Iterator[str]:
    """Yield the sentence on three columns that are axes by their order alone."""
    if triad.is_complete and not triad.has_named_axes:
        yield f"the names {', '.join(names)} show no axes, so they are x, y, z in this order"


def _list_stems(triads: Sequence[Triad]) -> str:
    stems = list(dict.fromkeys(triad.stem for triad in triads))
    more = [f"... ({len(stems)} in all)"] if len(stems) > _MAX_LISTED else []
    return ", ".join([*stems[:_MAX_LISTED], *more])


def find_accelerometer(names: Sequence[str], gyro: Sequence[int]) -> tuple[int, ...]:
    """Return the columns of the accelerometer of a gyro: of its device, or the only one."""
    triads = find_triads(dict(enumerate(names)))
    accels, _ = keep_best_stage(
        [triad for triad in triads if triad.kind == "accel" and triad.is_complete]
    )
    chosen = set(gyro)
    devices = {
        triad.device for triad in triads if triad.kind == "gyro" and chosen & set(triad.indices)
    }
    if len(devices) > 1:
        return ()
    same_device = [triad.indices for triad in accels if triad.device in devices]
    only = [triad.indices for triad in accels] if len(accels) == 1 else []
    return next(iter(same_device or only), ())
