"""Units, signs and axes of a recording's sensors, checked by its motion: `zerorate.check`."""

from __future__ import annotations

from typing import Unpack

from zerorate.checks.preparation import check_axes
from zerorate.checks.result import Checks
from zerorate.tasks.source import ReadingArguments, Source, name_source_in_errors, one_imu_of


def check(
    source: Source,
    *,
    gyro: str | None = None,
    accel: str | None = None,
    scale_errors: bool = True,
    **reading: Unpack[ReadingArguments],
) -> Checks:
    """Check the units, signs and axes of a recording's sensors against its motion.

    The gyro rotates the accelerometer's force into a fixed frame. There, gravity is constant only
    if unit and axes of the gyro are right. The field of a magnetometer is tested in the same way.
    Units and axes that the motion does not determine stay undecided. Nothing is corrected. All
    tasks make this check first.

    Parameters
    ----------
    source : Recording, path, data frame or mapping of arrays
        Recording with a gyro and an accelerometer of three axes at 10 Hz or more. A magnetometer is
        optional.
    gyro, accel : str
        Names of logs, such as ``"gyro_1"``. Default: the only gyro, and the accelerometer of its
        device. ``sensor="imu2"`` chooses both by the name of their device.
    scale_errors : bool
        Also test for scale errors and a delay of the gyro. Default True.
    **reading
        Arguments of `zerorate.read_recording`, if the source is a file.

    Returns
    -------
    Checks
        Findings on gyro and magnetometer. ``table()`` shows them. ``apply(recording)`` corrects a
        unit or axes if the correction is certain.

    Raises
    ------
    LogError
        If the source cannot be read.

    Examples
    --------
    >>> import zerorate as zr
    >>> recording = zr.simulate_motion("hand", duration=60.0).recording()
    >>> wrong = zr.Log(**{**vars(recording.gyro), "data": recording.gyro.data * [1, -1, 1]})
    >>> print(zr.check(zr.Recording({**recording, "gyro": wrong})).gyro.text)
    the gyro's y axis has the opposite sign to the accelerometer's
    """
    recording = one_imu_of(source, reading, gyro, accel)
    with name_source_in_errors(recording.source):
        return check_axes(recording, gyro or "gyro", accel, scale=scale_errors)
