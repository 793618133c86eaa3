"""Many methods on the same recordings, each measured by what it costs its user."""

from zerorate.compare.attitude import ATTITUDE_METHODS, compare_attitude
from zerorate.compare.comparison import Comparison, compare
from zerorate.compare.measures import Row
from zerorate.compare.methods import METHODS
from zerorate.compare.own import MethodError, OwnMethod
from zerorate.compare.trial import Kind, Trial, read_trial

__all__ = [
    "ATTITUDE_METHODS",
    "METHODS",
    "Comparison",
    "Kind",
    "MethodError",
    "OwnMethod",
    "Row",
    "Trial",
    "compare",
    "compare_attitude",
    "read_trial",
]


def __dir__() -> list[str]:
    """Show what is public."""
    return __all__
