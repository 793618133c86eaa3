"""The table of an array's constants: it is what `GyroArray` takes and refuses."""

import inspect
import math
import re

import pytest

from zerorate import GyroArray
from zerorate.array.options import ARRAY_OPTIONS

OTHERS = {"rate", "sensors", "axes", "rotations", "calibrations", "weights", "labels"}
"""Arguments that are more than one number or one word."""


def test_it_has_every_constant_with_its_default():
    signature = inspect.signature(GyroArray).parameters
    assert set(ARRAY_OPTIONS) == set(signature) - OTHERS
    for name, option in ARRAY_OPTIONS.items():
        assert (option.name, option.default) == (name, signature[name].default)


@pytest.mark.parametrize("name", ARRAY_OPTIONS)
def test_the_range_is_that_of_the_class(name):
    option = ARRAY_OPTIONS[name]
    taken = option.choices or ((0.0, 1.0) if name == "scale_error" else (5e-324, 1e300, None))
    for value in taken:
        assert f"{name}=" in repr(GyroArray(100.0, 3, **{name: value})) or value == option.default
    for value in ("pink",) if option.choices else (-1.0, math.nan):
        with pytest.raises(ValueError, match=f"^{name} must be {re.escape(option.expected)}, got"):
            GyroArray(100.0, 3, **{name: value})
