"""Data of a calibration: the recording, its rests, and the turns between them."""

from dataclasses import dataclass

from zerorate.types import Floats


@dataclass(frozen=True)
class Origin:
    """Source of a calibration, where it is known.

    Parameters
    ----------
    source
        Where the recording came from; empty where it is not known.
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
    """A stretch without motion, of which the mean of both sensors is known.

    Parameters
    ----------
    start, stop
        Seconds on the clock of the gyro.
    first, last
        Its samples are ``first`` to before ``last``.
    accel, gyro
        Mean output, raw, shape (3,).
    accel_sigma
        Standard error of ``accel`` as the fit takes it, raw unit, shape (3,).
    direction
        Unit vector of the reaction to gravity in the axes of the body, shape (3,), as estimated.
    norm_error
        ``|f| / g - 1`` after calibration.
    used
        Whether the fit used it.
    reason
        Why it was not, or what is odd about it.

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
        Seconds on the clock of the gyro: from within one rest to within the next.
    first, last
        Its samples are ``first`` to before ``last``.
    rests
        Places of the two rests in `Calibration.rests`.
    angle
        Angle between the orientations before and after, rad.
    axis
        About which, unit vector in the axes of the body before, shape (3,).
    residual
        Angle between gravity carried through the turn and gravity after it, rad.
    used
        Whether the fit used it.
    reason
        Why it was not, or what is odd about it.
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
