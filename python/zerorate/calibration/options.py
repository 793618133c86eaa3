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
        expected="from {} to {} m/s^2".format(*GRAVITY_RANGE_M_S2),
        meaning="Local gravity in m/s^2. Default: 9.80665. Its error, up to 0.3 %, becomes an "
        "error of the accelerometer's scale",
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
        "Errors assumed before the fit. datasheet: typical of data sheets (5 % scale, 30 mrad "
        "axes, 100 mg accelerometer bias); wide: anything below half of the scale",
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
