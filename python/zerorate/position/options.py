"""The constants of the position filter, as the core's table has them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from zerorate._native import position_options
from zerorate.options import Option, table

__all__ = ["POSITION_METHODS", "POSITION_OPTIONS"]

POSITION_OPTIONS: Final[Mapping[str, Option]] = MappingProxyType(
    {option.name: option for option in table(position_options())}
)
"""Of `zerorate.PositionFilter`: its method, then every constant, with the methods that use it."""

POSITION_METHODS: Final = POSITION_OPTIONS["method"].choices
"""All methods: the default, then those of papers."""
