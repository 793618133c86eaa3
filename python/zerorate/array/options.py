"""Constants of an array of gyros: names, defaults, ranges, units and meanings."""

from typing import Final

from zerorate.options import FILTER_OPTIONS, Option, index_by_name

_ROWS: Final = (
    Option.choice(
        "method",
        ("auto", "centralised"),
        "Fusion: learned biases, weights and a vote (auto), or the published two-stage filter "
        "(centralised), which models the rate as a random walk",
    ),
    Option(
        name="scale_error",
        kind="number",
        default=0.01,
        expected="from 0 to 1",
        meaning="Standard deviation of scale factors, for motion",
    ),
    *(FILTER_OPTIONS[name] for name in ("limit", "rest_limit", "bias_limit")),
)

ARRAY_OPTIONS: Final = index_by_name(_ROWS)
"""Options of `zerorate.GyroArray` with one number or one of some words as value.

The compiled class checks the values, and a test compares the class with this table.
"""
