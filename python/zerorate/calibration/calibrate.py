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
        Local gravity, m/s^2. Default 9.80665; an error of it, up to 0.3 %, is an error of the
        accelerometer's scale.
    accel, gyro : str, Log or array_like, shape (n, 3), optional
        Names of logs in the recording, if it has several, or the samples themselves. An array has
        no unit: it follows from gravity and the turns, and corrected samples are in rad/s and
        m/s^2.
    rate : float, optional
        Samples per second of arrays, Hz.
    rests : iterable of Rest or (start, stop), optional
        Where the sensor rested, s. Default: found by `find_rests`.
    g_sensitivity : {"auto", True, False}
        Subtract the g-sensitivity in rotations, too. "auto": if one of its elements differs from
        zero by three standard errors. False: it is not even estimated from the rests.
    frame : {"x", "z", "symmetric"}
        Axes of the body, as in `Calibration`.
    prior : {"datasheet", "wide"}
        "datasheet": standard deviations of 5 % for the scale, 30 mrad for the cross terms and 100
        mg for the accelerometer's bias. "wide": each is only smaller than half of the scale.
        Default "datasheet", and "wide" for a sensor of unknown unit.
    saturation : float, optional
        End of the gyro's range, raw unit. Default: the largest or smallest value of an axis, if it
        occurs ten times.

    Returns
    -------
    Calibration
        Check `valid` first: if it is False, ``problems`` has the reasons and ``advice`` the
        remedies.

    Raises
    ------
    CalibrationError
        With fewer than 4 rests or 6 turns that can be used.
    LogError
        If a sensor is missing, does not have three axes, or its data contradict its stated unit.
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
