"""The IMU noise parameters of PX4's EKF2."""

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from zerorate.noise.exports.settings import Names, Setting, settings
from zerorate.noise.exports.text import head, joined, number, written

if TYPE_CHECKING:
    from zerorate.noise.model import NoiseModel

__all__ = ["to_px4"]

_NAMES: Final = Names("EKF2_GYR_NOISE", "EKF2_GYR_B_NOISE", "EKF2_ACC_NOISE", "EKF2_ACC_B_NOISE")
_RANGES: Final = {
    "EKF2_GYR_NOISE": (0.0001, 0.1),
    "EKF2_GYR_B_NOISE": (0.0, 0.01),
    "EKF2_ACC_NOISE": (0.01, 1.0),
    "EKF2_ACC_B_NOISE": (0.0, 0.01),
}
_FLOAT: Final = 9
"""MAV_PARAM_TYPE_REAL32."""


def to_px4(
    model: "NoiseModel",
    path: str | os.PathLike[str] | None = None,
    *,
    rate: float = 100.0,
    accelerometer: "NoiseModel | None" = None,
    inflate: float = 1.0,
    force: bool = False,
) -> str:
    """Return the model as parameters of PX4's EKF2, in the format of QGroundControl.

    Parameters
    ----------
    path : str or path, optional
        A file to write as well, ``.params`` by custom. Default: none.
    rate : float
        Steps of the filter per second, Hz, not samples of the sensor: the inverse of
        ``EKF2_PREDICT_US``. Default 100, as PX4's.
    accelerometer : NoiseModel, optional
        Model of quantity "acceleration". Without one its lines are left out.
    inflate : float
        Factor on every number; default 1, noted in the file otherwise. PX4's own values, meant
        for a vehicle that vibrates, lie far above those of a sensor at rest.
    force : bool
        Whether to replace an existing file; default no.

    Returns
    -------
    str
        The text. Where a coefficient is not identifiable it holds the upper bound, and says so;
        it also says where a number lies outside the range that PX4 states.

    Raises
    ------
    ValueError
        If a model is of the wrong quantity, or rate or inflate not positive and finite.
    OSError
        If the file exists (without `force`) or cannot be written. Nothing is left half-written.

    Notes
    -----
    EKF2 takes deviations per step, not densities: at every step of dt its covariance prediction
    adds (dt EKF2_GYR_NOISE)^2 to the variance of the angle and (dt EKF2_GYR_B_NOISE)^2 to that
    of the bias. These are N^2 dt and K^2 dt for N sqrt(rate), in rad/s, and K sqrt(rate), in
    rad/s^2.

    Examples
    --------
    >>> from zerorate import NoiseModel
    >>> gyro = NoiseModel(angle_random_walk=1e-4, rate_random_walk=1e-6)
    >>> print(gyro.to_px4().expandtabs(2))
    # PX4 EKF2: noise of an IMU, deviations per filter step at 100 Hz.
    # No accelerometer was given: its lines are left out.
    # Vehicle-Id Component-Id Name Value Type
    # EKF2_GYR_NOISE: rad/s
    1 1 EKF2_GYR_NOISE  1.00000e-03 9
    # EKF2_GYR_B_NOISE: rad/s^2
    1 1 EKF2_GYR_B_NOISE  1.00000e-05 9
    <BLANKLINE>
    """
    found = settings(_NAMES, model, accelerometer, inflate, rate)
    title = f"PX4 EKF2: noise of an IMU, deviations per filter step at {rate:g} Hz."
    lines = head(title, accelerometer, inflate)
    lines.append("# Vehicle-Id Component-Id Name Value Type")
    lines += (line for setting in found for line in _lines(setting))
    return written(joined(lines), path, force)


def _lines(setting: Setting) -> Iterator[str]:
    low, high = _RANGES[setting.name]
    outside = "" if low <= setting.value <= high else f"; outside PX4's range {low:g} to {high:g}"
    yield f"# {setting.name}: {setting.remark}{outside}"
    yield f"1\t1\t{setting.name}\t{number(setting.value)}\t{_FLOAT}"
