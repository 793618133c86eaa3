"""Raw counts of a sensor's registers, and the factors that scale them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from zerorate.faults import keyword_argument, make_sentence
from zerorate.record.names import (
    UNKNOWN_UNIT,
    canonical_unit,
    split_unit,
)
from zerorate.types import Floats


class Sensitivities(NamedTuple):
    """Counts per deg/s and per g, by the range in deg/s and in g."""

    gyro: Mapping[float, float]
    accel: Mapping[float, float]


def _st_gyro_counts(*ranges: float) -> dict[float, float]:
    """Return the table of an STMicroelectronics gyro: 8.75 mdeg/s per count at 245 or 250 deg/s."""
    steps: dict[float, float] = {
        125: 4.375,
        245: 8.75,
        250: 8.75,
        500: 17.5,
        1000: 35.0,
        2000: 70.0,
        4000: 140.0,
    }
    return {end: 1000.0 / steps[end] for end in ranges}


_ACCEL_16_BIT: Final = {2.0: 16384.0, 4.0: 8192.0, 8.0: 4096.0, 16.0: 2048.0}
_ACCEL_ST: Final = {2.0: 1000 / 0.061, 4.0: 1000 / 0.122, 8.0: 1000 / 0.244, 16.0: 1000 / 0.488}
_MPU: Final = Sensitivities({250: 131.0, 500: 65.5, 1000: 32.8, 2000: 16.4}, _ACCEL_16_BIT)

SENSITIVITIES: Final[Mapping[str, Sensitivities]] = MappingProxyType(
    {
        # InvenSense, "Sensitivity Scale Factor": 131 LSB/(deg/s) at 250 deg/s, 16384 LSB/g at 2 g.
        "MPU-6000": _MPU,
        "MPU-6050": _MPU,
        "MPU-6500": _MPU,
        "MPU-9150": _MPU,
        "MPU-9250": _MPU,
        "ICM-20948": _MPU,
        "ICM-42688-P": Sensitivities({125: 262.0, 62.5: 524.3, **_MPU.gyro}, _ACCEL_16_BIT),
        "ITG-3200": Sensitivities({2000: 14.375}, {}),
        # Bosch, "Sensitivity": 16.4 LSB/(deg/s) at 2000 deg/s; the BMI088 has 16.384.
        "BMI160": Sensitivities(
            {125: 262.4, 250: 131.2, 500: 65.6, 1000: 32.8, 2000: 16.4}, _ACCEL_16_BIT
        ),
        "BMI088": Sensitivities(
            {end: 32768.0 / end for end in (125, 250, 500, 1000, 2000)},
            {3: 10920.0, 6: 5460.0, 12: 2730.0, 24: 1365.0},
        ),
        # STMicroelectronics, "Angular rate sensitivity": 8.75 mdps/LSB at 250 deg/s, and "Linear
        # acceleration sensitivity": 0.061 mg/LSB at 2 g.
        "L3G4200D": Sensitivities(_st_gyro_counts(250, 500, 2000), {}),
        "L3GD20": Sensitivities(_st_gyro_counts(250, 500, 2000), {}),
        "L3GD20H": Sensitivities(_st_gyro_counts(245, 500, 2000), {}),
        "LSM9DS1": Sensitivities(_st_gyro_counts(245, 500, 2000), _ACCEL_ST | {16.0: 1000 / 0.732}),
        "LSM6DS3": Sensitivities(_st_gyro_counts(125, 245, 500, 1000, 2000), _ACCEL_ST),
        "LSM6DSO": Sensitivities(_st_gyro_counts(125, 250, 500, 1000, 2000), _ACCEL_ST),
        "ISM330DHCX": Sensitivities(_st_gyro_counts(125, 250, 500, 1000, 2000, 4000), _ACCEL_ST),
    }
)
"""Sensitivities by device, from the electrical characteristics in its data sheet."""


@dataclass(frozen=True)
class RawCounts:
    """Factors that convert a device's raw counts to deg/s and g.

    Parameters
    ----------
    device
        Name of the device.
    gyro
        Factor of the gyro, deg/s per count.
    accel
        Factor of the accelerometer, g per count; None if its range is not given.
    """

    device: str
    gyro: float
    accel: float | None = None


def raw_counts(device: str, gyro: float, accel: float | None = None) -> RawCounts:
    """Return the factors from a device's raw counts to deg/s and g, from its data sheet.

    Parameters
    ----------
    device : str
        Key of `SENSITIVITIES`, for example ``"MPU-6050"``. Case, hyphens and blanks do not matter.
    gyro : float
        Range setting of the gyro, deg/s: 250 for ±250 deg/s.
    accel : float, optional
        Range setting of the accelerometer, g: 2 for ±2 g. Without it, accelerations stay unscaled.

    Returns
    -------
    RawCounts
        Value for `scale` of `zerorate.read_log`; the log then needs no unit.

    Raises
    ------
    ValueError
        If the table does not have the device or the range. The message lists the choices.

    Examples
    --------
    >>> import zerorate as zr
    >>> log = {"millis": [0, 5, 10], "gx": [131, 262, 0]}
    >>> zr.read_log(log, scale=zr.raw_counts("MPU-6050", 250)).data[:, 0]
    array([1., 2., 0.])
    """
    normalized = _normalize_device(device)
    name = next((known for known in SENSITIVITIES if _normalize_device(known) == normalized), None)
    if name is None:
        known = ", ".join(SENSITIVITIES)
        raise ValueError(
            make_sentence(
                keyword_argument("device"),
                f" is '{device}', which has no entry in the table; known: {known}",
            )
        )
    table = SENSITIVITIES[name]
    per_degree = _look_up_range(table.gyro, gyro, f"the gyro of the {name}", "deg/s")
    if accel is None:
        return RawCounts(name, 1.0 / per_degree)
    per_g = _look_up_range(table.accel, accel, f"the accelerometer of the {name}", "g")
    return RawCounts(name, 1.0 / per_degree, 1.0 / per_g)


def _normalize_device(device: str) -> str:
    return "".join(letter for letter in device.lower() if letter.isalnum())


def _look_up_range(table: Mapping[float, float], end: float, what: str, unit: str) -> float:
    if end not in table:
        known = ", ".join(f"{known_end:g}" for known_end in sorted(table)) or "none"
        raise ValueError(
            make_sentence(
                keyword_argument("range"),
                f" is {end:g} {unit}, but {what} has these ranges: {known} {unit}",
            )
        )
    return table[end]


Scale = float | Mapping[str, float] | RawCounts | None
"""Factor for all values, factors by kind of sensor, or the factors of a device."""

_KINDS: Final = {"gyro": "angular rate", "accel": "acceleration"}
_DEVICE_UNITS: Final = {"gyro": "deg/s", "accel": "g"}


@dataclass(frozen=True)
class Scaling:
    """Factors for the values of sensors, and the resulting units.

    Attributes
    ----------
    number
        Factor of the first sensor; None if there is none.
    factors
        Factors by kind, ``"gyro"`` or ``"accel"``.
    units
        Units by kind, if a device determines them.
    """

    number: float | None = None
    factors: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, scale: Scale) -> Scaling:
        """Return the factors of the argument `scale`; ValueError if its value is not valid."""
        if scale is None:
            return cls()
        if isinstance(scale, RawCounts):
            both = {"gyro": scale.gyro, "accel": scale.accel}
            factors = {kind: factor for kind, factor in both.items() if factor is not None}
            return cls(factors=factors, units={kind: _DEVICE_UNITS[kind] for kind in factors})
        if isinstance(scale, Mapping):
            unknown = sorted(map(str, scale.keys() - _KINDS.keys()))
            if unknown:
                raise ValueError(
                    make_sentence(
                        keyword_argument("scale"),
                        f" is of {' or '.join(_KINDS)}, got one of '{unknown[0]}'",
                    )
                )
            return cls(factors={kind: _check_factor(factor) for kind, factor in scale.items()})
        return cls(number=_check_factor(scale))

    def factor_for(self, kind: str | None, first: bool) -> float | None:
        """Return the factor of a kind of sensor, or the factor of the first sensor; else None."""
        if first and self.number is not None:
            return self.number
        return None if kind is None else self.factors.get(kind)

    def unit(self, kind: str, stated: str | None) -> str | None:
        """Return the unit of a kind of sensor: the device's unit, else the stated unit.

        Raises
        ------
        ValueError
            If the device's unit differs from the stated unit.
        """
        own = self.units.get(kind)
        if own is not None and stated is not None and canonical_unit(stated) != own:
            raise ValueError(
                make_sentence(
                    keyword_argument("unit"),
                    f" is {stated}, but the counts of that device become {own}",
                )
            )
        return own or stated


def _check_factor(scale: object) -> float:
    number = float(scale) if isinstance(scale, Real) and not isinstance(scale, bool) else math.nan
    if not math.isfinite(number) or number == 0.0:
        raise ValueError(
            make_sentence(
                keyword_argument("scale"), f" must be a finite number other than 0, got {scale!r}"
            )
        )
    return number


_MAX_PLAUSIBLE: Final = {"deg/s": 100.0, "rad/s": 10.0, "g": 16.0, "m/s^2": 160.0}
"""Largest value that is plausible in each unit; larger whole numbers are raw counts."""
_HALF_OF_16_BITS: Final = 1 << 15
_MIN_SAMPLES: Final = 16
"""Smallest number of samples to test: fewer can all be whole numbers by chance."""


def describe_counts(names: Sequence[str], kind: str, unit: str, head: Floats) -> str | None:
    """Return a sentence on columns that look like raw counts but are not scaled.

    Parameters
    ----------
    names, kind
        Names of the columns and their kind.
    unit
        Stated unit, or the unit for an unknown unit.
    head
        Values at the beginning of the columns, shape (n, k).
    """
    finite_values = head[np.isfinite(head)]
    if any(split_unit(name)[1] for name in names) or finite_values.size < _MIN_SAMPLES:
        return None
    if np.ptp(finite_values) == 0.0:
        return None
    largest = float(np.abs(finite_values).max())
    if largest <= _MAX_PLAUSIBLE.get(unit, 0.0 if unit == UNKNOWN_UNIT else np.inf):
        return None
    if not np.array_equal(finite_values, np.rint(finite_values)):
        return None
    with np.errstate(invalid="ignore"):
        jump = np.nanmax(np.abs(np.diff(head, axis=0)), initial=0.0)
    if finite_values.min() >= 0.0 and jump > _HALF_OF_16_BITS and largest < 2 * _HALF_OF_16_BITS:
        return (
            f"{', '.join(names)} jump by more than {_HALF_OF_16_BITS}: counts of 16 bits that were "
            f"written without their sign; subtract {2 * _HALF_OF_16_BITS} from values above "
            f"{_HALF_OF_16_BITS - 1}"
        )
    unit_text = "without a unit" if unit == UNKNOWN_UNIT else f"up to {largest:g} {unit}"
    ranges = "250, 2" if kind == "accel" else "250"
    python = f'scale=zr.raw_counts("MPU-6050", {ranges})'
    return make_sentence(
        f"{', '.join(names)} are whole numbers {unit_text}, as raw counts are: for an MPU-6050 ",
        keyword_argument(
            "device", "MPU-6050", python, keyword_argument("range", ranges.replace(" ", ""))
        ),
        ", or ",
        keyword_argument("scale"),
        " and ",
        keyword_argument("unit"),
        f", make {_DEVICE_UNITS[kind]} of them",
    )
