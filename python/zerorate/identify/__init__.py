"""From a record at rest to a drift model, with the tests that justify it."""

from zerorate.identify.model import ArmaModel

__all__ = ["ArmaModel"]
