"""From a record at rest to a drift model, with the tests that justify it."""

from zerorate.identify.filters import to_filter
from zerorate.identify.model import ArmaModel
from zerorate.identify.state_space import StateSpace

__all__ = ["ArmaModel", "StateSpace", "to_filter"]
