"""Choice of the sensors of a recording to calibrate, and correction of the gyro."""

from dataclasses import replace
from typing import Final

from zerorate.calibration.calibration import Calibration
from zerorate.record import Log, LogError, Recording

_AXIS_COUNT: Final = 3


def find_sensors(recording: Recording, calibration: Calibration) -> dict[str, str]:
    """Return the names of the gyro and accelerometer that a calibration was made of.

    The sensors are found by the names of their channels. If no names match, the first sensor of
    each kind is returned.
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
    """Return the accelerometer that a calibration was made of; None if it lacks three axes."""
    log = recording.get(find_sensors(recording, calibration)["accel"])
    return log if log is not None and log.channels == _AXIS_COUNT else None


def correct_gyro(recording: Recording, calibration: Calibration, *, by_columns: bool) -> Log:
    """Return the corrected gyro of a recording, with a note on it.

    Parameters
    ----------
    recording : Recording
        All sensors of a log.
    calibration : Calibration
        Calibration to apply.
    by_columns : bool
        True if the gyro was chosen by its columns: then the first gyro is corrected. False: the
        gyro that the calibration was made of, if the recording has it.

    Raises
    ------
    LogError
        If no gyro has three axes.
    ValueError
        If the gyro's unit does not fit the calibration's unit.
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
