"""Sensors among the columns of a table: axes by their names, and which of several is meant."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final, NamedTuple

from zerorate.record.log import LogError
from zerorate.record.names import Meaning, meaning_of
from zerorate.record.words import ROLES, STAGES, Parsed, words_of

ALL: Final = "all"
_AXES: Final = 3
_LISTED: Final = 8


class Triad(NamedTuple):
    """Columns of one sensor by their indices, in the order x, y, z whatever that of the file.

    ``told`` says whether the names tell the axes; there are fewer than three where the sensor has
    fewer, and more where names only count.
    """

    kind: str
    places: tuple[int, ...]
    stem: str
    stage: str
    device: str
    told: bool

    @property
    def whole(self) -> bool:
        """Whether there are three axes."""
        return len(self.places) == _AXES

    def matches(self, wanted: Sequence[str]) -> bool:
        """Whether words name this sensor: its device, its stage, or words of its columns."""
        own = self.stem.split("_")
        return all(word in own or ROLES.get(word) == self.stage for word in wanted)


class _Column(NamedTuple):
    place: int
    meaning: Meaning
    words: Parsed


def triads_in(names: Mapping[int, str]) -> list[Triad]:
    """Return the gyros, accelerometers and magnetometers that columns are of, by their names."""
    columns = [
        _Column(index, meaning, meaning.words)
        for index, meaning in ((index, meaning_of(name)) for index, name in names.items())
        if meaning is not None and meaning.words is not None
    ]
    found = [triad for group in _groups(columns) for triad in _triads_of(group)]
    return [triad for triad in _in_order(found) if triad.stage != "linear" or _whole(triad, found)]


def _groups(columns: Iterable[_Column]) -> list[list[_Column]]:
    """Return columns whose names differ in their axis or number alone."""
    groups: dict[tuple[str, str, bool], list[_Column]] = {}
    for column in columns:
        _, meaning, words = column
        key = (meaning.kind, words.stem, words.axis is None)
        groups.setdefault(key, []).append(column)
    return list(groups.values())


def _triads_of(group: list[_Column]) -> Iterator[Triad]:
    """Yield the sensor of a group of columns, or the first, second, ... of a table that repeats."""
    axes: dict[int | None, list[_Column]] = {}
    for column in group:
        own = column.words
        axes.setdefault(own.counted if own.axis is None else own.axis, []).append(column)
    order = sorted(axes, key=lambda axis: -1 if axis is None else axis)
    told = group[0].words.axis is not None or order in ([0], [0, 1], [0, 1, 2])
    for copy in range(max(map(len, axes.values()))):
        part = [axes[axis][copy] for axis in order if copy < len(axes[axis])]
        words = part[0].words
        device = f"{words.device}_{copy + 1}".lstrip("_") if copy else words.device
        stem = f"{words.stem}_{copy + 1}" if copy else words.stem
        places = tuple(column.place for column in part)
        yield Triad(part[0].meaning.kind, places, stem, words.stage, device, told)


def _in_order(found: list[Triad]) -> list[Triad]:
    """Return the sensors, three columns without axes and with names of their own being one."""
    result = list(found)
    for kind in dict.fromkeys(triad.kind for triad in found):
        own = [triad for triad in found if triad.kind == kind]
        places = tuple(index for triad in own for index in triad.places)
        if not any(triad.told for triad in own) and len(own) == len(places) == _AXES:
            one = own[0]._replace(places=tuple(sorted(places)), device="", told=False)
            result = [triad for triad in result if triad.kind != kind] + [one]
    return sorted(result, key=lambda triad: min(triad.places))


def _whole(linear: Triad, found: list[Triad]) -> bool:
    """Whether a linear acceleration has gravity in it, as in a message of ROS.

    That has an angular velocity beside it, where phones have a gyro.
    """
    others = [triad for triad in found if triad.kind == "accel" and triad.stage != "linear"]
    return not others and any(
        ROLES.get(word) == "angular" for triad in found for word in triad.stem.split("_")
    )


def _rank(triad: Triad) -> tuple[bool, int, int]:
    """Return what orders sensors: three axes, a good stage, a low number."""
    stage = triad.stage if triad.stage in STAGES else ""
    numbers = [int(word) for word in triad.device.split("_") if word.isdigit()]
    return not triad.whole, STAGES.index(stage), numbers[-1] if numbers else -1


def places_of(names: Sequence[str], kind: str) -> tuple[int, ...]:
    """Return the columns of the sensor of a kind that is read where none is named."""
    found = triads_in(dict(enumerate(names)))
    chosen, _ = chosen_of([triad for triad in found if triad.kind == kind], None)
    return tuple(index for triad in chosen for index in triad.places)


def without_worse(triads: Sequence[Triad]) -> tuple[list[Triad], list[Triad]]:
    """Return the best stage of each device, as `STAGES` orders them, and what is left of it."""
    best: dict[tuple[str, str], int] = {}
    for triad in triads:
        key, rank = (triad.kind, triad.device), _rank(triad)[1]
        best[key] = min(best.get(key, rank), rank)
    kept = [one for one in triads if _rank(one)[1] == best[one.kind, one.device]]
    return kept, [one for one in triads if one not in kept]


def chosen_of(triads: Sequence[Triad], sensor: str | None) -> tuple[list[Triad], list[Triad]]:
    """Return the sensors of one kind that are meant, and the others.

    One is meant: of those that ``sensor`` names, with three axes if any has, of the best stage, the
    one of the lowest number, the first in the file. ``"all"`` means one of every device.

    Raises
    ------
    LogError
        If there is no sensor of that name.
    """
    if sensor == ALL:
        return without_worse(triads)
    pool = named(triads, sensor)
    best = min(pool, key=_rank, default=None)
    return ([] if best is None else [best]), [one for one in triads if one is not best]


def named(triads: Sequence[Triad], sensor: str | None) -> list[Triad]:
    """Return the sensors that a name means, all for None; LogError if it means none."""
    if sensor is None or sensor == ALL or not triads:
        return list(triads)
    wanted = words_of(sensor)
    pool = [triad for triad in triads if wanted and triad.matches(wanted)]
    if not pool:
        raise LogError(f"sensor= names '{sensor}', which is none of: {_listed(triads)}")
    return pool


def note_on_others(chosen: Sequence[Triad], left: Sequence[Triad], label: str) -> Iterator[str]:
    """Yield the sentence on the sensors of a kind that are not read, if there are any."""
    if chosen and left:
        yield f"of several sensors {label} is read; sensor= chooses another: {_listed(left)}"


def note_on_axes(triad: Triad, names: Sequence[str]) -> Iterator[str]:
    """Yield the sentence on three columns whose order alone makes axes of them."""
    if triad.whole and not triad.told:
        yield f"the names {', '.join(names)} tell no axes, so they are x, y, z in this order"


def _listed(triads: Sequence[Triad]) -> str:
    stems = list(dict.fromkeys(triad.stem for triad in triads))
    more = [f"... ({len(stems)} in all)"] if len(stems) > _LISTED else []
    return ", ".join([*stems[:_LISTED], *more])


def accelerometer_of(names: Sequence[str], gyro: Sequence[int]) -> tuple[int, ...]:
    """Return the columns of the accelerometer of a gyro: of its device, or the only one."""
    found = triads_in(dict(enumerate(names)))
    accels, _ = without_worse([one for one in found if one.kind == "accel" and one.whole])
    chosen = set(gyro)
    devices = {one.device for one in found if one.kind == "gyro" and chosen & set(one.places)}
    if len(devices) > 1:
        return ()
    same = [one.places for one in accels if one.device in devices]
    only = [one.places for one in accels] if len(accels) == 1 else []
    return next(iter(same or only), ())
