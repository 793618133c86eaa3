"""Calibration of a gyroscope and an accelerometer from poses and rotations by hand."""

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
        Recording with a gyro and an accelerometer. Their sample times may differ; NaN marks missing
        samples.
    gravity : float, optional
        Local gravity, m/s^2. Default 9.80665. Its relative error becomes the relative error of the
        accelerometer's scale. The error of the default is up to 0.3 %.
    accel, gyro : str, Log or array_like, shape (n, 3), optional
        Names of the logs in the recording, if it has several gyros or accelerometers. Or the
        samples themselves. An array has no unit: the unit follows from gravity and the rotations.
        Corrected samples are then in rad/s and m/s^2.
    rate : float, optional
        Samples per second of arrays, Hz.
    rests : iterable of Rest or (start, stop), optional
        Intervals at rest, s. Default: found by `find_rests`.
    g_sensitivity : {"auto", True, False}
        True: subtract the g-sensitivity in rotations. "auto": subtract it if one of its elements
        differs from zero by more than three standard errors. False: do not estimate it at all.
    frame : {"x", "z", "symmetric"}
        Axes of the body, as in `Calibration`.
    prior : {"datasheet", "wide"}
        Standard deviations of the parameters before the fit. "datasheet": 5 % for the scale, 30
        mrad for the cross terms and 100 mg for the accelerometer's bias. "wide": half of the scale
        for each parameter. Default: "datasheet", but "wide" for a sensor of unknown unit.
    saturation : float, optional
        End of the gyro's range, raw unit. Default: the largest or smallest value of an axis, if
        this value occurs ten times.

    Returns
    -------
    Calibration
        Check `valid` first: if it is False, ``problems`` has the reasons and ``advice`` the
        remedies.

    Raises
    ------
    CalibrationError
        If the record has fewer than 4 usable rests or fewer than 6 usable rotations.
    LogError
        If a sensor is missing or does not have three axes. If its data contradict its stated unit.
    ValueError, TypeError
        If an argument is not as described.

    Notes
    -----
    The method follows Tedaldi, Pretto and Menegatti ("A robust and easy to implement method for IMU
    calibration without external equipments", ICRA 2014, section IV). One least-squares fit uses
    both sensors at all rests and rotations, and gives one covariance. Residuals are divided by
    their standard errors. The prior prevents a scale of zero. A parameter is not identifiable if
    its standard error exceeds 0.3 of its "datasheet" prior; the parameter then keeps its prior
    value.

    Recommended record: six seconds in each of 20 poses in all directions, with rotations of 60 to
    170 degrees about many axes between them. It determines all parameters. The bias of the
    accelerometer changes by about 1 mg from one power-on to the next.

    Examples
    --------
    >>> import zerorate as zr
    >>> calibration = zr.calibrate(zr.simulation.simulate_session(20, seed=3).recording)
    >>> calibration.valid, calibration.gyro.scale[0].identifiable, calibration.advice
    (True, True, ())
    """
    # The submodule has the name of the package, so its imports wait for the first access.
    from zerorate.calibration.fit.steps import Choices, run_calibration

    choices = Choices(gravity, g_sensitivity, frame, prior, saturation)
    return run_calibration(choices, recording, gyro=gyro, accel=accel, rate=rate, rests=rests)
