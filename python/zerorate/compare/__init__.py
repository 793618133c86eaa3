"""Many methods on the same recordings, each measured by what it costs its user."""

from zerorate.compare.comparison import Comparison, compare
from zerorate.compare.measures import Row
from zerorate.compare.methods import METHODS
from zerorate.compare.own import MethodError, OwnMethod
from zerorate.compare.trial import Kind, Trial, read_trial

__all__ = [
    "METHODS",
    "Comparison",
    "Kind",
    "MethodError",
    "OwnMethod",
    "Row",
    "Trial",
    "compare",
    "read_trial",
]
