"""From a record at rest to a drift model, with the tests that justify it."""

from zerorate.identify.autoregression import fit_ar
from zerorate.identify.filters import to_filter
from zerorate.identify.identification import identify
from zerorate.identify.model import ArmaModel
from zerorate.identify.order import OrderSelection, select_order
from zerorate.identify.result import Identification
from zerorate.identify.state_space import StateSpace

__all__ = [
    "ArmaModel",
    "Identification",
    "OrderSelection",
    "StateSpace",
    "fit_ar",
    "identify",
    "select_order",
    "to_filter",
]
