"""Calibrations that commands read, and recordings of an IMU that they are applied to."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from zerorate.calibration.calibration import Calibration
from zerorate.calibration.choice import corrected_gyro as gyro_of
from zerorate.calibration.choice import own_accel
from zerorate.cli.errors import DataFault, as_usage, of_a_file, of_log
from zerorate.cli.options import Reading
from zerorate.io import read_recording
from zerorate.io.formats import LogSource
from zerorate.record import Log, LogError, Recording
from zerorate.tasks.source import units_of_sensors


def read_calibration(path: Path) -> Calibration:
    """Return the calibration in a file, or raise a fault that says what is wrong with it."""
    try:
        return Calibration.from_json(path)
    except OSError as error:
        raise DataFault(of_a_file(error)) from None
    except ValueError as error:
        raise DataFault(str(error)) from None


def read_imu(
    reading: Reading, source: LogSource, reference: Sequence[str | int] | None = None
) -> Recording:
    """Return a recording of all sensors; the unit may be one of the gyro, or of both sensors.

    The columns of a reference may be chosen.
    """
    unit = reading.arguments["unit"]
    if unit is not None:
        reading = replace(reading, arguments={**reading.arguments, "unit": units_of_sensors(unit)})
    further = {} if reference is None else {"reference": reference}
    return reading.read(read_recording, source, **further)


def corrected_imu(
    reading: Reading, source: LogSource, calibration: Calibration
) -> tuple[Log, Log | None]:
    """Return the gyro of a recording, corrected, whose notes say so, and its accelerometer.

    Faults are as of `naming`.
    """
    recording = read_imu(reading, source)
    with naming(recording):
        asked = reading.arguments["columns"] is not None
        gyro = gyro_of(recording, calibration, asked=asked)
    return gyro, own_accel(recording, calibration)


@contextmanager
def naming(recording: Recording) -> Iterator[None]:
    """Say which log is at fault."""
    try:
        with as_usage():
            yield
    except LogError as error:
        raise of_log(error, recording.source) from None
