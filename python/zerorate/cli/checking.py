"""What a recording contradicts, said before the results of a command, and put right if asked."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.checks import Checks, Finding, check
from zerorate.cli.errors import DataFault
from zerorate.io import LogFile
from zerorate.record import Log, LogError, Recording
from zerorate.types import Floats

_READ: Final = 1 << 20
"""Samples of a log that `replay` looks at: of three hours at 100 Hz."""


def checked(
    recording: Recording, fix: bool, gyro: str | None = None, accel: str | None = None
) -> tuple[Recording, tuple[str, ...]]:
    """Return a recording, put right if asked and known how, and what is to be said of it first."""
    found = check(recording, gyro=gyro or "gyro", accel=accel, scale=False)
    return found.apply(recording) if fix else recording, tuple(_lines(found, fix))


def _lines(found: Checks, fix: bool) -> Iterator[str]:
    for one in (found.gyro, found.magnetometer):
        if one.alarm:
            yield f"{found.source}: {one.text}{_advice(one, one is found.gyro, fix)}"
    if found.clock:
        yield f"{found.source}: {found.clock}"


def _advice(finding: Finding, is_gyro: bool, fix: bool) -> str:
    if not is_gyro:
        return ""
    if not finding.exact:
        return ": --fix changes nothing, for it is not known which is right" if fix else ""
    return ": put right, by --fix" if fix else ": --fix puts it right"


def print_alarms(lines: Sequence[str]) -> None:
    """Print what contradicts a recording, and an empty line; nothing if nothing does."""
    if lines:
        print("\n".join(lines), end="\n\n")


@contextmanager
def said_first(lines: Sequence[str]) -> Iterator[None]:
    """Print what contradicts a recording before a fault, which may come of it."""
    try:
        yield
    except DataFault:
        print_alarms(lines)
        raise


def checked_files(
    gyro: LogFile, accel: LogFile | None, fix: bool
) -> tuple[LogFile, tuple[str, ...]]:
    """Return a gyro's log, put right if asked and known how, and what is to be said of it first.

    The first million samples are looked at.
    """
    if accel is None or gyro.header.channels != 3 or accel.header.channels != 3:
        return gyro, ()
    try:
        source = str(gyro.header.meta.get("source", "the log"))
        recording = Recording({"gyro": _beginning(gyro), "accel": _beginning(accel)}, source)
    except LogError:
        # What is wrong with it is said where it is read.
        return gyro, ()
    found = check(recording, scale=False)
    fixed = _fixed(gyro, found.gyro) if fix and found.gyro.exact else gyro
    return fixed, tuple(_lines(found, fix))


def _beginning(log: LogFile) -> Log:
    header, count = log.header, min(log.header.n, _READ)
    if log.whole is not None and count == header.n:
        return log.whole
    data = next(log.blocks(count)).T
    stamps = None if log.stamps is None else log.stamps(0, count)
    time = log.time(0, count)
    return Log(time, header.rate, data, header.names, header.unit, stamps=stamps)


def _fixed(log: LogFile, finding: Finding) -> LogFile:
    """Return a log of which each block is put right when it is read."""
    if log.whole is not None:
        return LogFile.of(finding.apply(log.whole))
    header = log.header
    sample = Log(np.zeros(1), header.rate, np.zeros((1, 3)), header.names, header.unit, header.meta)
    told = finding.apply(sample)
    matrix = np.eye(3) if finding.matrix is None else finding.matrix

    def blocks(rows: int) -> Iterator[Floats]:
        return (finding.factor * matrix @ block for block in log.blocks(rows))

    return replace(log, header=replace(header, unit=told.unit, meta=told.meta), blocks=blocks)
