"""Noise of a few well-known MEMS gyros, for simulation and comparison.

The coefficients come from data sheets. A noise density or an angle random walk is N. An in-run bias
stability or instability is B. None of these data sheets states a rate random walk. K is chosen so
that its Allan deviation at 1000 s equals the flat part of the curve. Single units differ from
typical values by a factor of two or more.
"""

import math
import re
from dataclasses import dataclass
from typing import Final

from zerorate.noise import FLICKER_FLOOR, NoiseModel
from zerorate.units import convert

_WALK_MEETS_FLOOR_S: Final = 1000.0
_UNREAD_SHEET: Final = "Quoted at second hand, not read in the sheet itself. "
_CHOSEN_WALK: Final = (
    "The rate random walk is not stated: chosen for simulation, to meet the bias-instability "
    "floor at 1000 s."
)


@dataclass(frozen=True)
class Device:
    """Entry of the table `DEVICES`: typical noise, turn-on bias and resolution of a gyro.

    Parameters
    ----------
    name : str
        Name given by the manufacturer.
    noise : NoiseModel
        Typical noise of one axis at rest, SI units.
    turn_on_bias : float
        Standard deviation of the bias between power-ons or between units, rad/s.
    resolution : float
        Step of the output, rad/s. 0 if the step is too small to model.
    source : str
        Name of the data sheet, the values stated there, and a note if a value is chosen for
        simulation.

    Examples
    --------
    >>> gyro = device("adis16405")
    >>> round(convert(gyro.resolution, "rad/s", "deg/s"), 6)
    0.05
    """

    name: str
    noise: NoiseModel
    turn_on_bias: float
    resolution: float
    source: str


def device(name: str) -> Device:
    """Return the entry of a gyro in the table `DEVICES`.

    Parameters
    ----------
    name : str
        Key of `DEVICES`. Case, spaces and hyphens do not matter.

    Returns
    -------
    Device
        Entry of the table.

    Raises
    ------
    ValueError
        If the table does not have the device. The message lists all devices.

    Examples
    --------
    >>> device("mpu6050").name
    'MPU-6050'
    """
    for designation, entry in DEVICES.items():
        if _normalise_name(designation) == _normalise_name(name):
            return entry
    raise ValueError(f"unknown device {name!r}: known are {', '.join(DEVICES)}")


def _normalise_name(name: str) -> str:
    return re.sub(r"[\s_-]", "", name).casefold()


def _noise(angle_random_walk: float, bias_instability: float) -> NoiseModel:
    """Return a model from deg/s/sqrt(Hz) and deg/s, with a chosen rate random walk."""
    instability = convert(bias_instability, "deg/s", "rad/s")
    return NoiseModel(
        angle_random_walk=convert(angle_random_walk, "deg/s/sqrt(Hz)", "rad/s/sqrt(Hz)"),
        bias_instability=instability,
        rate_random_walk=FLICKER_FLOOR * instability * math.sqrt(3.0 / _WALK_MEETS_FLOOR_S),
    )


_ENTRIES: Final = (
    Device(
        name="MTi-100",
        noise=_noise(0.01, convert(10.0, "deg/h", "deg/s")),
        turn_on_bias=convert(0.2, "deg/s", "rad/s"),
        resolution=0.0,
        source=(
            "Xsens, MTi 100-series specification: noise density "
            "0.01 deg/s/sqrt(Hz), in-run bias stability 10 deg/h, bias repeatability over one "
            "year 0.2 deg/s typical, 0.5 deg/s at most. " + _UNREAD_SHEET + _CHOSEN_WALK
        ),
    ),
    Device(
        name="3DM-GX4-25",
        noise=_noise(0.005, convert(10.0, "deg/h", "deg/s")),
        turn_on_bias=convert(0.05, "deg/s", "rad/s"),
        resolution=0.0,
        source=(
            "LORD MicroStrain, 3DM-GX4-25 data sheet: noise density 0.005 deg/s/sqrt(Hz), "
            "in-run bias stability 10 deg/h, initial bias error +-0.05 deg/s (taken as one "
            "standard deviation). " + _UNREAD_SHEET + _CHOSEN_WALK
        ),
    ),
    Device(
        name="ADIS16405",
        noise=_noise(convert(2.0, "deg/sqrt(h)", "deg/s/sqrt(Hz)"), 0.007),
        turn_on_bias=convert(3.0, "deg/s", "rad/s"),
        resolution=convert(0.05, "deg/s", "rad/s"),
        source=(
            "Analog Devices, ADIS16400/ADIS16405 data sheet: angular random walk 2.0 deg/sqrt(h), "
            "in-run bias stability 0.007 deg/s (1 sigma), initial bias error +-3 deg/s (1 sigma), "
            "sensitivity 0.05 deg/s per LSB at +-300 deg/s. Its rate noise density of "
            "0.05 deg/s/sqrt(Hz) at 25 Hz, above the random walk's 0.033, is not modelled. "
            + _UNREAD_SHEET
            + _CHOSEN_WALK
        ),
    ),
    Device(
        name="MPU-6050",
        noise=_noise(0.005, 0.002),
        turn_on_bias=convert(20.0 / 3.0, "deg/s", "rad/s"),
        resolution=convert(1.0 / 131.0, "deg/s", "rad/s"),
        source=(
            "InvenSense, MPU-6000/MPU-6050 Product Specification PS-MPU-6000A-00 rev. 3.4, "
            "section 6.1: rate noise spectral density 0.005 deg/s/sqrt(Hz) at 10 Hz, 131 LSB per "
            "deg/s at +-250 deg/s, initial zero-rate-output tolerance +-20 deg/s (taken as three "
            "standard deviations). It states no bias instability: 0.002 deg/s is taken as of the "
            "order of laboratory Allan plots (0.0012 deg/s for the unit of "
            "robotics.stackexchange.com question 8860). " + _CHOSEN_WALK
        ),
    ),
)

DEVICES: Final[dict[str, Device]] = {entry.name: entry for entry in _ENTRIES}
"""Table of the devices: each `Device` by its name, such as ``"MPU-6050"``."""
