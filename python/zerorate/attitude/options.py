"""Constants of the named methods of attitude and tilt, from the tables of the core."""

from typing import Final

from zerorate._native import attitude_options, tilt_options
from zerorate.options import index_by_name, options_of_rows

ATTITUDE_OPTIONS: Final = index_by_name(options_of_rows(attitude_options()))
"""Options of `zerorate.Attitude`: the method, then constants with their methods."""

TILT_OPTIONS: Final = index_by_name(options_of_rows(tilt_options()))
"""Options of `zerorate.Tilt`: the method, then constants with their methods."""

ATTITUDE_METHODS: Final = ATTITUDE_OPTIONS["method"].choices
"""Methods of `zerorate.Attitude`: first the default, then the named methods."""
