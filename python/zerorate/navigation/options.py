"""Constants of the navigation, foot and position filters: defaults, ranges, units, meanings."""

from typing import Final

from zerorate._native import position_options
from zerorate.options import Option, index_by_name, options_of_rows

_WHEELED: Final = ("wheeled",)

_ROWS: Final = (
    Option(
        name="gate",
        kind="number",
        default=50.0,
        expected="a positive number",
        meaning="Reject a fix with a larger normalised innovation squared",
    ),
    Option.choice(
        "adapt",
        ("inflate", "free", "fixed"),
        "Noise of the fixes: as stated, raised by innovations (inflate), also lowered (free), or "
        "fixed",
    ),
    Option(
        name="covariance_step",
        kind="seconds",
        default=0.1,
        unit="s",
        expected="from 0.0001 to 1 s",
        meaning="Time between steps of the covariance",
    ),
    Option.choice(
        "kind",
        ("rate", "increment"),
        "Kind of samples: rates and forces, or their integrals since the previous sample",
    ),
    Option(
        name="gyro_vibration",
        kind="number",
        default=0.0,
        expected="from 0 to 1",
        meaning="Noise of the gyro over its change from sample to sample, standard deviations",
    ),
    Option(
        name="antenna_sigma",
        kind="number",
        default=0.0,
        unit="m",
        expected="from 0 to 1000 m",
        meaning="Standard deviation of the antenna; it is estimated if above 0",
    ),
    Option(
        name="wheel_sigma",
        kind="number",
        default=0.3,
        unit="m/s",
        expected="from 0.001 to 1000 m/s",
        meaning="Standard deviation of the velocity across the wheels",
        methods=_WHEELED,
    ),
    Option(
        name="speed_sigma",
        kind="number",
        default=0.15,
        unit="m/s",
        expected="from 0.001 to 1000 m/s",
        choices=(),
        meaning="Standard deviation of the wheels' speed",
        methods=_WHEELED,
    ),
    Option(
        name="barometer_sigma",
        kind="number",
        default=0.5,
        unit="m",
        expected="from 0.001 to 1000 m",
        meaning="Standard deviation of a barometric height",
    ),
    Option(
        name="barometer_walk",
        kind="number",
        default=0.02,
        unit="m/sqrt(s)",
        expected="from 0 to 100 m/sqrt(s)",
        meaning="Random walk of the barometer's reference",
    ),
    Option(
        name="compass_sigma",
        kind="number",
        default=0.035,
        unit="rad",
        expected="from 0 to 3 rad",
        meaning="Standard deviation of the compass's constant offset; 0 for none",
    ),
    Option(
        name="compass_walk",
        kind="number",
        default=0.001,
        unit="rad/sqrt(s)",
        expected="from 0 to 1 rad/sqrt(s)",
        meaning="Random walk of the compass's offset",
    ),
)

NAVIGATION_OPTIONS: Final = index_by_name(_ROWS)
"""Options of `zerorate.NavigationFilter` with one number or one of some words as value.

The compiled class checks the values, and a test compares the class with this table. An option with
methods is used only if ``vehicle`` is one of them.
"""

FOOT_OPTIONS: Final = index_by_name(
    (
        Option(
            name="floor",
            kind="choice",
            default=None,
            expected="None or 'level'",
            choices=("level",),
            meaning="Level floor: a stance within 0.1 m of the previous height is on the same "
            "floor; a larger step is a stair",
        ),
    )
)
"""Options of `zerorate.FootNavigation` with one of some words as value."""

POSITION_OPTIONS: Final = index_by_name(options_of_rows(position_options()))
"""Options of `zerorate.PositionFilter`: the method, then constants with their methods."""

POSITION_METHODS: Final = POSITION_OPTIONS["method"].choices
"""Methods of `zerorate.PositionFilter`: first the default, then methods of papers."""
