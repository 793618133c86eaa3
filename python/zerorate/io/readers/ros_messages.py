"""Messages of ROS of any type whose fields tell what they are: their numbers as columns.

A type is known by the definition that a recording has of it. This runs where `ros` reads: in a
process of its own.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np

from zerorate.io.table import Column
from zerorate.record.names import looks_like_gyro, meaning_of

_Connection = Any
_Store = Any
_Path = tuple[str | int, ...]

_STAMP: Final = "stamp_ns"
_TIMES: Final = ("builtin_interfaces/msg/Time", "builtin_interfaces/Time")
_NUMBERS: Final = ("bool", "int", "uint", "float", "byte", "char", "octet")
_FIX: Final = "sensor_msgs/msg/NavSatFix"
_UNITS: Final = {"latitude": "latitude_deg", "longitude": "longitude_deg", "altitude": "altitude_m"}
"""Columns of a fix, as its definition has them."""
_MAY_TELL: Final = re.compile(r"(?i)gyr|ang|rate|omega|rot|lat|acc|mag|imu|\b[wg]_?[xyz]\b")
"""What stands in the definition of a type that may tell of a sensor; others are not parsed."""
_DEEPEST: Final = 6
_MOST: Final = 256
"""Fields that are looked at."""
_LONGEST: Final = 36
"""Numbers of an array that are columns: those of a covariance of six."""


class Plan(NamedTuple):
    """Where the numbers of a type of messages stand.

    ``stamp`` leads to the time of a header; it is None where there is none, and the time is that of
    reception.
    """

    names: tuple[str, ...]
    paths: tuple[_Path, ...]
    stamp: _Path | None

    @property
    def has_gyro(self) -> bool:
        """Whether any of the numbers is of a gyro."""
        return any(map(looks_like_gyro, self.names))


def plan_of(connection: _Connection) -> Plan | None:
    """Return the plan of a connection's messages; None if nothing in them is of a sensor."""
    if connection.msgdef.data and not _MAY_TELL.search(connection.msgdef.data):
        return None
    try:
        found = list(_fields(_store(connection), connection.msgtype, (), 0))
    except Exception:  # what a damaged definition raises has no common base
        return None
    stamp = next((path for path, kind in found if kind == "time" and "header" in path), None)
    paths = tuple(path for path, kind in found if kind == "number")[:_MOST]
    names = tuple(map(_name, paths))
    kinds = {meaning.kind for meaning in map(meaning_of, names) if meaning is not None}
    places = {"latitude", "longitude"} <= {name.rpartition("_")[2] for name in names}
    if not kinds & {"gyro", "accel", "mag"} and not places:
        return None
    if connection.msgtype == _FIX:
        names = tuple(_UNITS.get(name, name) for name in names)
    return Plan((_STAMP, *names), paths, stamp)


def _name(path: _Path) -> str:
    *steps, last = path
    if isinstance(last, int):
        return f"{'_'.join(map(str, steps))}[{last}]"
    return "_".join(map(str, path))


def columns_of(
    plan: Plan, connections: Iterable[tuple[_Connection, int, bytes]], wanted: Sequence[int]
) -> list[Column]:
    """Return columns of messages, each with its connection, time of reception, and bytes."""
    paths = [plan.paths[i - 1] for i in wanted if i]
    getters = [partial(_reached, path=path) for path in paths]
    decode: dict[int, Callable[[bytes], Any]] = {}
    stamps, rows = [], []
    for connection, received, raw in connections:
        if connection.id not in decode:
            decode[connection.id] = _decoder(connection)
        message = decode[connection.id](raw)
        stamps.append(received if plan.stamp is None else _time(_reached(message, plan.stamp)))
        rows.append([float(get(message)) for get in getters])
    values = iter(np.array(rows, np.float64).reshape(len(rows), len(getters)).T.copy())
    return [next(values) if i else np.array(stamps, np.int64) for i in wanted]


def _time(stamp: Any) -> int:  # noqa: ANN401
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def _reached(message: Any, path: _Path) -> Any:  # noqa: ANN401
    for step in path:
        message = message[step] if isinstance(step, int) else getattr(message, step)
    return message


def _decoder(connection: _Connection) -> Callable[[bytes], Any]:
    store = _store(connection)
    cdr = hasattr(connection.ext, "serialization_format")
    decode = store.deserialize_cdr if cdr else store.deserialize_ros1
    return lambda raw: decode(raw, connection.msgtype)


def _store(connection: _Connection) -> _Store:
    """Return the types that a connection's messages are made of, as the recording defines them."""
    from rosbags.interfaces import MessageDefinitionFormat as Form
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    cdr = hasattr(connection.ext, "serialization_format")
    told = connection.msgdef
    if told.format == Form.NONE or not told.data:
        return get_typestore(Stores.ROS2_HUMBLE if cdr else Stores.ROS1_NOETIC)
    store = get_typestore(Stores.EMPTY)
    if told.format == Form.MSG:
        types = get_types_from_msg(told.data, connection.msgtype)
    else:
        types = get_types_from_idl(told.data)
    store.register({name: own for name, own in types.items() if name not in store.fielddefs})
    return store


def _fields(store: _Store, name: str, path: _Path, depth: int) -> Iterator[tuple[_Path, str]]:
    """Yield the ways to the numbers and times in a type, of small arrays each of their own."""
    if depth > _DEEPEST:
        return
    for field, (node, about) in store.fielddefs[name][1]:
        way = (*path, field)
        match node.name:
            case "BASE" if about[0].startswith(_NUMBERS):
                yield way, "number"
            case "NAME" if about in _TIMES:
                yield way, "time"
            case "NAME":
                yield from _fields(store, about, way, depth + 1)
            case "ARRAY":
                (inner, kind), count = about
                numbers = inner.name == "BASE" and kind[0].startswith(_NUMBERS)
                if numbers and count <= _LONGEST:
                    yield from (((*way, i), "number") for i in range(count))
