"""Options of a calibration: names, defaults, ranges, units and meanings."""

from typing import Final

from zerorate.options import Option, index_by_name

GRAVITY_RANGE_M_S2: Final = (9.7, 9.9)
"""Smallest and largest gravity on Earth, m/s^2."""

_ROWS: Final = (
    Option(
        name="gravity",
        kind="number",
        default=None,
        unit="m/s^2",
        expected="that of a place on Earth in m/s^2, {} to {}".format(*GRAVITY_RANGE_M_S2),
        meaning="Local gravity. By default 9.80665, which may be wrong by 0.3 %; then so is the "
        "scale of the accelerometer",
    ),
    Option.choice(
        "frame",
        ("x", "z", "symmetric"),
        "Axes of the body. x: the accelerometer's x, and y in its x-y plane, as in Kalibr; z: the "
        "accelerometer's z, and y in its y-z plane, as in imu_tk; symmetric: as close to all "
        "three axes as possible",
    ),
    Option(
        name="g_sensitivity",
        kind="word or flag",
        default="auto",
        expected="'auto', True or False",
        choices=("auto",),
        meaning="Subtract g-sensitivity in rotations: if significant (auto), always, or never",
    ),
    Option.choice(
        "prior",
        ("datasheet", "wide"),
        "Prior errors: as of a data sheet, or only below half of the scale (wide)",
    ),
    Option(
        name="saturation",
        kind="number",
        default=None,
        expected="positive and finite",
        meaning="End of the gyro's range, in the unit of the log. By default the value that it "
        "reaches repeatedly. A rotation that reaches the range is not used",
    ),
)

CALIBRATION_OPTIONS: Final = index_by_name(_ROWS)
"""Arguments of `zerorate.calibrate` other than data, with their limits and messages."""
