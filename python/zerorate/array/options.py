"""The constants of an array of gyros: names, defaults, ranges, units and meanings."""

from typing import Final

from zerorate.options import FILTER_OPTIONS, Option, index_by_name

_ROWS: Final = (
    Option.choice(
        "method",
        ("auto", "centralised"),
        "How sensors become one: biases learned at rest, weights and a vote, or, to "
        "compare, the published filter of two stages, which takes the rate for a random walk",
    ),
    Option(
        name="scale_error",
        kind="number",
        default=0.01,
        expected="from 0 to 1",
        meaning="Deviation of the sensors' scale factors, by which they count in motion",
    ),
    *(FILTER_OPTIONS[name] for name in ("limit", "rest_limit", "bias_limit")),
)

ARRAY_OPTIONS: Final = index_by_name(_ROWS)
"""Of `zerorate.GyroArray`: every constant that is one number or one of some words.

The compiled class checks them, and a test holds the table to it.
"""
