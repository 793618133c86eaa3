"""The constants of the navigation filter: names, defaults, ranges, units and meanings."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from zerorate.options import Option

__all__ = ["NAVIGATION_OPTIONS"]

_WHEELED: Final = ("wheeled",)

_ROWS: Final = (
    Option(
        name="gate",
        kind="number",
        default=50.0,
        unit="",
        expected="a positive number",
        choices=(),
        meaning="Normalised innovation squared above which a fix is not taken",
        methods=(),
    ),
    Option(
        name="adapt",
        kind="choice",
        default="inflate",
        unit="",
        expected="'inflate', 'free' or 'fixed'",
        choices=("inflate", "free", "fixed"),
        meaning="What the noise of the fixes is: raised to what they show, followed both ways, or "
        "as the receiver tells it",
        methods=(),
    ),
    Option(
        name="covariance_step",
        kind="seconds",
        default=0.1,
        unit="s",
        expected="from 0.0001 to 1 s",
        choices=(),
        meaning="Time between two steps of the covariance",
        methods=(),
    ),
    Option(
        name="kind",
        kind="choice",
        default="rate",
        unit="",
        expected="'rate' or 'increment'",
        choices=("rate", "increment"),
        meaning="Whether samples are rates and forces, or their integrals since the sample before",
        methods=(),
    ),
    Option(
        name="wheel_sigma",
        kind="number",
        default=0.3,
        unit="m/s",
        expected="from 0.001 to 1000 m/s",
        choices=(),
        meaning="Deviation of the velocity across the wheels",
        methods=_WHEELED,
    ),
)

NAVIGATION_OPTIONS: Final[Mapping[str, Option]] = MappingProxyType(
    {option.name: option for option in _ROWS}
)
"""Of `zerorate.NavigationFilter`: every constant that is one number or one of some words.

The compiled class checks them, and a test holds the table to it. What has methods is used only with
a ``vehicle`` among them.
"""
