"""The constants of an array of gyros: names, defaults, ranges, units and meanings."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from zerorate.options import FILTER_OPTIONS, Option

__all__ = ["ARRAY_OPTIONS"]

_ROWS: Final = (
    Option(
        name="method",
        kind="choice",
        default="auto",
        unit="",
        expected="'auto' or 'centralised'",
        choices=("auto", "centralised"),
        meaning="How sensors become one: biases learned at rest, weights and a vote, or, to "
        "compare, the published filter of two stages, which takes the rate for a random walk",
        methods=(),
    ),
    Option(
        name="scale_error",
        kind="number",
        default=0.01,
        unit="",
        expected="from 0 to 1",
        choices=(),
        meaning="Deviation of the sensors' scale factors, by which they count in motion",
        methods=(),
    ),
    *(FILTER_OPTIONS[name] for name in ("limit", "rest_limit", "bias_limit")),
)

ARRAY_OPTIONS: Final[Mapping[str, Option]] = MappingProxyType(
    {option.name: option for option in _ROWS}
)
"""Of `zerorate.GyroArray`: every constant that is one number or one of some words.

The compiled class checks them, and a test holds the table to it.
"""
