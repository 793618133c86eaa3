"""The constants of the named methods of attitude and tilt, as the core's tables have them."""

from typing import Final

from zerorate._native import attitude_options, tilt_options
from zerorate.options import index_by_name, options_of_rows

ATTITUDE_OPTIONS: Final = index_by_name(options_of_rows(attitude_options()))
"""Of `zerorate.Attitude`: its method, then every constant, with the methods that use it."""

TILT_OPTIONS: Final = index_by_name(options_of_rows(tilt_options()))
"""The same of `zerorate.Tilt`."""

ATTITUDE_METHODS: Final = ATTITUDE_OPTIONS["method"].choices
"""All methods of `zerorate.Attitude`: the default, then the named ones."""
