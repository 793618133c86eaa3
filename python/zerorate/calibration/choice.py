"""Choice of the sensors of a recording to calibrate, and correction of the gyro."""

from dataclasses import replace
from typing import Final

from zerorate.calibration.calibration import Calibration
from zerorate.record import Log, LogError, Recording

_AXIS_COUNT: Final = 3


def find_sensors(recording: Recording, calibration: Calibration) -> dict[str, str]:
    """Return the names of gyro and accelerometer that a calibration was made of.

    They are found by the names of their channels; without such names it is the first of each kind.
    """
    channels = {"gyro": calibration.origin.gyro, "accel": calibration.origin.accel}
    names = {}
    for kind, channel_names in channels.items():
        matches = (
            name for name, log in recording.items() if channel_names and log.names == channel_names
        )
        names[kind] = next(matches, kind)
    return names


def find_accel(recording: Recording, calibration: Calibration) -> Log | None:
    """Return the accelerometer that a calibration was made of, if it is there with three axes."""
    log = recording.get(find_sensors(recording, calibration)["accel"])
    return log if log is not None and log.channels == _AXIS_COUNT else None


def correct_gyro(recording: Recording, calibration: Calibration, *, by_columns: bool) -> Log:
    """Return the corrected gyro of a recording, with a note on it.

    Parameters
    ----------
    recording : Recording
        All sensors of a log.
    calibration : Calibration
        What is taken off.
    by_columns : bool
        True if the gyro was chosen by its columns, so that it is the first; else it is the one
        that the calibration was made of, if it is there.

    Raises
    ------
    LogError
        If there is no gyro of three axes.
    ValueError
        If its unit does not fit that of the calibration.
    """
    names = find_sensors(recording, calibration)
    if by_columns:
        names["gyro"] = "gyro"
    if names["gyro"] not in recording:
        raise LogError("there is no gyro")
    gyro = calibration.apply(recording, **names)[names["gyro"]]
    count = len(recording.of_kind("accel"))
    if count < 2:
        return gyro
    note = f"of {count} accelerometers {names['accel']} is used as the force on the gyro"
    return replace(gyro, meta={**gyro.meta, "notes": (*gyro.meta["notes"], note)})
