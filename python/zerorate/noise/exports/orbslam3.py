"""The IMU lines of an ORB-SLAM3 settings file."""

import os
from typing import TYPE_CHECKING, Final

from zerorate.noise.discrete import positive_rate
from zerorate.noise.exports.settings import Names, settings
from zerorate.noise.exports.text import head, joined, number, written, yaml_line

if TYPE_CHECKING:
    from zerorate.noise.model import NoiseModel

__all__ = ["to_orbslam3"]

_NAMES: Final = Names("IMU.NoiseGyro", "IMU.GyroWalk", "IMU.NoiseAcc", "IMU.AccWalk")


def to_orbslam3(
    model: "NoiseModel",
    path: str | os.PathLike[str] | None = None,
    *,
    rate: float | None = None,
    accelerometer: "NoiseModel | None" = None,
    inflate: float = 1.0,
    force: bool = False,
) -> str:
    """Return the model as the IMU lines of an ORB-SLAM3 settings file.

    Parameters
    ----------
    path : str or path, optional
        A file to write as well. Default: none.
    rate : float, optional
        ``IMU.Frequency`` in Hz. Without it that line is left out, which ORB-SLAM3 does not
        accept: it is to be added by hand.
    accelerometer : NoiseModel, optional
        Model of quantity "acceleration". Without one its lines are left out, which ORB-SLAM3
        does not accept: they are to be added by hand.
    inflate : float
        Factor on every number but the rate; default 1, noted in the file otherwise.
    force : bool
        Whether to replace an existing file; default no.

    Returns
    -------
    str
        The text, to be put into a settings file. Where a coefficient is not identifiable it
        holds the upper bound, and says so.

    Raises
    ------
    ValueError
        If a model is of the wrong quantity, or rate or inflate not positive and finite.
    OSError
        If the file exists (without `force`) or cannot be written. Nothing is left half-written.

    Notes
    -----
    Noise is N and walk is K, of continuous time: ORB-SLAM3 itself multiplies the one by the root
    of ``IMU.Frequency`` and divides the other by it.

    Examples
    --------
    >>> from zerorate import NoiseModel
    >>> gyro = NoiseModel(angle_random_walk=1e-4, rate_random_walk=1e-6)
    >>> print(gyro.to_orbslam3(rate=200.0))
    # ORB-SLAM3: noise of an IMU, densities of continuous time.
    # No accelerometer was given: its lines are left out.
    IMU.NoiseGyro: 1.00000e-04  # rad/s/sqrt(Hz)
    IMU.GyroWalk: 1.00000e-06  # rad/s^2/sqrt(Hz)
    IMU.Frequency: 2.00000e+02  # Hz
    <BLANKLINE>
    """
    title = "ORB-SLAM3: noise of an IMU, densities of continuous time."
    lines = head(title, accelerometer, inflate)
    lines += map(yaml_line, settings(_NAMES, model, accelerometer, inflate))
    if rate is not None:
        lines.append(f"IMU.Frequency: {number(positive_rate(rate))}  # Hz")
    return written(joined(lines), path, force)
