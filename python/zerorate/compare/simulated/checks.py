"""Numbers of simulated gyros that mean something."""

import math

__all__ = ["check_not_negative", "check_positive"]


def check_not_negative(of: object, *names: str) -> None:
    """Raise ValueError unless these attributes are finite and from 0."""
    for name in names:
        value = getattr(of, name)
        if not 0.0 <= value < math.inf:
            raise ValueError(f"{name} must be finite and not negative, got {value}")


def check_positive(of: object, *names: str) -> None:
    """Raise ValueError unless these attributes are finite and above 0."""
    for name in names:
        value = getattr(of, name)
        if not 0.0 < value < math.inf:
            raise ValueError(f"{name} must be finite and positive, got {value}")
