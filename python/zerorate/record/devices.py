"""Devices of logs, by their names in the source, and choice of a device."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Final

from zerorate.faults import keyword_argument, make_sentence
from zerorate.record.log import Log, LogError
from zerorate.record.recording import Recording

DEVICE: Final = "device"
"""Key of ``Log.meta`` for the device in the names of a table's columns."""

_KINDS: Final = ("gyro", "accel", "mag", "temperature")
_NUMBER: Final = re.compile(r"[_ ]?\d+$")


def device_of(log: Log) -> str:
    """Return the name of a log's device in its source; empty without a name.

    The name is a word of the columns' names (``imu2`` of ``imu2_gyro_x``), or else the topic.
    """
    return str(log.meta.get(DEVICE) or log.meta.get("sensor") or "")


def sensor_labels(recording: Recording) -> dict[str, str]:
    """Return the label of each log of a recording.

    The label has device and kind, ``"imu2 gyro"``, if there are several logs of this kind.

    Examples
    --------
    >>> import numpy as np
    >>> import zerorate as zr
    >>> table = {f"imu{k}_gyro_{x}_dps": np.arange(9.0) for k in (1, 2) for x in "xyz"}
    >>> sensor_labels(zr.read_recording(table, rate=100.0))
    {'gyro': 'imu1 gyro', 'gyro_1': 'imu2 gyro'}
    """
    labels = {name: _label(recording, name) for name in recording}
    taken = list(labels.values())
    return {name: label if taken.count(label) == 1 else name for name, label in labels.items()}


def _label(recording: Recording, name: str) -> str:
    kind = _kind_of(name)
    device = device_of(recording[name])
    several = kind in _KINDS and len(recording.of_kind(kind)) > 1
    return f"{device} {kind}" if several and device else name


def _kind_of(name: str) -> str:
    kind, _, number = name.rpartition("_")
    return kind if number.isdigit() else name


def rival_devices(recording: Recording) -> tuple[str, ...]:
    """Return the names of the devices to choose from; empty for a single device.

    Further instances of the first topic are devices. Other topics of an autopilot are not, because
    they have the same sensors: for example ``vehicle_imu`` next to ``sensor_combined``.
    """
    logs = recording.of_kind("gyro")
    if len(logs) < 2:
        return ()
    names = [name for name in recording if _kind_of(name) == "gyro"]
    rivals = [
        device_of(log) or name
        for name, log in zip(names, logs, strict=True)
        if _is_rival(logs[0], log)
    ]
    return tuple(dict.fromkeys(rivals)) if len(set(rivals)) > 1 else ()


def _is_rival(first: Log, other: Log) -> bool:
    if DEVICE in first.meta or DEVICE in other.meta:
        return True
    topics = device_of(first), device_of(other)
    if any(topic.startswith("/") or not topic for topic in topics):
        return True
    return _NUMBER.sub("", topics[0]) == _NUMBER.sub("", topics[1])


def select_device(recording: Recording, sensor: str) -> Recording:
    """Return the recording of one device, with logs named ``gyro``, ``accel`` and so on.

    Parameters
    ----------
    recording : Recording
        Logs of several devices.
    sensor : str
        Name of a device, as from `device_of`, or name of a log: ``"gyro_1"``.

    Raises
    ------
    LogError
        If no device or log has this name.
    """
    wanted = _plain(sensor)
    names = [
        name
        for name, log in recording.items()
        if wanted in (_plain(device_of(log)), _plain(name)) and _kind_of(name) in _KINDS
    ]
    if not names:
        known = [device_of(log) or name for name, log in recording.items()]
        raise missing_device(sensor, known)
    if all(_plain(name) == wanted for name in names):
        number = names[0].removeprefix(_kind_of(names[0]))
        names = [name for name in recording if name in {f"{kind}{number}" for kind in _KINDS}]
    chosen = {_kind_of(name): recording[name] for name in reversed(names)}
    kinds = {kind for kind in _KINDS if kind in chosen}
    others = {name: log for name, log in recording.items() if _kind_of(name) not in kinds}
    return replace(recording, logs={**dict(reversed(chosen.items())), **others})


def missing_device(sensor: str, known: Iterable[str]) -> LogError:
    """Return the error for an unknown device."""
    listed = ", ".join(dict.fromkeys(known))
    return LogError(
        make_sentence(keyword_argument("sensor"), f" names '{sensor}', which is none of: {listed}"),
        "sensor",
    )


def several_devices(names: Iterable[str]) -> LogError:
    """Return the error for several devices in a task for one device."""
    listed = list(dict.fromkeys(names))
    return LogError(
        make_sentence(
            f"there are {len(listed)} IMUs: {', '.join(listed)}; choose one, such as ",
            keyword_argument("sensor", listed[0]),
        ),
        "sensor",
    )


def _plain(name: str) -> str:
    return re.sub(r"[\W_]", "", name).casefold()
