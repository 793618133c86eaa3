"""The IMU lines of a VINS-Mono or VINS-Fusion configuration."""

import os
from typing import TYPE_CHECKING, Final

from zerorate.noise.exports.settings import Names, settings
from zerorate.noise.exports.text import head, joined, written, yaml_line

if TYPE_CHECKING:
    from zerorate.noise.model import NoiseModel

__all__ = ["to_vins"]

_NAMES: Final = Names("gyr_n", "gyr_w", "acc_n", "acc_w")


def to_vins(
    model: "NoiseModel",
    path: str | os.PathLike[str] | None = None,
    *,
    rate: float | None = None,
    accelerometer: "NoiseModel | None" = None,
    inflate: float = 1.0,
    force: bool = False,
) -> str:
    """Return the model as the IMU lines of a VINS-Mono or VINS-Fusion configuration.

    Parameters
    ----------
    path : str or path, optional
        A file to write as well. Default: none.
    rate : float, optional
        Rate in Hz of the IMU messages that VINS integrates: with it deviations per sample are
        written, which is what its arithmetic takes. By default the densities of continuous time
        are, with which most published configurations are filled.
    accelerometer : NoiseModel, optional
        Model of quantity "acceleration". Without one its lines are left out.
    inflate : float
        Factor on every number; default 1, noted in the file otherwise. Users of VINS raise the
        numbers by 10 or more, for vibration and for what else its model leaves out.
    force : bool
        Whether to replace an existing file; default no.

    Returns
    -------
    str
        The text. Where a coefficient is not identifiable it holds the upper bound, and says so.

    Raises
    ------
    ValueError
        If a model is of the wrong quantity, or rate or inflate not positive and finite.
    OSError
        If the file exists (without `force`) or cannot be written. Nothing is left half-written.

    Notes
    -----
    The preintegration adds (dt gyr_w)^2 to the variance of the bias at every step of dt, so
    gyr_w = K sqrt(rate) gives the growth K^2 dt of a random walk; with K itself the bias is held
    sqrt(rate) times too steady, for which `inflate` is often raised. gyr_n = N sqrt(rate) is the
    deviation of one sample; the midpoint rule then takes both ends of a step as independent and
    adds half of N^2 dt.

    Examples
    --------
    >>> from zerorate import NoiseModel
    >>> gyro = NoiseModel(angle_random_walk=1e-4, rate_random_walk=1e-6)
    >>> print(gyro.to_vins(rate=100.0, inflate=10.0))
    # VINS: noise of an IMU at 100 Hz, deviations per sample.
    # Every number is 10 times the measured one.
    # No accelerometer was given: its lines are left out.
    gyr_n: 1.00000e-02  # rad/s
    gyr_w: 1.00000e-04  # rad/s^2
    <BLANKLINE>
    """
    found = settings(_NAMES, model, accelerometer, inflate, rate)
    if rate is None:
        title = "VINS: noise of an IMU, densities of continuous time."
    else:
        title = f"VINS: noise of an IMU at {rate:g} Hz, deviations per sample."
    lines = head(title, accelerometer, inflate)
    return written(joined([*lines, *map(yaml_line, found)]), path, force)
