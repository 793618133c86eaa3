"""The constants of the named methods of attitude and tilt, as the core's tables have them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from zerorate._native import attitude_options, tilt_options
from zerorate.options import Option, table

__all__ = ["ATTITUDE_METHODS", "ATTITUDE_OPTIONS", "TILT_OPTIONS"]

ATTITUDE_OPTIONS: Final[Mapping[str, Option]] = MappingProxyType(
    {option.name: option for option in table(attitude_options())}
)
"""Of `zerorate.Attitude`: its method, then every constant, with the methods that use it."""

TILT_OPTIONS: Final[Mapping[str, Option]] = MappingProxyType(
    {option.name: option for option in table(tilt_options())}
)
"""The same of `zerorate.Tilt`."""

ATTITUDE_METHODS: Final = ATTITUDE_OPTIONS["method"].choices
"""All methods of `zerorate.Attitude`: the default, then the named ones."""
