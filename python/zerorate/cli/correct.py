"""``zerorate calibrate --apply``: a log without what a calibration has found."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from zerorate.calibration import Calibration
from zerorate.calibration.choice import own_sensors
from zerorate.cli.calibrations import naming, read_imu
from zerorate.cli.errors import require, writing
from zerorate.cli.options import LogFormat, Reading
from zerorate.cli.outputs import check_outputs, print_written, progress_bar
from zerorate.cli.records import print_title, records
from zerorate.io import write_log
from zerorate.record import Log, Recording
from zerorate.record.log import notes_of
from zerorate.show.tables import bulleted
from zerorate.tasks.saving import LOG_FORMATS, Destination, together


class Sensors(NamedTuple):
    """The sensors of a recording that are meant, by their names; None for the usual ones."""

    gyro: str | None
    accel: str | None

    @property
    def both(self) -> dict[str, str]:
        """Return the names of both: the accelerometer is that of the same device."""
        gyro = self.gyro or "gyro"
        return {"gyro": gyro, "accel": self.accel or gyro.replace("gyro", "accel", 1)}

    def of(self, recording: Recording) -> Recording:
        """Return a recording of these sensors and the temperature alone."""
        own = {**self.both, "temperature": "temperature"}
        chosen = {name: recording[one] for name, one in own.items() if one in recording}
        return Recording(chosen, recording.source)


def correct(
    log: Path,
    reading: Reading,
    sensors: Sensors,
    calibration: Calibration,
    output: str,
    format: LogFormat | None,
    force: bool,
) -> None:
    """Write a log without what a calibration has found."""
    place = Destination.of(output, f"{log.stem}-zerorate-calibrated", [*LogFormat])
    suffix = place.choose("format", format, LOG_FORMATS)
    if suffix == "parquet":
        require("pyarrow", "io")
    for i, one in enumerate(records(log, reading.group_by)):
        with progress_bar() as progress:
            recording = read_imu(reading, one.source)
            progress("correcting", 0.5)
            with naming(recording):
                own = {} if any(sensors) else own_sensors(recording, calibration)
                corrected = calibration.apply(recording, **{**sensors.both, **own})
                tables = _tables(corrected)
            part = place.of_part(one.ending)
            paths = [part.file(f"{ending}.{suffix}") for ending in tables]
            check_outputs(paths, force, log)
            with writing(), together(paths, force) as temporary:
                for path, table in zip(temporary, tables.values(), strict=True):
                    write_log(table, path)
        print_title(one, first=i == 0)
        print(bulleted(notes_on(corrected)))
        print_written(paths)


def notes_on(recording: Recording) -> tuple[str, ...]:
    """Return the sentences on a recording and on its logs, none of them twice."""
    of_logs = (note for log in recording.values() for note in notes_of(log))
    return tuple(dict.fromkeys((*recording.notes, *of_logs)))


def _tables(recording: Recording) -> dict[str, Log]:
    """Return what is written of a recording, by the endings of names: logs of a clock together."""
    groups: dict[str, list[Log]] = {}
    for name, log in recording.items():
        fits = (group for group in groups.values() if _share(group, log))
        group = next(fits, None)
        if group is None:
            groups[f"-{name}" if groups else ""] = [log]
        else:
            group.append(log)
    return {ending: _joined(group) for ending, group in groups.items()}


def _share(group: Sequence[Log], log: Log) -> bool:
    first, taken = group[0], {name for one in group for name in one.names}
    return np.array_equal(first.sampled, log.sampled) and taken.isdisjoint(log.names)


def _joined(group: Sequence[Log]) -> Log:
    first = group[0]
    data = np.hstack([log.data for log in group])
    names = tuple(name for log in group for name in log.names)
    units = tuple(unit for log in group for unit in log.units)
    return replace(first, data=data, names=names, unit=units)  # type: ignore[arg-type]
