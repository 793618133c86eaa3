"""Which samples of a record count."""

import math

__all__ = ["span"]


def span(duration: float, score_from: float, rate: float) -> tuple[int, int]:
    """Return the first sample that counts and the number of all."""
    if not (0.0 <= score_from < duration < math.inf and 0.0 < rate < math.inf):
        raise ValueError(
            f"rate must be positive and score_from from 0 to below duration, got {rate} Hz, "
            f"{score_from} s and {duration} s"
        )
    first, n = round(score_from * rate), round(duration * rate)
    if not first < n:
        raise ValueError(f"no sample at {rate} Hz lies between {score_from} s and {duration} s")
    return first, n
