"""The earth (WGS84): radii, gravity, rotation, and distances.

Angles are in rad and lengths in m. Positions in records are the exception: latitude and longitude
in deg, height above the ellipsoid in m. Vectors point north, east, down.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.types import Floats

SEMI_MAJOR_AXIS: Final = 6_378_137.0
"""Semi-major axis a, m."""
ECCENTRICITY_SQUARED: Final = 6.6943799901413e-3
"""Square of the first eccentricity, e^2."""
EARTH_RATE_RAD_S: Final = 7.292115e-5
"""Rotation rate of the earth, rad/s."""
EQUATORIAL_GRAVITY: Final = 9.7803253359
POLAR_GRAVITY: Final = 9.8321849378
"""Normal gravity at the poles, on the ellipsoid, m/s^2."""

_AXIS_RATIO: Final = math.sqrt(1.0 - ECCENTRICITY_SQUARED)
"""Semi-minor axis divided by the semi-major axis."""
_SOMIGLIANA: Final = _AXIS_RATIO * POLAR_GRAVITY / EQUATORIAL_GRAVITY - 1.0


def radii(latitude: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Return the radii of curvature along the meridian and across it, m.

    Parameters
    ----------
    latitude : array_like
        Latitude, rad, any shape.

    Returns
    -------
    meridian, normal : ndarray, the shape of `latitude`
        M and N, m. A step north changes the latitude by step / M. A step east changes the longitude
        by step / (N cos(latitude)).

    Examples
    --------
    >>> [round(float(radius)) for radius in radii(0.0)]
    [6335439, 6378137]
    """
    flattened = 1.0 - ECCENTRICITY_SQUARED * np.sin(np.asarray(latitude, dtype=np.float64)) ** 2
    normal = SEMI_MAJOR_AXIS / np.sqrt(flattened)
    return np.asarray(normal * (1.0 - ECCENTRICITY_SQUARED) / flattened), np.asarray(normal)


def normal_gravity(latitude: npt.ArrayLike, height: npt.ArrayLike = 0.0) -> Floats:
    """Return normal gravity, m/s^2: Somigliana's formula times 1 - 2 h/a.

    Parameters
    ----------
    latitude : array_like
        Latitude, rad.
    height : array_like
        Height above the ellipsoid, m. Its shape must broadcast with `latitude`.

    Examples
    --------
    >>> round(float(normal_gravity(np.radians(45.0), 1000.0)), 9)
    9.803122828
    """
    square = np.sin(np.asarray(latitude, dtype=np.float64)) ** 2
    on_ellipsoid = (
        EQUATORIAL_GRAVITY
        * (1.0 + _SOMIGLIANA * square)
        / np.sqrt(1.0 - ECCENTRICITY_SQUARED * square)
    )
    above = np.asarray(height, dtype=np.float64)
    return np.asarray(on_ellipsoid * (1.0 - 2.0 * above / SEMI_MAJOR_AXIS))


def earth_rate(latitude: npt.ArrayLike) -> Floats:
    """Return the earth's rate north, east, down, rad/s, shape (..., 3), at a latitude, rad."""
    angle = np.asarray(latitude, dtype=np.float64)
    cosine, sine = np.cos(angle), np.sin(angle)
    return EARTH_RATE_RAD_S * np.stack([cosine, np.zeros_like(cosine), -sine], axis=-1)


def transport_rate(
    latitude: npt.ArrayLike, height: npt.ArrayLike, velocity: npt.ArrayLike
) -> Floats:
    """Return the rotation rate of the axes north, east, down due to motion over the earth, rad/s.

    Parameters
    ----------
    latitude, height : array_like, shape (...)
        Latitude, rad, and height above the ellipsoid, m.
    velocity : array_like, shape (..., 3)
        Velocity north, east, down, m/s.

    Returns
    -------
    ndarray, shape (..., 3)
    """
    meridian, normal = radii(latitude)
    v, above = np.asarray(velocity, dtype=np.float64), np.asarray(height, dtype=np.float64)
    east = v[..., 1] / (normal + above)
    north = v[..., 0] / (meridian + above)
    return np.stack([east, -north, -east * np.tan(np.asarray(latitude, dtype=np.float64))], axis=-1)


def local_ned(position: npt.ArrayLike, origin: npt.ArrayLike) -> Floats:
    """Return positions north, east, down from an origin, m, with the radii of curvature there.

    Parameters
    ----------
    position : array_like, shape (..., 3)
        Latitude, deg, longitude, deg, and height, m.
    origin : array_like, shape (3,) or (..., 3)
        Origin in the same units. With one origin per position, the result is the difference of two
        tracks.

    Returns
    -------
    ndarray, shape (..., 3)
        Positions, m. Differences of longitude are wrapped to half a turn. Meridians converge, so a
        distance d has an error of up to d^2 tan(latitude)/a. At a latitude of 45 deg this is 4 cm
        at 500 m, and 16 m at 10 km.

    Examples
    --------
    >>> local_ned([[45.0, 180.0, 90.0]], [45.0, -179.999, 100.0]).round(3)
    array([[  0.   , -78.848,  10.   ]])
    """
    target, start = np.asarray(position, dtype=np.float64), np.asarray(origin, dtype=np.float64)
    latitude, height = np.radians(start[..., 0]), start[..., 2]
    meridian, normal = radii(latitude)
    longitude_change = np.radians(wrap_degrees(target[..., 1] - start[..., 1]))
    north = np.radians(target[..., 0] - start[..., 0]) * (meridian + height)
    east = longitude_change * (normal + height) * np.cos(latitude)
    return np.stack(np.broadcast_arrays(north, east, height - target[..., 2]), axis=-1)


def offset_position(position: npt.ArrayLike, ned: npt.ArrayLike) -> Floats:
    """Return positions (deg, deg, m) moved by metres north, east, down.

    This is the inverse of `local_ned`, with the radii at `position` and the same accuracy.
    """
    start, offset = np.asarray(position, dtype=np.float64), np.asarray(ned, dtype=np.float64)
    latitude, height = np.radians(start[..., 0]), start[..., 2]
    meridian, normal = radii(latitude)
    north = start[..., 0] + np.degrees(offset[..., 0] / (meridian + height))
    east = start[..., 1] + np.degrees(offset[..., 1] / ((normal + height) * np.cos(latitude)))
    return np.stack(
        np.broadcast_arrays(north, wrap_degrees(east), height - offset[..., 2]), axis=-1
    )


def wrap_degrees(degrees: npt.ArrayLike) -> Floats:
    """Return angles wrapped to -180 to 180 deg; angles in this range are unchanged."""
    angles = np.asarray(degrees, dtype=np.float64)
    wrapped_angles: Floats = np.where(
        np.abs(angles) <= 180.0, angles, (angles + 180.0) % 360.0 - 180.0
    )
    return wrapped_angles
