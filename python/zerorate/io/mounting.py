"""Reading of the sensors' mounting from a file's metadata."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import Any

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.record.log import LogError
from zerorate.record.mounting import Mounting, check_rotation
from zerorate.types import Floats

_KEYS = ("body_from_sensor", "antenna_from_imu_m", "time_offset_s", "imu_time_offset_s")


def read_mounting(path: str | os.PathLike[str]) -> Mounting:
    """Read the mounting of the sensors from the metadata of a Parquet file.

    The keys are body_from_sensor (a matrix as JSON), antenna_from_imu_m and time_offset_s.
    time_offset_s is added to the times of the fixes. A file may instead have imu_time_offset_s,
    which is added to the times of the sensors. Other file formats have no such metadata.

    Raises
    ------
    LogError
        If a value in the metadata cannot be read.

    Examples
    --------
    >>> import zerorate as zr
    >>> zr.io.read_mounting("drive.csv")
    Mounting(body_from_sensor=None, antenna=None, time_offset=None)
    """
    metadata = _read_metadata(path)
    try:
        matrix = check_rotation(json.loads(metadata[_KEYS[0]])) if _KEYS[0] in metadata else None
        antenna = _parse_vector(metadata[_KEYS[1]]) if _KEYS[1] in metadata else None
        offset = float(metadata[_KEYS[2]]) if _KEYS[2] in metadata else None
        if offset is None and _KEYS[3] in metadata:
            offset = 0.0 - float(metadata[_KEYS[3]])
    except ValueError as error:
        raise LogError(
            f"{os.fspath(path)}: its metadata on the mounting is wrong: {error}"
        ) from None
    return Mounting(matrix, antenna, offset)


def mounting_of(text: str) -> Mounting:
    """Return the mounting from a text: nine numbers of a rotation row by row, or a file's path.

    The file contains the nine numbers, or has the mounting in its metadata.

    Raises
    ------
    ArgumentError
        If the text does not have nine numbers.
    LogError
        If the metadata cannot be read.

    Examples
    --------
    >>> from zerorate.io.mounting import mounting_of
    >>> mounting_of("0,1,0, 1,0,0, 0,0,-1").body_from_sensor.shape
    (3, 3)
    """
    path, content = Path(text), text
    if path.is_file():
        stated = read_mounting(path)
        if stated.body_from_sensor is not None:
            return stated
        content = _content(path)
    try:
        numbers = [float(word) for word in re.split(r"[\s,\[\]]+", content) if word]
    except ValueError:
        numbers = []
    if len(numbers) != 9:
        raise ArgumentError(
            "mount",
            "takes nine numbers of a rotation with commas between, a file with them, or 'none', "
            f"got '{text}'",
        )
    return Mounting(np.reshape(numbers, (3, 3)))


def _content(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""


def _read_metadata(path: str | os.PathLike[str]) -> dict[str, Any]:
    try:
        from pyarrow import ArrowException, parquet
    except ImportError:
        return {}
    try:
        raw_metadata = parquet.read_schema(os.fspath(path)).metadata or {}
    except (ArrowException, OSError):
        return {}
    return {
        key.decode(): value.decode() for key, value in raw_metadata.items() if key.decode() in _KEYS
    }


def _parse_vector(text: str) -> Floats:
    numbers = np.array([float(x) for x in text.strip("[]() ").split(",")])
    if numbers.shape != (3,):
        raise ValueError(f"expected three numbers, got {text!r}")
    return numbers
