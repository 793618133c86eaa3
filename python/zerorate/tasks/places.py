"""Places on the earth, as tasks are given them."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate.faults import given, said

_MAX_LONGITUDE: Final = 360.0


def place_of(at: npt.ArrayLike, max_latitude: float = 90.0) -> tuple[float, float]:
    """Return latitude and longitude, deg; ValueError if that is no place."""
    numbers = np.asarray(at, dtype=np.float64)
    limits = np.array([max_latitude, _MAX_LONGITUDE])
    if numbers.shape != (2,) or not (np.abs(numbers) <= limits).all():
        got = ",".join(f"{x:g}" for x in numbers.ravel())
        takes = f" takes deg, latitude within {max_latitude:g} first, got '{got}'"
        raise ValueError(said(given("at"), takes))
    latitude, longitude = numbers.tolist()
    return latitude, longitude
