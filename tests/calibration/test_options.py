"""The table of what is chosen of a calibration: it is what `calibrate` takes and refuses."""

import inspect
import math
import re

import pytest

import zerorate as zr
from zerorate.calibration.options import CALIBRATION_OPTIONS, GRAVITY_RANGE_M_S2

DATA = {"recording", "gyro", "accel", "rate", "rests"}


def made(name, value):
    """Return the words of the refusal: with no recording there is one anyway."""
    with pytest.raises((ValueError, TypeError, zr.LogError)) as message:
        zr.calibration.calibrate(**{name: value})
    return str(message.value)


def test_it_has_every_choice_with_its_default():
    signature = inspect.signature(zr.calibration.calibrate).parameters
    assert set(CALIBRATION_OPTIONS) == set(signature) - DATA
    task = inspect.signature(zr.calibrate).parameters
    for name, option in CALIBRATION_OPTIONS.items():
        assert (option.name, option.default) == (name, signature[name].default)
        assert task[name].default == option.default


@pytest.mark.parametrize("name", CALIBRATION_OPTIONS)
def test_the_range_is_that_of_the_function(name):
    option = CALIBRATION_OPTIONS[name]
    taken = [*option.choices, option.default]
    taken += [True, False] if option.kind == "word or flag" else []
    taken += {"gravity": GRAVITY_RANGE_M_S2, "saturation": (5e-324, 1e300)}.get(name, ())
    for value in taken:
        assert name not in made(name, value)
    for value in (-1.0, math.nan) if option.kind == "number" else ("pink", 2.0, None):
        told = made(name, value)
        assert re.match(
            f"{name} must be ({re.escape(option.expected)}|positive and finite), got", told
        )
