"""Conversion of angles, angular rates, accelerations and their noise terms.

The package computes in SI units with angles in radians. Degrees, hours and g appear only in this
module, on the command line, in tables and in plots. Only units of the same kind can be converted:
an angle random walk in deg/sqrt(h) is no rate in deg/h.
"""

import math
import re
from collections.abc import Sequence
from typing import Any, Final, NamedTuple, overload

import numpy as np
import numpy.typing as npt

__all__ = ["UNITS", "Unit", "canonical", "convert", "kind", "whole_samples"]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__


class Unit(NamedTuple):
    """A unit: a value times ``amount / time`` is the value in the SI unit of its kind.

    Amount and time are separate, so that the factor from deg/s to deg/h is exactly 3600. A prefix
    such as milli is part of the time.

    Examples
    --------
    >>> from zerorate.units import UNITS
    >>> UNITS["deg/h"].kind, UNITS["deg/h"].time
    ('rate', 3600.0)
    """

    kind: str
    amount: float
    time: float


_RAD: Final = 1.0
_DEG: Final = math.pi / 180.0
_METRE: Final = 1.0
_G: Final = 9.80665
"""Standard gravity, m/s^2, exact by definition."""

_MAX_SAMPLES: Final = 2.0**62
"""Upper bound of a number of samples; no record has more."""

UNITS: Final[dict[str, Unit]] = {
    "rad": Unit("angle", _RAD, 1.0),
    "deg": Unit("angle", _DEG, 1.0),
    "arcsec": Unit("angle", _DEG, 3600.0),
    "urad": Unit("angle", _RAD, 1e6),
    "rad/s": Unit("rate", _RAD, 1.0),
    "deg/s": Unit("rate", _DEG, 1.0),
    "mdeg/s": Unit("rate", _DEG, 1000.0),
    "deg/h": Unit("rate", _DEG, 3600.0),
    "rad/s/sqrt(Hz)": Unit("angle random walk", _RAD, 1.0),
    "deg/s/sqrt(Hz)": Unit("angle random walk", _DEG, 1.0),
    "mdeg/s/sqrt(Hz)": Unit("angle random walk", _DEG, 1000.0),
    "deg/sqrt(h)": Unit("angle random walk", _DEG, 60.0),
    "deg/h/sqrt(Hz)": Unit("angle random walk", _DEG, 3600.0),
    "rad/s^2/sqrt(Hz)": Unit("rate random walk", _RAD, 1.0),
    "deg/s/sqrt(s)": Unit("rate random walk", _DEG, 1.0),
    "deg/h/sqrt(h)": Unit("rate random walk", _DEG, 3600.0 * 60.0),
    "rad/s^2": Unit("rate ramp", _RAD, 1.0),
    "deg/s^2": Unit("rate ramp", _DEG, 1.0),
    "deg/h/s": Unit("rate ramp", _DEG, 3600.0),
    "deg/h^2": Unit("rate ramp", _DEG, 3600.0 * 3600.0),
    "m/s": Unit("velocity", _METRE, 1.0),
    "m/s^2": Unit("acceleration", _METRE, 1.0),
    "g": Unit("acceleration", _G, 1.0),
    "mg": Unit("acceleration", _G, 1e3),
    "ug": Unit("acceleration", _G, 1e6),
    "m/s^2/sqrt(Hz)": Unit("velocity random walk", _METRE, 1.0),
    "m/s/sqrt(h)": Unit("velocity random walk", _METRE, 60.0),
    "mg/sqrt(Hz)": Unit("velocity random walk", _G, 1e3),
    "ug/sqrt(Hz)": Unit("velocity random walk", _G, 1e6),
    "m/s^3/sqrt(Hz)": Unit("acceleration random walk", _METRE, 1.0),
    "m/s^2/sqrt(h)": Unit("acceleration random walk", _METRE, 60.0),
    "g/s/sqrt(Hz)": Unit("acceleration random walk", _G, 1.0),
    "mg/s/sqrt(Hz)": Unit("acceleration random walk", _G, 1e3),
    "ug/s/sqrt(Hz)": Unit("acceleration random walk", _G, 1e6),
    "ug/sqrt(h)": Unit("acceleration random walk", _G, 1e6 * 60.0),
    "m/s^3": Unit("acceleration ramp", _METRE, 1.0),
    "ug/s": Unit("acceleration ramp", _G, 1e6),
    "ug/h": Unit("acceleration ramp", _G, 1e6 * 3600.0),
}

_ALIASES: Final = {
    "radians": "rad",
    "degrees": "deg",
    "radps": "rad/s",
    "dps": "deg/s",
    "degps": "deg/s",
    "mdps": "mdeg/s",
    "dph": "deg/h",
    "degph": "deg/h",
    "rad/sqrt(s)": "rad/s/sqrt(Hz)",
    "deg/sqrt(s)": "deg/s/sqrt(Hz)",
    "dps/sqrt(hz)": "deg/s/sqrt(Hz)",
    "mdps/sqrt(hz)": "mdeg/s/sqrt(Hz)",
    "rad/s/sqrt(s)": "rad/s^2/sqrt(Hz)",
    "deg/s^2/sqrt(hz)": "deg/s/sqrt(s)",
    "rad/s/s": "rad/s^2",
    "deg/s/s": "deg/s^2",
    "deg/h/h": "deg/h^2",
    "microrad": "urad",
    "mps": "m/s",
    "mps2": "m/s^2",
    "m/s/s": "m/s^2",
    "m/s/sqrt(s)": "m/s^2/sqrt(Hz)",
    "m/s^2/sqrt(s)": "m/s^3/sqrt(Hz)",
    "g/sqrt(s)": "g/s/sqrt(Hz)",
    "mg/sqrt(s)": "mg/s/sqrt(Hz)",
    "ug/sqrt(s)": "ug/s/sqrt(Hz)",
}

_SPELLINGS: Final = (
    (r"\s+", ""),
    ("°|º", "deg"),
    ("µ|μ", "u"),
    ("²", "^2"),
    ("³", "^3"),
    (r"\*\*", "^"),
    (r"(?:√|sqrt|(?<![a-z])rt)\(?(hz|hours?|hr|h|sec|s)\)?", r"sqrt(\1)"),
    (r"(?<![a-z])(?:degrees|degree)(?![a-z])", "deg"),
    (r"(?<![a-z])(?:radians|radian)(?![a-z])", "rad"),
    (r"(?<![a-z])(?:seconds|second|sec)(?![a-z])", "s"),
    (r"(?<![a-z])(?:hours|hour|hr)(?![a-z])", "h"),
)

_NAMES: Final = {name.lower(): name for name in UNITS} | _ALIASES


def canonical(unit: str) -> str:
    """Return the name that the package uses for a unit.

    Parameters
    ----------
    unit : str
        A unit's name or alias (``dps``, ``°/s``, ``deg/hr``, ``°/√h``), in any case, with or
        without spaces.

    Returns
    -------
    str
        A key of `UNITS`.

    Raises
    ------
    ValueError
        If the unit is unknown.

    Examples
    --------
    >>> canonical("dps"), canonical("°/√h")
    ('deg/s', 'deg/sqrt(h)')
    """
    text = unit.lower()
    for pattern, replacement in _SPELLINGS:
        text = re.sub(pattern, replacement, text)
    if text not in _NAMES:
        raise ValueError(f"unknown unit {unit!r}: known are {', '.join(UNITS)}")
    return _NAMES[text]


def kind(unit: str) -> str:
    """Return the kind of a unit, for example ``"rate"`` or ``"angle random walk"``.

    Parameters
    ----------
    unit : str
        A unit's name or alias.

    Returns
    -------
    str
        ``angle``, ``rate``, ``angle random walk``, ``rate random walk``, ``rate ramp``,
        ``velocity``, ``acceleration``, ``velocity random walk``, ``acceleration random walk`` or
        ``acceleration ramp``.

    Raises
    ------
    ValueError
        If the unit is unknown.

    Examples
    --------
    >>> kind("deg/sqrt(h)")
    'angle random walk'
    """
    return UNITS[canonical(unit)].kind


@overload
def convert(value: float, from_unit: str, to_unit: str) -> float: ...
@overload
def convert(
    value: npt.NDArray[Any] | Sequence[Any], from_unit: str, to_unit: str
) -> npt.NDArray[np.float64]: ...
def convert(
    value: float | npt.NDArray[Any] | Sequence[Any], from_unit: str, to_unit: str
) -> float | npt.NDArray[np.float64]:
    """Convert a number or an array from one unit to another of the same kind.

    Parameters
    ----------
    value : float or array_like
        Value in `from_unit`, any shape.
    from_unit, to_unit : str
        Names or aliases of two units of the same kind.

    Returns
    -------
    float or ndarray of float64
        The value in `to_unit`, of the same shape.

    Raises
    ------
    ValueError
        If a unit is unknown, or the two are of different kinds.

    Notes
    -----
    Noise terms follow IEEE Std 952-1997, annex C: 1 deg/s/sqrt(Hz) = 60 deg/sqrt(h), and
    1 deg/s/sqrt(s) = 216000 deg/h/sqrt(h). 1 g = 9.80665 m/s^2.

    Examples
    --------
    >>> convert(10.0, "deg/s", "deg/h")
    36000.0
    >>> convert([0.005, 0.01], "deg/s/sqrt(Hz)", "deg/sqrt(h)")
    array([0.3, 0.6])
    """
    factor = _factor(canonical(from_unit), canonical(to_unit))
    if np.ndim(value) == 0:
        return float(value) * factor  # type: ignore[arg-type]
    return np.asarray(value, dtype=np.float64) * factor


def _factor(from_unit: str, to_unit: str) -> float:
    source, target = UNITS[from_unit], UNITS[to_unit]
    if source.kind != target.kind:
        same_kind = ", ".join(name for name, unit in UNITS.items() if unit.kind == source.kind)
        raise ValueError(
            f"cannot convert {from_unit} ({source.kind}) to {to_unit} ({target.kind}): "
            f"units of {source.kind} are {same_kind}"
        )
    return (source.amount / target.amount) * (target.time / source.time)


def whole_samples(seconds: float, rate: float) -> int:
    """Return the number of samples nearest to a duration, for any finite duration.

    Examples
    --------
    >>> from zerorate.units import whole_samples
    >>> whole_samples(0.5, 200.0)
    100
    """
    # The product of two finite floats can be infinite, and infinity has no integer.
    return round(min(max(seconds * rate, -_MAX_SAMPLES), _MAX_SAMPLES))
