"""Positions on the earth, as arguments of tasks."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import keyword_argument, make_sentence

_MAX_LONGITUDE_DEG: Final = 360.0


def parse_position(at: npt.ArrayLike, max_latitude: float = 90.0) -> tuple[float, float]:
    """Return latitude and longitude, deg; ValueError if one is out of range."""
    numbers = np.asarray(at, dtype=np.float64)
    limits = np.array([max_latitude, _MAX_LONGITUDE_DEG])
    if numbers.shape != (2,) or not (np.abs(numbers) <= limits).all():
        got = ",".join(f"{x:g}" for x in numbers.ravel())
        takes = f" takes deg, latitude within {max_latitude:g} first, got '{got}'"
        raise ValueError(make_sentence(keyword_argument("at"), takes))
    latitude, longitude = numbers.tolist()
    return latitude, longitude
