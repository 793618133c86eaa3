"""Tests of drift: whether a record's level, variance or unit root move it."""

from zerorate.identify.arrangements import ReverseArrangements, reverse_arrangements
from zerorate.identify.kpss import kpss

__all__ = ["ReverseArrangements", "kpss", "reverse_arrangements"]
