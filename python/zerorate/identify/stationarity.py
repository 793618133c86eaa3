"""Tests of drift: whether level or variance of a record change, and whether it has a unit root."""

from zerorate.identify.arrangements import ReverseArrangements, reverse_arrangements
from zerorate.identify.kpss import kpss
from zerorate.identify.unit_root import adf

__all__ = ["ReverseArrangements", "adf", "kpss", "reverse_arrangements"]
