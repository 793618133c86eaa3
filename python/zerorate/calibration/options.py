"""Options of a calibration: names, defaults, ranges, units and meanings."""

from typing import Final

from zerorate.options import Option, index_by_name

GRAVITY_RANGE_M_S2: Final = (9.7, 9.9)
"""Least and most gravity of places on Earth, m/s^2."""

_ROWS: Final = (
    Option(
        name="gravity",
        kind="number",
        default=None,
        unit="m/s^2",
        expected="that of a place on Earth in m/s^2, {} to {}".format(*GRAVITY_RANGE_M_S2),
        meaning="Local gravity; by default 9.80665, which may be wrong by 0.3 %: that moves the "
        "scale of the accelerometer alone",
    ),
    Option.choice(
        "frame",
        ("x", "z", "symmetric"),
        "Axes of the body. x: its x is that of the accelerometer, its y in the x-y plane "
        "of that, as Kalibr has it; z: its z, and y in the y-z plane, as imu_tk; symmetric: as "
        "near to all three as can be",
    ),
    Option(
        name="g_sensitivity",
        kind="word or flag",
        default="auto",
        expected="'auto', True or False",
        choices=("auto",),
        meaning="Whether what gravity makes the gyro read is taken off in turns, too: where it is "
        "clear (auto), always, or never",
    ),
    Option.choice(
        "prior",
        ("datasheet", "wide"),
        "What is known before: errors as of a data sheet, or nothing but that they are "
        "smaller than half of the scale",
    ),
    Option(
        name="saturation",
        kind="number",
        default=None,
        expected="positive and finite",
        meaning="End of the gyro's range, in the unit of the log; by default what it reaches again "
        "and again. A turn that reaches it is not used",
    ),
)

CALIBRATION_OPTIONS: Final = index_by_name(_ROWS)
"""Of `zerorate.calibrate`: every argument that is no data. Its refusals come from here."""
