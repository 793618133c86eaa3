"""Words of which sentences on numbers are made."""

from collections.abc import Sequence

from zerorate.numerals import significant

__all__ = ["listed", "model_name", "per_cent"]


def listed(parts: Sequence[str]) -> str:
    """Return "a, b and c"."""
    return " and ".join(filter(None, (", ".join(parts[:-1]), *parts[-1:])))


def per_cent(part: float) -> str:
    """Return a part in per cent, to two digits."""
    return f"{significant(100.0 * part, 2)} %" if part >= 1e-4 else "less than 0.01 %"


def model_name(order: tuple[int, int]) -> str:
    """Return AR(p), MA(q), ARMA(p, q), or "white noise"."""
    p, q = order
    if p and q:
        return f"ARMA({p}, {q})"
    return f"AR({p})" if p else f"MA({q})" if q else "white noise"
