"""Data of a calibration: the recording, its rests, and the rotations between them."""

from dataclasses import dataclass

from zerorate.types import Floats


@dataclass(frozen=True)
class Origin:
    """Source of the samples of a calibration.

    Parameters
    ----------
    source
        Name of the recording; empty if unknown.
    gyro, accel
        Names of the channels; empty for arrays.

    Examples
    --------
    >>> import zerorate as zr
    >>> origin = zr.calibrate(zr.simulation.simulate_session(12, seed=3).recording).origin
    >>> origin.source, origin.accel
    ('a simulated session', ('accel_x_g', 'accel_y_g', 'accel_z_g'))
    """

    source: str = ""
    gyro: tuple[str, ...] = ()
    accel: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Rest:
    """A static interval, with the means of both sensors.

    Parameters
    ----------
    start, stop
        Start and stop, s, as times of the gyro.
    first, last
        Indices of the samples: from ``first`` up to, but not including, ``last``.
    accel, gyro
        Mean output, raw unit, shape (3,).
    accel_sigma
        Standard error of ``accel`` in the fit, raw unit, shape (3,).
    direction
        Estimated direction of the reaction to gravity in the axes of the body, unit vector, shape
        (3,).
    norm_error
        ``|f| / g - 1`` after calibration.
    used
        True if the fit used the rest.
    reason
        Reason why the fit did not use the rest, or a remark.

    Examples
    --------
    >>> import zerorate as zr
    >>> found = zr.calibrate(zr.simulation.simulate_session(12, seed=3).recording)
    >>> rest = found.rests[0]
    >>> rest.used, rest.accel.shape, abs(rest.norm_error) < 1e-3
    (True, (3,), True)
    """

    start: float
    stop: float
    first: int
    last: int
    accel: Floats
    gyro: Floats
    accel_sigma: Floats
    direction: Floats
    norm_error: float
    used: bool = True
    reason: str = ""


@dataclass(frozen=True, eq=False)
class Turn:
    """Motion from one rest to the next.

    Parameters
    ----------
    start, stop
        Start and stop, s, as times of the gyro. Start is inside the rest before the motion, stop
        inside the rest after it.
    first, last
        Indices of the samples: from ``first`` up to, but not including, ``last``.
    rests
        Indices of the two rests in `Calibration.rests`.
    angle
        Angle between the orientations before and after, rad.
    axis
        Axis of the rotation, unit vector in the axes of the body before the motion, shape (3,).
    residual
        Angle between gravity propagated by the gyro and gravity measured after the motion, rad.
    used
        True if the fit used the rotation.
    reason
        Reason why the fit did not use the rotation, or a remark.
    residual_raw
        The angle `residual` before calibration; NaN if it was not computed.

    Examples
    --------
    >>> import numpy as np, zerorate as zr
    >>> found = zr.calibrate(zr.simulation.simulate_session(12, seed=3).recording)
    >>> turn = found.turns[0]
    >>> turn.rests, turn.used, bool(turn.residual < turn.residual_raw)
    ((0, 1), True, True)
    """

    start: float
    stop: float
    first: int
    last: int
    rests: tuple[int, int]
    angle: float
    axis: Floats
    residual: float
    used: bool = True
    reason: str = ""
    residual_raw: float = float("nan")
