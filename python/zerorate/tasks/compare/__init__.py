"""Comparison of methods on the same recordings by the effects of their errors."""

from zerorate.tasks.compare.attitude import ATTITUDE_METHODS, compare_attitude
from zerorate.tasks.compare.comparison import Comparison, compare_methods
from zerorate.tasks.compare.measures import Row
from zerorate.tasks.compare.methods import METHODS
from zerorate.tasks.compare.own_method import MethodError, OwnMethod
from zerorate.tasks.compare.task import Compared, compare
from zerorate.tasks.compare.trial import Kind, Trial, read_trial

__all__ = [
    "ATTITUDE_METHODS",
    "METHODS",
    "Compared",
    "Comparison",
    "Kind",
    "MethodError",
    "OwnMethod",
    "Row",
    "Trial",
    "compare",
    "compare_attitude",
    "compare_methods",
    "read_trial",
]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__
