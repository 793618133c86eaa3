"""The constants of the position filter, as the core's table has them."""

from typing import Final

from zerorate._native import position_options
from zerorate.options import by_name, table

POSITION_OPTIONS: Final = by_name(table(position_options()))
"""Of `zerorate.PositionFilter`: its method, then every constant, with the methods that use it."""

POSITION_METHODS: Final = POSITION_OPTIONS["method"].choices
"""All methods: the default, then those of papers."""
