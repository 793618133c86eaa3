"""Roll, pitch and yaw of autopilots' logs as quaternions."""

import numpy as np

from zerorate.types import Floats


def quaternions(roll: Floats, pitch: Floats, yaw: Floats) -> Floats:
    """Return the components w, x, y, z, (4, n), of turns by yaw, then pitch, then roll, rad."""
    with np.errstate(invalid="ignore", over="ignore"):
        half = [np.asarray(angle, np.float64) / 2 for angle in (roll, pitch, yaw)]
        (cr, cp, cy), (sr, sp, sy) = map(np.cos, half), map(np.sin, half)
    return np.array(
        (
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        )
    )
