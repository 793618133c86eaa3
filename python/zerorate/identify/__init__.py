"""From a record at rest to a drift model, with the tests that justify it."""

from zerorate.identify.identification import identify
from zerorate.identify.model import ArmaModel
from zerorate.identify.result import Identification

__all__ = ["ArmaModel", "Identification", "identify"]
