"""The check every sampling rate passes."""

from __future__ import annotations

import math
from numbers import Real


def checked_rate(rate: object) -> float:
    """Return the rate in Hz as a float; ValueError unless it is positive and finite."""
    number = isinstance(rate, Real) and not isinstance(rate, bool)
    if not number or not math.isfinite(float(rate)) or float(rate) <= 0:  # type: ignore[arg-type]
        raise ValueError(f"rate must be a positive finite number of Hz, got {rate!r}")
    return float(rate)  # type: ignore[arg-type]
