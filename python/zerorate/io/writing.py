"""Writing of logs in all formats."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from zerorate.io.clocks.clock import fit_grid
from zerorate.io.clocks.repeats import HEAD_ROWS, find_rows_per_sample
from zerorate.io.gyroflow import write_gcsv
from zerorate.io.mcap import write_mcap
from zerorate.io.readers.arrow import to_arrow
from zerorate.io.readers.layouts import META_MARK
from zerorate.io.readers.parquet import TIME_NAME, write_parquet
from zerorate.io.readers.text import make_text_header
from zerorate.io.table import Column
from zerorate.record.atomic import atomic_path, check_writable
from zerorate.record.log import Log, LogError, units_of
from zerorate.record.names import UNKNOWN_UNIT, add_unit_suffix, looks_like_gyro, split_unit

_Writer = Callable[[Log, Path, Sequence[str]], None]

_CHUNK_ROWS = 100_000


def write_log(
    log: Log,
    path: str | os.PathLike[str],
    *,
    force: bool = False,
) -> None:
    """Write a log so that `read_log` returns the same data and time, bit for bit.

    Extra columns keep their names and are written after the channels. In an ``.npz`` they are
    separate arrays. `read_log` reads extra columns only if they are requested by name.

    Parameters
    ----------
    log
        Log to write. Columns without a unit in their name get the suffix of the log's unit.
    path
        ``.csv``, ``.tsv``, ``.npz`` or ``.parquet``. A text table begins with a ``#`` line if its
        columns do not show rate, unit and names. ``.mcap`` (Foxglove, PlotJuggler) and ``.gcsv``
        (Gyroflow) are for other programs. These files use the programs' units, and omit parts of
        the log.
    force
        Replace an existing file. Default False.

    Raises
    ------
    ValueError
        If the suffix is unknown.
    LogError
        If two columns would have the same name, or a name ends in a unit that is not the log's
        unit.
    OSError
        If the file exists and ``force`` is False. If the folder is missing or not writable. No
        partial file remains.
    ImportError
        If pyarrow (extra ``io``) is not installed, for Parquet.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from pathlib import Path
    >>> from zerorate.record import Log
    >>> from zerorate.io import read_log, write_log
    >>> log = Log(np.arange(3) / 100.0, 100.0, [0.1, np.nan, 0.3], ["gyro_z_dps"], "deg/s")
    >>> path = Path(tempfile.mkdtemp()) / "log.csv"
    >>> write_log(log, path)
    >>> read_log(path)
    Log(3 samples at 100 Hz, 0.03 s, deg/s: gyro_z_dps)
    """
    target = Path(path)
    write = _find_writer(target.suffix.lower())
    check_writable(target, force)
    names = make_column_names(log.names, log.unit, log.extra)
    with atomic_path(target, force) as temporary:
        write(log, temporary, names)


def make_column_names(channels: Iterable[str], unit: str, extra: Iterable[str]) -> list[str]:
    """Return the names of a log's columns in a file; LogError if two are the same."""
    names, channel_names = [], list(channels)
    for name, channel_unit in zip(channel_names, units_of(unit, len(channel_names)), strict=True):
        own_unit = split_unit(name)[1]
        if own_unit not in (None, channel_unit):
            raise LogError(
                f"channel '{name}' is named in {own_unit}, but the log's unit is {channel_unit}"
            )
        names.append(add_unit_suffix(name, channel_unit))
    listed = [TIME_NAME, *names, *extra]
    if len(set(listed)) != len(listed):
        raise LogError(f"columns would share a name: {', '.join(listed)}")
    return names


def _find_writer(suffix: str) -> _Writer:
    if suffix not in _WRITERS:
        raise ValueError(f"cannot write a log as '{suffix}'; known: {', '.join(_WRITERS)}")
    return _WRITERS[suffix]


def _write_npz(log: Log, path: Path, names: Sequence[str]) -> None:
    arrays: dict[str, Column] = {
        "time": log.sampled,
        "data": log.data,
        "rate": np.array(log.rate),
        "unit": np.array(log.unit),
        "names": np.array(log.names),
    }
    if "sensor" in log.meta:
        arrays["sensor"] = np.array(str(log.meta["sensor"]))
    reserved = sorted(arrays.keys() & log.extra.keys())
    if reserved:
        raise LogError(f"an .npz has a place of its own for: {', '.join(reserved)}")
    np.savez(path, **arrays, **log.extra)  # type: ignore[arg-type]


def _write_text(log: Log, path: Path, names: Sequence[str]) -> None:
    delimiter = "\t" if path.suffix.lower() == ".tsv" else ","
    is_self_describing = _is_self_describing(log, names) and not any(
        map(looks_like_gyro, log.extra)
    )
    head = "" if is_self_describing else f"# {META_MARK} {_format_metadata(log)}\n"
    head += make_text_header([TIME_NAME, *names, *log.extra], delimiter) + "\n"
    with path.open("wb") as file:
        file.write(head.encode())
        columns: list[Column] = [log.sampled, log.data, *log.extra.values()]
        rows = np.column_stack(columns)
        for first in range(0, log.n, _CHUNK_ROWS):
            file.write(_format_rows(rows[first : first + _CHUNK_ROWS], delimiter))


def _is_self_describing(log: Log, names: Sequence[str]) -> bool:
    """Return True if rate, unit and names can be read from the columns alone."""
    plain = tuple(names) == log.names and all(looks_like_gyro(name) for name in names)
    units = {split_unit(name)[1] or UNKNOWN_UNIT for name in names}
    if not plain or units != {log.unit} or "sensor" in log.meta or log.n < 2:
        return False
    # Repeated rows are read as samples only with a stated rate.
    if find_rows_per_sample(log.data[:HEAD_ROWS], np.arange(min(log.n, HEAD_ROWS))) is not None:
        return False
    grid = fit_grid(log.sampled - log.sampled[0], float(log.sampled[0]))
    return grid.rate == log.rate and grid.length == log.n


def _format_metadata(log: Log) -> str:
    fields: dict[str, object] = {"rate": log.rate, "unit": log.unit, "names": log.names}
    if "sensor" in log.meta:
        fields["sensor"] = str(log.meta["sensor"])
    text = json.dumps(fields)
    # A spreadsheet splits the line at its commas; no part of it may begin like a formula.
    return re.sub(r"[,;](?=[^ ])", lambda mark: f"\\u{ord(mark[0]):04x}", text)


def _format_rows(rows: np.ndarray[tuple[int, ...], np.dtype[np.float64]], delimiter: str) -> bytes:
    try:
        import pyarrow as pa
        from pyarrow import csv as arrow_csv
    except ImportError:
        lines = (delimiter.join(map(repr, row)) + "\n" for row in rows.tolist())
        return "".join(lines).encode()
    columns = list(np.asfortranarray(rows).T)
    table = pa.table(
        [to_arrow(column) for column in columns], names=[str(i) for i in range(len(columns))]
    )
    sink = pa.BufferOutputStream()
    options = arrow_csv.WriteOptions(include_header=False, delimiter=delimiter)
    arrow_csv.write_csv(table, sink, options)
    text: bytes = sink.getvalue().to_pybytes()
    return text


_WRITERS: Final[dict[str, _Writer]] = {
    ".csv": _write_text,
    ".tsv": _write_text,
    ".npz": _write_npz,
    ".parquet": write_parquet,
    ".mcap": write_mcap,
    ".gcsv": write_gcsv,
}
WRITTEN_SUFFIXES: Final = (*_WRITERS,)
"""Suffixes of logs that can be written."""
