"""ROS messages of any type with meaningful field names: their numbers as columns.

The recording contains the definition of each type. This module runs in the separate process of
`ros`.
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
_TIME_TYPES: Final = ("builtin_interfaces/msg/Time", "builtin_interfaces/Time")
_NUMBER_TYPES: Final = ("bool", "int", "uint", "float", "byte", "char", "octet")
_FIX_TYPE: Final = "sensor_msgs/msg/NavSatFix"
_FIX_COLUMNS: Final = {
    "latitude": "latitude_deg",
    "longitude": "longitude_deg",
    "altitude": "altitude_m",
}
"""Columns of a fix, with the names in the message's definition."""
_SENSOR_HINT: Final = re.compile(r"(?i)gyr|ang|rate|omega|rot|lat|acc|mag|imu|\b[wg]_?[xyz]\b")
"""Words in the definition of a type with a sensor; other types are not parsed."""
_MAX_DEPTH: Final = 6
_MAX_FIELDS: Final = 256
"""Largest number of fields that are searched."""
_MAX_ARRAY_NUMBERS: Final = 36
"""Largest number of array elements that become columns, as in a 6 x 6 covariance."""


class MessagePlan(NamedTuple):
    """Positions of the numbers in a type of message.

    ``stamp`` is the position of the header's time. If it is None, the time of reception is used.
    """

    names: tuple[str, ...]
    paths: tuple[_Path, ...]
    stamp: _Path | None

    @property
    def has_gyro(self) -> bool:
        """True if a number belongs to a gyro."""
        return any(map(looks_like_gyro, self.names))


def make_plan(connection: _Connection) -> MessagePlan | None:
    """Return the plan for a connection's messages; None if they have no sensor."""
    if connection.msgdef.data and not _SENSOR_HINT.search(connection.msgdef.data):
        return None
    try:
        fields = list(_find_fields(_make_type_store(connection), connection.msgtype, (), 0))
    except Exception:  # a damaged definition can raise any exception
        return None
    stamp = next((path for path, kind in fields if kind == "time" and "header" in path), None)
    paths = tuple(path for path, kind in fields if kind == "number")[:_MAX_FIELDS]
    names = tuple(map(_column_name, paths))
    kinds = {meaning.kind for meaning in map(meaning_of, names) if meaning is not None}
    has_position = {"latitude", "longitude"} <= {name.rpartition("_")[2] for name in names}
    if not kinds & {"gyro", "accel", "mag"} and not has_position:
        return None
    if connection.msgtype == _FIX_TYPE:
        names = tuple(_FIX_COLUMNS.get(name, name) for name in names)
    return MessagePlan((_STAMP, *names), paths, stamp)


def _column_name(path: _Path) -> str:
    *steps, last = path
    if isinstance(last, int):
        return f"{'_'.join(map(str, steps))}[{last}]"
    return "_".join(map(str, path))


def decode_columns(
    plan: MessagePlan, connections: Iterable[tuple[_Connection, int, bytes]], wanted: Sequence[int]
) -> list[Column]:
    """Return columns from messages with their connections, times of reception, and bytes."""
    paths = [plan.paths[i - 1] for i in wanted if i]
    getters = [partial(_get_field, path=path) for path in paths]
    decode: dict[int, Callable[[bytes], Any]] = {}
    stamps, rows = [], []
    for connection, received, raw in connections:
        if connection.id not in decode:
            decode[connection.id] = _make_decoder(connection)
        message = decode[connection.id](raw)
        stamps.append(
            received if plan.stamp is None else _to_nanoseconds(_get_field(message, plan.stamp))
        )
        rows.append([float(get(message)) for get in getters])
    values = iter(np.array(rows, np.float64).reshape(len(rows), len(getters)).T.copy())
    return [next(values) if i else np.array(stamps, np.int64) for i in wanted]


def _to_nanoseconds(stamp: Any) -> int:  # noqa: ANN401
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def _get_field(message: Any, path: _Path) -> Any:  # noqa: ANN401
    for step in path:
        message = message[step] if isinstance(step, int) else getattr(message, step)
    return message


def _make_decoder(connection: _Connection) -> Callable[[bytes], Any]:
    store = _make_type_store(connection)
    cdr = hasattr(connection.ext, "serialization_format")
    decode = store.deserialize_cdr if cdr else store.deserialize_ros1
    return lambda raw: decode(raw, connection.msgtype)


def _make_type_store(connection: _Connection) -> _Store:
    """Return the types in a connection's messages, as the recording defines them."""
    from rosbags.interfaces import MessageDefinitionFormat as Form
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    cdr = hasattr(connection.ext, "serialization_format")
    definition = connection.msgdef
    if definition.format == Form.NONE or not definition.data:
        return get_typestore(Stores.ROS2_HUMBLE if cdr else Stores.ROS1_NOETIC)
    store = get_typestore(Stores.EMPTY)
    if definition.format == Form.MSG:
        types = get_types_from_msg(definition.data, connection.msgtype)
    else:
        types = get_types_from_idl(definition.data)
    store.register({name: own for name, own in types.items() if name not in store.fielddefs})
    return store


def _find_fields(store: _Store, name: str, path: _Path, depth: int) -> Iterator[tuple[_Path, str]]:
    """Yield the positions of numbers and times in a type; small arrays yield each element."""
    if depth > _MAX_DEPTH:
        return
    for field, (node, details) in store.fielddefs[name][1]:
        field_path = (*path, field)
        match node.name:
            case "BASE" if details[0].startswith(_NUMBER_TYPES):
                yield field_path, "number"
            case "NAME" if details in _TIME_TYPES:
                yield field_path, "time"
            case "NAME":
                yield from _find_fields(store, details, field_path, depth + 1)
            case "ARRAY":
                (inner, kind), count = details
                numbers = inner.name == "BASE" and kind[0].startswith(_NUMBER_TYPES)
                if numbers and count <= _MAX_ARRAY_NUMBERS:
                    yield from (((*field_path, i), "number") for i in range(count))
