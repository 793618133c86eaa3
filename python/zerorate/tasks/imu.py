"""The prepared gyro of a source with its accelerometer, read block by block."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from zerorate.calibration.calibration import Calibration
from zerorate.calibration.choice import correct_gyro, find_accel
from zerorate.checks.preparation import FILTER_CHOICES, Choices, PreparedRecording, prepare
from zerorate.checks.result import Finding
from zerorate.io.formats import LogSource
from zerorate.io.logfile import LogFile, open_imu
from zerorate.record.log import Log, LogError
from zerorate.record.recording import Recording
from zerorate.tasks.source import (
    Source,
    name_source_in_errors,
    one_imu_of,
    recording_of,
    units_of_sensors,
)
from zerorate.types import Floats
from zerorate.units import UNITS, convert

_MAX_CHECKED_SAMPLES: Final = 1 << 20
"""Number of samples that the preparation checks: three hours at 100 Hz."""
_AXES: Final = 3


@dataclass(frozen=True)
class Imu:
    """A gyro and the accelerometer of its body.

    Attributes
    ----------
    gyro : LogFile
        The gyro, with the chosen axes.
    accel : LogFile or None
        Accelerometer of the same device with three axes; None if there is none.
    alarms : tuple of str
        Contradictions found in the first million samples.
    """

    gyro: LogFile
    accel: LogFile | None = None
    alarms: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        source: Source | LogFile,
        reading: Mapping[str, Any],
        calibration: Calibration | None = None,
        choices: Choices = FILTER_CHOICES,
    ) -> Imu:
        """Return the gyro of a source, prepared and corrected by a calibration.

        The bias limit in `choices` has the unit of the gyro.
        """
        if isinstance(source, LogFile):
            return cls(source).prepare_sensors(choices)
        if calibration is not None:
            return cls._from_corrected(recording_of(source, reading), reading, calibration, choices)
        if isinstance(source, Recording | Log):
            return cls._from_recording(one_imu_of(source, reading), choices)
        return cls(*_open_files(source, reading)).prepare_sensors(choices)

    @classmethod
    def _from_corrected(
        cls,
        recording: Recording,
        reading: Mapping[str, Any],
        calibration: Calibration,
        choices: Choices,
    ) -> Imu:
        has_columns = reading.get("columns") is not None
        with name_source_in_errors(recording.source):
            gyro = LogFile.of(correct_gyro(recording, calibration, by_columns=has_columns))
        return cls(gyro, _as_log_file(find_accel(recording, calibration))).prepare_sensors(choices)

    @classmethod
    def _from_recording(cls, recording: Recording, choices: Choices) -> Imu:
        """Return the sensors of a recording; it may have several of a kind."""
        unit = "" if recording.gyro is None else recording.gyro.unit
        prepared = prepare(recording, _bias_limit_to_si(choices, unit))
        gyro, accel = prepared.recording.gyro, prepared.recording.accel
        if gyro is None:
            raise LogError(f"{recording.source}: there is no gyro")
        three_axes = accel if accel is not None and accel.channels == _AXES else None
        new_notes = [note for note in prepared.recording.notes if note not in recording.notes]
        file = LogFile.of(gyro)
        return cls(
            replace(file, header=file.header.with_notes(new_notes)),
            _as_log_file(three_axes),
            prepared.alarms,
        )

    @property
    def source(self) -> str:
        """Name of the log."""
        return str(self.gyro.header.meta.get("source", "the log"))

    def prepare_sensors(self, choices: Choices) -> Imu:
        """Return the sensors, corrected according to the check of their first samples.

        The corrections apply to all blocks.
        """
        try:
            logs = {"gyro": _read_beginning(self.gyro)}
            if self.accel is not None:
                logs["accel"] = _read_beginning(self.accel)
        except LogError:
            return self  # errors of the file are raised when it is read
        choices_si = _bias_limit_to_si(choices, self.gyro.header.unit)
        result = prepare(Recording(logs, self.source), choices_si)
        gyro = self.gyro if result.gyro_fix is None else _fix_blocks(self.gyro, result.gyro_fix)
        return Imu(gyro, self.accel, result.alarms)


def prepare_imu(source: Source, reading: Mapping[str, Any], choices: Choices) -> PreparedRecording:
    """Return the gyro of a source and its accelerometer in memory; otherwise like `Imu.of`."""
    if isinstance(source, Recording | Log):
        return prepare(one_imu_of(source, reading), choices)
    files = zip(("gyro", "accel"), _open_files(source, reading), strict=True)
    logs = {name: file.log() for name, file in files if file is not None}
    return prepare(Recording(logs, str(logs["gyro"].meta.get("source", "the log"))), choices)


def _open_files(source: LogSource, reading: Mapping[str, Any]) -> tuple[LogFile, LogFile | None]:
    return open_imu(source, **{**reading, "unit": _gyro_unit(reading)})


def _bias_limit_to_si(choices: Choices, unit: str) -> Choices:
    """Return the choices with the bias limit in rad/s; without a known unit, drop it."""
    limit = choices.bias_limit
    if limit is None or unit not in UNITS or UNITS[unit].kind != "rate":
        return replace(choices, bias_limit=None)
    return replace(choices, bias_limit=convert(limit, unit, "rad/s"))


def _gyro_unit(reading: Mapping[str, Any]) -> Any:  # noqa: ANN401
    """Return the unit of the gyro from an argument with one unit or two."""
    unit = reading.get("unit")
    if isinstance(unit, str) and "," not in unit:
        return unit
    return (units_of_sensors(unit) or {}).get("gyro")


def _as_log_file(log: Log | None) -> LogFile | None:
    return None if log is None else LogFile.of(log)


def _read_beginning(log: LogFile) -> Log:
    header, count = log.header, min(log.header.n, _MAX_CHECKED_SAMPLES)
    if log.whole is not None and count == header.n:
        return log.whole
    data = next(log.blocks(count)).T
    stamps = None if log.stamps is None else log.stamps(0, count)
    time = log.time(0, count)
    return Log(time, header.rate, data, header.names, header.unit, header.meta, stamps)


def _fix_blocks(log: LogFile, finding: Finding) -> LogFile:
    """Return a log with blocks that are corrected when read."""
    if log.whole is not None:
        return LogFile.of(finding.apply(log.whole))
    header = log.header
    sample = Log(np.zeros(1), header.rate, np.zeros((1, 3)), header.names, header.unit, header.meta)
    fixed_sample = finding.apply(sample)
    matrix = np.eye(3) if finding.matrix is None else finding.matrix

    def blocks(rows: int) -> Iterator[Floats]:
        return (finding.factor * matrix @ block for block in log.blocks(rows))

    return replace(
        log, header=replace(header, unit=fixed_sample.unit, meta=fixed_sample.meta), blocks=blocks
    )
