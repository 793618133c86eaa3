"""Data of a calibration: the recording, its rests, and the turns between them."""

from dataclasses import dataclass

from zerorate.types import Floats


@dataclass(frozen=True)
class Origin:
    """Source of a calibration, where it is known.

    Parameters
    ----------
    source
        Source of the recording; empty where it is not known.
    gyro, accel
        Names of the channels; empty of arrays.

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
        Seconds on the clock of the gyro.
    first, last
        Indices of its samples: from ``first`` up to, but not including, ``last``.
    accel, gyro
        Mean output, raw, shape (3,).
    accel_sigma
        Standard error of ``accel`` in the fit, raw unit, shape (3,).
    direction
        Unit vector of the reaction to gravity in the axes of the body, shape (3,), as estimated.
    norm_error
        ``|f| / g - 1`` after calibration.
    used
        True if the fit used it.
    reason
        Reason why it was not used, or an oddity.

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
    """A motion from one rest to the next.

    Parameters
    ----------
    start, stop
        Start and end, s, on the clock of the gyro: inside the rest before and inside the rest
        after.
    first, last
        Indices of its samples: from ``first`` up to, but not including, ``last``.
    rests
        Indices of the two rests in `Calibration.rests`.
    angle
        Angle between the orientations before and after, rad.
    axis
        Axis of the rotation, unit vector in the axes of the body before, shape (3,).
    residual
        Angle between gravity as propagated by the gyro through the motion and gravity measured
        after it, rad.
    used
        True if the fit used it.
    reason
        Reason why it was not used, or an oddity.
    residual_raw
        The same angle before calibration, NaN where it was not computed.

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
