"""Calibration of a gyroscope and an accelerometer from poses and turns by hand."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from zerorate.record.recording import Recording

if TYPE_CHECKING:
    from zerorate.calibration.calibration import Calibration
    from zerorate.calibration.fit.priors import PriorName
    from zerorate.calibration.fit.sensors import Source
    from zerorate.calibration.fit.solution import GSensitivity
    from zerorate.calibration.parameters import Frame
    from zerorate.calibration.record import Rest


def calibrate(
    recording: Recording | None = None,
    *,
    gravity: float | None = None,
    accel: Source = None,
    gyro: Source = None,
    rate: float | None = None,
    rests: Iterable[Rest | tuple[float, float]] | None = None,
    g_sensitivity: GSensitivity = "auto",
    frame: Frame = "x",
    prior: PriorName = "datasheet",
    saturation: float | None = None,
) -> Calibration:
    """Calibrate a gyroscope and an accelerometer from poses at rest and rotations by hand.

    Parameters
    ----------
    recording : Recording, optional
        With a gyro and an accelerometer, each on its own clock; NaN marks missing samples.
    gravity : float, optional
        Local gravity, m/s^2. Default 9.80665, from which it differs by up to 0.3 %: the scale of
        the accelerometer moves by as much.
    accel, gyro : str, Log or array_like, shape (n, 3), optional
        Which logs of the recording, if it has several; or the samples themselves. An array has no
        unit: gravity and the turns find it, and corrected samples are in rad/s and m/s^2.
    rate : float, optional
        Samples a second of arrays, Hz.
    rests : iterable of Rest or (start, stop), optional
        Where the sensor rested, s. Default: found by `find_rests`.
    g_sensitivity : {"auto", True, False}
        Subtract the g-sensitivity in rotations, too: "auto" if one of its
        elements differs from zero by three standard errors. It is estimated from rests anyway,
        but for False.
    frame : {"x", "z", "symmetric"}
        Axes of the body: as of `Calibration`.
    prior : {"datasheet", "wide"}
        Prior: scale within 5 %, cross terms within 30 mrad, bias of the
        accelerometer within 100 mg (standard deviations); or nothing but that they are smaller
        than half of it. Sensors of unknown unit have the wide one.
    saturation : float, optional
        End of the gyro's range, raw unit. Default: the largest or smallest value of an axis, if
        it comes ten times.

    Returns
    -------
    Calibration
        Check `valid` first: if it is False, ``problems`` says why, and ``advice`` what to do.

    Raises
    ------
    CalibrationError
        With fewer than 4 rests or 6 turns that can be used.
    LogError
        If a sensor is not there, has not three axes, or another unit than it says.
    ValueError, TypeError
        If an argument is not as described.

    Notes
    -----
    The method of Tedaldi, Pretto and Menegatti ("A robust and easy to implement method for IMU
    calibration without external equipments", ICRA 2014, section IV), rests and turns without any
    equipment, as one least-squares fit: the residuals are those of the sensors, in their standard
    errors, with a prior, so that the scale cannot vanish and the covariance is that of all at
    once. A parameter is not identifiable if its standard error is above 0.3 of the data sheet's;
    it stays where it was then.

    Six seconds in each of 20 poses, of all directions, and turns by 60 to 170 degrees about many
    axes determine everything. The bias of the accelerometer moves by about 1 mg from one switching
    on to the next.

    Examples
    --------
    >>> import zerorate as zr
    >>> calibration = zr.calibrate(zr.simulation.simulate_session(20, seed=3).recording)
    >>> calibration.valid, calibration.gyro.scale[0].identifiable, calibration.advice
    (True, True, ())
    """
    # Its imports come at the first access: its name is that of the package.
    from zerorate.calibration.fit.steps import Choices, run_calibration

    choices = Choices(gravity, g_sensitivity, frame, prior, saturation)
    return run_calibration(choices, recording, gyro=gyro, accel=accel, rate=rate, rests=rests)
