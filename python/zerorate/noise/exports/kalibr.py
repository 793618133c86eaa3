"""The imu.yaml of Kalibr."""

import json
import os
from typing import TYPE_CHECKING, Final

from zerorate.noise.discrete import positive_rate
from zerorate.noise.exports.settings import Names, settings
from zerorate.noise.exports.text import head, joined, number, written, yaml_line

if TYPE_CHECKING:
    from zerorate.noise.model import NoiseModel

__all__ = ["to_kalibr"]

_NAMES: Final = Names(
    "gyroscope_noise_density",
    "gyroscope_random_walk",
    "accelerometer_noise_density",
    "accelerometer_random_walk",
)


def to_kalibr(
    model: "NoiseModel",
    path: str | os.PathLike[str] | None = None,
    *,
    accelerometer: "NoiseModel | None" = None,
    rate: float | None = None,
    rostopic: str = "/imu0",
    inflate: float = 1.0,
    force: bool = False,
) -> str:
    """Return the model as an ``imu.yaml`` of Kalibr.

    Parameters
    ----------
    path : str or path, optional
        A file to write as well. Default: none.
    accelerometer : NoiseModel, optional
        Model of quantity "acceleration". Without one its lines are left out, which Kalibr
        does not accept: they are to be added by hand.
    rate : float, optional
        ``update_rate`` in Hz. Without it the line is left out.
    rostopic : str
        Topic of the recording; default "/imu0".
    inflate : float
        Factor on every number, for what a record at rest does not show; default 1, noted in the
        file otherwise.
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
    Noise density is N and random walk is K, of continuous time: Kalibr itself converts to its
    rate. The bias instability B is not a random walk, and has no line.

    Examples
    --------
    >>> from zerorate import NoiseModel
    >>> gyro = NoiseModel(angle_random_walk=1e-4, rate_random_walk=1e-6)
    >>> print(gyro.to_kalibr(rate=200.0))
    # Kalibr: noise of an IMU, densities of continuous time.
    # No accelerometer was given: its lines are left out.
    gyroscope_noise_density: 1.00000e-04  # rad/s/sqrt(Hz)
    gyroscope_random_walk: 1.00000e-06  # rad/s^2/sqrt(Hz)
    rostopic: "/imu0"
    update_rate: 2.00000e+02  # Hz
    <BLANKLINE>
    """
    lines = head("Kalibr: noise of an IMU, densities of continuous time.", accelerometer, inflate)
    lines += map(yaml_line, settings(_NAMES, model, accelerometer, inflate))
    # A JSON string is a YAML one in double quotes: nothing in it can end the line or begin a key.
    lines.append(f"rostopic: {json.dumps(rostopic)}")
    if rate is not None:
        lines.append(f"update_rate: {number(positive_rate(rate))}  # Hz")
    return written(joined(lines), path, force)
