"""From a record at rest to a drift model, with the tests that justify it."""

from zerorate.identify.autoregression import fit_ar
from zerorate.identify.model import ArmaModel
from zerorate.identify.order import OrderSelection, select_order

__all__ = ["ArmaModel", "OrderSelection", "fit_ar", "select_order"]
