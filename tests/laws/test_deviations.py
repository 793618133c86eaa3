"""Law 9: a stated standard deviation holds, of every stream that states one, on simulations.

The rows are those of `docs/evidence/deviations.md`, of fewer records. What is outside is named with
what it reaches, so that it can only improve.
"""

import runpy
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "deviations_streams.py"))
ROWS = EXAMPLE["ROWS"]
RECORDS = 3

HOLDS = (0.8, 1.2, 0.93)
"""Least and largest RMS of error over standard deviation, least share within two of them."""

SCATTER = (0.12, 0.03)
"""Of an RMS and of a share, of so few records whose errors are hardly independent."""

TOO_WIDE = (0.0, 0.8, 0.97)

OUTSIDE = {
    # Nothing excludes a walk, or a steep slope, that the record has not shown.
    "TemperatureFilter`, white/bias": TOO_WIDE,
    "TemperatureFilter`, white/slope": TOO_WIDE,
    "TemperatureFilter`, flicker/slope": TOO_WIDE,
    "TemperatureFilter`, strong flicker/slope": TOO_WIDE,
    "TemperatureFilter`, strong flicker/bias": TOO_WIDE,
    # The filter allows for scale, misalignment and shocks that these sensors do not have.
    "Attitude`, pendulum": (0.3, 1.0, 0.97),
    "Attitude`, spinning pendulum": (0.4, 1.6, 0.78),
    "Attitude`, arm": (0.5, 1.4, 0.90),
    "Attitude`, vehicle": (0.3, 1.3, 0.88),
    "Attitude`, hand": (0.3, 1.0, 0.97),
    # Held steadily on a circle from the start, gravity and the pull of the turn are one.
    "Attitude`, circle, from motion": (0.8, 5.0, 0.1),
    "Attitude`, circle, from rest": (0.6, 1.2, 0.93),
    "Attitude`, bias of a `DriftFilter`": TOO_WIDE,
    "noise of the default": (0.0, 1.2, 0.92),
    # A simulated stance is still to the last bit, a foot is not.
    "FootFilter`": TOO_WIDE,
}


def bounds_of(name):
    return next((bounds for part, bounds in OUTSIDE.items() if part in name), HOLDS)


@pytest.mark.parametrize("row", ROWS)
def test_what_is_stated_holds(row):
    for quantity, values in ROWS[row](RECORDS).items():
        errors = np.concatenate([np.ravel(x) for x in values])
        rms, share = np.sqrt(np.mean(errors**2)), np.mean(np.abs(errors) <= 2.0)
        least, largest, covered = bounds_of(f"{row}/{quantity}")
        assert np.isfinite(errors).all()
        assert least - SCATTER[0] < rms < largest + SCATTER[0], (quantity, rms, share)
        assert share > covered - SCATTER[1], (quantity, rms, share)
