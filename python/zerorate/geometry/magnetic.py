"""The earth's magnetic field at a place, by the World Magnetic Model (from pygeomag)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.util import find_spec
from typing import Final

from zerorate.faults import ArgumentError
from zerorate.texts import describe_missing_extra

FIRST_YEAR: Final = 2010.0
LAST_YEAR: Final = 2030.0
"""Range of years with coefficients; each set covers five years."""
_UT_PER_NT: Final = 1e-3
"""Factor from nT to uT."""


@dataclass(frozen=True)
class EarthField:
    """The earth's magnetic field at a place.

    Attributes
    ----------
    size : float
        Field strength, uT.
    dip : float
        Angle of the field below the horizontal, rad. It is negative in the south.
    declination : float
        Angle from true north to magnetic north, rad, positive east.
    model : str
        Name of the field model's coefficients.

    Examples
    --------
    >>> import zerorate as zr
    >>> field = zr.geometry.EarthField(size=48.8, dip=1.12, declination=0.07, model="a map")
    >>> field.size, field.model
    (48.8, 'a map')
    """

    size: float
    dip: float
    declination: float
    model: str


def earth_field(
    latitude: float, longitude: float, height: float = 0.0, year: float | None = None
) -> EarthField:
    """Return the earth's magnetic field at a place.

    Parameters
    ----------
    latitude, longitude : float
        Latitude and longitude, deg.
    height : float
        Height above the ellipsoid, m.
    year : float, optional
        Year with its fraction, such as 2026.5. Default: the current date.

    Raises
    ------
    ValueError
        If a coordinate is out of range, or there are no coefficients for the year.
    ImportError
        If pygeomag (extra ``magnetic``) is not installed.

    Notes
    -----
    The errors of the World Magnetic Model are 0.15 uT in strength, 0.2 deg in dip and 0.4 deg in
    declination. Near the poles they are larger. Buildings and vehicles change all three values by
    more than these errors.

    Examples
    --------
    >>> from zerorate.geometry import earth_field
    >>> there = earth_field(48.1, 11.6, 500.0, year=2026.0)
    >>> round(there.size, 1), round(there.dip, 2), round(there.declination, 3)
    (48.8, 1.12, 0.075)
    """
    for name, value, limit in (("latitude", latitude, 90.0), ("longitude", longitude, 360.0)):
        if not abs(value) <= limit:
            raise ArgumentError(name, f"must be within {limit:g} deg, got {value}")
    if not abs(height) <= 1e6:
        raise ArgumentError("height", f"must be in m, got {height}")
    when = _current_year() if year is None else year
    if not FIRST_YEAR <= when < LAST_YEAR:
        fault = f"must be {FIRST_YEAR:g} to {LAST_YEAR:g}, for which there is a model, got {when:g}"
        raise ArgumentError("year", fault)
    if find_spec("pygeomag") is None:
        raise ImportError(
            describe_missing_extra("pygeomag", "magnetic", "a model of the earth's field")
        )
    from pygeomag import GeoMag

    base = 5 * int(when // 5)
    field = GeoMag(base_year=base).calculate(latitude, longitude, height / 1000.0, when)
    return EarthField(
        field.f * _UT_PER_NT,
        math.radians(field.i),
        math.radians(field.d),
        f"World Magnetic Model {base}",
    )


def _current_year() -> float:
    """Return today's date as a year with its fraction; it is constant during a day."""
    today = datetime.now(UTC).timetuple()
    return today.tm_year + (today.tm_yday - 1) / 365.2425
